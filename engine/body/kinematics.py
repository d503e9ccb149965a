"""Lengths and tensions of a robot's cables, from the poses of its rods."""

from __future__ import annotations

from typing import Final

import numpy as np

from engine.body import module as t
from engine.body import servo
from engine.body.turns import points_on

_PASSIVE: Final = [(t.rod_of(n), t.passive_anchor(n, o)) for a, b in t.CABLES for n, o in ((a, b), (b, a))]
_INTERNAL: Final = [
    (rod, point)
    for n in t.SERVO_NODES
    for rod, point in zip((t.SERVO_ROD, t.rod_of(n)), t.servo_anchors(n), strict=True)
]
END_RODS: Final = np.array([rod for rod, _ in (*_PASSIVE, *_INTERNAL)])
"""(58,) rods that the ends of the cables are on, two of every passive cable, then of every internal one."""
END_PLACES: Final = np.array([point - t.ROD_MIDDLES[rod] for rod, point in (*_PASSIVE, *_INTERNAL)])
"""(58, 3) where they are on those rods, from their middles, in m."""
_FIRST_INTERNAL: Final = len(_PASSIVE)
_MEAN_TARGETS: Final = servo.TARGET_LENGTHS.mean(axis=1)


def internal_lengths(pose: np.ndarray) -> np.ndarray:
    """Return the (..., 5) lengths of the internal cables in m.

    Args:
        pose: (..., 6, 7) positions in m and quaternions (w, x, y, z) of a module's rods.
    """
    points = points_on(pose.astype(float), END_RODS[_FIRST_INTERNAL:], END_PLACES[_FIRST_INTERNAL:])
    ends = points.reshape(*points.shape[:-2], -1, 2, 3)
    return np.linalg.norm(ends[..., 1, :] - ends[..., 0, :], axis=-1)


def passive_tension(lengths: np.ndarray | float, stiffness: np.ndarray) -> np.ndarray:
    """Return the elastic tension of passive cables in N; a slack one has none.

    Args:
        lengths: between the anchors, in m.
        stiffness: of the same shape or one that fits it, relative to the stiffest.
    """
    return t.CABLE_STIFFNESS * stiffness * np.clip(lengths - t.CABLE_REST_LENGTH, 0.0, None)


def internal_tension(lengths: np.ndarray, commanded: np.ndarray) -> np.ndarray:
    """Return the tension of internal cables in N, apart from their damping.

    Args:
        lengths: in m.
        commanded: target lengths of the same shape, in m.
    """
    pull = t.SERVO_OFFSET + t.SERVO_GAIN * (lengths - commanded)
    return np.clip(pull, 0.0, t.SERVO_MAX_TENSION)


def contraction(lengths: np.ndarray) -> np.ndarray:
    """Return how far modules are contracted: 0 with a released servo, 1 with a servo turned all the way.

    It is the mean length of the five internal cables between those of the two commands. Before and after
    them a module may be longer or shorter, so the values of a robot that moves go a little beyond 0 and 1.

    Args:
        lengths: (..., 5) of the internal cables, commanded or actual, in m.
    """
    released, turned = _MEAN_TARGETS[0], _MEAN_TARGETS[-1]
    return (released - np.asarray(lengths).mean(axis=-1)) / (released - turned)
