"""What a browser's player plays and draws: the chosen robot, a variant of it, or pinned ones side by side."""

from __future__ import annotations

import threading
from collections.abc import Callable

import viser

from app.gui.actions import Actions
from app.gui.top_bar import TopBar
from app.pointing.pointing import Pointing
from app.pointing.seen import SeenRobot
from app.replay.player import ReplayMoment
from app.replay.scene import Scene, View
from app.replay.scene_camera import SceneCamera
from app.replay.side_by_side import SideBySideReplay
from app.replay.side_by_side_scene import SideBySideScene
from app.robot.pins_panel import PinsPanel
from app.robot.robot_panel import RobotPanel
from app.robot.what_if_panel import WhatIfEvents, WhatIfPanel
from app.runs.library import Library
from engine.replay.recording import Playable
from engine.replay.replay import Replay
from engine.replay.trial import TrialChoice
from engine.replay.what_if import WhatIfReplay
from viz.robot.robot_differences import Entry
from viz.robot.what_if_table import describe

LABEL_STEP = 5
"""Frames between two places of the label of a variant."""
LABEL_HEIGHT = 0.15
"""Metres that it hangs above the ground."""


class ReplaySource:
    """Makes the replays that a player plays, and shows their moments: its ``show`` is called by the player.

    Owns the panels that offer other replays than the chosen robot's.

    Args:
        client: the browser.
        bar: of the browser.
        scene: that shows one robot.
        camera: of the scene.
        panel: about the chosen robot; it gets a tab for variants.
        actions: of the browser.
        library: the runs.
        play: called when something else is to be played; it then asks ``replay`` for it.
        may_simulate: called with the seconds of robots' time to simulate; returns whether they are allowed,
            and tells the user if not.
    """

    def __init__(
        self,
        client: viser.ClientHandle,
        bar: TopBar,
        scene: Scene,
        camera: SceneCamera,
        panel: RobotPanel,
        actions: Actions,
        *,
        library: Library,
        play: Callable[[], None],
        may_simulate: Callable[[float], bool],
    ) -> None:
        self._scene, self._live, self._play = scene, panel.live, play
        self._side_by_side = SideBySideScene(client, camera)
        self._label = _VariantLabel(client.scene)
        self._pointing = Pointing(client, camera)
        self._robot: Entry | None = None
        self._what_if = WhatIfPanel(
            client, panel.tabs, actions, WhatIfEvents(self._play_variant, may_simulate)
        )
        self.pins = PinsPanel(client, bar, actions, self._play_pinned, library)
        """The robots that can be seen side by side."""

    def choose(self, robot: Entry | None) -> None:
        """Offer a robot to be played, pinned and changed; None for none."""
        self._robot = robot
        self.pins.choose(robot)
        self._what_if.choose(robot)

    @property
    def shows_a_variant(self) -> bool:
        """Whether a changed body is played, towards the task's own targets."""
        return self._what_if.watching and not self.pins.side_by_side

    def replay(self, trial: TrialChoice) -> Playable | None:
        """Return what is to be played of a trial, None if there is nothing.

        Raises:
            InvalidData: there is no such trial.
        """
        if self.pins.side_by_side:
            return self.pins.replay(trial)
        if self.shows_a_variant:
            return self._what_if.replay(trial.target)
        if self._robot is not None:
            return Replay.of(self._robot.config, self._robot.evaluation, trial)
        return None

    def show(self, moment: ReplayMoment) -> None:
        """Draw a moment, and take away what a replay of another kind has left."""
        replay = moment.replay
        if isinstance(replay, SideBySideReplay):
            self._label.remove()
            self._scene.clear()
            self._side_by_side.show(replay, moment.time, self._scene.overlays)
            self._pointing.show(self._in_lanes(replay), playing=moment.playing)
            self.pins.tell(replay, moment.time)
            return
        self._side_by_side.clear()
        self._scene.show(moment)
        self._pointing.show(SeenRobot.alone(moment, self._scene.drawing), playing=moment.playing)
        if isinstance(replay, WhatIfReplay):
            self._label.show(replay, moment.index)
        else:
            self._label.remove()
            self._live.show(moment)

    def _in_lanes(self, replay: SideBySideReplay) -> list[SeenRobot]:
        """Return the robots that are seen side by side; the chosen one is that of the card."""
        chosen = None if self._robot is None else self.pins.index(self._robot)
        return [
            SeenRobot(
                replay.lanes[d.number].morphology,
                d.drawing,
                replay.lanes[d.number].frames[d.index],
                d.lane.turn,
                d.lane.position,
                d.number == chosen,
            )
            for d in self._side_by_side.drawn
        ]

    def look(self, view: View) -> None:
        """Look at what is played another way; robots side by side are all shown."""
        if not self._side_by_side.look():
            self._scene.look(view)

    def clear(self) -> None:
        """Remove all robots from the scene."""
        self._label.remove()
        self._scene.clear()
        self._pointing.clear()
        self._side_by_side.clear()

    def close(self) -> None:
        """End what is being simulated."""
        self._what_if.stop()

    def _play_pinned(self) -> None:
        self._what_if.leave()
        self._play()

    def _play_variant(self) -> None:
        self.pins.leave()
        self._play()


class _VariantLabel:
    """Labels a variant as a robot that is in no archive. Threads may share it.

    Args:
        scene: of one client.
    """

    def __init__(self, scene: viser.SceneApi) -> None:
        self._scene = scene
        self._mutex = threading.Lock()
        self._label: viser.LabelHandle | None = None
        self._labelled: WhatIfReplay | None = None
        self._step = -1
        self._n_labels = 0

    def show(self, replay: WhatIfReplay, index: int) -> None:
        """Hang it over where the robot is at a recorded frame."""
        with self._mutex:
            step = index // LABEL_STEP
            if replay is self._labelled and step == self._step:
                return
            self._step = step
            x, y = (float(v) for v in replay.frames[index].pose[..., :2].mean(axis=(0, 1)))
            if replay is self._labelled and self._label is not None:
                self._label.position = (x, y, LABEL_HEIGHT)
                return
            self._remove()
            self._n_labels += 1
            self._label = self._scene.add_label(
                f"/what-if/{self._n_labels}",
                f"what if · {describe(replay.morphology)}",
                position=(x, y, LABEL_HEIGHT),
                anchor="bottom-center",
            )
            self._labelled = replay

    def remove(self) -> None:
        """Take it away."""
        with self._mutex:
            self._remove()

    def _remove(self) -> None:
        if self._label is not None:
            self._label.remove()
        self._label = self._labelled = None
