"""The frame of a build sheet: pages with header and footer, sections in order, the same bytes every time."""

from __future__ import annotations

import dataclasses
import io
import threading
from collections.abc import Sequence
from typing import Any

from reportlab import rl_config
from reportlab.pdfgen.canvas import Canvas
from reportlab.platypus import BaseDocTemplate, Flowable, Frame, PageBreak, PageTemplate

from viz.build_sheet import style
from viz.build_sheet.pen import Box, Picture
from viz.build_sheet.style import Paper


@dataclasses.dataclass(slots=True)
class PageLayout:
    """Where things are on the pages of a sheet, for tests to look at.

    Attributes:
        frame: inside of the margins, of every page.
        pictures: that were drawn, with their labels.
        grids: places of the tables, or of their parts if they go over pages.
        too_narrow: cells of tables with a word wider than the column.
        n_pages: number of pages.
    """

    frame: Box
    pictures: list[Picture] = dataclasses.field(default_factory=list)
    grids: list[Box] = dataclasses.field(default_factory=list)
    too_narrow: list[str] = dataclasses.field(default_factory=list)
    n_pages: int = 0


def on_pages_of_their_own(sections: Sequence[Sequence[Flowable]]) -> list[Flowable]:
    """Return the content of sections, each of which begins a page; an empty one takes none."""
    story: list[Flowable] = []
    for section in filter(None, sections):
        if story:
            story.append(PageBreak())
        story += section
    return story


def typeset(
    story: Sequence[Flowable], *, paper: Paper, title: str, running: str, date: str
) -> tuple[bytes, PageLayout]:
    """Return a PDF and where everything is on it.

    Args:
        story: the content.
        paper: to print on.
        title: of the document.
        running: what stands at the top of every page.
        date: of the run, at the foot of every page.
    """
    left, bottom = style.MARGIN, style.MARGIN + style.FOOTER
    layout = PageLayout(Box(0, left, bottom, left + paper.inner_width, bottom + paper.inner_height, "frame"))
    buffer = io.BytesIO()
    document = BaseDocTemplate(
        buffer,
        pagesize=(paper.width, paper.height),
        title=title,
        author="TensAtlas",
        subject="Build sheet of a tensegrity soft modular robot",
        creator="TensAtlas",
        invariant=1,  # no date of today, no random identifier
        pageCompression=1,
    )
    frame = Frame(
        left,
        bottom,
        paper.inner_width,
        paper.inner_height,
        leftPadding=0,
        rightPadding=0,
        topPadding=0,
        bottomPadding=0,
        id="page",
    )
    document.addPageTemplates(PageTemplate(id="page", frames=[frame]))

    def canvas(*arguments: Any, **more: Any) -> _NumberedCanvas:
        made = _NumberedCanvas(*arguments, **more)
        made.describe(paper, running, f"{date} · TensAtlas build sheet", layout)
        return made

    # streams as they are compressed: as text they would be a quarter larger and take a second to write
    with _binary_streams:
        document.build(list(story), canvasmaker=canvas)
    return buffer.getvalue(), layout


class _BinaryStreams:
    """Within it reportlab writes streams as bytes. The setting is the process's, so one at a time."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._before = 1

    def __enter__(self) -> None:
        self._lock.acquire()
        self._before = rl_config.useA85
        rl_config.useA85 = 0

    def __exit__(self, *_: object) -> None:
        rl_config.useA85 = self._before
        self._lock.release()


_binary_streams = _BinaryStreams()


class _NumberedCanvas(Canvas):
    """Keeps the pages back until their number is known."""

    def __init__(self, *arguments: Any, **more: Any) -> None:
        super().__init__(*arguments, **more)
        self._pages: list[dict[str, Any]] = []

    def describe(self, paper: Paper, running: str, footing: str, layout: PageLayout) -> None:
        """Say what every page shows, and where to keep what was drawn."""
        self._paper, self._running, self._footing = paper, running, footing
        self.layout = layout

    def showPage(self) -> None:  # noqa: N802
        """Keep a finished page."""
        self._pages.append(dict(self.__dict__))
        self._startPage()

    def save(self) -> None:
        """Write all pages with their numbers."""
        self.layout.n_pages = len(self._pages)
        for k, page in enumerate(self._pages, start=1):
            self.__dict__.update(page)
            self._frame_page(k, self.layout.n_pages)
            super().showPage()
        super().save()

    def _frame_page(self, number: int, of: int) -> None:
        width, height = self._paper.width, self._paper.height
        top, bottom = height - style.MARGIN - 2, style.MARGIN
        self.setFont(style.REGULAR, 8)
        self.setFillColor(style.SOFT)
        self.drawString(style.MARGIN, top, style.printable(self._running))
        self.drawRightString(width - style.MARGIN, top, f"page {number} of {of}")
        self.drawString(style.MARGIN, bottom, style.printable(self._footing))
        self.drawRightString(width - style.MARGIN, bottom, f"{self._paper.name} · print at 100 %")
        self.setStrokeColor(style.RULE)
        self.setLineWidth(0.5)
        self.setDash([])
        self.line(style.MARGIN, top - 4, width - style.MARGIN, top - 4)
