"""What a robot is asked to do: targets, what its controller senses, how a trial scores.

Positions here are horizontal, in metres. Bearings are in rad, positive to the left of where the head
points (counter-clockwise seen from above); so "90 left" is pi/2.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from typing import Final

import numpy as np

from engine.errors import InvalidData
from engine.robot import Wall

SETTLE_TIME: Final = 3.0
"""Seconds without actuation before a trial's clock starts."""
TRIAL_TIME: Final = 40.0
"""Seconds a trial lasts after settling."""


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Task:
    """One task. A new task is a new instance with its own functions.

    Attributes:
        name: as on the command line.
        n_inputs: how many numbers the controller senses.
        target_distance: from the settled head to each target, in m; d_init of the reported fitness.
        target_bearings: of the targets, in rad.
        sense: (head_position (..., 2), head_direction (..., 2), target (..., 2)) to (..., n_inputs).
        walls: number of modules to the fixed boxes of the world.
    """

    name: str
    n_inputs: int
    target_distance: float
    target_bearings: tuple[float, ...]
    sense: Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]
    walls: Callable[[int], tuple[Wall, ...]] = lambda _n_modules: ()

    @property
    def n_targets(self) -> int:
        """How many targets every solution is tried on."""
        return len(self.target_bearings)


def target_offsets(task: Task, bearings: Sequence[float] | None = None) -> np.ndarray:
    """Return the (targets, 2) target positions in the settled head's frame: x ahead, y left."""
    angle = np.asarray(task.target_bearings if bearings is None else bearings)
    return task.target_distance * np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def distance_and_bearing(
    position: np.ndarray, direction: np.ndarray, point: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return distance (...) in m and bearing (...) in rad, in (-pi, pi], of points from a head.

    Args:
        position: (..., 2) of the head.
        direction: (..., 2) where it points; need not be of unit length.
        point: (..., 2).
    """
    to = point - position
    ahead = to[..., 0] * direction[..., 0] + to[..., 1] * direction[..., 1]
    left = to[..., 1] * direction[..., 0] - to[..., 0] * direction[..., 1]
    # adding zero turns -0.0 into 0.0, so that straight behind is pi, never -pi
    return np.hypot(to[..., 0], to[..., 1]), np.arctan2(left + 0.0, ahead)


def bearing_name(bearing: float) -> str:
    """Return a bearing in rad for people, such as ``45° left``."""
    degrees = round(abs(math.degrees(bearing)))
    side = "left" if bearing > 0 else "right"
    return "straight ahead" if degrees == 0 else f"{degrees}° {side}"


def fitness(distances: np.ndarray) -> float:
    """Return the fitness in m, to be minimised (Zardini et al. 2021, equation 1).

    Args:
        distances: (targets, seeds) final distances in m.
    """
    per_target = np.asarray(distances).mean(axis=1)
    mean = per_target.mean()
    # never -0.0, whose sign a run file would not keep
    return float(mean + 0.5 * (per_target.max() - mean)) + 0.0


def _sense_target(position: np.ndarray, direction: np.ndarray, target: np.ndarray) -> np.ndarray:
    # the published networks take centimetres
    distance, bearing = distance_and_bearing(position, direction, target)
    return np.stack([100.0 * distance, bearing], axis=-1)


GOAL_REACHING: Final = Task(
    name="goal-reaching",
    n_inputs=2,
    target_distance=0.45,
    target_bearings=(math.pi / 2, math.pi / 4, -math.pi / 4, -math.pi / 2),
    sense=_sense_target,
)

TASKS: Final = {task.name: task for task in (GOAL_REACHING,)}


def get_task(name: str) -> Task:
    """Return a task by name.

    Raises:
        InvalidData: there is no such task.
    """
    if name not in TASKS:
        raise InvalidData(f"unknown task {name!r}; choose from {', '.join(TASKS)}")
    return TASKS[name]
