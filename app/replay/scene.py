"""The 3D scene of one browser: the ground, a robot in its world."""

from __future__ import annotations

import itertools
import threading

import numpy as np
import viser

from app.replay.overlays import Overlays
from app.replay.player import ReplayMoment
from app.replay.robot_drawing import RobotDrawing
from app.replay.scene_camera import SceneCamera
from engine.replay.recording import Playable
from viz.robot.geometry import Drawing

EYE = np.array([-0.55, -0.9, 0.95])
"""Direction from what is shown to the camera."""
EYE_BEHIND = np.array([-0.8, -0.35, 0.95])
"""The same with the way to the target along x."""
AROUND = 0.07 * np.array(list(itertools.product((-1.0, 1.0), (-1.0, 1.0), (0.0, 1.0))))
"""(8, 3) corners, in m, of the room that a module or a target on the ground is shown with."""


class Scene:
    """Draws one replay at a time.

    Args:
        client: whose scene it is.
        camera: of it.
    """

    def __init__(self, client: viser.ClientHandle, camera: SceneCamera) -> None:
        self._client, self._camera = client, camera
        self._scene = client.scene
        self._robot: RobotDrawing | None = None
        self._drawing = threading.Lock()
        self.follow = True
        self.overlays = Overlays()
        """Which overlays the next frame has."""
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

    def show(self, moment: ReplayMoment) -> None:
        """Draw a moment of a replay; another replay than the last one replaces the robot."""
        with self._drawing:
            self._show(moment)

    def clear(self) -> None:
        """Remove the robot."""
        with self._drawing:
            self._clear()

    def _show(self, moment: ReplayMoment) -> None:
        replay, overlays = moment.replay, self.overlays
        is_new = self._robot is None or replay is not self._robot.replay
        if self._robot is None or is_new:
            self._clear()
            self._robot = RobotDrawing(self._scene, replay)
        drawing = self._robot.compute(moment.time, overlays)
        if self._robot.place_world() or is_new:
            self._look_at(drawing, replay)
        with self._client.atomic():
            self._robot.show(moment.index, drawing, overlays, self._camera.facing)
        centre = drawing.centres[:, :2].mean(axis=0)
        if self.follow:
            self._camera.follow(centre)
        else:
            self._camera.start_following(centre)

    def _face(self) -> None:
        """Keep the numbers of the modules turned to the camera, also while nothing is played."""
        with self._drawing:
            if self._robot is not None:
                self._robot.face(self.overlays, self._camera.facing)

    def _clear(self) -> None:
        if self._robot is not None:
            self._robot.remove()
        self._robot = None

    def _look_at(self, drawing: Drawing, replay: Playable) -> None:
        """Show the robot and its target; among walls from behind the robot, so that none hides the way."""
        places, towards = drawing.centres[:, :2], EYE
        centre = places.mean(axis=0)
        if replay.target is not None:
            places = np.concatenate([places, replay.target[None]])
            if replay.walls:
                x, y = (replay.target - centre) / np.linalg.norm(replay.target - centre)
                towards = np.array([[x, -y, 0.0], [y, x, 0.0], [0.0, 0.0, 1.0]]) @ EYE_BEHIND
        corners = np.column_stack([places, np.zeros(len(places))])[:, None] + AROUND
        self._camera.start_following(centre)
        self._camera.show(corners.reshape(-1, 3), towards)
