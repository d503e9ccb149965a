"""What the window of a run offers besides progress: configuration, another like it, name, note, bin."""

from __future__ import annotations

import dataclasses
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Final

import viser

from app.gui.actions import Actions
from app.gui.widgets import ignoring_event, put, put_html
from app.runs import run_files, run_notes
from engine.config import RunConfig
from engine.errors import InvalidData, printable
from viz.runs import run_configuration

SURE: Final = 8.0
"""Seconds within which a run that is to be deleted must be confirmed."""


@dataclasses.dataclass(frozen=True, slots=True)
class CareEvents:
    """What is asked for.

    Attributes:
        another: a form for another run with this configuration, beside a run of this name.
        moved: the run is elsewhere now, from here to there; None for the bin.
    """

    another: Callable[[RunConfig, str], None]
    moved: Callable[[Path, Path | None], None]


class RunCare:
    """Takes care of the run that is shown.

    Args:
        gui: of one client, inside the window.
        actions: of the browser.
        events: whom it reports to.
        read_only: whether the configuration is all that may be seen.
    """

    def __init__(self, gui: viser.GuiApi, actions: Actions, events: CareEvents, *, read_only: bool) -> None:
        self._actions, self._events, self._read_only = actions, events, read_only
        self._path: Path | None = None
        self._config: RunConfig | None = None
        self._sure: threading.Timer | None = None
        self._configuration = gui.add_html("")
        if read_only:
            return
        self._another = gui.add_button(
            "Start another like this",
            icon=viser.Icon.COPY,
            color="gray",
            hint="Fill the form of a new run with this configuration and the next seed",
        )
        self._name = gui.add_text("Name", "", hint="The run's file is named so, and all that belongs to it")
        self._rename = gui.add_button(
            "Rename", icon=viser.Icon.PENCIL, color="gray", hint="Give the run the name above"
        )
        self._note = gui.add_text(
            "Note",
            "",
            multiline=True,
            hint="Yours to write; kept beside the run, found by the search",
        )
        self._keep = gui.add_button("Keep note", icon=viser.Icon.NOTE, color="gray", hint="Save the note")
        self._delete = gui.add_button(
            "Delete", icon=viser.Icon.TRASH, color="gray", hint="Move the run to the folder bin beside it"
        )
        self._another.on_click(ignoring_event(actions.guarded(self._start_another)))
        self._rename.on_click(ignoring_event(actions.guarded(self._give_name)))
        self._keep.on_click(ignoring_event(actions.guarded(self._keep_note)))
        self._delete.on_click(ignoring_event(actions.guarded(self._ask_or_delete)))

    def show(self, path: Path, config: RunConfig) -> None:
        """Take care of a run; what is being typed about it stays."""
        put_html(self._configuration, run_configuration.render(config))
        if path == self._path and config == self._config:
            return
        self._path, self._config = path, config
        if not self._read_only:
            self._calm()
            put(self._name, printable(path.stem))
            put(self._note, run_notes.note_of(path))

    def _shown(self) -> tuple[Path, RunConfig]:
        if self._path is None or self._config is None:
            raise InvalidData("Choose a run first.")
        return self._path, self._config

    def _start_another(self) -> None:
        path, config = self._shown()
        self._events.another(config, path.stem)

    def _give_name(self) -> None:
        path, _ = self._shown()
        new = run_files.rename(path, str(self._name.value))
        self._events.moved(path, new)
        self._actions.notify("Renamed", f"{printable(path.name)} is {printable(new.name)} now.")

    def _keep_note(self) -> None:
        path, _ = self._shown()
        run_notes.keep_note(path, str(self._note.value))
        self._actions.notify("Kept", f"The note lies beside {printable(path.name)}.")

    def _ask_or_delete(self) -> None:
        path, _ = self._shown()
        if self._sure is None:
            self._delete.label = f"Really delete {printable(path.stem)[:30]}?"
            self._delete.color = "red"
            self._sure = threading.Timer(SURE, self._calm)
            self._sure.daemon = True
            self._sure.start()
            return
        self._calm()
        place = run_files.to_bin(path)
        self._events.moved(path, None)
        self._actions.notify("Deleted", f"{printable(path.name)} is in {printable(str(place.parent))} now.")

    def _calm(self) -> None:
        """Ask again before anything is deleted."""
        if self._sure is not None:
            self._sure.cancel()
        self._sure = None
        if self._delete.label != "Delete":
            self._delete.label, self._delete.color = "Delete", "gray"
