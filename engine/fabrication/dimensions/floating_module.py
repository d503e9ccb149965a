"""One floating module, its servo off, released or contracted: lengths and distances.

A maker holds one module in the hand, without neighbours and off the ground. So the robot's model of one
module is simulated without gravity until it rests.

A finished module is measured between rod ends, where calipers reach, and held by its servo rod. The other
five rods then weigh less than a twentieth of what one cable pulls, so the floating module predicts what the
calipers must show: ``contraction``.
"""

from __future__ import annotations

import dataclasses
import functools
import itertools
from typing import Final

import mujoco
import numpy as np

from engine.body import module as t
from engine.body import servo
from engine.fabrication.dimensions import tolerances
from engine.simulation.built import PUBLISHED, Built
from engine.simulation.model import chain_spec
from engine.simulation.physics import Physics, as_built

HOLD: Final = 5.0
"""Simulated seconds before the module is measured."""
SLACK: Final = 1.0
"""Target length in m that lets an internal cable hang slack."""
RELEASED: Final = 0
CONTRACTED: Final = 180
"""Servo commands in degrees."""
_FACE: Final = 1
"""Joining face of the module, which joins nothing here; it only turns the module as a whole."""


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class ModuleState:
    """A floating module at rest.

    Attributes:
        cables: (24,) lengths of the passive cables between their anchors, in m, as ``module.CABLES``.
        servo_cables: (5,) lengths of the internal cables, in m, as ``module.SERVO_NODES``.
        servo_tensions: (5,) their tensions, in N.
        nodes: (12, 3) in m, in the frame of the module's centre, turned as built.
    """

    cables: np.ndarray
    servo_cables: np.ndarray
    servo_tensions: np.ndarray
    nodes: np.ndarray


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Distance:
    """The distance between two rod ends.

    Attributes:
        nodes: the two.
        released: in m, servo at 0 degrees.
        contracted: in m, servo at 180 degrees.
        tolerance: allowed deviation, in m: what errors of ``tolerances.INTERNAL_CABLE`` in all internal
            cables cause, plus ``tolerances.STIFFNESS`` times the stroke.
    """

    nodes: tuple[int, int]
    released: float
    contracted: float
    tolerance: float


def floating_module(
    level: int, command: int | None, off: float = 0.0, built: Built = PUBLISHED
) -> ModuleState:
    """Return a module of a stiffness level at rest.

    Args:
        level: the stiffness gene, 1 to 10.
        command: in degrees; None for servo off.
        off: how much longer the internal cables are than commanded, in m.
        built: what it is like where it differs from the published one.
    """
    return _simulated(level, command, off, built)


@functools.lru_cache(maxsize=2 * t.N_STIFFNESS_LEVELS)
def contraction(level: int, built: Built = PUBLISHED) -> tuple[Distance, ...]:
    """Return the three distances between nodes with internal cables that shrink most, in falling order.

    Args:
        level: the stiffness gene, 1 to 10.
        built: what the module is like where it differs from the published one.
    """
    released, contracted, long, short = (
        _distances(level, command, off, built)
        for command, off in (
            (RELEASED, 0.0),
            (CONTRACTED, 0.0),
            (CONTRACTED, tolerances.INTERNAL_CABLE),
            (CONTRACTED, -tolerances.INTERNAL_CABLE),
        )
    )
    pairs = sorted(itertools.combinations(sorted(t.SERVO_NODES), 2))
    pairs.sort(key=lambda p: round(contracted[p] - released[p], 5))
    return tuple(
        Distance(
            nodes=p,
            released=float(released[p]),
            contracted=float(contracted[p]),
            tolerance=float(
                max(abs(long[p] - contracted[p]), abs(short[p] - contracted[p]))
                + tolerances.STIFFNESS * (released[p] - contracted[p])
            ),
        )
        for p in pairs[:3]
    )


@functools.lru_cache(maxsize=10 * t.N_STIFFNESS_LEVELS)
def _simulated(level: int, command: int | None, off: float, built: Built) -> ModuleState:
    physics = as_built(Physics(), built)
    model = chain_spec((level,), (_FACE,), physics=physics, gravity=False).compile()
    data = mujoco.MjData(model)
    lengths = np.full(len(t.SERVO_NODES), SLACK)
    if command is not None:
        lengths = servo.target_lengths(np.array(command), built.target_lengths()) + off
    data.ctrl[:] = lengths
    mujoco.mj_step(model, data, round(HOLD / model.opt.timestep))
    mujoco.mj_forward(model, data)
    cables = [data.ten_length[model.tendon(f"m0_cable_{a}_{b}").id] for a, b in t.CABLES]
    internal = [data.ten_length[model.tendon(f"m0_servo_{n}").id] for n in t.SERVO_NODES]
    return ModuleState(
        cables=np.array(cables),
        servo_cables=np.array(internal),
        servo_tensions=-data.actuator_force.copy(),
        nodes=nodes_of(model, data),
    )


def nodes_of(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
    """Return the (12, 3) nodes, turned to fit the built ones as well as possible."""
    points = []
    for n, node in enumerate(t.NODES):
        body = model.body(f"m0_rod{t.rod_of(n)}").id
        half = (node - t.NODES[n ^ 1]) / 2
        points.append(data.xpos[body] + data.xmat[body].reshape(3, 3) @ half)
    nodes = np.array(points) - np.mean(points, axis=0)
    # Kabsch: the module may have turned while it floated
    u, _, vt = np.linalg.svd(nodes.T @ t.NODES)
    sign = np.sign(np.linalg.det(u @ vt))
    return nodes @ (u @ np.diag([1.0, 1.0, sign]) @ vt)


def _distances(level: int, command: int, off: float, built: Built) -> np.ndarray:
    """Return (12, 12) distances between the nodes in m, all internal cables longer by ``off`` in m."""
    nodes = floating_module(level, command, off, built).nodes
    return np.linalg.norm(nodes[:, None] - nodes, axis=2)
