"""Which trial of a robot to replay, and a target that the user places in it."""

from __future__ import annotations

import dataclasses
import math
import re
from typing import Final

import numpy as np

from engine.errors import InvalidData
from engine.exact import cosine_and_sine
from engine.tasks import bearing_name

NEAREST: Final = 5
FARTHEST: Final = 300
"""Centimetres from the settled head within which a target may be placed."""
_WRITTEN: Final = re.compile(r"-?[0-9]{1,3},[0-9]{1,3}")


@dataclasses.dataclass(frozen=True, slots=True)
class Aim:
    """The place of a target that the user chooses, seen from the settled head.

    Attributes:
        bearing: in whole degrees, positive to the left, from -180 to 180.
        distance: in whole centimetres. Whole numbers can be shared and typed.

    Raises:
        InvalidData: it is too near or too far, or its bearing is out of range.
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
        """Return the aim that a text such as ``30,62`` describes.

        Raises:
            InvalidData: it describes none, or one too near, too far or with a bearing out of range.
        """
        if not _WRITTEN.fullmatch(text):
            raise InvalidData(
                "a target is its bearing in degrees, positive to the left, and its distance"
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
        return self.distance / 100 * np.array(cosine_and_sine(math.radians(self.bearing)))

    @property
    def name(self) -> str:
        """Its name, such as ``30° left, 62 cm``."""
        return f"{bearing_name(math.radians(self.bearing))}, {self.distance} cm"


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class TrialChoice:
    """One of the trials of a robot.

    Attributes:
        target: which of the task's targets, counted from 0; its world is that of the trial.
        repeat: which of the noises that it was evaluated with, counted from 0.
        fresh: number of fresh noise, 0 for the evaluated one.
        aim: another place for the target, None for the task's.
    """

    target: int = 0
    repeat: int = 0
    fresh: int = 0
    aim: Aim | None = None


FIRST_TRIAL: Final = TrialChoice()
"""Towards the first target, under the first noise."""
