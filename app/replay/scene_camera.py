"""The camera of one browser's 3D scene: shows what matters, follows the robot, keeps the user's turns."""

from __future__ import annotations

import dataclasses
import math
import threading

import numpy as np
import viser

from app.gui.browser_value import PageSize
from app.replay.stage import FIELD_OF_VIEW
from viz.robot.framing import Window, eye_showing

TOP, BOTTOM, SIDES = 50, 130, 25
"""Pixels of the scene at its edges that are left free; the replay's panel covers the lower one."""
PHONE_WIDTH = 576
"""Pixels: in a window that is no wider, viser's panels cover the lower three fifths."""
PHONE_COVERED = 0.62
LEAST_FREE = 200
"""Pixels beside a window that a robot is shown in; where there are fewer, it may lie under the window."""
FOLLOW_STEP = 0.002
"""Metres that the robot moves before a following camera moves with it."""
KNOWN_PLACES = 1500
"""Places that the camera was sent to last; a slow browser may still report one: fifty seconds' worth."""
BEGINNINGS = np.array([[-5.0, 0.0, 0.0], [3.0, 3.0, 3.0]])
"""Where viser's own camera is before the first message; a slow browser may still report it after that."""
SAME = 0.004
"""Metres by which a reported place may differ from where the camera was sent."""


@dataclasses.dataclass(frozen=True, slots=True)
class Framing:
    """What a camera shows.

    Attributes:
        points: (n, 3) what is to be seen, in m.
        towards: (3,) direction from there to the camera.
        part: of the scene's free width that the points may fill.
    """

    points: np.ndarray
    towards: np.ndarray
    part: float = 1.0


@dataclasses.dataclass(frozen=True, slots=True)
class Ray:
    """Where a pointer points.

    Attributes:
        origin: (3,) the eye, in m.
        direction: (3,) of length 1.
        pixel: the angle that a pixel takes, in rad.
    """

    origin: np.ndarray
    direction: np.ndarray
    pixel: float


