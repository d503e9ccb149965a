"""The target of a replay: a slim post, and a line to it on the floor that says how far the head is away."""

from __future__ import annotations

from typing import Final

import numpy as np
import viser

from app.gui.viser_private import put_arrays
from app.replay.shapes import Discs, disc_glb, unit_tube
from viz import theme
from viz.robot.geometry import TARGET_HEIGHT, TARGET_RADIUS

POST_RADIUS: Final = 0.005
POST_HEIGHT: Final = 1.6 * TARGET_HEIGHT
DASH: Final = 0.02
"""Metres from one dash of the line to the next; half of that is dash."""
LINE_LIFT: Final = 0.002
LINE_STEP: Final = 0.002
"""Metres that the head moves before the line changes."""
LABEL_HEIGHT: Final = 0.03
_EDGE: Final = (*theme.TARGET, 255)
_RIMS: Final = ((*theme.TARGET, 70), (*theme.TARGET, 70), _EDGE, _EDGE)
_RADII: Final = (0.0, 0.84, 0.85, 1.0)


class TargetMark:
    """Marks a target on the floor.

    Args:
        scene: of one client.
        target: (2,) place in m.
        prefix: name of the node that everything hangs below.
    """

    def __init__(self, scene: viser.SceneApi, target: np.ndarray, *, prefix: str = "") -> None:
        self._target = np.asarray(target, dtype=float)
        x, y = map(float, self._target)
        tube = unit_tube()
        # of the same kind as the rods: a browser prepares nothing new for it
        post = scene.add_batched_meshes_simple(
            f"{prefix}/target/post",
            tube.vertices,
            tube.faces,
            batched_wxyzs=((1.0, 0.0, 0.0, 0.0),),
            batched_positions=((0.0, 0.0, POST_HEIGHT / 2),),
            batched_scales=np.array([[POST_RADIUS, POST_RADIUS, POST_HEIGHT]]),
            batched_colors=theme.linear(np.array([theme.TARGET], dtype=np.uint8)),
            lod="off",
            cast_shadow=False,
            receive_shadow=False,
            position=(x, y, 0.0),
        )
        self._place = Discs(scene, f"{prefix}/target/place", disc_glb(_RIMS, _RADII), TARGET_RADIUS)
        self._place.show(np.array([[x, y, LINE_LIFT]]))
        self._line = scene.add_line_segments(
            f"{prefix}/target/line",
            np.zeros((1, 2, 3), dtype=np.float32),
            theme.TARGET,
            thickness=0.0025,
            visible=False,
        )
        self._label = scene.add_label(
            f"{prefix}/target/distance", "", font_screen_scale=0.9, anchor="center-center", visible=False
        )
        self._handles: list[viser.SceneNodeHandle] = [post, self._line, self._label]
        self._head: np.ndarray | None = None
        self._text = ""

    def show(self, head: np.ndarray) -> None:
        """Draw the line from a (2,) place of the head, in m, once it has moved a little."""
        head = np.asarray(head, dtype=float)
        if self._head is not None and np.hypot(*(head - self._head)) < LINE_STEP:
            return
        self._head = head
        put_arrays(self._line, points=dashes(head, self._target))
        text = f"{100.0 * np.hypot(*(self._target - head)):.0f} cm"
        if text != self._text:
            self._label.text = self._text = text
        x, y = (float(v) for v in (head + self._target) / 2)
        self._label.position = (x, y, LABEL_HEIGHT)
        for handle in (self._line, self._label):
            if not handle.visible:
                handle.visible = True

    def remove(self) -> None:
        """Take it away."""
        for handle in self._handles:
            handle.remove()
        self._place.remove()


def dashes(head: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Return the (n, 2, 3) float32 dashes of the line from a head to a target, at least one.

    They lie fixed at the target, so that the line is eaten up from the head's end as it comes nearer.

    Args:
        head: (2,) in m.
        target: (2,) in m.
    """
    away = float(np.hypot(*(head - target)))
    way = (head - target) / away if away else np.zeros(2)
    start = np.arange(0.0, max(away, DASH / 2), DASH)
    ends = np.stack([start, np.minimum(start + DASH / 2, away)], axis=-1)
    points = target + ends[..., None] * way
    return np.concatenate([points, np.full((*ends.shape, 1), LINE_LIFT)], axis=-1).astype(np.float32)
