"""The 3D scene of one browser: the ground, a robot in its world."""

from __future__ import annotations

import itertools
import threading
import time
from typing import Final, Literal, get_args

import numpy as np
import viser

from app.replay.overlays import Overlays
from app.replay.player import ReplayMoment
from app.replay.robot_drawing import RobotDrawing
from app.replay.scene_camera import Framing, SceneCamera
from app.replay.stage import set_stage
from engine.replay.recording import Playable
from viz.robot.geometry import Drawing

EYE = np.array([-0.55, -0.9, 0.8])
"""Direction from what is shown to the camera."""
EYE_BEHIND = np.array([-0.8, -0.35, 0.95])
"""The same with the way to the target along x."""
EYE_LOW = np.array([-0.5, -0.95, 0.3])
EYE_ABOVE = np.array([0.0, -0.02, 1.0])
EYE_BESIDE = np.array([0.0, -1.0, 0.16])
"""The same, the robot's chain along x."""
EYE_BEFORE = np.array([0.75, -0.55, 0.4])
"""The same, the way out of the robot at its head along x."""
AROUND = 0.07 * np.array(list(itertools.product((-1.0, 1.0), (-1.0, 1.0), (0.0, 1.0))))
"""(8, 3) corners, in m, of the room that a module or a target on the ground is shown with."""
CLOSE_PART = 0.6
"""Of the scene's width that a robot seen from close by takes."""
CIRCLING = 2.0 * np.pi / 40.0
"""Radians that a circling camera turns in a second."""
View = Literal["close", "frame", "top", "side", "head"]
_VIEWS: Final[dict[str, View]] = {view: view for view in get_args(View)}


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
        self._seen: tuple[Drawing, Playable] | None = None
        self._view: View = "frame"
        self._next: View = "frame"
        self.circles = False
        """Whether the camera slowly circles what it follows."""
        self._circled = 0.0
        set_stage(self._scene)
        client.camera.on_update(lambda _camera: self._face())

    def show(self, moment: ReplayMoment) -> None:
        """Draw a moment of a replay; another replay than the last one replaces the robot."""
        with self._drawing:
            self._show(moment)

    @property
    def drawing(self) -> Drawing | None:
        """The robot as it was drawn last, None if there is none."""
        seen = self._seen
        return None if seen is None else seen[0]

    def look(self, view: View) -> None:
        """Look at the robot from close by, at it and its target, or from above, beside or before its head."""
        with self._drawing:
            self._view = view
            if self._seen is not None:
                self._look_at(*self._seen)

    def begin_with(self, view: View) -> None:
        """Look in this way at the robots to come."""
        with self._drawing:
            self._next = view

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
            self._view = self._next
        drawing = self._robot.compute(moment.time, overlays)
        self._seen = (drawing, replay)
        placed = self._robot.place_world()
        if is_new or (placed and self._view == "frame"):
            self._look_at(drawing, replay)
        with self._client.atomic():
            self._robot.show(moment.index, drawing, overlays, self._camera.facing)
        centre = drawing.centres[:, :2].mean(axis=0)
        now, before = time.monotonic(), self._circled
        self._circled = now
        if self.follow:
            circles = self.circles and moment.playing and now - before < 1.0
            self._camera.follow(centre, turn=CIRCLING * (now - before) if circles else 0.0)
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
        self._robot = self._seen = None

    def _look_at(self, drawing: Drawing, replay: Playable) -> None:
        """Frame the robot as the view says; among walls from behind it, so that none hides the way."""
        places, towards = drawing.centres[:, :2], EYE
        centre = places.mean(axis=0)
        part = 1.0
        if self._view == "frame":
            if replay.target is not None:
                places = np.concatenate([places, replay.target[None]])
                if replay.walls:
                    towards = _turned(EYE_BEHIND, replay.target - centre)
        elif self._view == "close":
            towards, part = EYE_LOW, CLOSE_PART
        elif self._view == "top":
            towards = EYE_ABOVE
        else:
            head = replay.head.module
            along = places[head] - places[0 if head else -1]
            towards = _turned(EYE_BESIDE if self._view == "side" else EYE_BEFORE, along)
            if self._view == "head":
                places = places[[head]]
        corners = np.column_stack([places, np.zeros(len(places))])[:, None] + AROUND
        self._camera.start_following(centre)
        self._camera.show(Framing(corners.reshape(-1, 3), towards, part))


def view_named(name: str) -> View | None:
    """Return the view of a name, which a browser has sent; None if there is none."""
    return _VIEWS.get(name)


def _turned(direction: np.ndarray, along: np.ndarray) -> np.ndarray:
    """Return a (3,) direction turned about the vertical as x turns to a (2,) direction along the ground."""
    x, y = along / max(float(np.linalg.norm(along)), 1e-9)
    return np.array([[x, -y, 0.0], [y, x, 0.0], [0.0, 0.0, 1.0]]) @ direction
