"""One browser: its selection, its panels, its replay. Runs belong to the server."""

from __future__ import annotations

import dataclasses
import os
from pathlib import Path

import viser

from app import archives_panel, evolution, robot_panel, transport
from app.actions import Actions
from app.arena import Arena
from app.compare_panel import ComparePanel
from app.library import Library, RunStatus
from app.map_board import MapBoard
from app.player import Player
from engine.archive import Cell
from engine.errors import InvalidData, TensAtlasError
from engine.evaluation import Evaluation
from engine.export import export_files
from engine.reader import Generation, RunReader
from engine.records import cell_name
from engine.replay import Playable, Replay
from engine.run import changed_versions
from engine.tasks import get_task
from engine.zip_file import zip_bytes


@dataclasses.dataclass(slots=True)
class Selection:
    """The robot of a clicked cell and the map it was clicked on."""

    archive: str
    evaluation: Evaluation

    @property
    def number(self) -> int:
        """Number of its evaluation."""
        return self.evaluation.solution.number


class Session:
    """Builds the panels of a client and connects them.

    Args:
        client: the browser.
        library: the runs on offer.
    """

    def __init__(self, client: viser.ClientHandle, library: Library) -> None:
        self._client = client
        self._library = library
        self._actions = Actions(client)
        self._mutex, self._guarded = self._actions.mutex, self._actions.guarded
        self._notify = self._actions.notify
        self._path: Path | None = None
        self._generations: list[Generation] = []
        self._follow_newest = True
        self._selection: Selection | None = None
        self._shown_reader: RunReader | None = None
        self._wanted_generation = 0
        self._arena = Arena(client)
        self._player = Player(self._show_frame, self._player_stopped)
        self._archives = archives_panel.ArchivesPanel(
            client,
            library.facts,
            archives_panel.Events(
                run_chosen=self._guarded(self.open_run),
                generation_chosen=self._slide,
                cell_clicked=self._guarded(self.pick),
                layout_chosen=self._guarded(self._set_layout),
                coloring_chosen=self._guarded(self._set_coloring),
            ),
        )
        self._board = MapBoard(self._archives)
        self._compare = ComparePanel(client, self._archives.panel, library.facts, self._actions)
        self._robot = robot_panel.RobotPanel(
            client,
            robot_panel.Events(
                export=self._guarded(self.export, alone=False),
                start=self._guarded(self.start_run, alone=False),
                stop=self._guarded(self.stop_run, alone=False),
                resume=self._guarded(self.resume_run, alone=False),
            ),
        )
        self._transport = transport.TransportPanel(
            client,
            self._player,
            transport.Events(trial_chosen=self._guarded(self.choose_trial), follow_changed=self._set_follow),
            taken=archives_panel.WIDTH + robot_panel.WIDTH,
        )
        self._guarded(self._open_first)()

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
        reader = self._shown_reader = self._library.reader(path)
        self._player.unload()
        self._arena.clear()
        self._robot.show_no_robot()
        self._board.clear()
        self._path, self._selection = path, None
        self._generations, self._follow_newest = [], True
        task = get_task(reader.config.task)
        self._transport.set_trials(task.target_names, reader.config.trials.repeats)
        if change := reader.task_change:
            self._notify("Another task", f"Note: {change}. Replays may differ from what was evaluated.")
        self._offer(path)
        self._archives.show_changes(changed_versions(path))
        status = self._library.status(path)
        self._update(reader, status)
        self._transport.refresh()
        self._library.watch(self, path, self._run_moved, status)

    def show_generation(self, number: int) -> None:
        """Show the maps as they were at the end of a generation."""
        reader = self._reader()
        if not self._generations:
            return
        number = min(max(number, 0), self._generations[-1].number)
        self._follow_newest = number == self._generations[-1].number
        self._draw(reader, number)

    def _slide(self, number: int) -> None:
        """Show a generation unless the slider has moved on by the time that others are done."""
        self._wanted_generation = number

        def show() -> None:
            if self._wanted_generation == number:
                self.show_generation(number)

        self._guarded(show)()

    def pick(self, map_name: str, cell: Cell) -> None:
        """Choose the robot that a cell of a map shows and replay it; say so if the cell is empty."""
        reader = self._reader()
        picked = self._board.pick(map_name, cell)
        if picked is None:
            return
        if picked.number is None:
            self._notify(
                "Empty cell",
                f"No robot of the {picked.archive} archive has been found for {picked.meaning}.",
            )
            return
        self._selection = Selection(picked.archive, reader.evaluation(picked.number))
        self._robot.show_robot(
            reader.config,
            self._selection.evaluation,
            f"{picked.archive} cell {cell_name(picked.cell)}",
            reader.generation_of(picked.number),
        )
        self._board.choose(picked.archive, picked.number)
        self.choose_trial(0, 0)

    def choose_trial(self, target: int, repeat: int) -> None:
        """Replay a trial of the chosen robot."""
        if self._selection is None:
            self._notify("No robot chosen", "Click a filled cell of a map first.")
            return
        replay = Replay(self._reader().config, self._selection.evaluation, target=target, repeat=repeat)
        self._transport.select_trial(target, repeat)
        self._player.load(replay)
        self._transport.refresh()

    def export(self) -> None:
        """Send the chosen robot to the browser as a zip file."""
        with self._mutex:
            if self._selection is None:
                raise InvalidData("Click a filled cell of a map first.")
            reader, number = self._reader(), self._selection.number
        name = f"{reader.path.stem}_robot_{number}"
        files = export_files(reader, number)
        self._client.send_file_download(f"{name}.zip", zip_bytes(files, name), save_immediately=True)

    def start_run(self, new: evolution.NewRun) -> None:
        """Start an evolution and show it."""
        path = evolution.start(new)
        with self._mutex:
            self.open_run(path)
        self._notify("Started", f"{path.name} evolves in a process of its own.")

    def stop_run(self) -> None:
        """Stop the shown run."""
        if self._path is not None:
            evolution.stop(self._path)
            self._notify("Stopping", f"{self._path.name} saves what is finished and stops.")

    def resume_run(self) -> None:
        """Go on with the shown run."""
        reader = self._reader()
        evolution.resume(reader.path, workers=os.cpu_count() or 1)

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
            self._notify("A run cannot be shown", problem)

    def _offer(self, shown: Path | None) -> None:
        paths = self._library.runs()
        self._archives.offer(paths, shown)
        self._compare.offer(paths, shown)

    def _run_moved(self, path: Path, status: RunStatus) -> None:
        def update() -> None:
            if path != self._path:
                return
            reader = self._library.reader(path)
            if reader is not self._shown_reader:  # another file has taken its place
                self.open_run(path)
                return
            self._offer(path)
            self._update(reader, status)

        self._guarded(update)()

    def _update(self, reader: RunReader, status: RunStatus) -> None:
        """Bring everything up to date with a run file."""
        after = self._generations[-1].number if self._generations else -1
        new = reader.generations(after)
        self._generations += new
        budget = reader.config.evaluations
        last = self._generations[-1] if self._generations else None
        progress = {"live": status.live, "complete": last is not None and last.n_evaluations >= budget}
        self._archives.show_status(reader, last, status.n_evaluations, **progress)
        self._robot.show_run(status.n_evaluations, budget, **progress)
        if new and last is not None:
            if self._follow_newest:
                self._draw(reader, last.number)
            elif self._board.generation is not None:
                self._archives.show_trend(self._generations, self._board.generation)

    def _draw(self, reader: RunReader, number: int) -> None:
        self._board.show(reader, next(g for g in self._generations if g.number == number))
        self._archives.show_trend(self._generations, number)

    def _set_layout(self, name: str) -> None:
        self._board.set_layout(name)

    def _set_coloring(self, name: str) -> None:
        self._board.set_coloring(name)

    def _reader(self) -> RunReader:
        if self._path is None:
            raise InvalidData("Choose a run first.")
        return self._library.reader(self._path)

    def _show_frame(self, replay: Playable, index: int) -> None:
        if replay is self._player.replay:
            self._arena.show(replay, index)
            self._transport.tick()

    def _player_stopped(self) -> None:
        self._transport.refresh()

    def _set_follow(self, follow: bool) -> None:
        self._arena.follow = follow
