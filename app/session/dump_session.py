"""One browser that looks at a failure dump."""

from __future__ import annotations

import viser

from app.gui.lanes import Lane
from app.gui.widgets import panel_widths
from app.replay.player import Player
from app.replay.scene import Scene, view_named
from app.replay.scene_camera import SceneCamera
from app.replay.scene_overlay import SceneOverlay
from app.replay.transport import TransportEvents, TransportPanel
from app.robot.robot_panel import dock
from app.session.software_rendering import tell_of_software_rendering
from engine.replay.dump import Dump
from engine.replay.dump_replay import DumpReplay
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
        simulating: lane of the browser for its replay.
    """

    def __init__(self, client: viser.ClientHandle, dump: Dump, simulating: Lane) -> None:
        gui, camera, page = client.gui, SceneCamera(client), client.camera.image_width
        width = panel_widths(page)[1]
        dock(gui, width)
        with gui.add_folder("Failed simulation"):
            gui.add_html(robot_card.render_failure(dump))
        scene = Scene(client, camera)
        overlay = SceneOverlay(gui)

        def look(what: str) -> None:
            if (view := view_named(what)) is not None:
                scene.look(view)

        overlay.on_do(look)
        self._player = Player(lane=simulating)
        self._player.show_with(scene.show)
        transport = TransportPanel(
            client, self._player, scene, TransportEvents(), room=page - width, step=SLIDER_STEP
        )
        transport.show_only(SPEED)
        self._player.load(DumpReplay(dump))
        tell_of_software_rendering(client, overlay.show_chip)

    def cancel(self) -> None:
        """Give up what is played for a browser that has gone."""
        self._player.cancel()

    def close(self) -> None:
        """End the threads of a browser that has gone."""
        self._player.close()
