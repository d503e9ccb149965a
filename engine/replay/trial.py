"""Which trial of a robot is to be replayed, and a target of one's own for it."""

from __future__ import annotations

import dataclasses
import math
import re
from typing import Final

import numpy as np

from engine.errors import InvalidData
from engine.tasks import bearing_name

NEAREST: Final = 5
FARTHEST: Final = 300
"""Centimetres from the settled head within which a target may be placed."""
_WRITTEN: Final = re.compile(r"-?[0-9]{1,3},[0-9]{1,3}")


@dataclasses.dataclass(frozen=True, slots=True)
class Aim:
    """Where a target of one's own is, seen from the settled head.

    Attributes:
        bearing: in whole degrees, positive to the left, from -180 to 180.
        distance: in whole centimetres. Whole numbers can be shared and typed.

    Raises:
        InvalidData: it is too near, too far or no direction.
    """

    bearing: int
    distance: int

    def __post_init__(self) -> None:
        if not -180 <= self.bearing <= 180:
            raise InvalidData(f"the bearing must be from -180° to 180°, not {self.bearing}°")
        if not NEAREST <= self.distance <= FARTHEST:
            raise InvalidData(
                f"a target must be {NEAREST} to {FARTHEST} cm from where the head begins,"
                f" not {self.distance} cm"
            )

    @classmethod
    def parse(cls, text: str) -> Aim:
        """Return the aim that ``text`` writes, such as ``30,62``.

        Raises:
            InvalidData: it writes none, or one that is too near, too far or no direction.
        """
        if not _WRITTEN.fullmatch(text):
            raise InvalidData(
                "a target of your own is its bearing in degrees, positive to the left, and its distance"
                f" in cm, such as 30,62, not {text[:40]!r}"
            )
        bearing, distance = map(int, text.split(","))
        return cls(bearing, distance)

    @property
    def text(self) -> str:
        """What ``parse`` reads."""
        return f"{self.bearing},{self.distance}"

    @classmethod
    def at(cls, offset: np.ndarray) -> Aim:
        """Return the aim at a (2,) point in the settled head's frame: x ahead, y left, in m.

        Raises:
            InvalidData: it is too near or too far.
        """
        x, y = (float(v) for v in offset)
        return cls(round(math.degrees(math.atan2(y, x))), round(100 * math.hypot(x, y)))

    @property
    def offset(self) -> np.ndarray:
        """(2,) its position in the settled head's frame: x ahead, y left, in m."""
        angle = math.radians(self.bearing)
        return self.distance / 100 * np.array([math.cos(angle), math.sin(angle)])

    @property
    def name(self) -> str:
        """What people call it, such as ``30° left, 62 cm``."""
        return f"{bearing_name(math.radians(self.bearing))}, {self.distance} cm"


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class TrialChoice:
    """One of the trials of a robot.

    Attributes:
        target: which of the task's targets, counted from 0; its world is that of the trial.
        repeat: which of the noises that it was evaluated with, counted from 0.
        fresh: number of fresh noise, 0 for the evaluated one.
        aim: where the target is instead, None for where the task has it.
    """

    target: int = 0
    repeat: int = 0
    fresh: int = 0
    aim: Aim | None = None


FIRST_TRIAL: Final = TrialChoice()
"""Towards the first target, under the first noise."""
