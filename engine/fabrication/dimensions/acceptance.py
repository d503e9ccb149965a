"""What a technician measures of a finished module, and whether it is as it was simulated.

Three measurements tell what can be wrong. The **spans** of the 24 cables, from rod end to rod end, servo
off, show a cable that is unlike the others: one that is 15 % too stiff is 2.7 mm too short, at every
stiffness. That all cables are too stiff does not change the shape; it shows in the **stretch**: how far two
parallel rods move apart when a weight pulls at them. The **lines** are measured from the ball to the loop,
before they are hooked in.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Sequence
from typing import Final

import mujoco
import numpy as np

from engine.body import module as t
from engine.body import servo
from engine.fabrication.dimensions import tolerances
from engine.fabrication.dimensions.floating_module import CONTRACTED, RELEASED, SLACK, nodes_of
from engine.simulation.built import PUBLISHED, Built
from engine.simulation.model import GRAVITY, chain_spec
from engine.simulation.physics import Physics, as_built

RODS: Final = (0, 1)
"""The two parallel rods that the weight pulls apart."""
WEIGHT: Final = 0.02
"""Mass in kg that pulls, for every 0.1 of stiffness."""
SETTLES: Final = 3.0
"""Simulated seconds before a module is measured."""
SPAN: Final = 0.0012
"""Allowed deviation of a span from its mean, in m: what ``STIFFNESS_WITHIN`` and ``REST`` come to."""
LINE_ENDS: Final = (RELEASED, CONTRACTED)


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Measured:
    """Measurements of a module.

    Attributes:
        spans: (24,) from rod end to rod end, as ``module.CABLES``, in m.
        stretch: by how much the weight moves the middles of the two rods apart, in m.
        lines: (2, 5) lengths of the internal cables at 0 and at 180 degrees, as ``SERVO_NODES``, in m.
    """

    spans: np.ndarray
    stretch: float
    lines: np.ndarray


def measured(level: int, built: Built = PUBLISHED, cables: Sequence[float] = ()) -> Measured:
    """Return what a module of a stiffness level measures.

    Args:
        level: the stiffness gene, 1 to 10.
        built: what the module is like where it differs from the published one; it is a robot's first.
        cables: further factors on the stiffness of its 24 cables; none for 1.
    """
    free, pulled = (_nodes(level, built, tuple(cables), force) for force in (0.0, pull(level)))
    apart = [float(np.linalg.norm(_middle(n, RODS[1]) - _middle(n, RODS[0]))) for n in (free, pulled)]
    ends = servo.target_lengths(np.array(LINE_ENDS, float), built.target_lengths())
    return Measured(
        spans=np.array([np.linalg.norm(free[a] - free[b]) for a, b in t.CABLES]),
        stretch=apart[1] - apart[0],
        lines=ends + built.errors_of(1)[0],
    )


@functools.lru_cache(maxsize=t.N_STIFFNESS_LEVELS)
def expected(level: int) -> Measured:
    """Return what a module of a stiffness level must measure."""
    return measured(level)


def pull(level: int) -> float:
    """Return the force in N of the weight that a module of a stiffness level is stretched with."""
    return WEIGHT * level * GRAVITY


def faults(level: int, found: Measured) -> list[str]:
    """Return what is wrong with a module, by its measurements; empty if it is as simulated."""
    wanted = expected(level)
    told = []
    mean = float(found.spans.mean())
    for nodes, span in zip(t.CABLES, found.spans, strict=True):
        if abs(span - mean) > SPAN:
            why = "too stiff or too short" if span < mean else "too soft or too long"
            told.append(f"the cable {nodes[0]} - {nodes[1]} is {why}, or one beside it is not right")
    more = found.stretch / wanted.stretch - 1.0
    if abs(more) > tolerances.STIFFNESS:
        told.append(f"the cables are too {'soft' if more > 0 else 'stiff'}")
    off = np.abs(found.lines - wanted.lines) > tolerances.INTERNAL_CABLE
    told += [
        f"the line to node {t.SERVO_NODES[k]} has the wrong length" for k in np.flatnonzero(off.any(axis=0))
    ]
    return told


def _middle(nodes: np.ndarray, rod: int) -> np.ndarray:
    return np.asarray(nodes[list(t.RODS[rod])].mean(axis=0))


@functools.lru_cache(maxsize=4 * t.N_STIFFNESS_LEVELS)
def _nodes(level: int, built: Built, cables: tuple[float, ...], force: float) -> np.ndarray:
    """Return the (12, 3) nodes of a floating module, servo off, two of its rods pulled apart."""
    spec = chain_spec((level,), (1,), physics=as_built(Physics(), built), gravity=False)
    for tendon, factor in zip(spec.tendons, cables, strict=False):
        tendon.stiffness = np.array(tendon.stiffness) * factor
    model = spec.compile()
    data = mujoco.MjData(model)
    data.ctrl[:] = SLACK
    first, second = (model.body(f"m0_rod{r}").id for r in RODS)
    mujoco.mj_forward(model, data)
    for _ in range(round(SETTLES / model.opt.timestep)):
        apart = data.xpos[second] - data.xpos[first]
        each = force * apart / np.linalg.norm(apart)
        data.qfrc_applied[:] = 0.0
        for rod, sign in ((first, -1.0), (second, 1.0)):
            # at the rod's middle, wherever its centre of mass is
            middle = data.xpos[rod]
            mujoco.mj_applyFT(model, data, sign * each, np.zeros(3), middle, rod, data.qfrc_applied)
        mujoco.mj_step(model, data)
    mujoco.mj_forward(model, data)
    return nodes_of(model, data)
