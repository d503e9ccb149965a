"""One browser that looks at a single replay, of no run's maps: its card, its controls, the scene."""

from __future__ import annotations

import viser

from app.gui.browser_value import PageSize
from app.gui.lanes import Lane
from app.pointing.pointing import Pointing
from app.pointing.seen import SeenRobot
from app.replay.player import Player, ReplayMoment
from app.replay.scene import Scene, view_named
from app.replay.scene_camera import SceneCamera
from app.replay.scene_overlay import SceneOverlay
from app.replay.transport import TransportEvents, TransportPanel
from app.robot.robot_panel import dock
from app.session.software_rendering import tell_of_software_rendering
from engine.replay.recording import Playable


class LoneReplaySession:
    """Shows a card and plays a replay.

    Args:
        client: the browser.
        title: of the card's folder.
        card: as HTML.
        replay: what to play.
        simulating: lane of the browser for its replay.
        speed: to begin with.
        step: of the slider, in s.
    """

    def __init__(
        self,
        client: viser.ClientHandle,
        title: str,
        card: str,
        replay: Playable,
        simulating: Lane,
        *,
        speed: str = "1 ×",
        step: float = 0.1,
    ) -> None:
        gui, page = client.gui, PageSize(client)
        camera = SceneCamera(client, page)
        dock(gui, page)
        with gui.add_folder(title):
            gui.add_html(card)
        self._scene = Scene(client, camera)
        overlay = SceneOverlay(gui)

        def look(what: str) -> None:
            if (view := view_named(what)) is not None:
                self._scene.look(view)

        overlay.on_do(look)
        self._pointing = Pointing(client, camera)
        self._player = Player(lane=simulating)
        self._player.show_with(self._show)
        transport = TransportPanel(
            client, self._player, self._scene, TransportEvents(), room=page.room("right"), step=step
        )
        page.on_change(lambda: transport.fit(page.room("right")))
        transport.show_only(speed)
        self._player.load(replay)
        tell_of_software_rendering(client, overlay.show_chip)

    def cancel(self) -> None:
        """Give up what is played for a browser that has gone."""
        self._player.cancel()

    def close(self) -> None:
        """End the threads of a browser that has gone."""
        self._player.close()

    def _show(self, moment: ReplayMoment) -> None:
        """Show a moment, on the player's thread."""
        self._scene.show(moment)
        self._pointing.show(SeenRobot.alone(moment, self._scene.drawing), playing=moment.playing)
