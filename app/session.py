"""One browser: its panels and what connects them. Runs belong to the server."""

from __future__ import annotations

from pathlib import Path

import viser

from app import archives_panel, robot_panel, transport
from app.actions import Actions
from app.arena import Arena
from app.compare_panel import ComparePanel
from app.library import Library, RunStatus
from app.map_board import MapBoard
from app.player import Player
from app.robot_folder import folder_name, robot_folder
from app.run_panel import RunPanel
from app.state import Selection, SessionState
from engine.archive import Cell
from engine.errors import InvalidData, TensAtlasError
from engine.fabrication.materials import load_materials
from engine.reader import RunReader
from engine.records import cell_name, parse_cell
from engine.replay import Playable, Replay
from engine.run import changed_versions
from engine.tasks import get_task
from engine.zip_file import zip_bytes
from viz.build_sheet.facts import Place


class Session:
    """Builds the panels of a client and connects them.

    Args:
        client: the browser.
        library: the runs on offer.
    """

    def __init__(self, client: viser.ClientHandle, library: Library) -> None:
        self._client = client
        self._library = library
        self._state = SessionState()
        self._actions = Actions(client)
        self._mutex, guarded = self._actions.mutex, self._actions.guarded
        self._arena = Arena(client)
        self._player = Player(self._show_frame, self._player_stopped)
        self._archives = archives_panel.ArchivesPanel(
            client,
            library.facts,
            archives_panel.Events(
                run_chosen=guarded(self.open_run),
                generation_chosen=self._slide,
                cell_clicked=guarded(self.pick),
                layout_chosen=guarded(self._set_layout),
                coloring_chosen=guarded(self._set_coloring),
            ),
        )
        self._board = MapBoard(self._archives)
        self._compare = ComparePanel(client, self._archives.panel, library.facts, self._actions)
        self._robot = robot_panel.RobotPanel(
            client, robot_panel.Events(export=guarded(self.export, alone=False))
        )
        self._run = RunPanel(client, self._actions, shown=lambda: self._state.path, show=self.open_run)
        self._transport = transport.TransportPanel(
            client,
            self._player,
            transport.Events(trial_chosen=guarded(self.choose_trial), follow_changed=self._set_follow),
            taken=archives_panel.WIDTH + robot_panel.WIDTH,
        )
        guarded(self._open_first)()

    def close(self) -> None:
        """End the threads of a browser that has gone."""
        with self._mutex:
            self._actions.closed = True
            self._library.unwatch(self)
            self._player.close()

    def open_run(self, path: Path) -> None:
        """Show another run.

        Raises:
            RunFileError: it cannot be read.
        """
        reader = self._library.reader(path)
        self._player.unload()
        self._arena.clear()
        self._robot.show_no_robot()
        self._board.clear()
        self._state.begin(path, reader)
        task = get_task(reader.config.task)
        self._transport.set_trials(task.target_names, reader.config.trials.repeats)
        if change := reader.task_change:
            self._actions.notify(
                "Another task", f"Note: {change}. Replays may differ from what was evaluated."
            )
        self._offer(path)
        self._archives.show_changes(changed_versions(path))
        status = self._library.status(path)
        self._update(reader, status)
        self._transport.refresh()
        self._library.watch(self, path, self._run_moved, status)

    def show_generation(self, number: int) -> None:
        """Show the maps as they were at the end of a generation."""
        reader, last = self._reader(), self._state.last
        if last is None:
            return
        number = min(max(number, 0), last.number)
        self._state.follow_newest = number == last.number
        self._draw(reader, number)

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
        self.choose(picked.archive, picked.cell, picked.number)

    def choose(self, archive: str, cell: Cell, number: int) -> None:
        """Choose the robot of an evaluation, which a cell of an archive holds, and replay it.

        Raises:
            RunFileError: the run has no such evaluation.
        """
        reader = self._reader()
        chosen = self._state.selection = Selection(
            archive, cell_name(cell), reader.evaluation(number), reader.generation_of(number)
        )
        self._robot.show_robot(
            reader.config, chosen.evaluation, f"{archive} cell {chosen.cell}", chosen.entered
        )
        self._board.choose(archive, number)
        self.choose_trial(0, 0)

    def choose_trial(self, target: int, repeat: int) -> None:
        """Replay a trial of the chosen robot."""
        chosen = self._state.selection
        if chosen is None:
            self._actions.notify("No robot chosen", "Click a filled cell of a map first.")
            return
        replay = Replay(self._reader().config, chosen.evaluation, target=target, repeat=repeat)
        self._state.target, self._state.repeat = target, repeat
        self._transport.select_trial(target, repeat)
        self._player.load(replay)
        self._transport.refresh()

    def export(self) -> None:
        """Send the chosen robot to the browser as a zip file."""
        with self._mutex:
            if self._state.selection is None:
                raise InvalidData("Click a filled cell of a map first.")
            reader, selection = self._reader(), self._state.selection
        name = folder_name(reader, selection.number)
        place = Place(archive=selection.archive, cell=parse_cell(selection.cell))
        files = robot_folder(reader, selection.number, materials=load_materials(), place=place)
        self._client.send_file_download(f"{name}.zip", zip_bytes(files, name), save_immediately=True)

    def _open_first(self) -> None:
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

    def _offer(self, shown: Path | None) -> None:
        paths = self._library.runs()
        self._archives.offer(paths, shown)
        self._compare.offer(paths, shown)

    def _slide(self, number: int) -> None:
        """Show a generation unless the slider has moved on by the time that others are done."""
        self._state.wanted_generation = number

        def show() -> None:
            if self._state.wanted_generation == number:
                self.show_generation(number)

        self._actions.guarded(show)()

    def _run_moved(self, path: Path, status: RunStatus) -> None:
        def update() -> None:
            if path != self._state.path:
                return
            reader = self._library.reader(path)
            if reader is not self._state.reader:  # another file has taken its place
                self.open_run(path)
                return
            self._offer(path)
            self._update(reader, status)

        self._actions.guarded(update)()

    def _update(self, reader: RunReader, status: RunStatus) -> None:
        """Bring everything up to date with a run file."""
        state = self._state
        new = reader.generations(-1 if state.last is None else state.last.number)
        state.generations += new
        budget, last = reader.config.evaluations, state.last
        complete = last is not None and last.n_evaluations >= budget
        self._archives.show_status(reader, last, status.n_evaluations, live=status.live, complete=complete)
        self._run.show_run(status.n_evaluations, budget, live=status.live, complete=complete)
        if new and last is not None:
            if state.follow_newest:
                self._draw(reader, last.number)
            elif self._board.generation is not None:
                self._archives.show_trend(state.generations, self._board.generation)

    def _draw(self, reader: RunReader, number: int) -> None:
        generations = self._state.generations
        self._board.show(reader, next(g for g in generations if g.number == number))
        self._archives.show_trend(generations, number)

    def _set_layout(self, name: str) -> None:
        self._board.set_layout(name)

    def _set_coloring(self, name: str) -> None:
        self._board.set_coloring(name)

    def _reader(self) -> RunReader:
        if self._state.path is None:
            raise InvalidData("Choose a run first.")
        return self._library.reader(self._state.path)

    def _show_frame(self, replay: Playable, index: int) -> None:
        if replay is self._player.replay:
            self._arena.show(replay, index)
            self._transport.tick()

    def _player_stopped(self) -> None:
        self._transport.refresh()

    def _set_follow(self, follow: bool) -> None:
        self._arena.follow = follow
