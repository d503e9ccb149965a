"""Whether a controller answers a target on the left in another way than one on the right.

That is a property of the network alone. Where robots end tells it less well: noise and an uneven body may
bring a blind robot to different places, and files made smaller have no trajectories.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from engine.body import servo
from engine.config import RunConfig, task_of
from engine.control.network import NetworkBatch
from engine.simulation.evaluation import Solution
from engine.simulation.trials import driving
from engine.tasks import Task
from engine.tasks.loading import made_up_view
from engine.tasks.task import sensed

_MIRRORED: Final = 1e-9
"""Most that bearings in rad on both sides may differ by and still count as mirrored."""


def steers(config: RunConfig, solutions: Sequence[Solution]) -> list[bool]:
    """Tell of each controller whether it answers left and right differently at the start of a trial.

    It does if for some pair of targets, as far to the left as to the right, any of its robot's modules gets
    another frequency or phase.

    Args:
        config: of their run.
        solutions: the robots.

    Raises:
        TaskError: the task cannot be asked what it senses.
    """
    task = task_of(config)
    pairs = mirrored_pairs(task.target_bearings)
    inputs: dict[int, np.ndarray] = {}
    found = []
    for s in solutions:
        n = s.morphology.n_modules
        if n not in inputs:
            inputs[n] = _sensed_at_start(task, n)
        outputs = NetworkBatch([driving(s.controller, config.trials)], n_outputs=2 * n).activate(
            inputs[n][None]
        )[0]
        commands = np.concatenate(
            [
                servo.pick(servo.FREQUENCIES, outputs[:, 0::2]),
                servo.pick(servo.PHASES, outputs[:, 1::2]),
            ],
            axis=1,
        )
        found.append(any((commands[i] != commands[j]).any() for i, j in pairs))
    return found


def mirrored_pairs(bearings: Sequence[float]) -> list[tuple[int, int]]:
    """Return the pairs of targets, left and right, that are mirrored about straight ahead."""
    return [
        (i, j)
        for i, left in enumerate(bearings)
        for j, right in enumerate(bearings)
        if left > 0.0 and math.isclose(left, -right, abs_tol=_MIRRORED)
    ]


def _sensed_at_start(task: Task, n_modules: int) -> np.ndarray:
    """Return what a robot senses that has settled, (targets, inputs)."""
    view = made_up_view(task, n_modules)
    return sensed(task, view, np.ones(view.shape, dtype=bool))[0]
