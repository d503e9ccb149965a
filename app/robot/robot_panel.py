"""The right panel of one browser: the chosen robot."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import viser

from app.gui.actions import Actions
from app.gui.browser_value import PageSize
from app.gui.file_maker import FileMaker
from app.gui.page_channel import page_file
from app.gui.viser_private import selector
from app.gui.widgets import put_html
from app.robot.lineage_panel import LineagePanel
from app.robot.live_panel import LivePanel
from engine.analysis.robustness import Robustness
from engine.config import RunConfig
from engine.simulation.evaluation import Evaluation
from engine.storage.rows import Ancestor
from engine.tasks import get_task
from viz.robot import robot_card

WELCOME = (
    "**1** · Every cell of a map is a robot: the best of its kind.\n\n"
    "**2** · Click a filled cell to watch it crawl towards its target, the cyan post.\n\n"
    "**3** · Take it along with *Export*, or evolve your own: *New run*, above."
)


def dock(gui: viser.GuiApi, page: PageSize) -> None:
    """Put a browser's main panel to the right of its page, where a robot is shown."""
    gui.set_panel_label("Robot")
    gui.main_panel.dock_right()
    page.fit_panel(gui.main_panel, "right")


class RobotPanel:
    """Shows a robot: its card, what goes on inside it, from whom it descends.

    Args:
        client: the browser.
        actions: of the browser.
        ancestor_chosen: called with the number of an ancestor that is to be shown.
        seek: called with a moment of the replay, in s, that the user points at.
        page: the browser's size.
    """

    def __init__(
        self,
        client: viser.ClientHandle,
        actions: Actions,
        ancestor_chosen: Callable[[int], None],
        seek: Callable[[float], None],
        page: PageSize,
    ) -> None:
        gui = client.gui
        dock(gui, page)
        gui.add_html(f'<style data-ta-mark="robot">{page_file("robot_panel.css", __package__)}</style>')
        self._welcome = gui.add_markdown(WELCOME)
        self._card = gui.add_html("")
        self._verdict = gui.add_html("")
        self.export = gui.add_button(
            "Export",
            icon=viser.Icon.DOWNLOAD,
            disabled=True,
            hint="Download this robot as a zip: build sheet, parts, firmware, MJCF. Choose paper and"
            " material under Take along",
        )
        """Asks for the robot's folder; who makes it listens."""
        self.pin = gui.add_button(
            "Pin",
            icon=viser.Icon.PIN,
            color="gray",
            disabled=True,
            hint="Pin or unpin this robot: those pinned can be seen side by side",
        )
        """Asks to pin the robot; who keeps the pins listens."""
        halves = "".join(
            f"{selector(button)}{{float:left;width:calc({share}% - 18px);box-sizing:border-box}}"
            for button, share in ((self.export, 57), (self.pin, 37))
        )
        gui.add_html(f"<style>{halves}{selector(self.pin)}~*{{clear:both}}</style>")
        self.maker = FileMaker(client, actions)
        """Makes files of the robot one at a time, and shows below the buttons how far each is."""
        self.tabs = gui.add_tab_group()
        """Where tabs of other things about the robot may lie."""
        self.live = LivePanel(gui, self.tabs, seek)
        """What goes on inside it while it is replayed."""
        self._lineage = LineagePanel(gui, self.tabs, ancestor_chosen)

    def show_robot(
        self,
        config: RunConfig,
        evaluation: Evaluation,
        where: str,
        entered: int | None,
        *,
        line: Sequence[Ancestor],
        robust: Robustness | None,
    ) -> None:
        """Show a robot.

        Args:
            config: of its run.
            evaluation: the robot.
            where: it was picked from.
            entered: the generation it was evaluated in.
            line: the robot that was chosen on a map, its parent, and so on; this robot is one of them.
            robust: what evaluating the run's elites again has shown, None if that was not done.
        """
        self._welcome.visible = False
        self._card.content = robot_card.render(config, evaluation, where, entered, robust)
        self.live.show_robot(config, evaluation)
        distance = get_task(config.task).target_distance
        self._lineage.show(line, evaluation.solution.number, distance)
        self.export.disabled = self.pin.disabled = False

    def show_verdict(self, material: str, problems: Sequence[str], instead: str) -> None:
        """Show whether the robot can be built from a material, and if not, why, and of what instead."""
        put_html(self._verdict, robot_card.render_verdict(material, problems, instead))

    def show_no_robot(self) -> None:
        """Show none, as at the start."""
        self._welcome.visible = True
        self._card.content = ""
        put_html(self._verdict, "")
        self.live.clear()
        self._lineage.clear()
        self.export.disabled = self.pin.disabled = True
