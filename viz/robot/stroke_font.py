"""Numbers drawn with line segments: all those of a scene are one batch, which turns to the camera."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

_OUTLINES: Final = {
    "0": "0,0.2 0.2,0 0.4,0 0.6,0.2 0.6,0.8 0.4,1 0.2,1 0,0.8 0,0.2",
    "1": "0.1,0.8 0.35,1 0.35,0",
    "2": "0,0.8 0.2,1 0.4,1 0.6,0.8 0.6,0.6 0,0 0.6,0",
    "3": "0,1 0.6,1 0.3,0.6 0.6,0.4 0.6,0.2 0.4,0 0.2,0 0,0.2",
    "4": "0.45,0 0.45,1 0,0.3 0.6,0.3",
    "5": "0.6,1 0.05,1 0.05,0.6 0.4,0.6 0.6,0.4 0.6,0.2 0.4,0 0,0",
    "6": "0.5,1 0.2,0.8 0,0.4 0,0.2 0.2,0 0.4,0 0.6,0.2 0.6,0.4 0.4,0.6 0.1,0.5",
    "7": "0,1 0.6,1 0.2,0",
    "8": "0.3,0.55 0.05,0.75 0.2,1 0.4,1 0.55,0.75 0.3,0.55 0,0.25 0.2,0 0.4,0 0.6,0.25 0.3,0.55",
    "9": "0.1,0 0.4,0.2 0.6,0.6 0.6,0.8 0.4,1 0.2,1 0,0.8 0,0.6 0.2,0.4 0.5,0.5",
}
WIDTH: Final = 0.6
"""Width of a digit, in heights of a digit."""
GAP: Final = 0.25
"""Gap between two digits, in heights of a digit."""


class NumberStrokes:
    """Numbers that stand at points and face the camera.

    Args:
        numbers: whole numbers from 0, one per point.
        height: of a digit, in m.
    """

    def __init__(self, numbers: Sequence[int], *, height: float) -> None:
        flat = [_segments(str(n)) * height for n in numbers]
        self._flat = np.concatenate(flat)
        self.owner = np.repeat(np.arange(len(flat)), list(map(len, flat)))
        """(segments,) index of the number that each segment belongs to."""

    def place(self, points: np.ndarray, right: np.ndarray, up: np.ndarray) -> np.ndarray:
        """Return the (segments, 2, 3) float32 line segments.

        Args:
            points: (numbers, 3) where the middle of a number's lower edge is, in m.
            right: (3,) unit vector in the world that points right on the screen.
            up: (3,) the same, upwards.
        """
        offsets = self._flat[..., :1] * right + self._flat[..., 1:] * up
        return (points[self.owner][:, None] + offsets).astype(np.float32)


def _segments(digits: str) -> np.ndarray:
    """Return the (segments, 2, 2) strokes of a number, 1 high, centred on x = 0."""
    whole = len(digits) * WIDTH + (len(digits) - 1) * GAP
    parts = []
    for k, digit in enumerate(digits):
        outline = np.array([[float(v) for v in point.split(",")] for point in _OUTLINES[digit].split()])
        outline[:, 0] += k * (WIDTH + GAP) - whole / 2
        parts.append(np.stack([outline[:-1], outline[1:]], axis=1))
    return np.concatenate(parts)
