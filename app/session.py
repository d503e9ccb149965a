"""One browser: its panels and what connects them. Runs belong to the server."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import viser

from app import archives_panel, robot_panel, transport
from app.actions import Actions
from app.arena import Arena
from app.color_controls import ColorWish
from app.compare_panel import ComparePanel
from app.generation_player import GenerationPlayer
from app.library import Library, RunStatus
from app.limits import VISITOR_SECONDS, SimulationBudget
from app.map_board import MapBoard
from app.marks import Marks
from app.navigation import Navigation
from app.palette import add_commands
from app.player import Player
from app.robot_folder import folder_name, robot_folder
from app.run_panel import RunPanel
from app.session_commands import steering_commands, viewing_commands
from app.shared_scale import SharedScale
from app.stage import Stage
from app.state import Selection, SessionState
from app.takeaway import Takeaway
from app.upload import Uploads
from app.viser_private import Gate
from engine.archive import Cell
from engine.dump import read_dump
from engine.dump_replay import DumpReplay
from engine.errors import InvalidData, TensAtlasError
from engine.fabrication.materials import load_materials
from engine.reader import RunReader
from engine.records import cell_name
from engine.replay import Frame, Playable, Replay
from engine.run import changed_versions
from engine.tasks import get_task
from engine.zip_file import zip_bytes
from viz.build_sheet.facts import Place
from viz.robot_differences import Entry


class Session:
    """Builds the panels of a client and connects them.

    Args:
        client: the browser.
        library: the runs on offer.
        gate: that checks what the browser sends.
        read_only: whether the browser is a visitor's, who may look only.
    """

    def __init__(
        self, client: viser.ClientHandle, library: Library, *, gate: Gate, read_only: bool = False
    ) -> None:
        self._client = client
        self._library = library
        self._state = SessionState()
        self._actions = Actions(client)
        self._mutex, guarded = self._actions.mutex, self._actions.guarded
        self._arena = Arena(client)
        self._budget = SimulationBudget(VISITOR_SECONDS if read_only else None)
        self._player = Player(self._show_frame, self._player_stopped, self._may_simulate)
        self._archives = archives_panel.ArchivesPanel(
            client,
            library.facts,
            archives_panel.Events(
                run_chosen=guarded(self.open_run),
                generation_chosen=self._slide,
                cell_clicked=guarded(self.pick),
                layout_chosen=guarded(self._set_layout),
                colors_changed=guarded(self._set_colors),
                growth_played=guarded(self._play_growth),
                space_pressed=guarded(self.toggle_replay),
            ),
        )
        if not read_only:
            Uploads(self._archives.picker.upload, gate, self._actions, self.open_run)
            self._archives.picker.allow_upload()
        self._board = MapBoard(self._archives, self._actions.notify, SharedScale(library).limits)
        self._growth = GenerationPlayer(self._grow, self._archives.show_growth_playing)
        self._compare = ComparePanel(client, self._archives.panel, library.facts, self._actions)
        self._robot = robot_panel.RobotPanel(
            client,
            robot_panel.Events(
                export=guarded(self.export, alone=False),
                ancestor_chosen=guarded(self.choose_ancestor),
                pin=guarded(lambda: self._stage.pin()),
            ),
        )
        self._takeaway = Takeaway(
            client,
            self._state,
            library,
            self._actions,
            budget=self._budget,
            moment=lambda: self._player.time,
        )
        self._stage = Stage(
            client,
            self._arena,
            self._robot.tabs,
            self._actions,
            play=self._play_again,
            may_simulate=self._may_simulate,
        )
        self._run = RunPanel(
            client,
            self._actions,
            shown=lambda: self._state.path,
            show=self.open_run,
            replay_dump=self.replay_dump,
            read_only=read_only,
        )
        self._transport = transport.TransportPanel(
            client,
            self._player,
            transport.Events(
                trial_chosen=guarded(self.choose_trial),
                follow_changed=self._set_follow,
                marks_changed=self._set_marks,
            ),
            taken=archives_panel.WIDTH + robot_panel.WIDTH,
        )
        commands = viewing_commands(self, self._actions, self._archives.picker, self._takeaway)
        if not read_only:
            commands += steering_commands(self._run, self._actions)
        add_commands(client.gui, commands)
        self._navigation = Navigation(client, self, self._state, library, self._actions)
        self._navigation.begin()

    def open_next(self) -> None:
        """Show the run below the shown one in the list, after the last the first."""
        paths = self._library.runs()
        if not paths:
            raise InvalidData("There is no run yet; start one under New run.")
        k = paths.index(self._state.path) if self._state.path in paths else -1
        self.open_run(paths[(k + 1) % len(paths)])

    def show_newest(self) -> None:
        """Show the maps as they are, and follow the run."""
        if self._state.last is not None:
            self.show_generation(self._state.last.number)

    def replay_again(self) -> None:
        """Play the replay from its start.

        Raises:
            InvalidData: there is none.
        """
        if self._player.replay is None:
            raise InvalidData("Click a filled cell of a map first.")
        self._player.seek(self._player.replay.start_time)
        self._player.play()
        self._transport.refresh()

    def close(self) -> None:
        """End the threads of a browser that has gone."""
        with self._mutex:
            self._actions.closed = True
            self._navigation.close()
            self._library.unwatch(self)
            self._growth.stop()
            self._takeaway.close()
            self._stage.close()
            self._player.close()

    def open_run(self, path: Path) -> None:
        """Show another run.

        Raises:
            RunFileError: it cannot be read.
        """
        reader = self._library.reader(path)
        self._growth.stop()
        self._player.unload()
        self._stage.clear()
        self._robot.show_no_robot()
        self._takeaway.panel.allow_robot(False)
        self._stage.choose(None)
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
        self._navigation.update(self._board.generation)

    def show_generation(self, number: int) -> None:
        """Show the maps as they were at the end of a generation."""
        reader, last = self._reader(), self._state.last
        if last is None:
            return
        number = min(max(number, 0), last.number)
        self._state.follow_newest = number == last.number
        self._draw(reader, number)
        self._navigation.update(self._board.generation)

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

    def choose(
        self,
        archive: str,
        cell: Cell | None,
        number: int,
        *,
        target: int = 0,
        repeat: int = 0,
        fresh: int = 0,
    ) -> None:
        """Choose the robot of an evaluation and replay a trial of it.

        Args:
            archive: it was chosen in.
            cell: of the archive that holds it, None if none does.
            number: of the evaluation.
            target: of the trial.
            repeat: of the trial.
            fresh: number of fresh noise, 0 for the evaluated one.

        Raises:
            RunFileError: the run has no such evaluation.
            InvalidData: it was never tried so.
        """
        reader = self._reader()
        self._state.selection = Selection(
            archive,
            cell,
            reader.evaluation(number),
            reader.generation_of(number),
            tuple(reader.lineage(number)),
        )
        self._show_chosen(target, repeat, fresh)

    def choose_ancestor(self, number: int) -> None:
        """Choose a robot from the lineage of the one that was clicked, and replay it, elite or not.

        Raises:
            RunFileError: the run has no such evaluation.
        """
        if (origin := self._state.selection) is None:
            return
        reader = self._reader()
        self._state.selection = dataclasses.replace(
            origin, evaluation=reader.evaluation(number), entered=reader.generation_of(number)
        )
        self._show_chosen(self._state.target, 0, 0)

    def _show_chosen(self, target: int, repeat: int, fresh: int) -> None:
        chosen = self._state.selection
        assert chosen is not None
        where = chosen.archive
        if chosen.cell is not None:
            where += f" cell {cell_name(chosen.cell)}"
        if chosen.is_ancestor:
            where = f"ancestor of robot {chosen.line[0].number}"
        self._robot.show_robot(
            self._reader().config, chosen.evaluation, where, chosen.entered, line=chosen.line
        )
        self._takeaway.panel.allow_robot(True)
        self._board.choose(chosen.archive, chosen.number)
        reader = self._reader()
        self._stage.choose(
            Entry(
                path=reader.path, config=reader.config, evaluation=chosen.evaluation, entered=chosen.entered
            )
        )
        self.choose_trial(target, repeat, fresh)

    def choose_trial(self, target: int, repeat: int, fresh: int = 0) -> None:
        """Replay a trial of the chosen robot, or of what is shown instead of it.

        Args:
            target: which of the task's targets.
            repeat: which of the noises that it was evaluated with.
            fresh: number of fresh noise, 0 for the evaluated one.

        Raises:
            InvalidData: there is no such trial.
        """
        chosen = self._state.selection
        replay = self._stage.replay(target, repeat, fresh)
        if replay is None and chosen is not None:
            config = self._reader().config
            replay = Replay(config, chosen.evaluation, target=target, repeat=repeat, fresh=fresh)
        if replay is None:
            self._player.unload()
            self._stage.clear()
            self._actions.notify("No robot chosen", "Click a filled cell of a map first.")
            return
        self._state.target, self._state.repeat, self._state.fresh = target, repeat, fresh
        self._transport.select_trial(target, repeat, fresh)
        self._navigation.update(self._board.generation)
        self._player.load(replay)
        self._transport.refresh()

    def _play_again(self) -> None:
        """Replay the present trial from its start."""
        state = self._state
        self.choose_trial(state.target, state.repeat, state.fresh)

    def replay_dump(self, path: Path) -> None:
        """Play the last moments of a simulation that failed.

        Raises:
            DumpError: the file cannot be read as a dump.
        """
        dump = read_dump(path)
        self._stage.clear()
        self._player.load(DumpReplay(dump))
        self._transport.refresh()
        failed = dump.failed
        self._actions.notify(
            f"Robot {failed.solution.number}, simulated until it failed", failed.failure.reason
        )

    def export(self) -> None:
        """Send the chosen robot to the browser as a zip file."""
        with self._mutex:
            if self._state.selection is None:
                raise InvalidData("Click a filled cell of a map first.")
            reader, selection = self._reader(), self._state.selection
        name = folder_name(reader, selection.number)
        place = None if selection.cell is None else Place(archive=selection.archive, cell=selection.cell)
        files = robot_folder(reader, selection.number, materials=load_materials(), place=place)
        self._client.send_file_download(f"{name}.zip", zip_bytes(files, name), save_immediately=True)

    def _may_simulate(self, seconds: float) -> bool:
        try:
            self._budget.spend(seconds)
        except InvalidData as e:
            self._actions.notify("One moment", str(e))
            return False
        return True

    def holder(self, archive: str, cell: Cell) -> int | None:
        """Return the number of the evaluation that a cell of an archive holds in the shown generation."""
        return self._board.holder(archive, cell)

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

    def _offer(self, shown: Path | None) -> None:
        paths = self._library.runs()
        self._archives.offer(paths, shown)
        self._compare.offer(paths, shown)

    def _slide(self, number: int) -> None:
        """Show a generation unless the slider has moved on by the time that others are done."""
        self._growth.stop()
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
        self._run.show_run(reader.path, status.n_evaluations, budget, state.generations, live=status.live)
        self._board.refresh()
        if new and last is not None:
            if state.follow_newest:
                self._draw(reader, last.number)
            elif self._board.generation is not None:
                self._archives.show_trend(state.generations, self._board.generation)

    def _draw(self, reader: RunReader, number: int) -> None:
        generations = self._state.generations
        self._board.show(reader, next(g for g in generations if g.number == number), generations[-1])
        self._archives.show_trend(generations, number)

    def _set_layout(self, name: str) -> None:
        self._board.set_layout(name)

    def _set_colors(self, wish: ColorWish) -> None:
        self._board.set_colors(wish)

    def _play_growth(self) -> None:
        """Run through the generations, or stop that."""
        if self._growth.playing:
            self._growth.stop()
        elif self._board.generation is not None:
            self._growth.play(
                self._board.generation, lambda: self._state.last.number if self._state.last else 0
            )

    def _grow(self, number: int) -> bool:
        """Show the next generation of those that play, unless something has stopped that."""
        shown = False

        def show() -> None:
            nonlocal shown
            if self._growth.playing:
                self.show_generation(number)
                shown = True

        self._actions.guarded(show)()
        return shown

    def toggle_replay(self) -> None:
        """Play or pause the replay, if there is one."""
        if self._player.replay is not None:
            self._player.pause() if self._player.playing else self._player.play()
            self._transport.refresh()

    def _reader(self) -> RunReader:
        if self._state.path is None:
            raise InvalidData("Choose a run first.")
        return self._library.reader(self._state.path)

    def _show_frame(self, replay: Playable, index: int, frame: Frame) -> None:
        if replay is self._player.replay:
            if self._stage.show(replay, index, frame):
                self._robot.show_frame(replay, index, playing=self._player.playing)
            self._transport.tick()

    def _player_stopped(self) -> None:
        self._transport.refresh()

    def _set_marks(self, marks: Marks) -> None:
        self._arena.marks = marks
        self._player.redraw()

    def _set_follow(self, follow: bool) -> None:
        self._arena.follow = follow
