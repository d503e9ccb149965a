"""What a finished module must measure when its servo is released and contracted.

Taken between rod ends, where calipers reach, on a module that is held by its servo rod: the other five
rods then weigh less than a twentieth of what one cable pulls, so that the floating module tells it.
"""

from __future__ import annotations

import dataclasses
import functools
import itertools

import numpy as np

from engine.body import module as t
from engine.fabrication import tolerances
from engine.fabrication.floating_module import CONTRACTED, RELEASED, floating_module


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Distance:
    """The distance between two rod ends.

    Attributes:
        nodes: the two.
        released: in m, servo at 0 degrees.
        contracted: in m, servo at 180 degrees.
        tolerance: what it may differ by, in m: what follows from internal cables that are all off by
            ``tolerances.INTERNAL_CABLE``, and the stiffness' share of the stroke.
    """

    nodes: tuple[int, int]
    released: float
    contracted: float
    tolerance: float


@functools.lru_cache(maxsize=t.N_STIFFNESS_LEVELS)
def contraction(level: int) -> tuple[Distance, ...]:
    """Return the three distances between nodes with internal cables that shrink most, the most first."""
    released, contracted, long, short = (
        _distances(level, command, off)
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


def _distances(level: int, command: int, off: float) -> np.ndarray:
    """Return (12, 12) distances between the nodes in m, all internal cables longer by ``off`` in m."""
    nodes = floating_module(level, command, off).nodes
    return np.linalg.norm(nodes[:, None] - nodes, axis=2)
