"""Squeezing: crawl to a target through an aperture narrower than the robot (Zardini et al. 2021).

The published robot is turned about the vertical before it is dropped, so that its settled head looks along an
axis of the walls. On a plane the dynamics do not depend on that turn. So here robots fall unturned, without
walls, and the walls are put up afterwards in the frame of the settled head. The search for the head needs no
walls either, and a body settles alike for every task. With the published order a robot would have to settle
twice, the first time only to measure the turn.
"""

from __future__ import annotations

import dataclasses
import math
from typing import Final

import numpy as np

from engine.body import module as t
from engine.exact import cosine_and_sine, length
from engine.tasks.task import Task
from engine.tasks.view import View
from engine.tasks.walls import Wall

MODULE_LENGTH: Final = 2.0 * float(length(t.NODES[0]))
"""Diameter of a module as built, 11.11 cm, from which the published walls are derived."""
THICKNESS: Final = 1.5 * MODULE_LENGTH
"""Thickness of every wall, in m; in the front wall, the length of the aperture."""
HEIGHT: Final = 0.12
APERTURE: Final = 0.72 * MODULE_LENGTH
"""Width of the aperture, in m."""
MARGIN: Final = 0.04
"""Extra distance of the walls without an aperture, in m."""
SENSOR_RANGE: Final = 0.10
"""Largest distance at which a wall straight ahead is sensed, in m."""
DEPTH: Final = 0.04
"""How far past the entrance a head must end for the bonus, in m."""
BONUS: Final = 0.04
"""Deducted from the final distance, in m."""

_DISTANCE: Final = 0.6
_GATE_DISTANCE: Final = 0.1583
"""How far the entrance is from where the head begins, in m; rounded, as cosines differ between machines."""
_BEARINGS: Final = (math.radians(5.0), -math.radians(5.0))


def entrance(target: np.ndarray) -> np.ndarray:
    """Return the (..., 2) middle of the aperture's entrance for a (..., 2) target, in m."""
    return np.stack([target[..., 0] / 4.0, target[..., 1]], axis=-1)


def walls(target: int, n_modules: int) -> tuple[Wall, ...]:
    """Return the front wall, left and right of its aperture, and the walls left, right and behind.

    The front wall's middle is a quarter of the target's distance plus half a wall ahead of the head, its
    aperture is centred on the target's sideways position. The middles of the other walls are at
    b = max(that, two nominal robot lengths, the sideways position) + 4 cm.
    """
    x, y = (_DISTANCE * part for part in cosine_and_sine(_BEARINGS[target]))
    half = THICKNESS / 2.0
    front = x / 4.0 + half
    b = max(front, 2.0 * n_modules * MODULE_LENGTH, abs(y)) + MARGIN
    inner, opening = b - half, APERTURE / 2.0
    return (
        _box((front - half, front + half), (y + opening, inner)),
        _box((front - half, front + half), (-inner, y - opening)),
        _box((-b - half, front + half), (inner, b + half)),
        _box((-b - half, front + half), (-b - half, -inner)),
        _box((-b - half, -inner), (-inner, inner)),
    )


def _box(x: tuple[float, float], y: tuple[float, float]) -> Wall:
    return Wall(
        centre=((x[0] + x[1]) / 2.0, (y[0] + y[1]) / 2.0, HEIGHT / 2.0),
        half_size=((x[1] - x[0]) / 2.0, (y[1] - y[0]) / 2.0, HEIGHT / 2.0),
    )


def _sense(view: View) -> np.ndarray:
    gate = entrance(view.target)
    distance, bearing = view.to_target()
    gate_distance, gate_bearing = view.to(gate)
    past = view.position[..., 0] > gate[..., 0]
    return np.stack(
        [
            distance,
            bearing,
            np.where(past, -gate_distance, gate_distance),
            gate_bearing,
            view.clearance <= SENSOR_RANGE,
        ],
        axis=-1,
    )


def _score(view: View) -> np.ndarray:
    depth = view.position[..., 0] - entrance(view.target)[..., 0]
    return view.distance - np.where(depth >= DEPTH, BONUS, 0.0)


def _score_by_distance(view: View) -> np.ndarray:
    gate = entrance(view.target)
    past = view.position[..., 0] > gate[..., 0]
    far = np.linalg.norm(view.position - gate, axis=-1) >= DEPTH
    return view.distance - np.where(past & far, BONUS, 0.0)


SQUEEZING: Final = Task(
    name="squeezing",
    summary="crawl to a target 60 cm away through an aperture of 8 cm",
    inputs=("distance", "bearing", "gate dist.", "gate bear.", "obstacle"),
    sense=_sense,
    units=(100.0, 1.0, 100.0, 1.0, 1.0),
    sensed_in=("m", "rad", "m", "rad", ""),
    relative_units=(1.0 / _DISTANCE, 1.0 / math.pi, 1.0 / _GATE_DISTANCE, 1.0 / math.pi, 1.0),
    target_distance=_DISTANCE,
    target_bearings=_BEARINGS,
    walls=walls,
    score=_score,
    score_name="final distance, less 4 cm past the gate",
)
SQUEEZING_BY_DISTANCE: Final = dataclasses.replace(SQUEEZING, score=_score_by_distance)
"""The same with the published bonus: for a head past the entrance and ``DEPTH`` away from its middle."""
