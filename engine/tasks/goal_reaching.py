"""Goal reaching: crawl to a target on an open plane (Zardini et al. 2021, section 3.2)."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from engine.tasks.task import Task
from engine.tasks.view import View


def _sense(view: View) -> np.ndarray:
    distance, bearing = view.to_target()
    return np.stack([distance, bearing], axis=-1)


_DISTANCE: Final = 0.45

GOAL_REACHING: Final = Task(
    name="goal-reaching",
    summary="crawl to a target 45 cm away on an open plane",
    inputs=("distance", "bearing"),
    sense=_sense,
    units=(100.0, 1.0),
    sensed_in=("m", "rad"),
    relative_units=(1.0 / _DISTANCE, 1.0 / math.pi),
    target_distance=_DISTANCE,
    target_bearings=(math.pi / 2, math.pi / 4, -math.pi / 4, -math.pi / 2),
)
