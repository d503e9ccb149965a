"""Turns as unit quaternions, w first, and as matrices; of many at once, in the precision they come in."""

from __future__ import annotations

import numpy as np


def rotation_rows(turns: np.ndarray) -> tuple[tuple[np.ndarray, ...], ...]:
    """Return the rows of the rotation matrices of (..., 4) unit quaternions, each three (...) arrays."""
    w, x, y, z = np.moveaxis(turns, -1, 0)
    return (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )


def points_on(poses: np.ndarray, body: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Return where points of bodies are.

    Args:
        poses: (..., bodies, 7) positions in m and quaternions (w, x, y, z) of all bodies.
        body: (points,) which body each point is on.
        places: (points, 3) where on it, in the body's own frame, in m.

    Returns:
        (..., points, 3) in m, of the poses' type.
    """
    out = np.empty((*poses.shape[:-2], *places.shape), dtype=poses.dtype)
    # there are far fewer bodies than points, so that turning by matrices is cheap
    for k, row in enumerate(rotation_rows(poses[..., 3:])):
        turned = sum(part[..., body] * along for part, along in zip(row, places.T, strict=True))
        out[..., k] = poses[..., body, k] + turned
    return out
