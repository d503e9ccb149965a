"""The 3D scene of one browser: the ground, a robot in its world, the camera."""

from __future__ import annotations

import math
import threading
import time

import numpy as np
import viser
from scipy.spatial.transform import Rotation

from app.marks import Marks
from app.robot_drawing import RobotDrawing
from engine.replay import Frame, Playable

CAMERA_PATIENCE = 5.0
"""Seconds to wait for a browser to say that its camera is where it was placed."""
EYE = np.array([-0.55, -0.9, 0.75])
"""Where the camera is, for a size of 1 m, relative to what it looks at."""
EYE_BEHIND = np.array([-0.8, -0.35, 0.95])
"""The same with the way to the target along x."""
NEARER = 0.08
"""How much nearer than the robot a camera looks, for a size of 1 m: a panel covers the lower edge."""
PHONE_WIDTH = 576
"""Pixels: in a window that is no wider, viser's panels cover the lower three fifths."""
PHONE_AWAY = 1.5
"""How much farther away a camera is there, because the window is narrow."""
PHONE_RISE = 0.6
"""Where the robot is then: so far up from the middle of the window to its upper edge."""
FOLLOW_STEP = 0.002
"""Metres that the robot moves before a following camera moves with it."""


class Arena:
    """Draws one replay at a time.

    Args:
        client: whose scene it is.
    """

    def __init__(self, client: viser.ClientHandle) -> None:
        self._client = client
        self._scene = client.scene
        self._robot: RobotDrawing | None = None
        self._drawing = threading.Lock()
        self._placed: tuple[np.ndarray, float, float] | None = None
        self.follow = True
        self.marks = Marks()
        """Which marks the next frame has."""
        self._scene.set_up_direction("+z")
        self._scene.add_grid(
            "/ground",
            infinite_grid=True,
            cell_size=0.05,
            section_size=0.25,
            cell_color=(62, 68, 78),
            section_color=(92, 100, 112),
            plane_color=(32, 36, 42),
            plane_opacity=0.6,
            fade_distance=3.0,
            shadow_opacity=0.35,
        )
        client.camera.on_update(lambda _camera: self._face())

    def look_at(self, centre: np.ndarray, size: float, eye: np.ndarray = EYE) -> None:
        """Look at a point of the ground from a distance that shows so many metres around it.

        Args:
            centre: (2,) the point, in m.
            size: how much to show, in m.
            eye: (3,) where to look from, relative to the point and to the size.
        """
        camera = self._client.camera
        phone = camera.image_width <= PHONE_WIDTH
        away = max(size, 0.3) * (PHONE_AWAY if phone else 1.0)
        nearer = (self._nearer_on_phone(eye) if phone else NEARER) * away * eye[:2] / np.linalg.norm(eye[:2])
        with self._client.atomic():
            camera.position = (centre[0] + eye[0] * away, centre[1] + eye[1] * away, eye[2] * away)
            camera.look_at = (float(centre[0] + nearer[0]), float(centre[1] + nearer[1]), 0.0)
        self._placed = (np.array(camera.position), camera.update_timestamp, time.monotonic())

    def _nearer_on_phone(self, eye: np.ndarray) -> float:
        """Return how much nearer than what it shows a camera looks there, for a size of 1 m."""
        flat = float(np.hypot(*eye[:2]))
        down = math.atan2(eye[2], flat) + math.atan(PHONE_RISE * math.tan(self._client.camera.fov / 2))
        return flat - float(eye[2]) / math.tan(min(down, 1.5))

    def show(self, replay: Playable, index: int, frame: Frame) -> None:
        """Draw a frame of a replay; another replay than the last one replaces the robot.

        Args:
            replay: the robot.
            index: of the recorded frame that is nearest.
            frame: to draw.
        """
        with self._drawing:
            self._show(replay, index, frame)

    def clear(self) -> None:
        """Remove the robot."""
        with self._drawing:
            self._clear()

    def _show(self, replay: Playable, index: int, frame: Frame) -> None:
        marks = self.marks
        if self._robot is None or replay is not self._robot.replay:
            self._begin(replay, frame)
        assert self._robot is not None
        centre = frame.pose[..., :3].mean(axis=(0, 1))
        if self._robot.place_world():
            assert replay.target is not None
            self._frame(centre[:2], replay.target, among_walls=bool(replay.walls))
        drawing = self._robot.compute(frame, marks)
        with self._client.atomic():
            self._robot.show(index, frame, drawing, marks, self._facing())
        if self.follow:
            self._follow(centre)
        else:
            self._followed = centre[:2]

    def _face(self) -> None:
        """Keep the numbers of the modules turned to the camera, also while nothing is played."""
        with self._drawing:
            if self._robot is not None:
                self._robot.face(self.marks, self._facing())

    def _facing(self) -> np.ndarray:
        """Return the (2, 3) directions in the world that are right and up on the screen."""
        turn = Rotation.from_quat(np.asarray(self._client.camera.wxyz), scalar_first=True)
        return turn.apply([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])

    def _clear(self) -> None:
        if self._robot is not None:
            self._robot.remove()
        self._robot = None

    def _begin(self, replay: Playable, frame: Frame) -> None:
        self._clear()
        self._robot = RobotDrawing(self._scene, replay, frame)
        ground = frame.pose[..., :2]
        self._followed = ground.mean(axis=(0, 1))
        self.look_at(self._followed, np.ptp(ground, axis=(0, 1)).max() + 0.3)

    def _frame(self, robot: np.ndarray, target: np.ndarray, *, among_walls: bool) -> None:
        """Show the robot and its target; among walls from behind the robot, so that none hides the way."""
        self._followed = robot
        way = target - robot
        size = 1.05 * float(np.linalg.norm(way)) + 0.2
        eye = EYE
        if among_walls:
            x, y = way / np.linalg.norm(way)
            eye = np.array([[x, -y, 0.0], [y, x, 0.0], [0.0, 0.0, 1.0]]) @ EYE_BEHIND
        self.look_at((robot + target) / 2, size, eye)

    def _follow(self, centre: np.ndarray) -> None:
        """Move the camera as the robot moves; how the user turned and zoomed it stays."""
        if not self._camera_has_arrived():
            return
        step = centre[:2] - self._followed
        if np.hypot(*step) < FOLLOW_STEP:
            return
        self._followed = centre[:2]
        # what the camera looks at moves along with its position
        self._client.camera.position = self._client.camera.position + np.array([*step, 0.0])

    def _camera_has_arrived(self) -> bool:
        """Tell whether the browser has taken the camera where it was last placed.

        What a busy browser reports in the meantime is where its camera was before; a step from there
        would take the camera back.
        """
        if self._placed is not None:
            (position, placed, since), camera = self._placed, self._client.camera
            reported = camera.update_timestamp != placed
            arrived = reported and np.allclose(camera.position, position, rtol=0.0, atol=0.01)
            if arrived or time.monotonic() - since > CAMERA_PATIENCE:
                self._placed = None
        return self._placed is None
