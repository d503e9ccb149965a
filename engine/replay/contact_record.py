"""Where a robot's rod ends touched the ground during its trials, and which way they slid there."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Final

import numpy as np

from engine.body import module as t
from engine.body.feet import Feet
from engine.body.kinematics import ahead, points_on

_ENDS: Final = (1.0 - 2.0 * t.ROD_END_CUT / t.ROD_LENGTH) * (t.NODES - t.ROD_MIDDLES[t.NODE_RODS])
"""(12, 3) where the axis of a rod's capsule ends below each node, from the rod's middle, in m."""


@dataclasses.dataclass(frozen=True, slots=True)
class ContactRecord:
    """What the rod ends of M modules did on the ground, taken over all trials.

    Attributes:
        resting: (M, 12) whether a node touches in the first pose of a trial, in which the robot rests.
        share: (M, 12) part of the time for which it touches.
        forward, backward, across: (M, 12) how far it slides per trial while it touches, in m: the way that
            feet slide, against it, and square to it.
        facing: (M, 12, 3) mean of the unit vector forward while it touches, in the rod end's frame: z along
            the rod and outwards, x from the rod to the middle of its module. The shorter, the more the rod
            end turns; 0 if it never touches.
    """

    resting: np.ndarray
    share: np.ndarray
    forward: np.ndarray
    backward: np.ndarray
    across: np.ndarray
    facing: np.ndarray


def contact_record(trials: Sequence[np.ndarray], feet: Feet) -> ContactRecord:
    """Return what the rod ends did in trials.

    Args:
        trials: of each (frames, M, 6, 7) the positions in m and quaternions (w, x, y, z) of the rods; at
            least one frame.
        feet: which way is forward; without feet it is towards the end.
    """
    way = -1.0 if feet == "start" else 1.0
    single = [_of_one(poses.astype(float), way) for poses in trials]
    frames = sum(len(poses) for poses in trials)
    touched = np.sum([s[1] for s in single], axis=0)
    slid, facing = np.mean([s[2] for s in single], axis=0), np.sum([s[3] for s in single], axis=0)
    return ContactRecord(
        resting=np.any([s[0] for s in single], axis=0),
        share=touched / frames,
        forward=slid[..., 0],
        backward=slid[..., 1],
        across=slid[..., 2],
        facing=facing / np.maximum(touched, 1)[..., None],
    )


def rod_ends(poses: np.ndarray) -> np.ndarray:
    """Return the (..., 12, 3) places in m where the capsules of rods end; not above their radius they touch.

    Args:
        poses: (..., 6, 7) positions in m and quaternions (w, x, y, z) of a module's rods.
    """
    return points_on(poses.astype(float), t.NODE_RODS, _ENDS)


def _of_one(poses: np.ndarray, way: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return of one trial which nodes rest, in how many frames each touches, slides and summed facings."""
    middles = poses[..., t.NODE_RODS, :3]
    places = rod_ends(poses)
    touching = places[..., 2] <= t.ROD_RADIUS
    centres = poses[..., :3].mean(axis=-2)
    forward = np.broadcast_to(ahead(centres, way)[..., None, :], places.shape)
    steps = np.diff(places, axis=0) * (touching[1:] & touching[:-1])[..., None]
    along = (steps * forward[:-1]).sum(axis=-1)
    across = np.abs(steps[..., 1] * forward[:-1, ..., 0] - steps[..., 0] * forward[:-1, ..., 1])
    slid = np.stack([np.maximum(along, 0.0), np.maximum(-along, 0.0), across], axis=-1).sum(axis=0)
    z = _unit(places - middles)
    inwards = centres[..., None, :] - middles
    x = _unit(inwards - z * (inwards * z).sum(axis=-1, keepdims=True))
    local = np.stack([(forward * axis).sum(axis=-1) for axis in (x, np.cross(z, x), z)], axis=-1)
    facing = (local * touching[..., None]).sum(axis=0)
    return touching[0], touching.sum(axis=0), slid, facing


def _unit(vectors: np.ndarray) -> np.ndarray:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))
