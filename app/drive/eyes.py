"""What is seen of a robot at one moment, by a camera or in a simulation."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Protocol

import numpy as np


@dataclasses.dataclass(frozen=True, slots=True)
class HeadPose:
    """Where a head is on the ground, and where it points.

    Attributes:
        x, y: in m, of the head point.
        direction: in rad, counter-clockwise from the x axis, seen from above.
    """

    x: float
    y: float
    direction: float

    @property
    def position(self) -> np.ndarray:
        """(2,) in m."""
        return np.array([self.x, self.y])

    @property
    def facing(self) -> np.ndarray:
        """(2,) direction, of unit length."""
        return np.array([np.cos(self.direction), np.sin(self.direction)])


@dataclasses.dataclass(frozen=True, slots=True)
class Seen:
    """What is seen at one moment.

    Attributes:
        time: in s, of a clock that only goes forwards.
        head: None where it is hidden.
        target: (2,) in m, None where it is hidden.
        picture: makes a JPEG of it.
    """

    time: float
    head: HeadPose | None
    target: np.ndarray | None
    picture: Callable[[], bytes]


class Eyes(Protocol):
    """Whatever sees a robot."""

    def look(self) -> Seen:
        """Wait for the next picture, 20 to 30 a second, and return what is seen in it."""
        ...

    def close(self) -> None:
        """Look no longer."""
        ...
