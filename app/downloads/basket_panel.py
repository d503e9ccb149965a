"""The downloads of a browser: files of the shown replay, the run's table, a basket of chosen robots."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from typing import Final

import viser

from app.downloads.basket import PAPERS, BasketItem, ExportChoice
from app.gui.click_channel import ClickChannel
from app.gui.top_bar import TopBar
from app.gui.widgets import ignoring_event, in_a_row, put_html
from engine.errors import printable
from engine.fabrication.materials import PRESETS
from viz.runs import basket_list

WINDOW: Final = "Take along"
RECORDINGS: Final = {"Page": "html", "Picture": "png", "Video": "mp4"}
"""Label of each button: kind of recording."""


@dataclasses.dataclass(frozen=True, slots=True)
class BasketEvents:
    """What the panel reports."""

    record: Callable[[str], None]
    table: Callable[[], None]
    atlas: Callable[[], None]
    add: Callable[[], None]
    remove: Callable[[int], None]
    clear: Callable[[], None]
    download: Callable[[], None]


class BasketPanel:
    """The window "Take along".

    Args:
        client: the browser.
        bar: of the browser; it gets the window.
        events: what the user does.
    """

    def __init__(self, client: viser.ClientHandle, bar: TopBar, events: BasketEvents) -> None:
        gui, self._bar = client.gui, bar
        with bar.window(WINDOW, viser.Icon.BASKET, "Files of robots, of the replay and of the run"):
            self.exports = ExportChooser(gui)
            self._add = gui.add_button(
                "Add to basket", icon=viser.Icon.BASKET, disabled=True, hint="Keep the chosen robot"
            )
            self._add.on_click(ignoring_event(events.add))
            handler = ClickChannel(
                gui, lambda name, at: self._clicked(name, at, events), label="basket clicks"
            ).handler
            self._handler = handler
            self._list = gui.add_html("")
            self._download = gui.add_button(
                "Download basket",
                color="gray",
                icon=viser.Icon.DOWNLOAD,
                hint="The exports of all robots in the basket as one zip",
            )
            self._download.on_click(ignoring_event(events.download))
            self._clear = gui.add_button(
                "Clear basket", color="gray", icon=viser.Icon.TRASH, hint="Take all robots out"
            )
            self._clear.on_click(ignoring_event(events.clear))
            self._recordings = gui.add_button_group(
                "Replay as",
                tuple(RECORDINGS),
                visible=False,
                hint="The trial that is shown: one HTML file that plays without a server, this moment as"
                " a PNG, or an MP4 of 1280 x 720, which takes about half a minute",
            )

            @self._recordings.on_click
            def _(event: viser.GuiEvent) -> None:
                if event.target.value in RECORDINGS:
                    events.record(RECORDINGS[event.target.value])

            self._table = gui.add_button(
                "Table of this run",
                color="gray",
                icon=viser.Icon.TABLE,
                hint="All elites of the run as CSV, with pyribs' column names",
            )
            self._table.on_click(ignoring_event(events.table))
            self._atlas = gui.add_button(
                "Atlas of this run",
                color="gray",
                icon=viser.Icon.MAP,
                hint="The maps and every elite crawling, as one HTML file that opens without a"
                " server; it takes a minute or two",
            )
            self._atlas.on_click(ignoring_event(events.atlas))
        self.show_basket(())

    def allow_robot(self, chosen: bool) -> None:
        """Enable the downloads, or disable them, because no robot is chosen."""
        self._add.disabled = not chosen
        # viser cannot disable a group of buttons
        self._recordings.visible = chosen

    def show_basket(self, basket: Sequence[BasketItem]) -> None:
        """List the robots in the basket."""
        rows = [(printable(i.path.stem), i.number, i.modules, i.f_s) for i in basket]
        put_html(self._list, basket_list.render(rows, self._handler))
        self._download.visible = self._clear.visible = bool(basket)
        self._download.label = f"Download basket ({len(basket)})"
        self._bar.tell(WINDOW, str(len(basket) or ""))

    def _clicked(self, name: str, at: tuple[int, ...], events: BasketEvents) -> None:
        if name == basket_list.REMOVE and len(at) == 1:
            events.remove(at[0])


class ExportChooser:
    """Asks for the paper and the material of exports: two lists in a row.

    Args:
        gui: of one browser, at the place where the lists go.
    """

    def __init__(self, gui: viser.GuiApi) -> None:
        self._paper = gui.add_dropdown(
            "Paper", tuple(PAPERS), hint="Paper that the build sheets of exports are printed on"
        )
        self._material = gui.add_dropdown(
            "Material", PRESETS, hint="What exported robots are built from; docs/fabrication.md has more"
        )
        gui.add_html(in_a_row((self._paper, 38), (self._material, 62), labelled=1))

    def on_material(self, changed: Callable[[], None]) -> None:
        """Call a function whenever the user chooses another material."""
        self._material.on_update(ignoring_event(changed))

    @property
    def material(self) -> object:
        """The chosen material, as the browser has sent it."""
        return self._material.value

    @property
    def choice(self) -> ExportChoice:
        """What is chosen.

        Raises:
            InvalidData: the browser has sent a choice that is not on offer.
        """
        return ExportChoice.of(self._paper.value, self._material.value)
