"""A robot of the scene that can be pointed at, alone or in a lane."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from app.pointing.picking import RobotPart, module_at, part_at
from app.replay.player import ReplayMoment
from app.replay.scene_camera import Ray
from engine.body.morphology import Morphology
from engine.replay.recording import ReplayFrame
from viz.robot.geometry import Drawing


@dataclasses.dataclass(frozen=True, slots=True)
class SeenRobot:
    """A robot as it was drawn last.

    Attributes:
        body: of it.
        drawing: in its own world.
        frame: that was recorded nearest to the moment.
        turn, position: from its own world to the scene; None where they are the same.
        on_card: whether the page shows its network and its servos.
    """

    body: Morphology
    drawing: Drawing
    frame: ReplayFrame
    turn: Rotation | None = None
    position: np.ndarray | None = None
    on_card: bool = True

    @classmethod
    def alone(cls, moment: ReplayMoment, drawing: Drawing | None) -> list[SeenRobot]:
        """Return the only robot of a scene at a moment of its replay, if it was drawn."""
        if drawing is None:
            return []
        replay = moment.replay
        return [cls(replay.morphology, drawing, replay.frames[moment.index])]

    def places(self, points: np.ndarray) -> np.ndarray:
        """Return where (n, 3) points of its world lie in the scene, float32."""
        if self.turn is not None and self.position is not None:
            points = self.turn.apply(points) + self.position
        return np.ascontiguousarray(points, dtype=np.float32)

    def turns(self, quaternions: np.ndarray) -> np.ndarray:
        """Return how what is turned by (n, 4) quaternions in its world is turned in the scene, float32."""
        if self.turn is not None:
            own = Rotation.from_quat(quaternions, scalar_first=True)
            quaternions = (self.turn * own).as_quat(scalar_first=True)
        return np.ascontiguousarray(quaternions, dtype=np.float32)

    def ray(self, ray: Ray) -> Ray:
        """Return a ray of the scene in its own world."""
        if self.turn is None or self.position is None:
            return ray
        back = self.turn.inv()
        return Ray(back.apply(ray.origin - self.position), back.apply(ray.direction), ray.pixel)


def module_under(ray: Ray, robots: Sequence[SeenRobot]) -> tuple[int, int] | None:
    """Return the indices of robot and module that a ray passes through, the nearest one; None for none."""
    found = []
    for k, robot in enumerate(robots):
        own = robot.ray(ray)
        if (module := module_at(own, robot.drawing)) is not None:
            depth = (robot.drawing.centres[module] - own.origin) @ own.direction
            found.append((float(depth), k, module))
    return min(found)[1:] if found else None


def part_under(ray: Ray, robots: Sequence[SeenRobot]) -> tuple[int, RobotPart] | None:
    """Return the index of a robot and its rod or cable that a ray means, the nearest one; None for none."""
    found = []
    for k, robot in enumerate(robots):
        own = robot.ray(ray)
        if (part := part_at(own, robot.drawing)) is not None:
            depth = (part.ends(robot.drawing).mean(axis=0) - own.origin) @ own.direction
            found.append((float(depth), k, part))
    return min(found, key=lambda f: f[:2])[1:] if found else None
