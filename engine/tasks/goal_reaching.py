"""Goal reaching: crawl to a target on an open plane (Zardini et al. 2021, section 3.2)."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from engine.tasks.task import Task
from engine.tasks.view import View


def _sense(view: View) -> np.ndarray:
    # the published networks take centimetres
    distance, bearing = view.to_target()
    return np.stack([100.0 * distance, bearing], axis=-1)


GOAL_REACHING: Final = Task(
    name="goal-reaching",
    summary="crawl to a target 45 cm away on an open plane",
    inputs=("distance", "bearing"),
    sense=_sense,
    target_distance=0.45,
    target_bearings=(math.pi / 2, math.pi / 4, -math.pi / 4, -math.pi / 2),
)
