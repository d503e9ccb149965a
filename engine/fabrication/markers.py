"""The printed tags by which a camera finds head and target: two of the family AprilTag 36h11.

OpenCV calls the family ``DICT_APRILTAG_36h11``. A tag's direction is that of its upper edge as printed.
"""

from __future__ import annotations

import dataclasses
from typing import Final

import numpy as np

HEAD_ID: Final = 0
TARGET_ID: Final = 1
N_CELLS: Final = 8
"""Cells along a side of the black square."""
_ROWS: Final = {
    HEAD_ID: "######## ###.#### ##..#.## ####.#.# ####..## #.#...## #.#.#..# ########",
    TARGET_ID: "######## #.##.### #.#..#.# ####..## ###....# #...#.## ##..#..# ########",
}


@dataclasses.dataclass(frozen=True, slots=True)
class Marker:
    """A printed tag.

    Attributes:
        number: of its picture in the family.
        side: of its black square, in m; white paper of one cell's width must remain around it.
        name: what it marks.
    """

    number: int
    side: float
    name: str

    @property
    def cell(self) -> float:
        """Side of a cell, in m."""
        return self.side / N_CELLS

    def black(self) -> np.ndarray:
        """Return (8, 8) whether a cell is black, the uppermost row first."""
        return np.array([[c == "#" for c in row] for row in _ROWS[self.number].split()])


HEAD: Final = Marker(HEAD_ID, 0.05, "head")
TARGET: Final = Marker(TARGET_ID, 0.08, "target")
