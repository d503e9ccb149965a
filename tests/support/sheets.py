"""What holds of every printed sheet."""

from __future__ import annotations

import io
import itertools

from pypdf import PdfReader

from viz.build_sheet.document import PageLayout


def check_nothing_overflows_or_overlaps(pdf: bytes, layout: PageLayout) -> None:
    """Check that all pages are known, and that tables and pictures lie in the frame and beside each other."""
    assert layout.n_pages == len(PdfReader(io.BytesIO(pdf)).pages)
    assert layout.too_narrow == []
    frame = layout.frame
    placed = [*layout.grids, *(p.area for p in layout.pictures)]
    for box in placed:
        assert frame.x0 - 0.5 <= box.x0 <= box.x1 <= frame.x1 + 0.5, box
        assert frame.y0 - 0.5 <= box.y0 <= box.y1 <= frame.y1 + 0.5, box
    for a, b in itertools.combinations(placed, 2):
        assert not a.overlaps(b), (a, b)
