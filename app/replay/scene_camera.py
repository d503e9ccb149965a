"""The camera of one browser's 3D scene: shows what matters, follows the robot, keeps the user's turns."""

from __future__ import annotations

import time

import numpy as np
import viser

from engine.body.kinematics import rotation_rows
from viz.robot.framing import Window, eye_showing

PATIENCE = 5.0
"""Seconds to wait for a browser to say that its camera is where it was placed."""
TOP, BOTTOM, SIDES = 50, 225, 25
"""Pixels of the scene at its edges that are left free; the replay's panel covers the lower one."""
PHONE_WIDTH = 576
"""Pixels: in a window that is no wider, viser's panels cover the lower three fifths."""
PHONE_COVERED = 0.62
FOLLOW_STEP = 0.002
"""Metres that the robot moves before a following camera moves with it."""


class SceneCamera:
    """Places the camera.

    Args:
        client: whose it is, its window's scene not yet narrowed by panels beside it.
    """

    def __init__(self, client: viser.ClientHandle) -> None:
        self._client = client
        self._phone = client.camera.image_width <= PHONE_WIDTH
        self._placed: tuple[np.ndarray, float, float] | None = None
        self._followed = np.zeros(2)

    @property
    def facing(self) -> np.ndarray:
        """The (2, 3) directions in the world that are right and up on the screen."""
        right, down, _ahead = np.array(rotation_rows(self._client.camera.wxyz)).T
        return np.stack([right, -down])

    def show(self, points: np.ndarray, towards: np.ndarray) -> None:
        """Show points above the panel that covers the lower edge.

        Args:
            points: (n, 3) what is to be seen, in m.
            towards: (3,) direction from there to the camera.
        """
        camera = self._client.camera
        height = camera.image_height
        window = Window(
            fov=camera.fov,
            width=camera.image_width,
            height=height,
            top=TOP,
            bottom=PHONE_COVERED * height if self._phone else BOTTOM,
            sides=SIDES,
        )
        eye, focus = eye_showing(points, towards, window)
        with self._client.atomic():
            camera.position, camera.look_at = tuple(eye), tuple(focus)
        self._placed = (np.array(camera.position), camera.update_timestamp, time.monotonic())

    def start_following(self, place: np.ndarray) -> None:
        """Follow from here on what is now at a (2,) place of the ground, in m."""
        self._followed = place

    def follow(self, place: np.ndarray) -> None:
        """Move as what is followed moves to a (2,) place; how the user turned and zoomed it stays."""
        if not self._has_arrived():
            return
        step = place - self._followed
        if np.hypot(*step) < FOLLOW_STEP:
            return
        self._followed = place
        # what the camera looks at moves along with its position
        self._client.camera.position = self._client.camera.position + np.array([*step, 0.0])

    def _has_arrived(self) -> bool:
        """Tell whether the browser has taken the camera where it was last placed.

        What a busy browser reports in the meantime is where its camera was before; a step from there
        would take the camera back.
        """
        if self._placed is not None:
            (position, placed, since), camera = self._placed, self._client.camera
            reported = camera.update_timestamp != placed
            arrived = reported and np.allclose(camera.position, position, rtol=0.0, atol=0.01)
            if arrived or time.monotonic() - since > PATIENCE:
                self._placed = None
        return self._placed is None
