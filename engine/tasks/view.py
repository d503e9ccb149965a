"""What a task sees of running simulations: all of them at once, at one moment."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable, Sequence

import numpy as np

from engine.exact import bearing, length
from engine.tasks.walls import Obstacles, Wall


@dataclasses.dataclass(frozen=True, slots=True, eq=False)
class GroundFrame:
    """The settled heads' frames on the ground: x where the head pointed, y to its left.

    A target and walls are placed in it, so a robot always starts at the origin, facing along x. On a plane
    this equals turning every robot before it is dropped until its head faces one way.

    Attributes:
        origin: (robots, 1, 2) positions of the settled heads in the world, in m.
        axes: (robots, 1, 2, 2) the directions of x and y in the world.
    """

    origin: np.ndarray
    axes: np.ndarray

    @classmethod
    def of(cls, front: np.ndarray, rear: np.ndarray) -> GroundFrame:
        """Return the frames of heads whose front and rear faces are at (robots, 1, 2)."""
        ahead = front - rear
        ahead = ahead / length(ahead)[..., None]
        left = np.stack([-ahead[..., 1], ahead[..., 0]], axis=-1)
        return cls(front, np.stack([ahead, left], axis=-2))

    def to_world(self, points: np.ndarray) -> np.ndarray:
        """Convert (robots, copies, 2) points from the frame to the world."""
        return self.origin + (points[..., :1] * self.axes[..., 0, :] + points[..., 1:] * self.axes[..., 1, :])

    def from_world(self, points: np.ndarray) -> np.ndarray:
        """Convert (robots, copies, 2) points from the world to the frame."""
        return self.turned(points - self.origin)

    def turned(self, directions: np.ndarray) -> np.ndarray:
        """Convert (robots, copies, 2) directions from the world to the frame."""
        products = self.axes * directions[..., None, :]
        return products[..., 0] + products[..., 1]

    def place(self, robot: int, walls: Sequence[Wall]) -> tuple[Wall, ...]:
        """Convert walls from a robot's frame to the world."""
        x, y = self.axes[robot, 0]
        yaw = math.atan2(x[1], x[0])
        placed = []
        for w in walls:
            at = self.origin[robot, 0] + w.centre[0] * x + w.centre[1] * y
            placed.append(
                Wall(centre=(float(at[0]), float(at[1]), w.centre[2]), half_size=w.half_size, yaw=w.yaw + yaw)
            )
        return tuple(placed)


class View:
    """Simulations at one moment; every value is computed when it is asked for.

    Arrays begin with (robots, copies): every robot is simulated in several copies, one for each target
    and repeat. Lengths are in m. Positions are in the settled head's frame (``GroundFrame``): the trial began
    with the head at the origin, facing along x; y is to the left, z up from the ground.

    Args:
        front, rear: (robots, copies, 2) front and rear faces of the heads, in the world.
        target: (robots, copies, 2) the targets in the world.
        frame: of the settled heads.
        obstacles: the walls of every copy, in the settled head's frame.
        time: seconds since the trial began.
        rods: returns the (robots, copies, modules, 6, 3) centres of all rods, in the world.
        height: returns the (robots, copies) heights of the heads' front faces.
    """

    def __init__(
        self,
        *,
        front: np.ndarray,
        rear: np.ndarray,
        target: np.ndarray,
        frame: GroundFrame,
        obstacles: Obstacles,
        time: float,
        rods: Callable[[], np.ndarray],
        height: Callable[[], np.ndarray],
    ) -> None:
        self._front = front
        self._facing = front - rear
        self._target = target
        self._frame = frame
        self._obstacles = obstacles
        self._rods = rods
        self._height = height
        self._time = time

    @property
    def shape(self) -> tuple[int, int]:
        """Robots and copies."""
        return self._front.shape[0], self._front.shape[1]

    @functools.cached_property
    def time(self) -> np.ndarray:
        """(robots, copies) seconds since the trial began, the same for all."""
        return np.full(self.shape, self._time)

    @functools.cached_property
    def position(self) -> np.ndarray:
        """(robots, copies, 2) position of the head: the middle of its front face."""
        return self._frame.from_world(self._front)

    @functools.cached_property
    def direction(self) -> np.ndarray:
        """(robots, copies, 2) direction of the head, of unit length."""
        facing = self._frame.turned(self._facing)
        return facing / length(facing)[..., None]

    @functools.cached_property
    def height(self) -> np.ndarray:
        """(robots, copies) height of the middle of the head's front face above the ground."""
        return self._height()

    @functools.cached_property
    def target(self) -> np.ndarray:
        """(robots, copies, 2) the target."""
        return self._frame.from_world(self._target)

    @functools.cached_property
    def modules(self) -> np.ndarray:
        """(robots, copies, modules, 3) centres of the modules, from the first of the chain to the last."""
        centres = self._rods().mean(axis=3)
        flat = centres[..., :2].reshape(len(centres), -1, 2)
        level = self._frame.from_world(flat).reshape(*centres.shape[:-1], 2)
        return np.concatenate([level, centres[..., 2:]], axis=-1)

    @functools.cached_property
    def distance(self) -> np.ndarray:
        """(robots, copies) from the head to the target."""
        return length(self._target - self._front)

    @functools.cached_property
    def clearance(self) -> np.ndarray:
        """(robots, copies) from the head straight ahead to a wall; infinite if there is none."""
        return self._obstacles.clearance(self.position, self.direction)

    def to_target(self) -> tuple[np.ndarray, np.ndarray]:
        """Return distance (m) and bearing (rad) of the target, (robots, copies) each."""
        # in the world's frame, so that no rounding comes between a sensor and its value
        return distance_and_bearing(self._front, self._facing, self._target)

    def to(self, point: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return distance (m) and bearing (rad, positive to the left) of points, (robots, copies, 2)."""
        return distance_and_bearing(self.position, self.direction, point)


def distance_and_bearing(
    position: np.ndarray, direction: np.ndarray, point: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return distance (...) in m and bearing (...) in rad, in (-pi, pi], of points from a head.

    Args:
        position: (..., 2) of the head.
        direction: (..., 2) of the head, of any length.
        point: (..., 2).
    """
    to = point - position
    ahead = to[..., 0] * direction[..., 0] + to[..., 1] * direction[..., 1]
    left = to[..., 1] * direction[..., 0] - to[..., 0] * direction[..., 1]
    return length(to), bearing(left, ahead)
