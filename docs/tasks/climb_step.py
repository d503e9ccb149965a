"""Climb a step: crawl 30 cm ahead, the last 15 of them on a step 1 or 2 cm high.

tensatlas evolve runs/step.tsmr --task docs/tasks/climb_step.py
TENSATLAS_TASKS=docs/tasks/climb_step.py tensatlas explore runs/step.tsmr
"""

import numpy as np

from engine.tasks import Task, View, Wall

EDGE = 0.15  # where the step begins, in m ahead of the settled head
HEIGHTS = (0.01, 0.02)  # of the step for the two targets, in m
DISTANCE = 0.3  # of the target, in m
HIGH = 0.1  # a head this high would sense 1, in m
LIFT = 0.05  # what a robot gains that stands on the step with every module, in m


def walls(target: int, _n_modules: int) -> tuple[Wall, ...]:
    """Return the step as one long box, half a metre wide on either side."""
    half = HEIGHTS[target] / 2
    return (Wall(centre=(EDGE + 0.5, 0.0, half), half_size=(0.5, 0.5, half)),)


def sense(view: View) -> np.ndarray:
    """Return what the controller senses: the target, the edge ahead, how high the head is; from -1 to 1."""
    distance, bearing = view.to_target()
    return np.stack(
        [
            distance / DISTANCE,  # larger numbers than 1 would saturate the networks
            bearing / np.pi,
            np.minimum(view.clearance / EDGE, 1),  # to the edge; infinite where there is none
            view.height / HIGH,
        ],
        axis=-1,
    )


def score(view: View) -> np.ndarray:
    """Return the distance left, less a bonus that grows with the share of modules on the step."""
    on_step = (view.modules[..., 0] > EDGE).mean(axis=-1)
    return view.distance - LIFT * on_step


TASK = Task(
    name="climb-step",
    summary="crawl 30 cm ahead, up a step of 1 or 2 cm",
    inputs=("distance", "bearing", "edge", "height"),
    sense=sense,
    target_distance=DISTANCE,
    target_bearings=(0.0, 0.0),
    names=("step of 1 cm", "step of 2 cm"),
    walls=walls,
    score=score,
    score_name="distance left, less up to 5 cm on the step",
)
