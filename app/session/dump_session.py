"""One browser that looks at a failure dump."""

from __future__ import annotations

import viser

from app.replay import transport
from app.replay.overlays import Marks
from app.replay.player import Player
from app.replay.scene import Arena
from app.replay.scene_camera import SceneCamera
from app.robot.robot_panel import WIDTH, dock
from app.session.software_rendering import spare_software_rendering
from engine.replay.dump import Dump
from engine.replay.dump_replay import DumpReplay
from engine.replay.recording import Playable
from viz.robot import robot_card

SLIDER_STEP = 0.01
"""Seconds: a simulation explodes within few control updates."""
SPEED = "⅒ ×"
"""Speed to begin with: every time step can be seen."""


class DumpSession:
    """Shows a dump's card and plays it.

    Args:
        client: the browser.
        dump: what to show.
    """

    def __init__(self, client: viser.ClientHandle, dump: Dump) -> None:
        gui, camera = client.gui, SceneCamera(client)
        dock(gui)
        with gui.add_folder("Failed simulation"):
            gui.add_html(robot_card.render_failure(dump))
        self._arena = Arena(client, camera)
        self._player = Player(self._show_moment, lambda: self._transport.refresh())
        self._transport = transport.TransportPanel(
            client,
            self._player,
            transport.Events(
                trial_chosen=lambda _trial: None,
                elsewhere=lambda: None,
                follow_changed=self._set_follow,
                marks_changed=self._set_marks,
            ),
            taken=WIDTH,
            step=SLIDER_STEP,
        )
        self._transport.show_only(SPEED)
        self._player.load(DumpReplay(dump))
        self._transport.refresh()
        spare_software_rendering(client)

    def close(self) -> None:
        """End the threads of a browser that has gone."""
        self._player.close()

    def _show_moment(self, replay: Playable, index: int, moment: float) -> None:
        self._arena.show(replay, index, moment)
        self._transport.tick()

    def _set_follow(self, follow: bool) -> None:
        self._arena.follow = follow

    def _set_marks(self, marks: Marks) -> None:
        self._arena.marks = marks
        self._player.redraw()
