"""The robot that a browser's user has chosen: its card, its replay, and what it is compared with."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path

import numpy as np
import viser

from app.downloads.downloads import NO_ROBOT, Takeaway
from app.gui.actions import Actions
from app.limits import VISITOR_SECONDS, SimulationBudget
from app.maps import archives_panel
from app.maps.map_board import MapBoard
from app.replay import transport
from app.replay.ground_picker import GroundPointer
from app.replay.overlays import Marks
from app.replay.player import Player
from app.replay.scene import Arena
from app.replay.scene_camera import SceneCamera
from app.robot import robot_panel
from app.robot.replay_source import Stage
from app.runs.library import Library
from app.state import Selection, SessionState
from engine.errors import InvalidData
from engine.replay.dump import read_dump
from engine.replay.dump_replay import DumpReplay
from engine.replay.recording import Playable
from engine.replay.replay import Replay
from engine.replay.trial import FIRST_TRIAL, TrialChoice
from engine.search.archive import Cell, cell_name
from engine.storage.reader import RunReader
from engine.tasks import get_task
from viz.robot.robot_differences import Entry


class ChosenRobot:
    """Builds the panels about robots and connects them.

    Args:
        client: the browser.
        state: what it looks at.
        library: the runs.
        board: the maps, on which the robot is marked.
        actions: of the browser.
        moved: called when the place that the browser is at has become another one.
        read_only: whether the browser is a visitor's, whose simulations are limited.
    """

    def __init__(
        self,
        client: viser.ClientHandle,
        state: SessionState,
        library: Library,
        board: MapBoard,
        actions: Actions,
        *,
        moved: Callable[[], None],
        read_only: bool,
    ) -> None:
        self._state, self._library, self._board = state, library, board
        self._actions, self._moved = actions, moved
        guarded = actions.guarded
        camera = SceneCamera(client)
        self._arena = Arena(client, camera)
        self._pointer = GroundPointer(client.scene, actions)
        self._budget = SimulationBudget(VISITOR_SECONDS if read_only else None)
        self._player = Player(self._show_moment, lambda: self._transport.refresh(), self._may_simulate)
        self._panel = robot_panel.RobotPanel(
            client,
            actions,
            robot_panel.Events(
                export=guarded(lambda: self.takeaway.export()),
                ancestor_chosen=guarded(self.choose_ancestor),
                pin=guarded(lambda: self._stage.pin()),
            ),
        )
        self.takeaway = Takeaway(
            client,
            state,
            library,
            actions,
            self._panel.maker,
            budget=self._budget,
            moment=lambda: self._player.time,
        )
        """Makes files of it."""
        self._stage = Stage(
            client,
            self._arena,
            camera,
            self._panel.tabs,
            actions,
            play=self._play_again,
            may_simulate=self._may_simulate,
        )
        self._transport = transport.TransportPanel(
            client,
            self._player,
            transport.Events(
                trial_chosen=guarded(self.choose_trial),
                elsewhere=guarded(self.place_target),
                follow_changed=self._set_follow,
                marks_changed=self._set_marks,
            ),
            taken=archives_panel.WIDTH + robot_panel.WIDTH,
        )

    def close(self) -> None:
        """End the threads of a browser that has gone."""
        self.takeaway.close()
        self._stage.close()
        self._player.close()

    def clear(self) -> None:
        """Show no robot: another run is about to be shown."""
        self._pointer.cancel()
        self._player.unload()
        self._stage.clear()
        self._panel.show_no_robot()
        self.takeaway.panel.allow_robot(False)
        self._stage.choose(None)

    def begin(self, reader: RunReader) -> None:
        """Offer the trials of a run."""
        task = get_task(reader.config.task)
        self._transport.set_trials(task.target_names, reader.config.trials.repeats)

    def refresh(self) -> None:
        """Show where the replay is."""
        self._transport.refresh()

    def choose(
        self,
        archive: str,
        cell: Cell | None,
        number: int,
        trial: TrialChoice = FIRST_TRIAL,
    ) -> None:
        """Choose the robot of an evaluation and replay a trial of it.

        Args:
            archive: it was chosen in.
            cell: of the archive that holds it, None if none does.
            number: of the evaluation.
            trial: of the robot.

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
        self._show(trial)

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
        self._show(TrialChoice(target=self._state.trial.target))

    def choose_trial(self, trial: TrialChoice) -> None:
        """Replay a trial of the chosen robot, or of what is shown instead of it.

        Raises:
            InvalidData: there is no such trial.
        """
        chosen = self._state.selection
        self._pointer.cancel()
        if self._stage.shows_a_variant:
            trial = dataclasses.replace(trial, aim=None)
        replay = self._stage.replay(trial)
        if replay is None and chosen is not None:
            replay = Replay.of(self._reader().config, chosen.evaluation, trial)
        if replay is None:
            self._player.unload()
            self._stage.clear()
            self._actions.notify("No robot chosen", NO_ROBOT)
            return
        self._state.trial = trial
        self._transport.select_trial(trial)
        self._moved()
        self._player.load(replay)
        self._transport.refresh()

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

    def replay_again(self) -> None:
        """Play the replay from its start.

        Raises:
            InvalidData: there is none.
        """
        if self._player.replay is None:
            raise InvalidData(NO_ROBOT)
        self._player.seek(self._player.replay.start_time)
        self._player.play()
        self._transport.refresh()

    def toggle_replay(self) -> None:
        """Play or pause the replay, if there is one."""
        if self._player.replay is not None:
            self._player.toggle()
            self._transport.refresh()

    def place_target(self) -> None:
        """Let the user click on the ground where the target is to be, and replay the robot with it there.

        Raises:
            InvalidData: it is not one robot of an archive that is shown.
        """
        if not isinstance(self._player.replay, Replay):
            raise InvalidData(
                "Choose a robot first."
                if self._player.replay is None
                else "A target can be placed while one robot of an archive is replayed; go back to it first."
            )
        self._pointer.ask(self._aim)
        self._actions.notify("Where to?", "Click on the ground where the target is to be.")

    def _aim(self, point: np.ndarray) -> None:
        """Replay the robot with its target at a (2,) point of the ground."""
        replay = self._player.replay
        if isinstance(replay, Replay):
            self.choose_trial(dataclasses.replace(self._state.trial, aim=replay.aim_at(point)))

    def _show(self, trial: TrialChoice) -> None:
        """Show the chosen robot and replay a trial of it."""
        chosen = self._state.selection
        assert chosen is not None
        where = chosen.archive
        if chosen.cell is not None:
            where += f" cell {cell_name(chosen.cell)}"
        if chosen.is_ancestor:
            where = f"ancestor of robot {chosen.line[0].number}"
        reader = self._reader()
        self._panel.show_robot(reader.config, chosen.evaluation, where, chosen.entered, line=chosen.line)
        self.takeaway.panel.allow_robot(True)
        self._board.choose(chosen.archive, chosen.number)
        self._stage.choose(
            Entry(
                path=reader.path, config=reader.config, evaluation=chosen.evaluation, entered=chosen.entered
            )
        )
        self.choose_trial(trial)

    def _play_again(self) -> None:
        """Replay the present trial from its start."""
        self.choose_trial(self._state.trial)

    def _may_simulate(self, seconds: float) -> bool:
        try:
            self._budget.spend(seconds)
        except InvalidData as e:
            self._actions.notify("One moment", str(e))
            return False
        return True

    def _reader(self) -> RunReader:
        return self._library.shown(self._state.path)

    def _show_moment(self, replay: Playable, index: int, moment: float) -> None:
        if replay is self._player.replay:
            if self._stage.show(replay, index, moment):
                self._panel.show_frame(replay, index, playing=self._player.playing)
            self._transport.tick()

    def _set_marks(self, marks: Marks) -> None:
        self._arena.marks = marks
        self._player.redraw()

    def _set_follow(self, follow: bool) -> None:
        self._arena.follow = follow
