"""Where one browser is among the runs: comes to the place that its address names, and keeps it up to date."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import Final, Protocol

import viser

from app.gui.actions import Actions
from app.runs.library import Library
from app.session.address import AddressBar, Place, find_run, run_name
from app.session.chosen_robot import ChosenRobot
from app.state import SessionState
from engine.errors import InvalidData, TensAtlasError
from engine.search.archive import Cell, cell_name

PATIENCE: Final = 4.0
"""Seconds that a browser has to say what it came for."""


class Traveller(Protocol):
    """What can be sent somewhere: a session."""

    def open_run(self, path: Path) -> None:
        """Show a run."""
        ...

    def open_first(self) -> None:
        """Show the first run that can be shown, or say that there is none."""
        ...

    def show_generation(self, number: int) -> None:
        """Show the maps as they were."""
        ...

    def holder(self, archive: str, cell: Cell) -> int | None:
        """Return the number of the evaluation that a cell of an archive holds."""
        ...


class Navigation:
    """Sends a session to the place of its browser's address once that is known.

    Args:
        client: the browser.
        traveller: the session.
        robot: where a robot is chosen.
        state: of the session.
        library: the runs on offer.
        actions: of the browser.
    """

    def __init__(
        self,
        client: viser.ClientHandle,
        traveller: Traveller,
        robot: ChosenRobot,
        state: SessionState,
        library: Library,
        actions: Actions,
    ) -> None:
        self._traveller, self._robot, self._state, self._library = traveller, robot, state, library
        self._gui, self._actions = client.gui, actions
        self._arrived = False
        self._bar: AddressBar | None = None
        # a program that is no browser never says where it came for
        self._impatience = threading.Timer(PATIENCE, actions.guarded(self._arrive), [Place()])
        self._impatience.daemon = True

    def begin(self) -> None:
        """Ask the browser what it came for; the session is ready to go there."""
        self._bar = AddressBar(self._gui, self._actions.guarded(self._arrive))
        self._impatience.start()

    def close(self) -> None:
        """Wait for nobody any more."""
        self._impatience.cancel()

    def update(self, generation: int | None) -> None:
        """Bring the address up to date.

        Args:
            generation: that the maps show, None if they show none.
        """
        state = self._state
        if state.path is None or self._bar is None:
            return
        chosen = state.selection
        self._bar.show(
            Place(
                run=run_name(state.path, self._library.runs()),
                archive=None if chosen is None else chosen.archive,
                cell=None if chosen is None else chosen.own_cell,
                robot=None if chosen is None else chosen.number,
                generation=None if state.follow_newest else generation,
                trial=state.trial,
            )
        )

    def _arrive(self, place: Place) -> None:
        """Go where the browser came for, or to the first run; what cannot be found is said.

        Raises:
            TensAtlasError: the run cannot be shown, or there is nothing where the address points.
        """
        fresh, self._arrived = not self._arrived, True
        self._impatience.cancel()
        path = None if place.run is None else find_run(place.run, self._library.runs())
        if path is None:
            if place.run is not None:
                self._actions.notify(
                    "No such run",
                    f"There is no run {place.run[:80]!r} here; choose one from the list.",
                    stays=True,
                )
            if fresh:
                self._traveller.open_first()
            return
        try:
            self._traveller.open_run(path)
        except TensAtlasError:
            self._traveller.open_first()
            raise
        if place.generation is not None:
            self._traveller.show_generation(place.generation)
        archive, number = place.archive or "morphology", place.robot
        if number is None and place.cell is not None:
            number = self._traveller.holder(archive, place.cell)
            if number is None:
                raise InvalidData(
                    f"Cell {cell_name(place.cell)} of the {archive} archive is empty; click a filled one."
                )
        if number is not None:
            self._robot.choose(archive, place.cell, number, place.trial)
