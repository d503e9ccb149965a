"""A robot's motion as data for ``replay_view.js``: the scene that it draws, and the packed columns.

A column is a coordinate of a point, or the tension of a cable. What a viewer draws at a moment between two
frames lies on a smooth curve (a Catmull-Rom spline) through the frames.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from engine.body import module as t
from engine.body.morphology import Morphology
from engine.simulation.rollout import Head
from engine.tasks.walls import Wall
from viz import theme
from viz.recording import packing
from viz.robot.geometry import (
    ACTUATOR_DRAWN_RADIUS,
    NODE_DRAWN_RADIUS,
    ROD_DRAWN_RADIUS,
    STRAIN_FULL_COLOR,
    RobotGeometry,
)
from viz.robot.skeleton import N_POINTS

EVERY_CABLE: Final = t.N_CABLES
SERVO_CABLES: Final = len(t.SERVO_NODES)
"""Cables of a module whose tension can be kept: all, or those that the servo pulls. A viewer works out the
others' from the distances of their nodes."""
_LIMIT: Final = 32_000
_BETWEEN_NODES: Final = 0.0019
"""How much longer the way between two nodes is than the cable between their rods' surfaces, in m: the mean of
crawling robots."""


@dataclasses.dataclass(frozen=True, slots=True)
class Detail:
    """How exactly a motion is kept.

    Attributes:
        step: metres between two values that a coordinate can take; more where the robot goes so far that
            16 bits would not do.
        levels: steps of a cable's tension.
        told: ``EVERY_CABLE`` or ``SERVO_CABLES``.
    """

    step: float
    levels: int
    told: int


@dataclasses.dataclass(frozen=True, slots=True)
class TrialMotion:
    """One trial of a robot of M modules.

    Attributes:
        poses: (frames, M, 6, 7) positions in m and quaternions of the rods; at least one frame.
        lengths: (frames, M, 5) commanded lengths of the internal cables, in m.
        target: (2,) in m.
        walls: in its world.
    """

    poses: np.ndarray
    lengths: np.ndarray
    target: np.ndarray
    walls: Sequence[Wall]


@dataclasses.dataclass(frozen=True, slots=True)
class Motion:
    """What a viewer gets.

    Attributes:
        scene: JSON-ready: what it draws besides the motion, and how to read that.
        columns: packed by ``packing``.
        off: the farthest that a point lies from where it was simulated, in m.
    """

    scene: dict[str, Any]
    columns: bytes
    off: float


def motion(
    morphology: Morphology,
    head: Head,
    trials: Sequence[TrialMotion],
    *,
    detail: Detail,
    start: float,
    period: float,
) -> Motion:
    """Return the motion of a robot.

    Args:
        morphology: its body.
        head: which end of it is its head.
        trials: at least one.
        detail: how exactly it is kept.
        start: time of the trial's clock one ``period`` before the first frame, in s.
        period: seconds between two frames.
    """
    geometry = RobotGeometry(morphology, head.module)
    drawn = [geometry.draw_all(trial.poses, trial.lengths) for trial in trials]
    points = [np.array([d.nodes for d in frames], dtype=float) for frames in drawn]
    everywhere = np.concatenate([p.reshape(-1, 3) for p in points])
    origin = (everywhere.min(axis=0) + everywhere.max(axis=0)) / 2
    step = max(detail.step, float(np.abs(everywhere - origin).max()) / _LIMIT)
    columns, off = [], 0.0
    for places, frames in zip(points, drawn, strict=True):
        whole = np.round((places - origin) / step)
        off = max(off, float(np.linalg.norm(origin + step * whole - places, axis=-1).max()))
        shares = np.array([d.tension for d in frames]).reshape(len(frames), -1, EVERY_CABLE)
        told = np.round(detail.levels * shares[..., EVERY_CABLE - detail.told :])
        columns.append(
            np.concatenate([a.reshape(len(frames), -1) for a in (whole, told)], axis=1).astype(np.int16)
        )
    stiffness = np.array(morphology.stiffnesses)
    scene = {
        "modules": morphology.n_modules,
        "points": N_POINTS,
        "rods": [list(r) for r in t.RODS],
        "passive": [list(c) for c in t.CABLES],
        # a module's thirteenth point is its actuator
        "servo": [[len(t.NODES), n] for n in t.SERVO_NODES],
        "head": head.module,
        "front": list(head.front),
        "period": period,
        "start": start,
        "step": step,
        "origin": origin.tolist(),
        "levels": detail.levels,
        "told": detail.told,
        "stiffness": (stiffness / stiffness.max()).tolist(),
        "slack": t.CABLE_REST_LENGTH + _BETWEEN_NODES,
        "reach": STRAIN_FULL_COLOR * t.CABLE_REST_LENGTH,
        "packing": {"taps": packing.TAPS, "unit": packing.UNIT},
        "rodColors": geometry.rod_colors.tolist(),
        "radius": {"rod": ROD_DRAWN_RADIUS, "node": NODE_DRAWN_RADIUS, "servo": ACTUATOR_DRAWN_RADIUS},
        "colors": {
            "node": theme.NODE,
            "servo": theme.SERVO_ROD,
            "servoSlack": theme.SERVO_SLACK,
            "servoTaut": theme.SERVO_TAUT,
            "target": theme.TARGET,
            "trail": theme.TRAIL,
            "wall": theme.WALL,
        },
        "trials": [
            {
                "frames": len(trial.poses),
                "target": np.asarray(trial.target, dtype=float).tolist(),
                "walls": [w.to_json() for w in trial.walls if not w.is_buried],
            }
            for trial in trials
        ],
    }
    return Motion(scene, packing.packed(columns), off)
