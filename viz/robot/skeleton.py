"""Where a robot's rods and cables begin and end: every drawing of a robot starts from this."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from engine.body import module as t
from engine.body.kinematics import END_PLACES, END_RODS, points_on

N_POINTS: Final = len(t.NODES) + 1
"""Points of a module: its nodes, then the point of the servo's arm that the internal cables leave from."""
_POINT_RODS: Final = [*(t.rod_of(n) for n in range(len(t.NODES))), t.SERVO_ROD]
_POINT_PLACES: Final = np.array([*t.NODES, t.ACTUATOR_POINT]) - t.ROD_MIDDLES[_POINT_RODS]
_RODS: Final = np.array([*_POINT_RODS, *END_RODS])
_PLACES: Final = np.array([*_POINT_PLACES, *END_PLACES], dtype=np.float32)
"""On which rod, and where in its frame, what ``posed`` returns is."""


def posed(poses: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return where points and cables are, in m.

    Args:
        poses: (..., M, 6, 7) positions in m and quaternions of the rods of M modules.

    Returns:
        (..., M, 13, 3) points of each module, and (..., M, 29, 2, 3) ends of its cables: the passive ones in
        the order of ``module.CABLES``, then the internal ones in the order of ``SERVO_NODES``.
    """
    points = points_on(poses, _RODS, _PLACES)
    ends = points[..., N_POINTS:, :]
    return points[..., :N_POINTS, :], ends.reshape(*ends.shape[:-2], -1, 2, 3)


@dataclasses.dataclass(frozen=True, slots=True)
class Skeleton:
    """A robot of M modules, in m.

    Attributes:
        nodes: (M, 12, 3) rod ends.
        arms: (M, 3) where the internal cables leave the servo's arm.
        cables: (M, 24, 2, 3) ends of the passive cables, in the order of ``module.CABLES``.
        servo_cables: (M, 5, 2, 3) ends of the internal cables, in the order of ``SERVO_NODES``.
    """

    nodes: np.ndarray
    arms: np.ndarray
    cables: np.ndarray
    servo_cables: np.ndarray

    @classmethod
    def settled(cls, pose: np.ndarray) -> Skeleton:
        """Return a robot in a simulated pose (M, 6, 7): positions in m and quaternions of its rods."""
        points, cables = (a.astype(float) for a in posed(pose.astype(np.float32)))
        passive, servo = np.split(cables, [len(t.CABLES)], axis=1)
        return cls(points[:, :-1], points[:, -1], passive, servo)

    @classmethod
    def placed(cls, placements: Sequence[tuple[Rotation, np.ndarray]]) -> Skeleton:
        """Return undeformed modules by the turn and the centre (3,), in m, of each."""

        def place(points: np.ndarray) -> np.ndarray:
            flat = points.reshape(-1, 3)
            moved = [turn.apply(flat) + centre for turn, centre in placements]
            return np.array(moved).reshape(-1, *points.shape)

        passive = np.array([[t.passive_anchor(a, b), t.passive_anchor(b, a)] for a, b in t.CABLES])
        servo = np.array([t.servo_anchors(node) for node in t.SERVO_NODES])
        return cls(place(t.NODES), place(t.ACTUATOR_POINT), place(passive), place(servo))

    @property
    def n_modules(self) -> int:
        """Number of modules."""
        return len(self.nodes)

    @property
    def rods(self) -> np.ndarray:
        """(M, 6, 2, 3) ends of the rods."""
        return self.nodes[:, np.array(t.RODS)]

    @property
    def centres(self) -> np.ndarray:
        """(M, 3) means of the nodes."""
        return self.nodes.mean(axis=1)

    def moved(self, place: Callable[[np.ndarray], np.ndarray]) -> Skeleton:
        """Return it with every point moved by a function of points (..., 3) in m."""
        return Skeleton(place(self.nodes), place(self.arms), place(self.cables), place(self.servo_cables))
