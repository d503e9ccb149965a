"""The list of runs of one browser: folded to the chosen one, unfolded to all with what each is."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import viser

from app.gui.click_channel import ClickChannel
from app.gui.viser_private import selector
from app.gui.widgets import in_a_row, put, put_html
from app.runs.run_names import label_paths
from viz.runs import run_list
from viz.runs.run_list import SORTS, RunFacts


class RunPicker:
    """Lets a run be chosen.

    Args:
        gui: of one client, inside the panel that it belongs to.
        facts: what is known of a run.
    """

    def __init__(self, gui: viser.GuiApi, facts: Callable[[Path], RunFacts]) -> None:
        self._facts = facts
        self._report: Callable[[Path], None] = lambda _path: None
        self._labels: dict[str, Path] = {}
        self._listed: tuple[Path, ...] | None = None
        self._offered: tuple[Path, ...] = ()
        self._chosen: Path | None = None
        self._head = gui.add_html("")
        self._search = gui.add_text(
            "Search", "", visible=False, hint="Words of a name, task, algorithm, date, state or note"
        )
        self._order = gui.add_dropdown(
            "Sort by", SORTS, visible=False, hint="The order of the runs in the list"
        )
        gui.add_html(in_a_row((self._search, 58), (self._order, 42), labelled=1))
        self._list = gui.add_html("")
        self.upload = gui.add_upload_button(
            "Upload a run",
            icon=viser.Icon.UPLOAD,
            color="gray",
            mime_type=".tsmr",
            hint="Bring a run file, *.tsmr, from your machine; it is checked and kept in runs/uploads",
        )
        """Brings run files; shown with the list once ``allow_upload`` was called."""
        self._may_upload = False
        # the browser calls every file that has come an uploaded one; whether it is a run is ours to say
        gui.add_html('<style>[id^="upload-"][data-ta-in~="closable"]{display:none}</style>')
        # viser shows an upload button whatever its ``visible`` says
        self._hide_upload = f"<style>{selector(self.upload)}{{display:none}}</style>"
        self._upload_style = gui.add_html(self._hide_upload)
        self._handler = ClickChannel(gui, self._clicked, label="run clicks").handler
        self._show_head()
        for widget in (self._search, self._order):
            widget.on_update(lambda event: self._show_list() if event.client is not None else None)

    def on_choose(self, chosen: Callable[[Path], None]) -> None:
        """Call a function with every run that the user chooses."""
        self._report = chosen

    def offer(self, paths: Sequence[Path], chosen: Path | None) -> None:
        """Offer runs; an unfolded list stays as it is unless there are others, so that it holds still."""
        self._labels = label_paths(paths)
        self._chosen = chosen
        self._show_head()
        if self._listed is not None and self._offered != tuple(paths):
            self._show_list()

    def allow_upload(self) -> None:
        """Offer to bring run files below the list."""
        self._may_upload = True
        self._show_upload(self._listed is not None)

    def show_list(self) -> None:
        """Unfold the list."""
        self._show_list()
        self._show_head()

    def _clicked(self, name: str, index: tuple[int, ...]) -> None:
        if name == "runs":
            if self._listed is None:
                self._show_list()
            else:
                self._fold()
            self._show_head()
        elif name == "run" and self._listed is not None and index[0] < len(self._listed):
            path = self._listed[index[0]]
            self._fold()
            self._show_head()
            self._report(path)

    def _show_head(self) -> None:
        label = next((label for label, path in self._labels.items() if path == self._chosen), "")
        content = run_list.render_chosen(label, len(self._labels), self._listed is not None, self._handler)
        put_html(self._head, content)

    def _show_list(self) -> None:
        if self._listed is None:
            put(self._search, "")
        runs = [(label, self._facts(path)) for label, path in self._labels.items()]
        runs = run_list.arranged(runs, str(self._search.value), str(self._order.value))
        self._offered, self._listed = tuple(self._labels.values()), tuple(self._labels[r[0]] for r in runs)
        index = self._listed.index(self._chosen) if self._chosen in self._listed else None
        put_html(self._list, run_list.render_list(runs, index, self._handler))
        self._show_upload(True)
        self._show_search(True)

    def _fold(self) -> None:
        self._listed = None
        put_html(self._list, "")
        self._show_upload(False)
        self._show_search(False)

    def _show_search(self, shown: bool) -> None:
        put(self._search, shown, "visible")
        put(self._order, shown, "visible")

    def _show_upload(self, shown: bool) -> None:
        put_html(self._upload_style, "" if shown and self._may_upload else self._hide_upload)