class SceneCamera:
    """Places the camera, and knows where it is: a slow browser tells that late.

    What a browser reports is either a place that the camera was sent to a while ago, or, if it is none of
    these, where its user has taken it. Only from the latter does the camera go on.

    Args:
        client: whose it is.
        page: its size.
    """

    def __init__(self, client: viser.ClientHandle, page: PageSize) -> None:
        self._client = client
        self._page = page
        client.camera.fov = FIELD_OF_VIEW
        self._eye, self._focus = np.array([0.6, -1.0, 0.5]), np.zeros(3)
        self._sent, self._n_sent = np.full((KNOWN_PLACES, 3), np.inf), 0
        for place in BEGINNINGS:
            self._remember(place)
        self._framing: Framing | None = None
        self._size = (0.0, 0.0)
        self._covered = 0
        self._followed = np.zeros(2)
        self._framed_at = self._followed
        self._mutex = threading.RLock()
        client.camera.on_update(lambda _camera: self._reported())
        page.on_change(self._reported)

    @property
    def facing(self) -> np.ndarray:
        """The (2, 3) directions in the world that are right and up on the screen, as far as is known."""
        with self._mutex:
            out = (self._eye - self._focus) / np.linalg.norm(self._eye - self._focus)
        right = np.array([-out[1], out[0], 0.0])
        level = float(np.linalg.norm(right))
        right = right / level if level > 1e-6 else np.array([1.0, 0.0, 0.0])
        return np.stack([right, np.cross(out, right)])

    def ray(self, x: float, y: float) -> Ray:
        """Return the ray from the eye through a place of the scene.

        Args:
            x: from 0 at its left edge to 1 at the right one.
            y: from 0 at its upper edge to 1 at the lower one.
        """
        (width, height), edge = self._page.scene, math.tan(FIELD_OF_VIEW / 2)
        right, up = self.facing
        with self._mutex:
            eye, ahead = self._eye, self._focus - self._eye
        across = edge * width / max(height, 1)
        way = ahead / np.linalg.norm(ahead) + (2 * x - 1) * across * right + (1 - 2 * y) * edge * up
        return Ray(eye, way / np.linalg.norm(way), 2 * edge / max(height, 1))

    def across(self, point: np.ndarray) -> float:
        """Return where a (3,) point is seen: from -1 at the scene's left edge to 1 at its right one."""
        (width, height), edge = self._page.scene, math.tan(FIELD_OF_VIEW / 2)
        with self._mutex:
            eye, ahead = self._eye, self._focus - self._eye
        way = point - eye
        depth = max(float(way @ ahead / np.linalg.norm(ahead)), 1e-6)
        half = edge * width / max(height, 1)
        return float(way @ self.facing[0] / depth / half)

    def show(self, framing: Framing) -> None:
        """Show points above the panel that covers the lower edge, whatever size the scene gets meanwhile."""
        with self._mutex:
            self._show(framing)

    def _show(self, framing: Framing) -> None:
        self._framing, self._framed_at = framing, self._followed
        self._remember(self._client.camera.position)  # which may be reported once more
        self._size = (width, height) = self._page.scene
        phone = self._page.width <= PHONE_WIDTH
        left = self._covered if not phone and width - self._covered >= LEAST_FREE else 0
        sides = max(SIDES, 0.5 * (1.0 - framing.part) * (width - left))
        window = Window(
            fov=FIELD_OF_VIEW,
            width=width,
            height=height,
            top=TOP,
            bottom=PHONE_COVERED * height if phone else BOTTOM,
            sides=sides,
            left=left,
        )
        self._go(*eye_showing(framing.points, framing.towards, window))

    def cover(self, left: int) -> None:
        """Show what is framed beside a window that covers so many pixels at the left edge; 0 for none."""
        with self._mutex:
            self._covered = left
            self._frame_again()

    def start_following(self, place: np.ndarray) -> None:
        """Follow from here on what is now at a (2,) place of the ground, in m."""
        with self._mutex:
            self._followed = place

    def follow(self, place: np.ndarray, *, turn: float = 0.0) -> None:
        """Move as what is followed moves to a (2,) place; how the user turned and zoomed it stays.

        Args:
            place: in m.
            turn: to circle it by, in rad.
        """
        with self._mutex:
            self._follow(place, turn)

    def _follow(self, place: np.ndarray, turn: float) -> None:
        step = place - self._followed
        if np.hypot(*step) < FOLLOW_STEP and not turn:
            return
        self._followed = place
        move = np.array([*step, 0.0])
        eye, focus = self._eye + move, self._focus + move
        if turn:
            middle, c, s = np.array([*place, 0.0]), math.cos(turn), math.sin(turn)
            about = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
            eye, focus = (about @ (p - middle) + middle for p in (eye, focus))
        self._go(eye, focus)

    def _go(self, eye: np.ndarray, focus: np.ndarray) -> None:
        self._eye, self._focus = eye, focus
        self._remember(eye)
        camera = self._client.camera
        with self._client.atomic():
            camera.position, camera.look_at = tuple(eye), tuple(focus)

    def _remember(self, place: np.ndarray) -> None:
        """Take note of a (3,) place that may be reported and is not the user's doing."""
        self._sent[self._n_sent % KNOWN_PLACES] = place
        self._n_sent += 1

    def _reported(self) -> None:
        """Take note of where the browser says that its camera is, and how large its scene is."""
        camera = self._client.camera
        with self._mutex:
            place = np.array(camera.position)
            if np.abs(self._sent - place).max(axis=1).min() > SAME:
                self._eye, self._focus = place, np.array(camera.look_at)
                self._framing = None  # it is the user's now
            if self._page.scene != self._size:
                self._frame_again()

    def _frame_again(self) -> None:
        """Show what is framed in the room that there is now, from where the camera is."""
        if (framing := self._framing) is not None:
            moved = np.array([*(self._followed - self._framed_at), 0.0])
            self._show(Framing(framing.points + moved, self._eye - self._focus, framing.part))
