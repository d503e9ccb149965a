"""What the 3D scene of one browser shows: the chosen robot, a variant of it, or several side by side."""

from __future__ import annotations

import threading
from collections.abc import Callable

import viser

from app.gui.actions import Actions
from app.replay.scene import Arena
from app.replay.scene_camera import SceneCamera
from app.replay.side_by_side import LaneReplay
from app.replay.side_by_side_scene import LaneArena
from app.robot.pins_panel import PinsPanel
from app.robot.what_if_panel import Events, WhatIfPanel
from engine.replay.recording import Playable
from engine.replay.trial import TrialChoice
from engine.replay.what_if import WhatIfReplay
from viz.robot.robot_differences import Entry
from viz.robot.what_if_table import describe

LABEL_STEP = 5
"""Frames between two places of the label of a variant."""
LABEL_HEIGHT = 0.15
"""Metres that it hangs above the ground."""


class Stage:
    """Owns the panels of what a robot is compared with, and hands moments to whatever draws their kind.

    Args:
        client: whose scene it is.
        arena: that draws one robot.
        camera: of the scene.
        tabs: the group that gets a tab for variants.
        actions: of the browser.
        play: called when something else than before is to be played; it asks ``replay`` what.
        may_simulate: asked before so many seconds of robots' time are simulated; it says why not.
    """

    def __init__(
        self,
        client: viser.ClientHandle,
        arena: Arena,
        camera: SceneCamera,
        tabs: viser.GuiTabGroupHandle,
        actions: Actions,
        *,
        play: Callable[[], None],
        may_simulate: Callable[[float], bool],
    ) -> None:
        self._arena, self._scene, self._play = arena, client.scene, play
        self._lanes = LaneArena(client, camera, lambda: arena.marks)
        self._label: viser.LabelHandle | None = None
        self._labelled: Playable | None = None
        self._label_place = -1
        self._n_labels = 0
        self._labelling = threading.Lock()
        self._what_if = WhatIfPanel(client, tabs, actions, Events(self._play_variant, may_simulate))
        self._pins = PinsPanel(client, actions, self._play_lanes)

    def choose(self, robot: Entry | None) -> None:
        """Offer a robot to be pinned and changed, and show one robot at a time again."""
        self._pins.choose(robot)
        self._what_if.choose(robot)

    def pin(self) -> None:
        """Pin the chosen robot, or unpin it if it is pinned.

        Raises:
            InvalidData: there is none, or four are pinned already.
        """
        self._pins.pin_or_unpin()

    @property
    def shows_a_variant(self) -> bool:
        """Whether a changed body is played, towards the task's own targets."""
        return self._what_if.watching and not self._pins.side_by_side

    def replay(self, trial: TrialChoice) -> Playable | None:
        """Return what is to be played of the trial, None for the chosen robot itself.

        Raises:
            InvalidData: there is no such trial.
        """
        if self._pins.side_by_side:
            self._lanes.name(self._pins.lane_names())
            return self._pins.replay(trial)
        if self.shows_a_variant:
            return self._what_if.replay(trial.target)
        return None

    def show(self, replay: Playable, index: int, moment: float) -> bool:
        """Draw a moment, and take away what a replay of another kind has left.

        Args:
            replay: what is played.
            index: of the recorded frame that is nearest.
            moment: of the replay's clock, in s.

        Returns:
            Whether it is of the chosen robot itself.
        """
        if isinstance(replay, LaneReplay):
            self._clear_label()
            self._arena.clear()
            self._lanes.show(replay, moment)
            self._pins.tell(replay, moment)
            return False
        self._lanes.clear()
        self._arena.show(replay, index, moment)
        if isinstance(replay, WhatIfReplay):
            self._show_label(replay, index)
            return False
        self._clear_label()
        return True

    def clear(self) -> None:
        """Remove all robots."""
        self._clear_label()
        self._arena.clear()
        self._lanes.clear()

    def close(self) -> None:
        """End what is being simulated."""
        self._what_if.close()

    def _play_lanes(self) -> None:
        self._what_if.leave()
        self._play()

    def _play_variant(self) -> None:
        self._pins.leave()
        self._play()

    def _show_label(self, replay: WhatIfReplay, index: int) -> None:
        """Say over a variant that it is none of the archive's robots."""
        with self._labelling:
            new = replay is not self._labelled
            if not new and index // LABEL_STEP == self._label_place:
                return
            self._label_place = index // LABEL_STEP
            x, y = (float(v) for v in replay.frames[index].pose[..., :2].mean(axis=(0, 1)))
            if new or self._label is None:
                if self._label is not None:
                    self._label.remove()
                self._n_labels += 1
                self._label = self._scene.add_label(
                    f"/what-if/{self._n_labels}",
                    f"what if · {describe(replay.morphology)}",
                    position=(x, y, LABEL_HEIGHT),
                    anchor="bottom-center",
                )
                self._labelled = replay
            else:
                self._label.position = (x, y, LABEL_HEIGHT)

    def _clear_label(self) -> None:
        with self._labelling:
            if self._label is not None:
                self._label.remove()
            self._label = self._labelled = None
