"""The robot that a browser's user has chosen: its card, its replay, its files, what it is compared with."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path

import numpy as np
import viser

from app.downloads.downloads import NO_ROBOT, Downloads
from app.gui.actions import Actions
from app.gui.browser_value import PageSize
from app.gui.lanes import Lane
from app.gui.top_bar import TopBar
from app.gui.widgets import ignoring_event
from app.limits import VISITOR_SECONDS, SimulationBudget
from app.maps.map_board import MapBoard
from app.replay.ground_picker import GroundPicker
from app.replay.player import Player, ReplayMoment
from app.replay.scene import Scene, View, view_named
from app.replay.scene_camera import SceneCamera
from app.replay.scene_overlay import CALM, TOUCHED, SceneOverlay
from app.replay.transport import TransportEvents, TransportPanel
from app.robot import robot_panel
from app.robot.pins_panel import robust_of
from app.robot.replay_source import ReplaySource
from app.runs.library import Library
from app.session.greeting import Greeting, best_target
from app.state import Choice, Selection, ShownRun
from engine.analysis.robustness import Robustness, robust_stamp
from engine.errors import InvalidData
from engine.replay.dump import read_dump
from engine.replay.dump_replay import DumpReplay
from engine.replay.recording import Playable
from engine.replay.replay import Replay
from engine.replay.trial import TrialChoice
from engine.search.archive import Cell, cell_name
from engine.storage.reader import RunReader
from engine.tasks import get_task
from viz.robot.robot_differences import Entry


class ChosenRobot:
    """Builds the panels about robots and connects them.

    Args:
        client: the browser.
        page: size of the browser's.
        bar: of the browser.
        run: that is shown.
        choice: that it makes.
        library: the runs.
        board: the maps, on which the robot is marked.
        actions: of the browser.
        simulating: lane of the browser for its replays.
        moved: called when the browser shows something else than its address says.
        read_only: whether the browser is a visitor's, whose simulations are limited.
    """

    def __init__(
        self,
        client: viser.ClientHandle,
        page: PageSize,
        bar: TopBar,
        run: ShownRun,
        choice: Choice,
        library: Library,
        board: MapBoard,
        actions: Actions,
        *,
        simulating: Lane,
        moved: Callable[[], None],
        read_only: bool,
    ) -> None:
        self._run, self._choice, self._library, self._board = run, choice, library, board
        self._actions, self._moved = actions, moved
        self._robust: tuple[object, Robustness | None] | None = None
        self._drawn: Playable | None = None
        guarded = actions.guarded
        self._budget = SimulationBudget(VISITOR_SECONDS if read_only else None)
        self._picker = GroundPicker(client.scene, actions)
        camera = SceneCamera(client, page)
        bar.on_covering(camera.cover)
        scene = Scene(client, camera)
        self.overlay = SceneOverlay(client.gui)
        """Lies over its scene."""
        self.player = Player(self._may_simulate, simulating)
        """Plays it."""
        self._panel = robot_panel.RobotPanel(
            client, actions, guarded(self.choose_ancestor), self.player.seek, page
        )
        self.downloads = Downloads(
            client,
            bar,
            run,
            choice,
            library,
            actions,
            self._panel.maker,
            self.player,
            budget=self._budget,
            judged=self._panel.show_verdict,
        )
        """Makes files of it."""
        self._source = ReplaySource(
            client,
            bar,
            scene,
            camera,
            self._panel,
            actions,
            library=library,
            play=self._play_again,
            may_simulate=self._may_simulate,
        )
        self._transport = TransportPanel(
            client,
            self.player,
            scene,
            TransportEvents(guarded(self._choose_other_trial), guarded(self.place_target)),
            room=page.room("left", "right"),
        )
        page.on_change(lambda: self._transport.fit(page.room("left", "right")))
        self._greeting = Greeting(self.overlay, scene, self._transport)
        self.overlay.on_do(guarded(self._look))
        self.player.show_with(self._show_moment)
        self._panel.export.on_click(ignoring_event(guarded(self.downloads.export)))
        self._panel.pin.on_click(ignoring_event(guarded(self._source.pins.pin_or_unpin)))

    def to_breed(self) -> dict[str, Callable[[], list[tuple[Path, int]]]]:
        """Return what returns the robots that can be bred, run and number of each, by what they are."""

        def shown() -> list[tuple[Path, int]]:
            path, chosen = self._run.path, self._choice.selection
            return [] if path is None or chosen is None else [(path, chosen.number)]

        return {
            "This robot": shown,
            "Pins": lambda: [(e.path, e.number) for e in self._source.pins.pins],
            "Basket": lambda: [(item.path, item.number) for item in self.downloads.basket],
        }

    def arrived(self, gui: viser.GuiApi) -> None:
        """Bring back the pinned robots, once what the address names is shown.

        Args:
            gui: at a place that is always on the page.
        """
        self._source.pins.begin(gui)

    def cancel(self) -> None:
        """Give up what is simulated, played and made for a browser that has gone."""
        self._panel.maker.cancel()
        self._source.close()
        self.player.cancel()

    def close(self) -> None:
        """End the threads of a browser that has gone."""
        self.cancel()
        self.player.close()

    def begin(self, reader: RunReader) -> None:
        """Show no robot, and offer the trials of a run that is about to be shown."""
        self._greeting.end()
        self.overlay.show_no_still()
        self._choice.forget()
        self._picker.cancel()
        self.player.unload()
        self._source.clear()
        self._panel.show_no_robot()
        self.downloads.panel.allow_robot(False)
        self._source.choose(None)
        task = get_task(reader.config.task)
        self._transport.set_trials(task.target_names, reader.config.trials.repeats)

    def choose(
        self,
        archive: str,
        cell: Cell | None,
        number: int,
        trial: TrialChoice | None = None,
    ) -> None:
        """Choose the robot of an evaluation and replay a trial of it.

        Args:
            archive: it was chosen in.
            cell: of the archive that holds it, None if none does.
            number: of the evaluation.
            trial: of the robot; None for one towards the target that it reaches best.

        Raises:
            RunFileError: the run has no such evaluation.
            InvalidData: it was never tried so.
        """
        self._end_greeting()
        reader = self._reader()
        chosen = Selection.of(reader, archive, cell, number)
        self._show(reader, chosen, trial or TrialChoice(target=best_target(chosen.evaluation)))

    def greet(self, n_trials: int) -> None:
        """Show the best robot of the run, if there is any, on its way to the target that it reaches best.

        Args:
            n_trials: how many robots the run has tried.

        Raises:
            RunFileError: the file cannot be read.
        """
        best = self._board.best()
        if best is None or self._choice.selection is not None:
            return
        reader = self._reader()
        chosen = Selection.of(reader, *best)
        evaluation = chosen.evaluation
        body = evaluation.solution.morphology
        self.overlay.show_still(body, body.n_modules - 1 if evaluation.head_is_end else 0)
        self._greeting.begin(n_trials)
        self._choice.greets = True
        self._show(reader, chosen, TrialChoice(target=best_target(evaluation)))

    def choose_ancestor(self, number: int) -> None:
        """Choose a robot from the lineage of the one that was clicked, and replay it, elite or not.

        Raises:
            RunFileError: the run has no such evaluation.
        """
        if (origin := self._choice.selection) is None:
            return
        self._end_greeting()
        reader = self._reader()
        ancestor = dataclasses.replace(
            origin, evaluation=reader.evaluation(number), entered=reader.generation_of(number)
        )
        self._show(reader, ancestor, TrialChoice(target=self._choice.trial.target))

    def choose_trial(self, trial: TrialChoice) -> None:
        """Replay a trial of the chosen robot, or of what is shown instead of it.

        Raises:
            InvalidData: there is no such trial.
        """
        self._picker.cancel()
        if self._source.shows_a_variant:
            trial = dataclasses.replace(trial, aim=None)
        replay = self._source.replay(trial)
        if replay is None:
            self.player.unload()
            self._source.clear()
            self._actions.notify("No robot chosen", NO_ROBOT)
            return
        self._choice.replay(trial)
        self._transport.select_trial(trial)
        self.player.load(replay)
        self._moved()  # whoever waits for the robot need not wait for that

    def _choose_other_trial(self, trial: TrialChoice) -> None:
        self._end_greeting()
        self.choose_trial(trial)

    def _end_greeting(self) -> None:
        self._choice.greets = False
        self._greeting.end()

    def look(self, view: View) -> None:
        """Look at what is played another way."""
        self._greeting.hold_still()
        self._source.look(view)

    def _look(self, what: str) -> None:
        if what == CALM:
            self._greeting.be_calm()
        elif what == TOUCHED:
            self._greeting.hold_still()
        elif (view := view_named(what)) is not None:
            self.look(view)

    def _show_moment(self, moment: ReplayMoment) -> None:
        self._source.show(moment)
        self._greeting.tick()
        if moment.replay is not self._drawn:
            self._drawn = moment.replay
            self.overlay.robot_is_there()

    def replay_dump(self, path: Path) -> None:
        """Play the last moments of a simulation that failed.

        Raises:
            DumpError: the file cannot be read as a dump.
        """
        dump = read_dump(path)
        self._source.clear()
        self.player.load(DumpReplay(dump))
        failed = dump.failed
        self._actions.notify(
            f"Robot {failed.solution.number}, simulated until it failed", failed.failure.reason
        )

    def replay_again(self) -> None:
        """Play the replay from its start.

        Raises:
            InvalidData: there is none.
        """
        replay = self.player.replay
        if replay is None:
            raise InvalidData(NO_ROBOT)
        self.player.seek(replay.start_time)
        self.player.play()

    def place_target(self) -> None:
        """Let the user click on the ground where the target is to be, and replay the robot with it there.

        Raises:
            InvalidData: it is not one robot of an archive that is shown.
        """
        if not isinstance(self.player.replay, Replay):
            raise InvalidData(
                "Choose a robot first."
                if self.player.replay is None
                else "A target can be placed while one robot of an archive is replayed; go back to it first."
            )
        self._picker.ask(self._aim)
        self._actions.notify("Where to?", "Click on the ground where the target is to be.")

    def _aim(self, point: np.ndarray) -> None:
        """Replay the robot with its target at a (2,) point of the ground."""
        replay = self.player.replay
        if isinstance(replay, Replay):
            self.choose_trial(dataclasses.replace(self._choice.trial, aim=replay.aim_at(point)))

    def _show(self, reader: RunReader, chosen: Selection, trial: TrialChoice) -> None:
        """Show a robot of a run and replay a trial of it."""
        self._choice.select(chosen)
        where = chosen.archive
        if chosen.cell is not None:
            where += f" cell {cell_name(chosen.cell)}"
        if chosen.is_ancestor:
            where = f"ancestor of robot {chosen.line[0].number}"
        self._panel.show_robot(
            reader.config,
            chosen.evaluation,
            where,
            chosen.entered,
            line=chosen.line,
            robust=self._robust_of(reader),
        )
        self.downloads.panel.allow_robot(True)
        self.downloads.judge_later()
        self._board.choose(chosen.archive, chosen.number)
        self._source.choose(
            Entry(
                path=reader.path,
                config=reader.config,
                evaluation=chosen.evaluation,
                entered=chosen.entered,
                robust=self._robust_of(reader),
            )
        )
        self.choose_trial(trial)

    def _robust_of(self, reader: RunReader) -> Robustness | None:
        """Return what evaluating the run's elites again has shown, if that was done and can be read."""
        stamp = (reader, robust_stamp(reader.path))
        if self._robust is None or self._robust[0] != stamp:
            self._robust = (stamp, robust_of(reader))
        return self._robust[1]

    def _play_again(self) -> None:
        """Replay the present trial from its start."""
        self.choose_trial(self._choice.trial)

    def _may_simulate(self, seconds: float) -> bool:
        try:
            self._budget.spend(seconds)
        except InvalidData as e:
            self._actions.notify("One moment", str(e))
            return False
        return True

    def _reader(self) -> RunReader:
        return self._library.shown(self._run.path)
