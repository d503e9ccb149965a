"""One browser: its panels and what connects them. Runs belong to the server."""

from __future__ import annotations

import dataclasses
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Final

import viser

from app.gui.actions import Actions
from app.gui.browser_value import PageSize
from app.gui.lanes import Lanes
from app.gui.top_bar import TopBar
from app.gui.viser_private import Gate
from app.maps.archives_panel import ArchivesEvents, ArchivesPanel
from app.maps.elites_panel import ElitesPanel
from app.maps.generation_player import GenerationPlayer
from app.maps.map_board import MapBoard
from app.maps.shared_scale import SharedScale
from app.runs.breed_panel import BreedPanel
from app.runs.compare_panel import ComparePanel
from app.runs.library import Library, RunStatus
from app.runs.run_panel import RunPanel
from app.runs.upload import Uploads
from app.session.chosen_robot import ChosenRobot
from app.session.commands import add_commands, steering_commands, viewing_commands
from app.session.navigation import Navigation
from app.session.preferences import ThemeSwitch
from app.session.software_rendering import tell_of_software_rendering
from app.state import Choice, ShownRun
from engine.errors import InvalidData, TensAtlasError, printable
from engine.search.archive import Cell
from engine.storage.reader import RunReader, changed_versions
from viz.runs.run_list import RunFacts

GIVING_UP: Final = 0.5
"""Seconds between two looks whether growth is still wanted, while its next step waits for its turn."""


