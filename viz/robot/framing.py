"""Places a perspective camera so that points fill the free part of a window."""

from __future__ import annotations

import dataclasses
import math
from typing import Final

import numpy as np

NEAREST: Final = 0.5
"""How far the eye stays from the nearest point, as a part of the diagonal of the box around all points: from
nearer by, what lies in front would dwarf the rest."""
STEEPEST: Final = 0.999
"""Largest vertical part of the unit vector to the eye; straight down there would be no up."""


@dataclasses.dataclass(frozen=True, slots=True)
class Window:
    """What a camera fills, and what of it is covered.

    Attributes:
        fov: from the lower edge to the upper one, in rad.
        width, height: in pixels.
        top, bottom, sides: pixels at the upper, at the lower and at either other edge to be left free.
        left: pixels more at the left edge.
    """

    fov: float
    width: float
    height: float
    top: float = 0.0
    bottom: float = 0.0
    sides: float = 0.0
    left: float = 0.0

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """Tangents to the free part's left, right, lower and upper edge.

        Where next to nothing is free, a tenth of the window counts as free.
        """
        edge = math.tan(self.fov / 2)
        pixel = 2 * edge / self.height
        side = edge * self.width / self.height
        return (
            *_free(side, (self.sides + self.left) * pixel, self.sides * pixel),
            *_free(edge, self.bottom * pixel, self.top * pixel),
        )


def _free(edge: float, first: float, last: float) -> tuple[float, float]:
    """Return tangents to the ends of what is free between -edge and edge, both ends partly covered."""
    low, high = first - edge, edge - last
    if high - low < 0.2 * edge:
        middle = min(max((low + high) / 2, -0.9 * edge), 0.9 * edge)
        low, high = middle - 0.1 * edge, middle + 0.1 * edge
    return low, high


def eye_showing(points: np.ndarray, towards: np.ndarray, window: Window) -> tuple[np.ndarray, np.ndarray]:
    """Return where a camera is nearest that shows points in the middle of a window's free part.

    Each edge of the free part is a plane through the eye that no point may lie beyond. With the directions
    of the camera fixed, those are linear in the eye's place, so that the answer is exact.

    Args:
        points: (n, 3) what is to be seen, in m.
        towards: (3,) direction from there to the eye; so steeply up that the middle of the free part is seen
            from above.
        window: that is filled.

    Returns:
        (3,) the eye, and (3,) the point of the ground that lies in the middle of the whole window, in m.
    """
    out = np.asarray(towards, dtype=float) / np.linalg.norm(towards)
    if out[2] > STEEPEST:
        yaw = math.atan2(out[1], out[0]) if out[:2].any() else math.pi
        flat = math.sqrt(1.0 - STEEPEST**2)
        out = np.array([flat * math.cos(yaw), flat * math.sin(yaw), STEEPEST])
    right = np.cross([0.0, 0.0, 1.0], out)
    right /= np.linalg.norm(right)
    up = np.cross(out, right)
    x, y, ahead = np.stack([right, up, -out]) @ np.asarray(points, dtype=float).T
    left, right_end, low, high = window.bounds
    aside, side = (left + right_end) / 2, (right_end - left) / 2
    middle, half = (low + high) / 2, (high - low) / 2
    depth = min(
        _farthest_in(x, ahead, aside, side),
        _farthest_in(y, ahead, middle, half),
        ahead.min() - NEAREST * float(np.linalg.norm(np.ptp(points, axis=0))),
    )
    centre = (_centre(x, ahead - depth, aside, side), _centre(y, ahead - depth, middle, half), depth)
    eye = centre[0] * right + centre[1] * up - centre[2] * out
    return eye, eye - out * (eye[2] / out[2])


def _farthest_in(across: np.ndarray, ahead: np.ndarray, middle: float, half: float) -> float:
    """Return how far ahead the eye may be so that all points lie between two edges of its view.

    Args:
        across: (n,) places of the points.
        ahead: (n,) the same along the view.
        middle: tangent to the middle between the edges.
        half: tangent from there to either edge.
    """
    low, high = _places(across, ahead, middle, half)
    return (high - low) / (2.0 * half)


def _centre(across: np.ndarray, ahead: np.ndarray, middle: float, half: float) -> float:
    """Return the eye's place across that leaves as much room at one edge as at the other.

    Args:
        across: (n,) places of the points.
        ahead: (n,) how far they lie ahead of the eye.
        middle: as of ``_farthest_in``.
        half: as there; all points fit between the edges.
    """
    # edges that lie ever closer together, until the points touch both
    least, most = 0.0, half
    for _ in range(50):
        half = (least + most) / 2
        low, high = _places(across, ahead, middle, half)
        least, most = (least, half) if low <= high else (half, most)
    return sum(_places(across, ahead, middle, most)) / 2


def _places(across: np.ndarray, ahead: np.ndarray, middle: float, half: float) -> tuple[float, float]:
    """Return the smallest and largest place across, for an eye at 0 ahead; arguments as of ``_centre``."""
    return (
        float((across - (middle + half) * ahead).max()),
        float((across - (middle - half) * ahead).min()),
    )
