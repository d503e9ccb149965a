"""Lengths and tensions of a robot's cables, points on its rods, and its modules' way ahead, by its pose."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from engine.body import module as t
from engine.body import servo

_PASSIVE: Final = [(t.rod_of(n), t.passive_anchor(n, o)) for a, b in t.CABLES for n, o in ((a, b), (b, a))]
_INTERNAL: Final = [
    (rod, point)
    for n in t.SERVO_NODES
    for rod, point in zip((t.SERVO_ROD, t.rod_of(n)), t.servo_anchors(n), strict=True)
]
END_RODS: Final = np.array([rod for rod, _ in (*_PASSIVE, *_INTERNAL)])
"""(58,) rod at each cable end: two ends of every passive cable, then of every internal one."""
END_PLACES: Final = np.array([point - t.ROD_MIDDLES[rod] for rod, point in (*_PASSIVE, *_INTERNAL)])
"""(58, 3) position of each end, from the middle of its rod, in m."""
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
    """Return the elastic tension of passive cables in N; 0 in a slack one.

    Args:
        lengths: between the anchors, in m.
        stiffness: relative to the stiffest cable; its shape must broadcast to that of the lengths.
    """
    return t.CABLE_STIFFNESS * stiffness * np.clip(lengths - t.CABLE_REST_LENGTH, 0.0, None)


def internal_tension(lengths: np.ndarray, commanded: np.ndarray) -> np.ndarray:
    """Return the tension of internal cables in N, without damping.

    Args:
        lengths: in m.
        commanded: target lengths of the same shape, in m.
    """
    pull = t.SERVO_OFFSET + t.SERVO_GAIN * (lengths - commanded)
    return np.clip(pull, 0.0, t.SERVO_MAX_TENSION)


def contraction(lengths: np.ndarray) -> np.ndarray:
    """Return how far modules are contracted: 0 with a released servo, 1 with a servo turned all the way.

    The mean length of the five internal cables is compared with that at the two commands. A moving module may
    be longer or shorter than at either, so its values go a little beyond 0 and 1.

    Args:
        lengths: (..., 5) of the internal cables, commanded or actual, in m.
    """
    released, turned = _MEAN_TARGETS[0], _MEAN_TARGETS[-1]
    return (released - np.asarray(lengths).mean(axis=-1)) / (released - turned)


def ahead(centres: np.ndarray, way: float) -> np.ndarray:
    """Return the (..., M, 3) level unit vectors along which feet of modules slide, as the kernel has them.

    Args:
        centres: (..., M, 3) of the modules, in m.
        way: 1 towards the end of the chain, -1 towards its start.
    """
    last = centres.shape[-2] - 1
    order = np.arange(last + 1)
    along = centres[..., np.minimum(order + 1, last), :] - centres[..., np.maximum(order - 1, 0), :]
    along = way * along * (1.0, 1.0, 0.0)
    size = np.linalg.norm(along, axis=-1, keepdims=True)
    return np.asarray(along / np.maximum(size, np.finfo(float).tiny))


def quaternion_product(first: Sequence[float], then: Sequence[float]) -> tuple[float, float, float, float]:
    """Return the turn by one unit quaternion w, x, y, z and then by another, in fixed axes."""
    (w, x, y, z), (a, b, c, d) = then, first
    return (
        w * a - x * b - y * c - z * d,
        w * b + x * a + y * d - z * c,
        w * c - x * d + y * a + z * b,
        w * d + x * c - y * b + z * a,
    )


def rotation_rows(turns: np.ndarray) -> tuple[tuple[np.ndarray, ...], ...]:
    """Return the rows of the rotation matrices of (..., 4) unit quaternions, each three (...) arrays."""
    w, x, y, z = np.moveaxis(turns, -1, 0)
    return (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )


def points_on(poses: np.ndarray, body: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Return the positions of points on bodies.

    Args:
        poses: (..., bodies, 7) positions in m and quaternions (w, x, y, z) of all bodies.
        body: (points,) which body each point is on.
        places: (points, 3) position of each point in the frame of its body, in m.

    Returns:
        (..., points, 3) in m, with the dtype of the poses.
    """
    out = np.empty((*poses.shape[:-2], *places.shape), dtype=poses.dtype)
    # there are far fewer bodies than points, so matrices are cheaper than quaternions
    for k, row in enumerate(rotation_rows(poses[..., 3:])):
        turned = sum(part[..., body] * along for part, along in zip(row, places.T, strict=True))
        out[..., k] = poses[..., body, k] + turned
    return out
