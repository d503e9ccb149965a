"""What a replay is drawn with in software: a look, a camera, rods, balls, faces, colours."""

from __future__ import annotations

import dataclasses
import functools
import itertools
from collections.abc import Callable, Iterable, Sequence
from typing import Final

import numpy as np
from PIL import ImageDraw
from scipy.spatial.transform import Rotation

from engine.tasks.walls import Wall

Color = tuple[int, ...]
PaintedPart = tuple[float, Callable[[], object]]
"""Something to draw: its distance from the eye in m, and what draws it."""
NEAR: Final = 0.03
"""Metres before the eye within which nothing is drawn."""


@dataclasses.dataclass(frozen=True, slots=True)
class ReplayLook:
    """How a picture looks.

    Attributes:
        size: width and height in pixels, both even, as video needs them.
        light: dark lines on a bright ground instead of the other way round.
        caption: whether to say below which robot it is and what time.
    """

    size: tuple[int, int] = (1280, 720)
    light: bool = False
    caption: bool = True

    @property
    def ground(self) -> Color:
        """Colour of the ground."""
        return (238, 241, 244) if self.light else (23, 26, 31)

    @property
    def text(self) -> Color:
        """Colour of texts and lines of the ground."""
        return (70, 82, 100) if self.light else (150, 162, 180)


@dataclasses.dataclass(frozen=True, slots=True)
class PerspectiveCamera:
    """A perspective camera.

    Attributes:
        focus: (3,) what it looks at, in m.
        yaw: where the eye is, in rad about the vertical, counter-clockwise from the x axis.
        pitch: how far up the eye is, in rad.
        distance: from the focus to the eye, in m.
        size: width and height of the picture, in pixels.
    """

    focus: np.ndarray
    yaw: float
    pitch: float
    distance: float
    size: tuple[int, int]

    @property
    def axes(self) -> np.ndarray:
        """(3, 3) unit vectors to the right, up and ahead."""
        c, s = np.cos(self.pitch), np.sin(self.pitch)
        out = np.array([np.cos(self.yaw) * c, np.sin(self.yaw) * c, s])
        right = np.array([-np.sin(self.yaw), np.cos(self.yaw), 0.0])
        return np.stack([right, np.cross(out, right), -out])

    def project(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return where (n, 3) points are seen.

        Returns:
            (n, 2) pixels, (n,) distances ahead of the eye in m, (n,) pixels per metre there.
        """
        axes = self.axes
        eye = self.focus - self.distance * axes[2]
        seen = (points - eye) @ axes.T
        width, height = self.size
        scale = 1.25 * min(height, 1.1 * width) / np.maximum(seen[:, 2], 1e-3)
        pixels = np.stack([width / 2 + scale * seen[:, 0], height / 2 - scale * seen[:, 1]], axis=-1)
        return pixels, seen[:, 2], scale

    def showing(self, points: np.ndarray, margin: float = 0.12) -> PerspectiveCamera:
        """Return this camera moved until (n, 3) points lie within the picture, a margin around them."""
        middle = (points.min(axis=0) + points.max(axis=0)) / 2
        camera = dataclasses.replace(self, focus=np.array([middle[0], middle[1], 0.02]), distance=0.3)
        half = np.array(self.size) / 2
        while camera.distance < 20.0:
            pixels, ahead, _ = camera.project(points)
            if (ahead > 0.1).all() and (np.abs(pixels / half - 1.0) < 1.0 - margin).all():
                break
            camera = dataclasses.replace(camera, distance=1.04 * camera.distance)
        return camera


def parts_of(
    paint: Callable[..., object], depths: np.ndarray, *columns: Iterable, lift: float = 0.0
) -> list[PaintedPart]:
    """Return things of one kind that lie before the eye, to be painted.

    Args:
        paint: draws one of them.
        depths: (n,) their distances ahead of the eye, in m.
        columns: what ``paint`` is called with, of each.
        lift: how much nearer they count, in m, so that they hide what they touch.
    """
    return [
        (depth - lift, functools.partial(paint, *row))
        for depth, *row in zip(depths.tolist(), *columns, strict=True)
        if depth >= NEAR
    ]


def paint_all(parts: Sequence[PaintedPart]) -> None:
    """Paint everything, the farthest first."""
    for _, paint in sorted(parts, key=lambda part: -part[0]):
        paint()


def draw_rod(draw: ImageDraw.ImageDraw, ends: np.ndarray, width: float, layers: Sequence[Color]) -> None:
    """Draw a rod, lit from above left: its edge, its body, its highlight."""
    parts = zip(layers, (1.0, 0.72, 0.28), (0.0, 0.0, 0.17), strict=True)
    for color, wide, shift in parts:
        draw.line((ends - shift * width).ravel().tolist(), color, max(1, round(wide * width)))


def draw_ball(
    draw: ImageDraw.ImageDraw, centre: Sequence[float], radius: float, shades: Sequence[Color]
) -> None:
    """Draw a ball, lit from above left: its edge, its middle."""
    (x, y), r = centre, radius
    draw.ellipse([x - r, y - r, x + r, y + r], shades[0])
    x, y, r = x - 0.16 * r, y - 0.18 * r, 0.74 * r
    draw.ellipse([x - r, y - r, x + r, y + r], shades[1])


def wall_faces(wall: Wall) -> list[np.ndarray]:
    """Return the six (4, 3) faces of a wall."""
    turn, half = Rotation.from_euler("z", wall.yaw), np.array(wall.half_size)
    faces = []
    for axis, side in itertools.product(range(3), (-1.0, 1.0)):
        ring = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
        corners = np.insert(ring, axis, side, axis=1) * half
        faces.append(turn.apply(corners) + wall.centre)
    return faces


def shade(color: Sequence[int], part: float) -> Color:
    """Return a colour darkened to a part of itself."""
    return tuple(int(c * part) for c in color)


def mix(color: Sequence[int], other: Color, part: float) -> Color:
    """Return a colour with a part of another."""
    return tuple(int(c * (1.0 - part) + o * part) for c, o in zip(color, other, strict=True))
