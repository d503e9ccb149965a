"""Which of a task's targets lie at the left, and which at the right."""

from __future__ import annotations

import dataclasses
import math
from typing import Final

import numpy as np

from engine.tasks.task import Task

_REACH: Final = {"m": 2.0, "rad": math.pi, "": 1.0}
"""The largest magnitude of something sensed, by its unit: robots are tried on 2 m at most."""


@dataclasses.dataclass(frozen=True, slots=True)
class Sides:
    """How a task tells left from right.

    Attributes:
        bearing: which input of the controllers is the bearing of the target, positive at the left.
        reach: the largest magnitude of each input, as the controllers get it.
        left, right: which targets lie at which side; both have those straight ahead.
    """

    bearing: int
    reach: tuple[float, ...]
    left: tuple[int, ...]
    right: tuple[int, ...]

    def remaining(self, scores: np.ndarray) -> tuple[float, float]:
        """Return the mean scores for targets at the left and at the right, in m.

        Args:
            scores: (targets, repeats) in m.
        """
        by_target = scores.mean(axis=1)
        left, right = (float(np.mean(by_target[list(side)])) for side in (self.left, self.right))
        return left, right


def sides_of(task: Task) -> Sides | None:
    """Return how a task tells left from right, or None if it does not.

    Args:
        task: in the units in which it is sensed.
    """
    if "bearing" not in task.inputs:
        return None
    left = tuple(k for k, b in enumerate(task.target_bearings) if b >= 0.0)
    right = tuple(k for k, b in enumerate(task.target_bearings) if b <= 0.0)
    if not left or not right:
        return None
    reach = (abs(unit) * _REACH[kind] for unit, kind in zip(task.units, task.sensed_in, strict=True))
    return Sides(task.inputs.index("bearing"), tuple(reach), left, right)
