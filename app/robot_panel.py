"""The right panel of one browser: the chosen robot."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import viser

from engine.config import RunConfig
from engine.evaluation import Evaluation
from engine.tasks import get_task
from viz import network_diagram, robot_card

WIDTH = 330
WELCOME = (
    "**1** · Every cell of a map is a robot: the best of its kind.\n\n"
    "**2** · Click a filled cell to watch it crawl towards its target, the cyan post.\n\n"
    "**3** · Take it along with *Export*, or evolve your own below."
)


@dataclasses.dataclass(frozen=True, slots=True)
class Events:
    """What the panel reports."""

    export: Callable[[], None]


def dock(gui: viser.GuiApi) -> None:
    """Put a browser's main panel to the right, where what is said about a robot goes."""
    gui.set_panel_label("TensAtlas")
    gui.main_panel.dock_right()
    gui.main_panel.set_width(WIDTH)


class RobotPanel:
    """Shows a robot."""

    def __init__(self, client: viser.ClientHandle, events: Events) -> None:
        gui = client.gui
        dock(gui)
        with gui.add_folder("Robot"):
            self._welcome = gui.add_markdown(WELCOME)
            self._card = gui.add_html("")
            self._export = gui.add_button(
                "Export",
                icon=viser.Icon.DOWNLOAD,
                disabled=True,
                hint="Download this robot as a zip: MJCF, genotypes, bill of materials",
            )
            with gui.add_folder("Controller network", expand_by_default=False):
                self._network = gui.add_html('<div style="opacity:.7">no robot chosen</div>')

        @self._export.on_click
        def _(_event: viser.GuiEvent) -> None:
            events.export()

    def show_robot(self, config: RunConfig, evaluation: Evaluation, where: str, entered: int | None) -> None:
        """Show a robot."""
        self._welcome.visible = False
        self._card.content = robot_card.render(config, evaluation, where, entered)
        s = evaluation.solution
        self._network.content = network_diagram.render(
            s.controller, s.morphology.n_modules, get_task(config.task).inputs
        )
        self._export.disabled = False

    def show_no_robot(self) -> None:
        """Show none, as at the start."""
        self._welcome.visible = True
        self._card.content = self._network.content = ""
        self._export.disabled = True
