"""What ``viz.recording.render`` draws with: looks, rods, balls, faces, colours."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable, Sequence

import numpy as np
from PIL import ImageDraw
from scipy.spatial.transform import Rotation

from engine.body import module as t
from engine.tasks.walls import Wall
from viz.robot.geometry import Drawing

Color = tuple[int, ...]
Part = tuple[float, Callable[[], None]]
"""Something to draw: its distance from the eye in m, and what draws it."""


@dataclasses.dataclass(frozen=True, slots=True)
class Look:
    """What a picture looks like.

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


def rod_ends(drawing: Drawing) -> np.ndarray:
    """Return the (rods, 2, 3) ends of the rods: of a module's points the first twelve are its nodes."""
    per_module = len(t.NODES) + 1
    nodes = drawing.nodes.reshape(-1, per_module, 3).astype(float)
    return nodes[:, np.array(t.RODS)].reshape(-1, 2, 3)


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
