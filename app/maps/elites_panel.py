"""The window of one browser with the list of elites: sorted, searched, filtered by f_s."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import viser

from app.gui.click_channel import ClickChannel
from app.gui.top_bar import TopBar
from app.gui.widgets import put, put_html
from engine.search.archive import Cell
from viz.maps import elite_list
from viz.maps.contents import Content
from viz.maps.elite_list import ListedElite

WINDOW = "Elites"
STEP = 0.5
"""Centimetres between two ends of the filter."""


class ElitesPanel:
    """Lists the elites of the generation that the maps show.

    Args:
        gui: of one client.
        bar: of the browser; it gets the window.
    """

    def __init__(self, gui: viser.GuiApi, bar: TopBar) -> None:
        self._bar = bar
        self._elites: Sequence[ListedElite] = ()
        self._chosen: int | None = None
        self._picked: Callable[[str, Cell, int], None] = lambda _archive, _cell, _number: None
        self._filtered: Callable[[float | None], None] = lambda _least: None
        with bar.window(
            WINDOW, viser.Icon.LIST_SEARCH, "All elites as a list: search, filter by f_s", self._draw
        ):
            self._search = gui.add_text(
                "Search",
                "",
                hint="Words of an elite: 6 modules, stiffness 0.3, robot 637, controller 2,5",
            )
            self._least = gui.add_slider(
                "f_s from, cm",
                min=0.0,
                max=1.0,
                step=STEP,
                initial_value=0.0,
                hint="Robots with less are left out of the list and pale in the maps",
            )
            self._list = gui.add_html("")
            self._mark = gui.add_html("")
            self._handler = ClickChannel(gui, self._clicked, label="elites").handler

        @self._search.on_update
        def _(event: viser.GuiEvent) -> None:
            if event.client is not None:
                self._draw()

        @self._least.on_update
        def _(event: viser.GuiEvent) -> None:
            if event.client is not None:
                self._filtered(self.least)
                self._draw()

    def connect(
        self, picked: Callable[[str, Cell, int], None], filtered: Callable[[float | None], None]
    ) -> None:
        """Report the robots that are clicked, by archive, cell and number, and the filter's least f_s."""
        self._picked, self._filtered = picked, filtered

    @property
    def least(self) -> float | None:
        """The least f_s in cm that is wanted; None for any."""
        value = self._least.value
        return None if value <= self._least.min else float(value)

    def show(self, contents: Mapping[str, Content], chosen: int | None, robust: Mapping[int, float]) -> None:
        """List the elites of archives, and mark a robot.

        Args:
            contents: the archives by name.
            chosen: number of the robot; None for none.
            robust: f_s in cm under noise that robots were not selected with, where it is known, by number.
        """
        elites = elite_list.listed(contents, robust)
        if elites:
            all_wanted = self.least is None
            values = [e.elite.f_s for e in elites]
            low, high = math.floor(min(values)), math.ceil(max(values))
            put(self._least, float(low), "min")
            put(self._least, float(max(high, low + 1)), "max")
            if all_wanted or not low <= self._least.value <= high:
                put(self._least, float(low))
        self._elites, self._chosen = elites, chosen
        self._draw()

    def _draw(self) -> None:
        if not self._bar.shows(WINDOW):  # a list is long
            return
        found = elite_list.searched(self._elites, str(self._search.value), self.least)
        put_html(self._list, elite_list.render(found, len(self._elites), self._handler))
        put_html(self._mark, elite_list.mark(self._chosen))

    def _clicked(self, name: str, index: tuple[int, ...]) -> None:
        number = elite_list.clicked_number(name, index)
        found = next((e for e in self._elites if e.elite.number == number), None)
        if found is not None:
            self._picked(*found.places[0], found.elite.number)
