"""What the cables of a robot pull and its rods bear in a pose, in N."""

from __future__ import annotations

from typing import Final

import numpy as np

from engine.body import module as t
from engine.body.kinematics import (
    END_PLACES,
    END_RODS,
    internal_tension,
    passive_tension,
    points_on,
    rotation_rows,
)

_AXES: Final = np.array([(t.NODES[b] - t.NODES[a]) / t.ROD_LENGTH for a, b in t.RODS])
"""(6, 3) of the rods of a module as built, from the first to the second node."""
_ALONG: Final = (END_PLACES * _AXES[END_RODS]).sum(axis=1)
_ENDS: Final = np.where(np.abs(_ALONG) > t.ROD_LENGTH / 4, np.sign(_ALONG), 0.0)
"""(58,) per cable end: -1 at the first end of its rod, 1 at the second, 0 at the servo in the middle."""


def cable_tensions(pose: np.ndarray, commanded: np.ndarray, stiffness: np.ndarray) -> np.ndarray:
    """Return the (M, 29) elastic tensions, without damping, of the passive cables, then the internal ones.

    Args:
        pose: (M, 6, 7) positions in m and quaternions (w, x, y, z) of the rods.
        commanded: (M, 5) lengths of the internal cables, in m.
        stiffness: (M,) of the passive cables, relative to the stiffest.
    """
    return _tensions(_ends(pose), commanded, stiffness)


def rod_compressions(pose: np.ndarray, commanded: np.ndarray, stiffness: np.ndarray) -> np.ndarray:
    """Return the (M, 6) forces with which the cables press the rods together; negative where they stretch.

    It is the mean over both ends of what the cables there pull along the rod. Links, weight and the ground
    are left out. Arguments are those of ``cable_tensions``.
    """
    ends = _ends(pose)
    way = ends[:, :, ::-1] - ends
    pull = way / np.linalg.norm(way, axis=-1, keepdims=True)
    pull *= _tensions(ends, commanded, stiffness)[..., None, None]
    rows = rotation_rows(pose.astype(float)[..., 3:])
    axes = np.stack(
        [sum(part * along for part, along in zip(r, _AXES.T, strict=True)) for r in rows], axis=-1
    )
    pressing = -(pull.reshape(len(pose), -1, 3) * axes[:, END_RODS]).sum(axis=-1) * _ENDS / 2
    return np.stack([pressing[:, rod == END_RODS].sum(axis=1) for rod in range(len(t.RODS))], axis=1)


def _ends(pose: np.ndarray) -> np.ndarray:
    """Return the (M, 29, 2, 3) ends of the cables, in m."""
    return points_on(pose.astype(float), END_RODS, END_PLACES).reshape(len(pose), -1, 2, 3)


def _tensions(ends: np.ndarray, commanded: np.ndarray, stiffness: np.ndarray) -> np.ndarray:
    length = np.linalg.norm(ends[..., 1, :] - ends[..., 0, :], axis=-1)
    passive, internal = np.split(length, [len(t.CABLES)], axis=-1)
    pulls = passive_tension(passive, np.asarray(stiffness)[:, None]), internal_tension(internal, commanded)
    return np.concatenate(pulls, axis=-1)