class Session:
    """Builds the panels of a client and connects them.

    Args:
        client: the browser.
        library: the runs on offer.
        gate: that checks what the browser sends.
        lanes: of the browser.
        read_only: whether the browser is a visitor's, who may look only.
    """

    def __init__(
        self,
        client: viser.ClientHandle,
        library: Library,
        gate: Gate,
        lanes: Lanes,
        *,
        read_only: bool = False,
    ) -> None:
        self._library = library
        self._run, self._wanted_generation = ShownRun(), 0
        self._choice = choice = Choice()
        told: Callable[[str], str] = library.for_visitors if read_only else str

        def facts(path: Path) -> RunFacts:
            found = library.facts(path)
            return dataclasses.replace(found, problem=found.problem and told(found.problem))

        self._actions = actions = Actions(client, lanes, told)
        guarded = actions.guarded
        page = PageSize(client)
        self._bar = bar = TopBar(client, actions.guarded(self._toggle_theme))
        self._archives = ArchivesPanel(client, facts, page)
        if not read_only:
            Uploads(self._archives.picker.upload, gate, actions, self.open_run)
            self._archives.picker.allow_upload()
        self._elites = ElitesPanel(client.gui, bar)
        self._board = MapBoard(self._archives, actions.notify, SharedScale(library).limits, self._elites)
        self._growth = GenerationPlayer(self._grow, self._archives.show_growth_playing)
        self._navigation = Navigation(client, self._run, choice, library, self._board, actions)
        self._robot = ChosenRobot(
            client,
            page,
            bar,
            self._run,
            choice,
            library,
            self._board,
            actions,
            simulating=lanes.simulating,
            moved=self._moved,
            read_only=read_only,
        )
        self._compare = ComparePanel(
            client,
            bar.window("Compare", viser.Icon.CHART_BAR, "Runs side by side: trends, maps, tests"),
            facts,
            actions,
        )
        self._run_panel = RunPanel(
            client,
            bar,
            actions,
            self._run,
            show=self.open_run,
            replay_dump=self._robot.replay_dump,
            moved=self._run_is_elsewhere,
            read_only=read_only,
        )
        self._breed: BreedPanel | None = None
        if not read_only:
            self._breed = BreedPanel(
                client.gui,
                bar.window("Breed", viser.Icon.HEART, "Children of robots that you like"),
                actions,
                library,
                self._robot.to_breed(),
                show=self.open_run,
                replay=self._replay_child,
                tell=lambda n: bar.tell("Breed", f"{n} marked" if n else ""),
            )
        self._archives.connect(
            ArchivesEvents(
                run_chosen=guarded(self.open_run),
                generation_chosen=self._slide,
                cell_clicked=guarded(self.pick),
                layout_chosen=guarded(self._board.set_layout),
                colors_changed=guarded(self._board.set_colors),
                growth_played=guarded(self._play_growth),
                space_pressed=guarded(self._robot.player.toggle),
            )
        )
        self._elites.connect(guarded(self._robot.choose), guarded(self._board.filter))
        commands = viewing_commands(self, self._robot, actions, self._archives.picker)
        if not read_only:
            commands += steering_commands(self._run_panel, actions)
        add_commands(client.gui, commands)
        self._navigation.begin(self, self._robot)
        self._theme = ThemeSwitch(client.gui)
        self._robot.downloads.begin(client.gui)
        tell_of_software_rendering(client, self._robot.overlay.show_chip)

    def open_next(self) -> None:
        """Show the next run in the list; after the last, the first."""
        paths = self._library.runs()
        if not paths:
            raise InvalidData("There is no run yet; start one under New run.")
        k = paths.index(self._run.path) if self._run.path in paths else -1
        self.open_run(paths[(k + 1) % len(paths)])

    def show_newest(self) -> None:
        """Show the newest generation, and follow the run."""
        if self._run.last is not None:
            self.show_generation(self._run.last.number)

    def cancel(self) -> None:
        """Give up all that a browser has set off which has gone; nothing more begins."""
        self._actions.closed = True
        self._navigation.close()
        self._library.unwatch(self)
        if self._breed is not None:
            self._breed.cancel()
        self._growth.stop()
        self._robot.cancel()

    def close(self) -> None:
        """End the threads of a browser that has gone."""
        self._actions.closed = True
        with self._actions.mutex:  # what was going on may have begun something new
            self.cancel()
        self._robot.close()

    def open_run(self, path: Path) -> None:
        """Show another run.

        Raises:
            RunFileError: it cannot be read.
        """
        reader = self._library.reader(path)
        self._growth.stop()
        self._robot.begin(reader)
        self._board.clear()
        self._run.begin(path, reader)
        if change := reader.task_change:
            self._actions.notify(
                "Another task", f"Note: {change}. Replays may differ from what was evaluated."
            )
        self._offer(path)
        self._archives.show_changes(changed_versions(path))
        status = self._library.status(path)
        self._update(reader, status)
        self._library.watch(self, path, self._run_moved, status)
        if self._breed is not None:
            self._breed.begin(path, reader)
        if not self._navigation.going:
            self.greet()
        self._moved()

    def greet(self) -> None:
        """Show the best robot of the run, if none is shown."""
        if self._run.reader is not None and self._run.last is not None:
            self._robot.greet(self._run.reader.n_evaluations())

    def show_generation(self, number: int) -> None:
        """Show the maps as they were at the end of a generation."""
        reader, last = self._reader(), self._run.last
        if last is None:
            return
        number = min(max(number, 0), last.number)
        self._run.look_at(number)
        self._draw(reader, number)
        self._navigation.update()

    def pick(self, map_name: str, cell: Cell) -> None:
        """Choose the robot that a cell of a map shows and replay it; say so if the cell is empty."""
        picked = self._board.pick(map_name, cell)
        if picked is None:
            return
        if picked.number is None:
            self._actions.notify(
                "Empty cell",
                f"No robot of the {picked.archive} archive has been found for {picked.meaning}.",
            )
            return
        self._robot.choose(picked.archive, picked.cell, picked.number)

    def _replay_child(self, path: Path, number: int) -> None:
        """Replay a robot of a run, elite or not."""
        if path != self._run.path:
            self.open_run(path)
        self._robot.choose("morphology", None, number)

    def open_first(self) -> None:
        """Show the first run that can be shown, or say that there is none."""
        paths = self._library.runs()
        self._offer(None)
        problems = []
        for path in paths:
            try:
                self.open_run(path)
                break
            except TensAtlasError as e:
                problems.append(str(e))
        else:
            self._archives.show_nothing(
                "There is no run to show yet. Start one under “New run” on the right, or run"
                " <code>tensatlas evolve runs/first.tsmr</code>."
            )
        for problem in problems:
            self._actions.notify("A run cannot be shown", problem)

    def _toggle_theme(self) -> None:
        self._theme.toggle()

    def _moved(self) -> None:
        """Let the page's address and its name say what is shown."""
        self._navigation.update()
        run, chosen = self._run.path, self._choice.selection
        what = "" if run is None else printable(run.stem)
        self._bar.name_page(what if chosen is None else f"robot {chosen.number} of {what}")

    def _offer(self, shown: Path | None) -> None:
        paths = self._library.runs()
        self._archives.picker.offer(paths, shown)
        self._compare.offer(paths, shown)

    def _slide(self, number: int) -> None:
        """Show a generation, unless the slider has moved on before this runs."""
        self._growth.stop()
        self._wanted_generation = number

        def show() -> None:
            if self._wanted_generation == number:
                self.show_generation(number)

        self._actions.guarded(show)()

    def _run_is_elsewhere(self, path: Path, new: Path | None) -> None:
        """Show a run at its new place, or another one if it is in the bin."""
        self._library.unwatch(self)
        self._library.forget(path)
        if new is not None:
            self.open_run(new)
        else:
            self.open_first()

    def _run_moved(self, path: Path, status: RunStatus) -> None:
        """Show that a run has advanced; on the library's thread, which waits for no browser."""

        def update() -> None:
            if path != self._run.path:
                return
            reader = self._library.reader(path)
            if reader is not self._run.reader:  # another file has taken its place
                self.open_run(path)
                return
            self._offer(path)
            self._update(reader, status)
            self.greet()  # with its first generation, a new run has a robot to show

        self._actions.put("run moved", update)

    def _update(self, reader: RunReader, status: RunStatus) -> None:
        """Bring everything up to date with a run file."""
        run = self._run
        new = reader.generations(-1 if run.last is None else run.last.number)
        run.add(reader, new)
        budget, last = reader.config.evaluations, run.last
        complete = last is not None and last.n_evaluations >= budget
        self._archives.show_status(reader, last, status.n_evaluations, live=status.live, complete=complete)
        self._run_panel.show_run(
            reader.path,
            reader.config,
            status.n_evaluations,
            run.generations,
            live=status.live,
            slimmed=reader.slimmed,
        )
        self._board.refresh()
        if new and last is not None:
            if run.follow_newest:
                self._draw(reader, last.number)
            elif self._board.generation is not None:
                self._archives.show_trend(run, self._board.generation)

    def _draw(self, reader: RunReader, number: int) -> None:
        generations = self._run.generations
        self._board.show(reader, next(g for g in generations if g.number == number), generations[-1])
        self._archives.show_trend(self._run, number)

    def _play_growth(self) -> None:
        """Run through the generations, or stop that."""
        if self._growth.playing:
            self._growth.stop()
        elif self._board.generation is not None:
            self._growth.play(self._board.generation, lambda: self._run.last.number if self._run.last else 0)

    def _grow(self, number: int) -> bool:
        """Show the next generation while growth is playing; return whether it was shown."""
        shown, done = False, threading.Event()

        def show() -> None:
            nonlocal shown
            try:
                if self._growth.playing:
                    self.show_generation(number)
                    shown = True
            finally:
                done.set()

        self._actions.put("growth", show)
        while not done.wait(GIVING_UP):
            if self._actions.closed or not self._growth.playing:
                return False
        return shown

    def _reader(self) -> RunReader:
        return self._library.shown(self._run.path)
