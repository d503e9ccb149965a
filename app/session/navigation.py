"""Where one browser is among the runs: comes to the place that its address names, and keeps it up to date."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import Final, Protocol

import viser

from app.gui.actions import Actions
from app.maps.map_board import MapBoard
from app.runs.library import Library
from app.runs.run_names import find_run, run_name
from app.session.address import Address, AddressBar
from app.session.chosen_robot import ChosenRobot
from app.state import Choice, ShownRun
from engine.errors import InvalidData, TensAtlasError
from engine.replay.trial import FIRST_TRIAL
from engine.search.archive import cell_name

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

    def greet(self) -> None:
        """Show the best robot of the run, if none is shown."""
        ...


class Navigation:
    """Sends a session to the place of its browser's address once that is known, and keeps the address true.

    Args:
        client: the browser.
        run: that is shown.
        choice: the chosen robot and its trial.
        library: the runs on offer.
        board: the maps.
        actions: of the browser.
    """

    def __init__(
        self,
        client: viser.ClientHandle,
        run: ShownRun,
        choice: Choice,
        library: Library,
        board: MapBoard,
        actions: Actions,
    ) -> None:
        self._run, self._choice, self._library, self._board = run, choice, library, board
        self._gui, self._actions = client.gui, actions
        self._arrived = self._going = False
        self._bar: AddressBar | None = None
        self._impatience: threading.Timer | None = None

    def begin(self, traveller: Traveller, robot: ChosenRobot) -> None:
        """Ask the browser what it came for.

        Args:
            traveller: the session, ready to go there.
            robot: where a robot is chosen.
        """

        def arrive(address: Address) -> None:
            self._actions.put("arrive", lambda: go(address))

        def go(address: Address) -> None:
            try:
                self._arrive(traveller, robot, address)
            finally:  # a slow browser says so late, and what it names ends what else is shown
                robot.arrived(self._gui)

        def begin_anyway() -> None:
            if not self._arrived:
                self._arrive(traveller, robot, Address())

        # a program that is no browser never says what it wants to see
        self._impatience = threading.Timer(PATIENCE, self._actions.put, ["begin anyway", begin_anyway])
        self._impatience.daemon = True
        self._bar = AddressBar(self._gui, arrive)
        self._impatience.start()

    def close(self) -> None:
        """Wait for nobody any more."""
        if self._impatience is not None:
            self._impatience.cancel()

    @property
    def going(self) -> bool:
        """Whether the session is on its way to what an address asks for."""
        return self._going

    def update(self) -> None:
        """Bring the address up to date; on the way to what it asks for, leave it as it is.

        A page that is loaded again in the meantime then asks for the same.
        """
        run, chosen = self._run, self._choice.wanted
        if run.path is None or self._bar is None or self._going:
            return
        self._bar.show(
            Address(
                run=run_name(run.path, self._library.runs()),
                archive=None if chosen is None else chosen.archive,
                cell=None if chosen is None else chosen.own_cell,
                robot=None if chosen is None else chosen.number,
                generation=None if run.follow_newest else self._board.generation,
                trial=FIRST_TRIAL if chosen is None else self._choice.trial,
            )
        )

    def _arrive(self, traveller: Traveller, robot: ChosenRobot, address: Address) -> None:
        """Go where the browser came for, or to the first run; what cannot be found is said.

        Raises:
            TensAtlasError: the run cannot be shown, or there is nothing where the address points.
        """
        self._going = True
        try:
            self._go(traveller, robot, address)
        finally:
            self._going = False
            traveller.greet()
            self.update()

    def _go(self, traveller: Traveller, robot: ChosenRobot, address: Address) -> None:
        fresh, self._arrived = not self._arrived, True
        self.close()
        path = None if address.run is None else find_run(address.run, self._library.runs())
        if path is None:
            if address.run is not None:
                self._actions.notify(
                    "No such run",
                    f"There is no run {address.run[:80]!r} here; choose one from the list.",
                    stays=True,
                )
            if fresh:
                traveller.open_first()
            return
        try:
            traveller.open_run(path)
        except TensAtlasError:
            traveller.open_first()
            raise
        if address.generation is not None:
            traveller.show_generation(address.generation)
        archive, number = address.archive or "morphology", address.robot
        if number is None and address.cell is not None:
            number = self._board.holder(archive, address.cell)
            if number is None:
                raise InvalidData(
                    f"Cell {cell_name(address.cell)} of the {archive} archive is empty; click a filled one."
                )
        if number is not None:
            robot.choose(archive, address.cell, number, address.trial)
