"""The building blocks of a page: headings, paragraphs, lists, tables."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

from reportlab.platypus import Flowable, KeepTogether, Paragraph, Spacer, Table, TableStyle

from viz.build_sheet import style
from viz.build_sheet.pen import Box

PADDING = 3.5


def heading(text: str) -> Paragraph:
    """Return a section's heading."""
    return Paragraph(text, style.HEADING)


def subheading(text: str) -> Paragraph:
    """Return a heading within a section."""
    return Paragraph(text, style.SUBHEADING)


def body(text: str) -> Paragraph:
    """Return a paragraph; ``text`` is reportlab's markup."""
    return Paragraph(text, style.BODY)


def note(text: str) -> Paragraph:
    """Return a paragraph in small grey letters."""
    return Paragraph(text, style.NOTE)


def warning(text: str) -> Paragraph:
    """Return a paragraph that stands out."""
    return Paragraph(text, style.WARNING)


def bullets(items: Sequence[str], numbered: bool = False) -> list[Paragraph]:
    """Return a list, with dots or numbers."""
    return [
        Paragraph(item, style.BULLET, bulletText=f"{k}." if numbered else "•")
        for k, item in enumerate(items, start=1)
    ]


def gap(height: float = 6.0) -> Spacer:
    """Return empty room of a height in points."""
    return Spacer(1, height)


def together(parts: Sequence[Flowable]) -> KeepTogether:
    """Return parts that stay on one page."""
    flat: list[Flowable] = []
    for part in parts:
        # one that is nested in another would be put on a page of its own
        flat += part._content if isinstance(part, KeepTogether) else [part]
    return KeepTogether(flat)


class Grid(Table):
    """A table that wraps the text of its cells and tells the page's layout where it was drawn.

    Attributes:
        too_narrow: texts of which a word is wider than its column.
    """

    too_narrow: tuple[str, ...] = ()

    def draw(self) -> None:
        """Draw it where reportlab has moved the origin to."""
        super().draw()
        x0, y0 = self.canv.absolutePosition(0, 0)
        x1, y1 = self.canv.absolutePosition(self._width, self._height)
        layout = getattr(self.canv, "layout", None)
        if layout is not None:
            layout.grids.append(Box(self.canv.getPageNumber(), x0, y0, x1, y1, "table"))
            layout.too_narrow += self.too_narrow

    def onSplit(self, part: Grid, byRow: int = 1) -> None:  # noqa: N802, N803, ARG002
        """Tell a part of it, on another page, what is known of the whole."""
        part.too_narrow = self.too_narrow


def grid(
    header: Sequence[str],
    rows: Sequence[Sequence[str]],
    widths: Sequence[float],
    *,
    right: Sequence[int] = (),
    total: bool = False,
    marked: Sequence[int] = (),
) -> Grid:
    """Return a table with a header that is repeated on every page.

    Args:
        header: of the columns; an empty one makes no header.
        rows: cells as reportlab's markup.
        widths: of the columns, in points.
        right: columns set flush right, for figures.
        total: whether the last row is a sum.
        marked: rows with a coloured ground, such as what needs attention.
    """
    data: list[list[Paragraph]] = []
    too_narrow: list[str] = []

    def cell(text: str, column: int, head: bool, bold: bool = False) -> Paragraph:
        aligned = column in right
        look = (style.CELL_HEAD_RIGHT if aligned else style.CELL_HEAD) if head or bold else None
        look = look or (style.CELL_RIGHT if aligned else style.CELL)
        paragraph = Paragraph(text, look)
        if paragraph.minWidth() > widths[column] - 2 * PADDING + 0.1:
            too_narrow.append(text)
        return paragraph

    if header:
        data.append([cell(h, k, True) for k, h in enumerate(header)])
    last = len(rows) - 1
    for r, row in enumerate(rows):
        data.append([cell(v, k, False, total and r == last) for k, v in enumerate(row)])
    first = 1 if header else 0
    look: list[tuple[Any, ...]] = [
        ("VALIGN", (0, 0), (-1, -1), "TOP"),
        ("LEFTPADDING", (0, 0), (-1, -1), PADDING),
        ("RIGHTPADDING", (0, 0), (-1, -1), PADDING),
        ("TOPPADDING", (0, 0), (-1, -1), 2.2),
        ("BOTTOMPADDING", (0, 0), (-1, -1), 2.8),
        ("LINEBELOW", (0, first), (-1, -1), 0.3, style.RULE),
    ]
    if header:
        look += [
            ("BACKGROUND", (0, 0), (-1, 0), style.BAND),
            ("LINEBELOW", (0, 0), (-1, 0), 0.8, style.SOFT),
        ]
    if total:
        look.append(("LINEABOVE", (0, -1), (-1, -1), 0.8, style.SOFT))
    look += [("BACKGROUND", (0, r + first), (-1, r + first), style.WARN_BAND) for r in marked]
    table = Grid(data, colWidths=list(widths), repeatRows=first, hAlign="LEFT", style=TableStyle(look))
    table.too_narrow = tuple(too_narrow)
    return table


def columns(width: float, *parts: float) -> list[float]:
    """Return widths that share a width in proportion."""
    whole = sum(parts)
    return [width * p / whole for p in parts]


def in_pairs(pictures: Sequence[Flowable], width: float, above: float) -> Table:
    """Return pictures in rows of two.

    Args:
        pictures: at least one.
        width: of a row, in points.
        above: room above each row, in points.
    """
    return in_rows(pictures, width, above, 2)


def in_rows(pictures: Sequence[Flowable], width: float, above: float, n: int) -> Table:
    """Return pictures in rows of n.

    Args:
        pictures: at least one.
        width: of a row, in points.
        above: room above each row, in points.
        n: how many in a row.
    """
    rows = [[*pictures[k : k + n], *[""] * n][:n] for k in range(0, len(pictures), n)]
    look = [
        *[(f"{side}PADDING", (0, 0), (-1, -1), 0) for side in ("LEFT", "RIGHT")],
        ("TOPPADDING", (0, 0), (-1, -1), above),
    ]
    return Table(rows, colWidths=[width / n] * n, hAlign="LEFT", style=TableStyle(look))


def beside(left: Any, right: Any, widths: Sequence[float], align: Literal["TOP", "MIDDLE"] = "TOP") -> Table:
    """Return two blocks side by side."""
    look = [
        ("VALIGN", (0, 0), (-1, -1), align),
        *[(f"{side}PADDING", (0, 0), (-1, -1), 0) for side in ("LEFT", "RIGHT", "TOP", "BOTTOM")],
    ]
    return Table([[left, right]], colWidths=list(widths), hAlign="LEFT", style=TableStyle(look))
