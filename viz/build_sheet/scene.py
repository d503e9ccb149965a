"""Robots as vector graphics: tubes and balls seen from afar, painted from back to front."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from reportlab.lib.colors import Color, HexColor, white

from viz.build_sheet import style
from viz.build_sheet.pen import Pen

PIECE: Final = 0.011
"""Tubes are sorted by depth in pieces of at most this length, in m."""
HAZE: Final = 0.35
"""How far the colour of the rearmost thing is mixed with white."""
_SHADES: Final = ((1.0, -0.45), (0.82, 0.0), (0.42, 0.3), (0.14, 0.6))
"""Width of each stroke of a tube, as a part of its own, and how much darker or lighter than its colour."""


@dataclasses.dataclass(frozen=True, slots=True)
class Tube:
    """A straight tube: ends (3,) and radius in m, its colour."""

    start: np.ndarray
    end: np.ndarray
    radius: float
    color: Color


@dataclasses.dataclass(frozen=True, slots=True)
class Ball:
    """A ball: centre (3,) and radius in m, its colour."""

    centre: np.ndarray
    radius: float
    color: Color


@dataclasses.dataclass(frozen=True, slots=True)
class OrthographicCamera:
    """Looks at a scene from infinitely far away.

    Attributes:
        right, up: (3,) unit vectors of the picture.
    """

    right: np.ndarray
    up: np.ndarray

    @classmethod
    def looking(cls, azimuth: float, elevation: float) -> OrthographicCamera:
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
class SceneView:
    """A camera and where its picture goes on the paper.

    Attributes:
        camera: what looks.
        scale: points per m.
        origin: (2,) where the world's origin appears, in points.
    """

    camera: OrthographicCamera
    scale: float
    origin: np.ndarray

    @classmethod
    def fitting(
        cls,
        camera: OrthographicCamera,
        points: np.ndarray,
        box: tuple[float, float, float, float],
        largest: float = math.inf,
    ) -> SceneView:
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


def clearest(
    points: np.ndarray, azimuths: Sequence[float], elevations: Sequence[float]
) -> OrthographicCamera:
    """Return the camera in whose picture the two nearest of some points (n, 3) are farthest apart.

    Args:
        points: to tell apart, in m.
        azimuths: to choose from, in degrees; of equals the first is taken.
        elevations: likewise.
    """

    def nearest(camera: OrthographicCamera) -> float:
        seen = camera.flat(points)
        apart = np.linalg.norm(seen[:, None] - seen[None], axis=-1)
        return float(apart[np.triu_indices(len(seen), 1)].min())

    cameras = [OrthographicCamera.looking(a, e) for a in azimuths for e in elevations]
    return max(cameras, key=nearest)


def paint(pen: Pen, view: SceneView, things: list[Tube | Ball], *, thinnest: float = 0.5) -> None:
    """Paint tubes and balls, those behind first.

    Args:
        pen: to paint with.
        view: how they are seen.
        things: in m.
        thinnest: width of a line, in points, below which tubes do not go.
    """
    if not things:
        return
    owners: list[Tube | Ball] = []
    starts, ends = [], []
    for thing in things:
        if isinstance(thing, Ball):
            owners.append(thing)
            starts.append(thing.centre[None])
            ends.append(thing.centre[None])
            continue
        n = max(1, math.ceil(float(np.linalg.norm(thing.end - thing.start)) / PIECE))
        marks = thing.start + np.linspace(0.0, 1.0, n + 1)[:, None] * (thing.end - thing.start)
        owners += [thing] * n
        starts.append(marks[:-1])
        ends.append(marks[1:])
    a, b = np.concatenate(starts), np.concatenate(ends)
    # a node lies on its rod's end: let it win
    depth = view.camera.depth((a + b) / 2) + np.array([thing.radius for thing in owners])
    # as seen: what is painted must not hang on the last bits of a simulation
    depth = np.round(depth, 6)
    haze = HAZE * (depth.max() - depth) / max(float(np.ptp(depth)), 1e-9)
    seen_a, seen_b = (view.origin + view.scale * view.camera.flat(p) for p in (a, b))
    for k in np.argsort(depth, kind="stable"):
        thing, mist = owners[k], round(float(haze[k]), 2)
        if isinstance(thing, Ball):
            _ball(pen, seen_a[k].tolist(), thing.radius * view.scale, thing.color, mist)
        else:
            width = max(2.0 * thing.radius * view.scale, thinnest)
            _tube(pen, seen_a[k].tolist(), seen_b[k].tolist(), width, thing, mist)


def _tube(pen: Pen, start: list[float], end: list[float], width: float, tube: Tube, haze: float) -> None:
    along = (end[0] - start[0], end[1] - start[1])
    length = math.hypot(*along)
    # the lighter strokes reach a little over the joints of the pieces, which then do not show
    over = min(0.4, length / 2) / length if length > 1e-6 else 0.0
    dx, dy = over * along[0], over * along[1]
    long = (start[0] - dx, start[1] - dy), (end[0] + dx, end[1] + dy)
    if width < 1.2:
        pen.line(*long, color=_shaded(tube.color, 0.0, haze), width=width)
        return
    shades = _SHADES if width > 2.6 else _SHADES[:2]
    for k, (part, shade) in enumerate(shades):
        a, b = ((start[0], start[1]), (end[0], end[1])) if k == 0 else long
        pen.line(a, b, color=_shaded(tube.color, shade, haze), width=width * part)


def _ball(pen: Pen, centre: list[float], radius: float, color: Color, haze: float) -> None:
    x, y = centre
    pen.disc((x, y), radius, fill=_shaded(color, -0.45, haze))
    for part, shade in _SHADES[1:] if radius > 1.5 else _SHADES[1:2]:
        shift = 0.3 * radius * (1.0 - part)
        pen.disc((x - shift, y + shift), radius * part * 0.95, fill=_shaded(color, shade, haze))


def _shaded(color: Color, shade: float, haze: float) -> Color:
    return _mixed(color.hexval(), shade, haze)


@functools.lru_cache(maxsize=4096)
def _mixed(color: str, shade: float, haze: float) -> Color:
    other = white if shade > 0.0 else style.INK
    return style.mixed(style.mixed(HexColor(color), other, abs(shade)), white, haze)
