"""One view of a part with its measures on a picture, and cuts and shadows of solids."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from manifold3d import CrossSection, Manifold
from reportlab.lib.colors import Color, white

from viz.build_sheet import style
from viz.build_sheet.details import CAP
from viz.build_sheet.pen import Pen

Point = tuple[float, float]
LEAD: Final = 10.0
"""From the base line of a note to the next one, in points."""


class View:
    """One view of a part on a picture.

    Args:
        pen: draws.
        origin: where the part's origin appears, in points.
        scale: points per mm.
    """

    def __init__(self, pen: Pen, origin: Point, scale: float) -> None:
        self.pen, self.origin, self.scale = pen, origin, scale

    def at(self, x: float, y: float) -> Point:
        """Return where a point in mm appears."""
        return self.origin[0] + self.scale * x, self.origin[1] + self.scale * y

    def shape(self, section: CrossSection, fill: Color = CAP) -> None:
        """Draw an outline with its holes."""
        rings = [np.asarray(ring) for ring in section.to_polygons()]
        # outer rings go counter-clockwise, and come before the holes in them
        for ring in sorted(rings, key=_area, reverse=True):
            points = [self.at(float(x), float(y)) for x, y in ring]
            self.pen.path(points, fill=fill if _area(ring) > 0 else white, width=0.5, close=True)

    def level(self, x0: float, x1: float, y: float, text: str, ticks: Point) -> None:
        """Draw a level dimension line in mm, ``y`` of it in points beside the origin."""
        a, b = self.at(x0, 0)[0], self.at(x1, 0)[0]
        low, high = (self.at(0, v)[1] for v in ticks)
        where = self.origin[1] + y
        self.pen.dimension((a, where), (b, where), text, ticks=(low, high))

    def upright(self, y0: float, y1: float, x: float, text: str, ticks: Point) -> None:
        """Draw an upright dimension line in mm, ``x`` of it in points beside the origin."""
        a, b = self.at(0, y0)[1], self.at(0, y1)[1]
        left, right = (self.at(v, 0)[0] for v in ticks)
        where = self.origin[0] + x
        self.pen.dimension((where, a), (where, b), text, ticks=(left, right))

    def note(self, x: float, y: float, text: str, to: Point) -> None:
        """Write a text at a place in points beside the origin, with a line to a point in mm."""
        place = (self.origin[0] + x, self.origin[1] + y)
        self.pen.text(place[0] + 2, place[1] - 2.5, text)
        self.pen.line(place, self.at(*to), width=0.35, color=style.SOFT)

    def notes(self, x: float, notes: list[tuple[float, str, Point]]) -> None:
        """Write notes (y, text, to) from the upper one to the lowest, each clear of the one above it."""
        free = math.inf
        for y, text, to in notes:
            free = min(y, free)
            self.note(x, free, text, to)
            free -= LEAD

    def title(self, y: float, text: str) -> None:
        """Write what the view shows, so many points beside the origin."""
        self.pen.text(self.origin[0], self.origin[1] + y, text, align="centre", color=style.SOFT)


def _area(ring: np.ndarray) -> float:
    x, y = ring[:, 0], ring[:, 1]
    return float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2


def cut(solid: Manifold, at: float = 0.0) -> CrossSection:
    """Return the cut through a solid in the plane y = 0 or at another y: x to the right, z up."""
    return solid.rotate((-90.0, 0.0, 0.0)).slice(-at)


def shadow(solid: Manifold) -> CrossSection:
    """Return the outline of a solid seen along y: x to the right, z up."""
    return solid.rotate((-90.0, 0.0, 0.0)).project()
