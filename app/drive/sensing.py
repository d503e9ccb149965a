"""From where head and target are to what a task's controller senses."""

from __future__ import annotations

from typing import NoReturn

import numpy as np

from app.drive.eyes import HeadPose
from engine.errors import InvalidData
from engine.tasks import GroundFrame, Task, View, sensed, target_offsets, worlds
from engine.tasks.walls import Obstacles


class Sensing:
    """What the controller of one robot senses during a drive.

    The walls stand where the task has them, seen from where the head began: of its worlds the one whose
    target was nearest.

    Args:
        task: whose sensors.
        n_modules: of the robot.
        head: where it begins.
        target: (2,) where the target is then, in m.
    """

    def __init__(self, task: Task, n_modules: int, head: HeadPose, target: np.ndarray) -> None:
        self._task = task
        self._frame = GroundFrame.of(*_faces(head))
        seen = self._frame.from_world(target[None, None])[0, 0]
        nearest = int(np.argmin(np.linalg.norm(target_offsets(task) - seen, axis=1)))
        self._obstacles = Obstacles([worlds(task, n_modules)[nearest]])

    def values(self, head: HeadPose, target: np.ndarray, time: float) -> np.ndarray:
        """Return (inputs,) what the task's ``sense`` gives, in m, rad and so on.

        Args:
            head: where it is.
            target: (2,) where the target is, in m.
            time: since the drive began, in s.

        Raises:
            InvalidData: the task senses what no camera above the floor sees.
            TaskError: its function fails.
        """
        front, rear = _faces(head)
        view = View(
            front=front,
            rear=rear,
            target=target[None, None],
            frame=self._frame,
            obstacles=self._obstacles,
            time=time,
            rods=self._unseen,
            height=self._unseen,
        )
        told = sensed(self._task, view, np.array([[True]]))[0, 0]
        return np.asarray(told / np.array(self._task.units))

    def _unseen(self) -> NoReturn:
        raise InvalidData(f"task {self._task.name} senses heights or modules, which a camera does not see")


def _faces(head: HeadPose) -> tuple[np.ndarray, np.ndarray]:
    """Return (1, 1, 2) points in front and behind, as a simulation has them."""
    front = head.position[None, None]
    return front, front - 0.05 * head.facing
