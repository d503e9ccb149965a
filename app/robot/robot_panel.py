"""The right panel of one browser: the chosen robot."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence

import viser

from app.gui.actions import Actions
from app.gui.file_maker import FileMaker
from app.robot.lineage_panel import LineagePanel
from app.robot.live_panel import LivePanel
from engine.config import RunConfig
from engine.replay.recording import Playable
from engine.simulation.evaluation import Evaluation
from engine.storage.rows import Ancestor
from engine.tasks import get_task
from viz.robot import robot_card

WIDTH = 330
WELCOME = (
    "**1** · Every cell of a map is a robot: the best of its kind.\n\n"
    "**2** · Click a filled cell to watch it crawl towards its target, the cyan post.\n\n"
    "**3** · Take it along with *Export*, or evolve your own below."
)

TABS_STYLE = (
    '<style class="ta-robot">[role="tablist"]:has(>[title="What if"])>[role="tab"]{padding:0 .5em!important}'
    '[role="tablist"]:has(>[title="What if"])>[role="tab"]>div{margin-right:.35em!important}</style>'
)
"""All tabs about a robot in one row."""


@dataclasses.dataclass(frozen=True, slots=True)
class Events:
    """What the panel reports."""

    export: Callable[[], None]
    ancestor_chosen: Callable[[int], None]
    pin: Callable[[], None]


def dock(gui: viser.GuiApi) -> None:
    """Put a browser's main panel to the right, where what is said about a robot goes."""
    gui.set_panel_label("TensAtlas")
    gui.main_panel.dock_right()
    gui.main_panel.set_width(WIDTH)


class RobotPanel:
    """Shows a robot: its card, what goes on inside it, from whom it descends."""

    def __init__(self, client: viser.ClientHandle, actions: Actions, events: Events) -> None:
        gui = client.gui
        dock(gui)
        with gui.add_folder("Robot"):
            gui.add_html(TABS_STYLE)
            self._welcome = gui.add_markdown(WELCOME)
            self._card = gui.add_html("")
            self._export = gui.add_button(
                "Export",
                icon=viser.Icon.DOWNLOAD,
                disabled=True,
                hint="Download this robot as a zip: build sheet, parts, firmware, MJCF. Choose paper and"
                " material under Take along",
            )
            self._pin = gui.add_button(
                "Pin",
                icon=viser.Icon.PIN,
                color="gray",
                disabled=True,
                hint="Pin or unpin this robot: those pinned can be seen side by side, see below",
            )
            self.maker = FileMaker(client, actions)
            """Shows how far the file is that is being made, below the button that most are asked for with."""
            self.tabs = gui.add_tab_group()
            """Where tabs of other things about the robot may lie."""
            self._live = LivePanel(gui, self.tabs)
            self._lineage = LineagePanel(gui, self.tabs, events.ancestor_chosen)

        @self._export.on_click
        def _(_event: viser.GuiEvent) -> None:
            events.export()

        @self._pin.on_click
        def _(_event: viser.GuiEvent) -> None:
            events.pin()

    def show_robot(
        self,
        config: RunConfig,
        evaluation: Evaluation,
        where: str,
        entered: int | None,
        *,
        line: Sequence[Ancestor],
    ) -> None:
        """Show a robot.

        Args:
            config: of its run.
            evaluation: the robot.
            where: it was picked from.
            entered: the generation it was evaluated in.
            line: the robot that was chosen on a map, its parent, and so on; this robot is one of them.
        """
        self._welcome.visible = False
        self._card.content = robot_card.render(config, evaluation, where, entered)
        self._live.show_robot(config, evaluation)
        distance = get_task(config.task).target_distance
        self._lineage.show(line, evaluation.solution.number, distance)
        self._export.disabled = self._pin.disabled = False

    def show_no_robot(self) -> None:
        """Show none, as at the start."""
        self._welcome.visible = True
        self._card.content = ""
        self._live.clear()
        self._lineage.clear()
        self._export.disabled = self._pin.disabled = True

    def show_frame(self, replay: Playable, index: int, *, playing: bool) -> None:
        """Show what goes on inside the robot at a frame of its replay."""
        self._live.tick(replay, index, playing=playing)
