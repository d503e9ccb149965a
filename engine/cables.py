"""Lengths and tensions of a robot's cables, from the poses of its rods."""

from __future__ import annotations

from typing import Final

import numpy as np

from engine import servo
from engine import tensegrity as t

_PASSIVE: Final = [(t.rod_of(n), t.passive_anchor(n, o)) for a, b in t.CABLES for n, o in ((a, b), (b, a))]
_INTERNAL: Final = [
    (rod, point)
    for n in t.SERVO_NODES
    for rod, point in zip((t.SERVO_ROD, t.rod_of(n)), t.servo_anchors(n), strict=True)
]
_ROD: Final = np.array([rod for rod, _ in (*_PASSIVE, *_INTERNAL)])
_LOCAL: Final = np.array([point - t.ROD_MIDDLES[rod] for rod, point in (*_PASSIVE, *_INTERNAL)])
_FIRST_INTERNAL: Final = len(_PASSIVE)
_MEAN_TARGETS: Final = servo.TARGET_LENGTHS.mean(axis=1)


def cable_ends(pose: np.ndarray) -> np.ndarray:
    """Return the (..., 29, 2, 3) ends in m: of the 24 passive cables, then of the 5 internal ones.

    Args:
        pose: (..., 6, 7) positions in m and quaternions (w, x, y, z) of a module's rods.
    """
    return _ends(pose, slice(None))


def internal_lengths(pose: np.ndarray) -> np.ndarray:
    """Return the (..., 5) lengths of the internal cables in m.

    Args:
        pose: (..., 6, 7) positions in m and quaternions (w, x, y, z) of a module's rods.
    """
    ends = _ends(pose, slice(_FIRST_INTERNAL, None))
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


def rotate(q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Turn vectors (..., 3) by unit quaternions (..., 4), w first."""
    w, u = q[..., :1], q[..., 1:]
    return v + 2.0 * _cross(u, _cross(u, v) + w * v)


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return what ``np.cross`` does of vectors (..., 3), to the bit, in half its time."""
    out = np.empty(np.broadcast_shapes(a.shape, b.shape))
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        out[..., k] = a[..., i] * b[..., j] - a[..., j] * b[..., i]
    return out


def _ends(pose: np.ndarray, which: slice) -> np.ndarray:
    rod, local = _ROD[which], _LOCAL[which]
    pose = pose.astype(float)
    points = pose[..., rod, :3] + rotate(pose[..., rod, 3:], local)
    return points.reshape(*points.shape[:-2], -1, 2, 3)
