"""What a run greets its viewer with: its best robot, crawling before anything has been clicked."""

from __future__ import annotations

import math
import time
from typing import Final

import numpy as np

from app.replay.scene import Scene
from app.replay.scene_overlay import SceneOverlay
from app.replay.transport import TransportPanel
from engine.simulation.evaluation import Evaluation

SPEED: Final = "4 ×"
USUAL_SPEED: Final = "1 ×"
LASTS: Final = 120.0
"""Seconds that the robot goes on crawling and the camera circling."""
LINE: Final = "Evolved in {:,} trials. Click any square."


class Greeting:
    """Shows a robot from close by, fast, over and over, the camera circling, until the user does something.

    Args:
        overlay: of the scene.
        scene: that the robot appears in.
        transport: of the player that plays it.
    """

    def __init__(self, overlay: SceneOverlay, scene: Scene, transport: TransportPanel) -> None:
        self._overlay, self._scene, self._transport = overlay, scene, transport
        self._goes_on = self._calm = False
        self._until = math.inf

    def begin(self, n_trials: int) -> None:
        """Greet with the robot that is loaded next.

        Args:
            n_trials: how many robots the run has tried.
        """
        self._goes_on = True
        self._overlay.say(LINE.format(n_trials))
        self._scene.begin_with("close")
        self._scene.circles = not self._calm
        self._until = math.inf if self._calm else time.monotonic() + LASTS
        self._transport.play_at(SPEED, loop=not self._calm)

    def be_calm(self) -> None:
        """Let nothing circle, and play once: the user wants no motion that they have not asked for."""
        self._calm = True
        self._scene.circles = False
        if self._goes_on:
            self._transport.play_at(SPEED)

    def tick(self) -> None:
        """Come to rest after a while: a page that is left open need not keep a processor busy for ever."""
        if self._goes_on and time.monotonic() > self._until:
            self._until = math.inf
            self._scene.circles = False
            self._transport.play_at(SPEED)

    def hold_still(self) -> None:
        """Circle no more: the user has taken the camera."""
        self._scene.circles = False

    def end(self) -> None:
        """The user has chosen something."""
        if not self._goes_on:
            return
        self._goes_on = False
        self._overlay.say("")
        self._scene.begin_with("frame")
        self._scene.circles = False
        self._transport.play_at(USUAL_SPEED)


def best_target(evaluation: Evaluation) -> int:
    """Return the index of the target that a robot comes nearest to, in the mean over its repeats."""
    means = np.nan_to_num(evaluation.distances.mean(axis=1), nan=np.inf)
    return int(np.argmin(means))
