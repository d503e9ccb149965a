"""A picture on a page: drawn with a pen that remembers where it wrote, so that tests can look for clashes."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable
from typing import Any, Final, Literal

from reportlab.lib.colors import Color
from reportlab.pdfbase.pdfmetrics import stringWidth
from reportlab.platypus import Flowable

from viz.build_sheet import style

Align = Literal["left", "centre", "right"]
LABEL_SIZE: Final = 8.0


@dataclasses.dataclass(frozen=True, slots=True)
class Box:
    """A place on a page, in points from the lower left corner, and what lies there."""

    page: int
    x0: float
    y0: float
    x1: float
    y1: float
    what: str

    def overlaps(self, other: Box, slack: float = 0.5) -> bool:
        """Tell whether both cover the same place, by more than a slack in points."""
        return (
            self.page == other.page
            and min(self.x1, other.x1) - max(self.x0, other.x0) > slack
            and min(self.y1, other.y1) - max(self.y0, other.y0) > slack
        )


class Pen:
    """Draws in points, the origin at a picture's lower left corner.

    Args:
        canvas: reportlab's.
        width, height: of the picture.
    """

    def __init__(self, canvas: Any, width: float, height: float) -> None:
        self.canvas = canvas
        self.width = width
        self.height = height
        self.labels: list[Box] = []

    def line(
        self,
        start: tuple[float, float],
        end: tuple[float, float],
        *,
        color: Color = style.INK,
        width: float = 0.6,
        dash: tuple[float, ...] = (),
        cap: int = 0,
    ) -> None:
        """Draw a line; ``cap`` 0 is cut off, 1 round."""
        # written as PDF says it: a sheet has 15,000 lines, and reportlab takes five calls for each
        numbers = f"{start[0]:.3f} {start[1]:.3f} m {end[0]:.3f} {end[1]:.3f} l S"
        dashes = " ".join(f"{d:g}" for d in dash)
        self.canvas.addLiteral(f"{_rgb(color)} RG {width:.3f} w {cap} J [{dashes}] 0 d n {numbers}")

    def path(
        self,
        points: Any,
        *,
        stroke: Color | None = style.INK,
        fill: Color | None = None,
        width: float = 0.6,
        dash: tuple[float, ...] = (),
        close: bool = False,
    ) -> None:
        """Draw a path through points (n, 2)."""
        c = self.canvas
        p = c.beginPath()
        p.moveTo(*map(float, points[0]))
        for point in points[1:]:
            p.lineTo(*map(float, point))
        if close:
            p.close()
        c.setLineJoin(1)
        c.drawPath(p, **self._ink(stroke, fill, width, dash))

    def disc(
        self,
        centre: tuple[float, float],
        radius: float,
        *,
        fill: Color | None = style.NODE,
        stroke: Color | None = None,
        width: float = 0.5,
    ) -> None:
        """Draw a disc."""
        if stroke is None and fill is not None:
            self.canvas.addLiteral(f"{_rgb(fill)} rg n {_circle(*centre, radius)} f")
            return
        self.canvas.circle(*centre, radius, **self._ink(stroke, fill, width))

    def box(
        self,
        x: float,
        y: float,
        width: float,
        height: float,
        *,
        fill: Color | None = None,
        stroke: Color | None = style.INK,
        line: float = 0.6,
        radius: float = 0.0,
    ) -> None:
        """Draw a box, its corners rounded if asked for."""
        c = self.canvas
        kinds = self._ink(stroke, fill, line)
        if radius:
            c.roundRect(x, y, width, height, radius, **kinds)
        else:
            c.rect(x, y, width, height, **kinds)

    def _ink(
        self, stroke: Color | None, fill: Color | None, width: float, dash: tuple[float, ...] = ()
    ) -> dict[str, int]:
        """Set colours and line; return the arguments that say which of them a shape of the canvas has."""
        if stroke is not None:
            self.canvas.setStrokeColor(stroke)
        if fill is not None:
            self.canvas.setFillColor(fill)
        self.canvas.setLineWidth(width)
        self.canvas.setDash(list(dash))
        return {"stroke": int(stroke is not None), "fill": int(fill is not None)}

    def text(
        self,
        x: float,
        y: float,
        text: str,
        *,
        size: float = LABEL_SIZE,
        align: Align = "left",
        bold: bool = False,
        color: Color = style.INK,
        halo: bool = False,
        upright: bool = False,
    ) -> None:
        """Write a line, its base line at ``y``.

        Args:
            x: where it starts, has its middle or ends.
            y: of the base line.
            text: to write.
            size: of the letters.
            align: what of it lies at ``x``.
            bold: whether in bold.
            color: of the letters.
            halo: whether on a white plate, for writing over a drawing.
            upright: whether it runs upwards instead of to the right.
        """
        c, font = self.canvas, style.BOLD if bold else style.REGULAR
        text = style.printable(text)
        length = stringWidth(text, font, size)
        back = {"left": 0.0, "centre": length / 2, "right": length}[align]
        up, down = 0.74 * size, 0.2 * size
        area = (x - back, y - down, x - back + length, y + up)
        if upright:
            area = (x - up, y - back, x + down, y - back + length)
        if halo:
            c.setFillColorRGB(1, 1, 1)
            x0, y0, x1, y1 = area
            c.rect(x0 - 1, y0 - 0.5, x1 - x0 + 2, y1 - y0 + 1, stroke=0, fill=1)
        c.saveState()
        c.setFillColor(color)
        c.setFont(font, size)
        if upright:
            c.translate(x, y)
            c.rotate(90)
            c.drawString(-back, 0, text)
        else:
            c.drawString(x - back, y, text)
        c.restoreState()
        x0, y0 = c.absolutePosition(area[0], area[1])
        x1, y1 = c.absolutePosition(area[2], area[3])
        self.labels.append(Box(c.getPageNumber(), x0, y0, x1, y1, text))

    def dimension(
        self,
        start: tuple[float, float],
        end: tuple[float, float],
        text: str,
        *,
        ticks: tuple[float, float] | None = None,
    ) -> None:
        """Draw a dimension line, level or upright, with arrow heads and its measure.

        A line that is too short for the measure has its arrow heads outside, and the measure beyond its end.

        Args:
            start: of the line.
            end: of the line.
            text: the measure.
            ticks: for a level line the heights, for an upright one the places, that its two
                extension lines come from.
        """
        level = start[1] == end[1]
        if ticks is not None:
            for (x, y), tick in zip((start, end), ticks, strict=True):
                tip = (x, tick) if level else (tick, y)
                beyond = (x, y + (2 if y > tick else -2)) if level else (x + (2 if x > tick else -2), y)
                self.line(tip, beyond, color=style.SOFT, width=0.35)
        length = stringWidth(style.printable(text), style.REGULAR, LABEL_SIZE)
        gap = abs(end[0] - start[0]) if level else abs(end[1] - start[1])
        outside = gap < length + 12
        if outside:
            self._short_dimension(start, end, text, length)
            return
        self.line(start, end, color=style.SOFT, width=0.5)
        for (x, y), sign in ((start, 1.0), (end, -1.0)):
            a, b = (4.0 * sign, 1.3) if level else (1.3, 4.0 * sign)
            other = (a, -1.3) if level else (-1.3, b)
            self.path([(x, y), (x + a, y + b), (x + other[0], y + other[1])], stroke=None, fill=style.SOFT)
        x, y = (start[0] + end[0]) / 2, (start[1] + end[1]) / 2
        if level:
            self.text(x, y - 0.27 * LABEL_SIZE, text, align="centre", halo=True)
        else:
            self.text(x + 0.27 * LABEL_SIZE, y, text, align="centre", halo=True, upright=True)

    def _short_dimension(
        self, start: tuple[float, float], end: tuple[float, float], text: str, length: float
    ) -> None:
        """Draw a dimension line whose arrow heads point inwards, from outside; the text is so long."""
        level = start[1] == end[1]
        x1, y1 = end
        reach = 9.0
        self.line(start, end, color=style.SOFT, width=0.5)
        for (x, y), sign in ((start, -1.0), (end, 1.0)):
            away = (x + sign * reach, y) if level else (x, y + sign * reach)
            self.line((x, y), away, color=style.SOFT, width=0.5)
            tip = [(x + 4 * sign, y + 1.3), (x + 4 * sign, y - 1.3)]
            if not level:
                tip = [(x + 1.3, y + 4 * sign), (x - 1.3, y + 4 * sign)]
            self.path([(x, y), *tip], stroke=None, fill=style.SOFT)
        if level and x1 + reach + 2 + length <= self.width:
            self.text(x1 + reach + 2, y1 - 0.27 * LABEL_SIZE, text)
        elif level:
            self.text(start[0] - reach - 2, y1 - 0.27 * LABEL_SIZE, text, align="right")
        else:
            self.text(x1, y1 + reach + 3, text, align="centre")


@functools.lru_cache(maxsize=4096)
def _rgb(color: Color) -> str:
    return " ".join(f"{v:.3f}" for v in color.rgb())


def _circle(x: float, y: float, r: float) -> str:
    """Return PDF's operators for a circle of four Bezier curves."""
    k = 0.5522847498 * r
    text = f"{x + r:.3f} {y:.3f} m"
    for (ax, ay), (bx, by), (cx, cy) in (
        ((r, k), (k, r), (0.0, r)),
        ((-k, r), (-r, k), (-r, 0.0)),
        ((-r, -k), (-k, -r), (0.0, -r)),
        ((k, -r), (r, -k), (r, 0.0)),
    ):
        text += f" {x + ax:.3f} {y + ay:.3f} {x + bx:.3f} {y + by:.3f} {x + cx:.3f} {y + cy:.3f} c"
    return text + " h"


class Picture(Flowable):
    """A picture of a given size that a function draws.

    Args:
        width, height: in points.
        draw: draws it.
        name: what tests call it.
    """

    def __init__(self, width: float, height: float, draw: Callable[[Pen], None], name: str) -> None:
        super().__init__()
        self.width = width
        self.height = height
        self.name = name
        self.labels: list[Box] = []
        self.area: Box | None = None
        self._draw = draw

    def wrap(self, *_: float) -> tuple[float, float]:
        """Return the size."""
        return self.width, self.height

    def draw(self) -> None:
        """Draw it where reportlab has moved the origin to."""
        pen = Pen(self.canv, self.width, self.height)
        self._draw(pen)
        x0, y0 = self.canv.absolutePosition(0, 0)
        x1, y1 = self.canv.absolutePosition(self.width, self.height)
        self.area = Box(self.canv.getPageNumber(), x0, y0, x1, y1, self.name)
        self.labels = pen.labels
        layout = getattr(self.canv, "layout", None)
        if layout is not None:
            layout.pictures.append(self)
