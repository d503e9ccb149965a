"""The tab with a robot's ancestors; a click replays one."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import viser

from app.gui.click_channel import ClickChannel
from app.gui.widgets import put_html
from engine.storage.rows import Ancestor
from viz.robot import lineage_list


class LineagePanel:
    """Lists the ancestors of the robot that was chosen, whichever of them is shown.

    Args:
        gui: of one client.
        tabs: the group that gets the tab.
        chosen: called with the number of a listed robot that was clicked.
    """

    def __init__(
        self, gui: viser.GuiApi, tabs: viser.GuiTabGroupHandle, chosen: Callable[[int], None]
    ) -> None:
        self._chosen = chosen
        self._line: Sequence[Ancestor] = ()
        with tabs.add_tab("Lineage", viser.Icon.GIT_COMMIT):
            self._handler = ClickChannel(gui, self._clicked, label="ancestor clicks").handler
            self._list = gui.add_html("")

    def show(self, line: Sequence[Ancestor], shown: int, target_distance: float) -> None:
        """List a robot and its ancestors.

        Args:
            line: the robot, its parent, and so on.
            shown: number of the one that is replayed.
            target_distance: of the task, in m.
        """
        self._line = line
        put_html(self._list, lineage_list.render(line, shown, target_distance, self._handler))

    def clear(self) -> None:
        """List nobody."""
        self._line = ()
        put_html(self._list, "")

    @property
    def line(self) -> Sequence[Ancestor]:
        """Who is listed."""
        return self._line

    def _clicked(self, name: str, index: tuple[int, ...]) -> None:
        number = lineage_list.clicked_number(name, index)
        if any(a.number == number for a in self._line):
            assert number is not None
            self._chosen(number)
