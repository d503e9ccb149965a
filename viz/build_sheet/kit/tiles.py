"""The flat net of a module at 1:1 over several sheets of paper, with marks to join them."""

from __future__ import annotations

import io
import math
from typing import Final

import numpy as np
from reportlab.lib.units import mm
from reportlab.pdfgen.canvas import Canvas

from engine.fabrication.dimensions.cables import CableDesign
from engine.fabrication.parts.net import Net
from engine.fabrication.parts.shapes import net_outline
from viz.build_sheet import style
from viz.build_sheet.style import Paper

MARGIN: Final = 12 * mm
"""Of every sheet: printers leave it white."""
OVERLAP: Final = 10 * mm
"""By which neighbouring sheets show the same."""
BORDER: Final = 8 * mm
"""Around the net."""
BESIDE: Final = (3.6 * mm, 1.8 * mm)
"""From the middle of a ring to its number."""
BAR: Final = 50 * mm
"""Length of the bar that tells whether the sheet was printed at 100 %."""


def net_tiles(net: Net, design: CableDesign, paper: Paper, title: str) -> tuple[bytes, tuple[int, int]]:
    """Return a PDF with a net's outline at 1:1, and how many rows and columns of sheets it has.

    The paper is turned as needs fewer sheets. Equal arguments give equal bytes.

    Args:
        net: to draw.
        design: of its cables.
        paper: to print on.
        title: of every sheet.
    """
    size = np.array(net.size) * 1000 * mm + 2 * BORDER
    upright = _sheets(size, (paper.width, paper.height))
    lying = _sheets(size, (paper.height, paper.width))
    turned = math.prod(lying) < math.prod(upright)
    rows, columns = lying if turned else upright
    width, height = (paper.height, paper.width) if turned else (paper.width, paper.height)
    inner = np.array([width, height]) - 2 * MARGIN
    file = io.BytesIO()
    # the same bytes every time: no date, no random name
    canvas = Canvas(file, pagesize=(width, height), invariant=1)
    canvas.setTitle(title)
    shape = net_outline(net, design)
    outline = [np.array(ring.coords) * mm for ring in (shape.exterior, *shape.interiors)]
    for row in range(rows):
        for column in range(columns):
            _sheet(canvas, net, outline, title, inner, (row, column), (rows, columns))
            canvas.showPage()
    canvas.save()
    return file.getvalue(), (rows, columns)


def _sheets(size: np.ndarray, page: tuple[float, float]) -> tuple[int, int]:
    """Return the rows and columns of sheets of a size that show so much."""
    inner = np.array(page) - 2 * MARGIN
    columns, rows = (
        max(1, math.ceil((s - OVERLAP) / (i - OVERLAP))) for s, i in zip(size, inner, strict=True)
    )
    return rows, columns


def _sheet(
    canvas: Canvas,
    net: Net,
    outline: list[np.ndarray],
    title: str,
    inner: np.ndarray,
    where: tuple[int, int],
    of: tuple[int, int],
) -> None:
    """Draw one sheet; row 0 is the uppermost."""
    (row, column), (rows, columns) = where, of
    step = inner - OVERLAP
    # lower left corner of what the sheet shows, on the whole drawing
    corner = np.array([column * step[0], (rows - 1 - row) * step[1]])
    shift = MARGIN - corner
    canvas.saveState()
    frame = canvas.beginPath()
    frame.rect(MARGIN, MARGIN, *inner)
    canvas.clipPath(frame, stroke=0)
    places = [shift + BORDER + 1000 * mm * np.array(e.position) for e in net.eyelets]
    canvas.setStrokeColor(style.CABLE)
    canvas.setLineWidth(0.5)
    path = canvas.beginPath()
    for ring in outline:
        points = shift + BORDER + ring
        path.moveTo(*map(float, points[0]))
        for point in points[1:]:
            path.lineTo(*map(float, point))
        path.close()
    canvas.drawPath(path)
    canvas.setFillColor(style.INK)
    canvas.setFont(style.BOLD, 9)
    for eyelet, place in zip(net.eyelets, places, strict=True):
        x, y = map(float, place)
        canvas.drawString(x + BESIDE[0], y + BESIDE[1], eyelet.label)
    _marks(canvas, inner, shift, step, of)
    canvas.restoreState()
    canvas.setStrokeColor(style.RULE)
    canvas.setLineWidth(0.4)
    canvas.rect(MARGIN, MARGIN, *inner)
    canvas.setFillColor(style.INK)
    canvas.setFont(style.REGULAR, 8)
    name = f"{title} · sheet {chr(ord('A') + row)}{column + 1} of {rows} × {columns} · print at 100 %"
    canvas.drawString(MARGIN, MARGIN - 5 * mm, name)
    canvas.setStrokeColor(style.INK)
    canvas.setLineWidth(1.0)
    x, y = MARGIN + inner[0] - BAR, MARGIN - 4 * mm
    canvas.line(x, y, x + BAR, y)
    for end in (x, x + BAR):
        canvas.line(end, y - 1 * mm, end, y + 1 * mm)
    canvas.drawRightString(x - 2 * mm, y - 1 * mm, "50 mm")


def _marks(
    canvas: Canvas, inner: np.ndarray, shift: np.ndarray, step: np.ndarray, of: tuple[int, int]
) -> None:
    """Draw crosses in the strips that two sheets share: laid over each other they join the sheets."""
    rows, columns = of
    canvas.setStrokeColor(style.SOFT)
    canvas.setLineWidth(0.5)

    def cross(x: float, y: float) -> None:
        canvas.line(x - 3 * mm, y, x + 3 * mm, y)
        canvas.line(x, y - 3 * mm, x, y + 3 * mm)
        canvas.circle(x, y, 1.5 * mm)

    parts = (0.15, 0.5, 0.85)
    for c in range(1, columns):
        for r in range(rows):
            for part in parts:
                cross(shift[0] + c * step[0] + OVERLAP / 2, shift[1] + r * step[1] + part * inner[1])
    for r in range(1, rows):
        for c in range(columns):
            for part in parts:
                cross(shift[0] + c * step[0] + part * inner[0], shift[1] + r * step[1] + OVERLAP / 2)
