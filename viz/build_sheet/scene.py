"""Robots as vector graphics: tubes and balls seen from afar, painted from back to front (painter's algorithm)."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from reportlab.lib.colors import Color, white

from viz.build_sheet import style
from viz.build_sheet.picture import Pen

PIECE: Final = 0.008
"""Tubes are sorted by depth in pieces of at most this length, in m."""
HAZE: Final = 0.35
"""How far the colour of the rearmost thing is mixed with white."""
_SHADES: Final = ((1.0, -0.45), (0.82, 0.0), (0.42, 0.3), (0.14, 0.6))
"""Width of each stroke of a tube, as a part of its own, and how much darker or lighter than its colour."""


@dataclasses.dataclass(frozen=True, slots=True)
class Tube:
    """A straight tube: ends (3,) and radius in m, its colour; a flat one has no shading."""

    start: np.ndarray
    end: np.ndarray
    radius: float
    color: Color
    flat: bool = False


@dataclasses.dataclass(frozen=True, slots=True)
class Ball:
    """A ball: centre (3,) and radius in m, its colour."""

    centre: np.ndarray
    radius: float
    color: Color


@dataclasses.dataclass(frozen=True, slots=True)
class Camera:
    """Looks at a scene from infinitely far away.

    Attributes:
        right, up: (3,) unit vectors of the picture.
    """

    right: np.ndarray
    up: np.ndarray

    @classmethod
    def looking(cls, azimuth: float, elevation: float) -> Camera:
        """Look at the origin from a direction, both in degrees: azimuth 0 looks along +y, 90 along -x."""
        a, e = math.radians(azimuth), math.radians(elevation)
        right = np.array([math.cos(a), math.sin(a), 0.0])
        up = np.array([-math.sin(a) * math.sin(e), math.cos(a) * math.sin(e), math.cos(e)])
        return cls(right, up)

    def flat(self, points: np.ndarray) -> np.ndarray:
        """Return (..., 2) places in the picture of points (..., 3), in m."""
        return np.stack([points @ self.right, points @ self.up], axis=-1)

    def depth(self, points: np.ndarray) -> np.ndarray:
        """Return how near points (..., 3) are, in m: larger is nearer."""
        return points @ np.cross(self.right, self.up)


@dataclasses.dataclass(frozen=True, slots=True)
class View:
    """A camera and where its picture goes on the paper.

    Attributes:
        camera: what looks.
        scale: points per m.
        origin: (2,) where the world's origin appears, in points.
    """

    camera: Camera
    scale: float
    origin: np.ndarray

    @classmethod
    def fitting(
        cls,
        camera: Camera,
        points: np.ndarray,
        box: tuple[float, float, float, float],
        largest: float = math.inf,
    ) -> View:
        """Return the view that shows points (n, 3) in the middle of a box, as large as they fit.

        Args:
            camera: what looks.
            points: to show, in m.
            box: left, bottom, width and height, in points.
            largest: scale allowed, in points per m.
        """
        seen = camera.flat(points)
        low, high = seen.min(axis=0), seen.max(axis=0)
        size = np.maximum(high - low, 1e-6)
        scale = min(box[2] / size[0], box[3] / size[1], largest)
        middle = np.array([box[0] + box[2] / 2, box[1] + box[3] / 2])
        return cls(camera, float(scale), middle - scale * (low + high) / 2)

    def at(self, point: np.ndarray) -> tuple[float, float]:
        """Return where a point (3,) in m appears, in points."""
        x, y = self.origin + self.scale * self.camera.flat(point)
        return float(x), float(y)


def clearest(points: np.ndarray, azimuths: Sequence[float], elevations: Sequence[float]) -> Camera:
    """Return the camera in whose picture the two nearest of some points (n, 3) are farthest apart.

    Args:
        points: to tell apart, in m.
        azimuths, elevations: to choose from, in degrees; of equals the first is taken.
    """

    def nearest(camera: Camera) -> float:
        seen = camera.flat(points)
        apart = np.linalg.norm(seen[:, None] - seen[None], axis=-1)
        return float(apart[np.triu_indices(len(seen), 1)].min())

    cameras = [Camera.looking(a, e) for a in azimuths for e in elevations]
    return max(cameras, key=nearest)


def paint(pen: Pen, view: View, things: list[Tube | Ball], *, thinnest: float = 0.5) -> None:
    """Paint tubes and balls, those behind first.

    Args:
        pen: to paint with.
        view: how they are seen.
        things: in m.
        thinnest: width of a line, in points, below which tubes do not go.
    """
    pieces: list[tuple[float, int, Tube | Ball]] = []
    for thing in things:
        if isinstance(thing, Ball):
            # a node lies on its rod's end: let it win
            near = float(view.camera.depth(thing.centre)) + thing.radius
            pieces.append((near, len(pieces), thing))
            continue
        n = max(1, math.ceil(float(np.linalg.norm(thing.end - thing.start)) / PIECE))
        marks = thing.start + np.linspace(0.0, 1.0, n + 1)[:, None] * (thing.end - thing.start)
        for a, b in zip(marks[:-1], marks[1:], strict=True):
            piece = dataclasses.replace(thing, start=a, end=b)
            pieces.append((float(view.camera.depth((a + b) / 2)) + thing.radius, len(pieces), piece))
    if not pieces:
        return
    pieces.sort(key=lambda p: p[:2])
    far, near = pieces[0][0], pieces[-1][0]
    for depth, _, thing in pieces:
        haze = HAZE * (near - depth) / max(near - far, 1e-9)
        if isinstance(thing, Ball):
            _ball(pen, view, thing, haze)
        else:
            _tube(pen, view, thing, haze, thinnest)


def _tube(pen: Pen, view: View, tube: Tube, haze: float, thinnest: float) -> None:
    start, end = view.at(tube.start), view.at(tube.end)
    width = max(2.0 * tube.radius * view.scale, thinnest)
    shades = ((1.0, 0.0),) if tube.flat or width < 1.2 else _SHADES
    along = np.array(end) - start
    length = float(np.hypot(*along))
    # the lighter strokes reach a little over the joints of the pieces, which then do not show
    over = along / length * min(0.4, length / 2) if length > 1e-6 else along
    for k, (part, shade) in enumerate(shades):
        color = _shaded(tube.color, shade, haze)
        a, b = (start, end) if k == 0 and len(shades) > 1 else (tuple(start - over), tuple(end + over))
        pen.line(a, b, color=color, width=width * part)


def _ball(pen: Pen, view: View, ball: Ball, haze: float) -> None:
    x, y = view.at(ball.centre)
    radius = ball.radius * view.scale
    pen.disc((x, y), radius, fill=_shaded(ball.color, -0.45, haze))
    for part, shade in _SHADES[1:]:
        shift = 0.3 * radius * (1.0 - part)
        pen.disc((x - shift, y + shift), radius * part * 0.95, fill=_shaded(ball.color, shade, haze))


def _shaded(color: Color, shade: float, haze: float) -> Color:
    other = white if shade > 0.0 else style.INK
    return style.mixed(style.mixed(color, other, abs(shade)), white, haze)
