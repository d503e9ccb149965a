"""Pinned robots of one browser: up to four of any runs, to see side by side."""

from __future__ import annotations

import contextlib
import dataclasses
import time
from collections.abc import Callable, Sequence

import viser

from app.gui.actions import Actions
from app.gui.click_channel import ClickChannel
from app.gui.remembered_robots import Kept, RememberedRobots
from app.gui.top_bar import TopBar
from app.gui.widgets import ignoring_event, put_html
from app.replay.side_by_side import MAX_LANES, SideBySideReplay
from app.runs.library import Library
from app.runs.run_names import find_run, run_name
from engine.analysis.robustness import Robustness, load_robust_of
from engine.errors import InvalidData, TensAtlasError
from engine.replay.replay import Replay
from engine.replay.trial import TrialChoice
from engine.storage.reader import RunReader
from engine.tasks import get_task
from viz.robot import robot_differences as differences
from viz.robot.robot_differences import Entry

WINDOW = "Side by side"
MEMORY_KEY = "tensatlas-pins"
"""Key under which a tab remembers its pins."""
PLAY = "Replay in lanes"
NOTHING = (
    '<div style="font-size:12.5px;line-height:1.45;opacity:.7;padding:2px 10px 6px">Pin up to four robots, of'
    " any runs, and see them crawl side by side.</div>"
)
TELL_INTERVAL = 0.3
"""Seconds between two updates of the distances."""


class PinsPanel:
    """Keeps the pinned robots and shows what they differ in.

    Args:
        client: the browser.
        bar: of the browser; it gets a window.
        actions: of the browser.
        play: called when something else is to be played: other lanes than before, or one robot again.
        library: the runs.
    """

    def __init__(
        self,
        client: viser.ClientHandle,
        bar: TopBar,
        actions: Actions,
        play: Callable[[], None],
        library: Library,
    ) -> None:
        gui, self._bar, self._library, self._actions = client.gui, bar, library, actions
        self._memory: RememberedRobots | None = None
        self._kept: object = ((), False)
        self._play = play
        self._chosen: Entry | None = None
        self._pins: list[Entry] = []
        self._told = 0.0
        self.side_by_side = False
        """Whether the scene shows the pinned robots instead of the chosen one."""
        with bar.window(WINDOW, viser.Icon.COLUMNS, "The pinned robots, in lanes and as a table"):
            self._list = gui.add_html(NOTHING)
            self._handler = ClickChannel(gui, actions.guarded(self._clicked), label="pins").handler
            self._toggle = gui.add_button(
                PLAY,
                icon=viser.Icon.COLUMNS,
                visible=False,
                hint="Replay the pinned robots in lanes, in step; the transport plays all of them",
            )
            self._now = gui.add_html("")
            self._table = gui.add_html("")
        self._toggle.on_click(ignoring_event(actions.guarded(self._switch)))

    def begin(self, gui: viser.GuiApi) -> None:
        """Ask the browser which robots were pinned before the page was loaded again.

        Args:
            gui: at a place that is always on the page.
        """
        if self._memory is None:
            self._memory = RememberedRobots(gui, MEMORY_KEY, MAX_LANES, self._actions.guarded(self._restore))

    def _restore(self, kept: list[Kept], side_by_side: bool) -> None:
        paths, found = self._library.runs(), []
        for name, number in kept:
            if (path := find_run(name, paths)) is not None:
                with contextlib.suppress(TensAtlasError):  # it is not there any more
                    reader = self._library.reader(path)
                    evaluation, entered = reader.evaluation(number), reader.generation_of(number)
                    pinned = Entry(path=path, config=reader.config, evaluation=evaluation, entered=entered)
                    found.append(dataclasses.replace(pinned, robust=robust_of(reader)))
        if found and not self._pins:
            self._pins, self.side_by_side = found, side_by_side
            self._show()
            if side_by_side:
                self._play()

    @property
    def pins(self) -> tuple[Entry, ...]:
        """The pinned robots."""
        return tuple(self._pins)

    def choose(self, robot: Entry | None) -> None:
        """Offer a robot to be pinned, and go back to showing one robot at a time."""
        self._chosen = robot
        self.leave()
        self._show()

    def leave(self) -> None:
        """Show one robot again, without playing it."""
        self.side_by_side = False
        put_html(self._now, "")
        self._show()

    def replay(self, trial: TrialChoice) -> SideBySideReplay:
        """Return the replay of the pinned robots; of a run with fewer targets or seeds its last one."""
        return side_by_side_replay(self._pins, trial)

    def tell(self, replay: SideBySideReplay, moment: float) -> None:
        """Show how far every robot is from its target, now and then and where the replay ends."""
        early = time.monotonic() - self._told < TELL_INTERVAL and moment < replay.reached()
        if early or not self.side_by_side:
            return
        self._told = time.monotonic()
        lanes = [(r.failure, replay.distance(k, moment)) for k, r in enumerate(replay.lanes)]
        put_html(self._now, differences.render_distances(lanes))

    def _clicked(self, name: str, index: tuple[int, ...]) -> None:
        if name == "unpin" and index[0] < len(self._pins):
            del self._pins[index[0]]
            self._changed()

    def pin_or_unpin(self) -> None:
        """Pin the chosen robot, or unpin it if it is pinned.

        Raises:
            InvalidData: there is none, or four are pinned already.
        """
        robot = self._chosen
        if robot is None:
            raise InvalidData("Click a filled cell of a map first.")
        known = self.index(robot)
        if known is not None:
            del self._pins[known]
        elif len(self._pins) == MAX_LANES:
            raise InvalidData(f"{MAX_LANES} robots are pinned already: unpin one first.")
        else:
            self._pins.append(robot)
        self._changed()

    def _switch(self) -> None:
        self.side_by_side = not self.side_by_side and bool(self._pins)
        put_html(self._now, "")
        self._show()
        self._play()

    def _changed(self) -> None:
        was = self.side_by_side
        self.side_by_side = was and bool(self._pins)
        self._show()
        if was:
            self._play()

    def _show(self) -> None:
        put_html(self._list, differences.render_pins(self._pins, self._handler) or NOTHING)
        put_html(self._table, differences.render(self._pins))
        self._bar.tell(WINDOW, str(len(self._pins) or ""))
        state = (tuple((e.path, e.number) for e in self._pins), self.side_by_side)
        if self._memory is not None and state != self._kept:
            self._kept, paths = state, self._library.runs()
            named = [(run_name(e.path, paths), e.number) for e in self._pins]
            self._memory.keep([(n, k) for n, k in named if n is not None], marked=self.side_by_side)
        self._toggle.visible = bool(self._pins)
        label = "Back to one robot" if self.side_by_side else PLAY
        if self._toggle.label != label:
            self._toggle.label = label
            self._toggle.icon = viser.Icon.ARROW_BACK if self.side_by_side else viser.Icon.COLUMNS

    def index(self, robot: Entry) -> int | None:
        """Return where a robot is pinned, None if it is not."""
        same = (k for k, e in enumerate(self._pins) if (e.path, e.number) == (robot.path, robot.number))
        return next(same, None)


def robust_of(reader: RunReader) -> Robustness | None:
    """Return what evaluating a run's elites again has shown, None if that cannot be read."""
    try:
        return load_robust_of(reader)
    except TensAtlasError:  # the maps say what is wrong with it
        return None


def side_by_side_replay(robots: Sequence[Entry], trial: TrialChoice) -> SideBySideReplay:
    """Return a replay of robots in step: their trials towards one target with one noise seed.

    Args:
        robots: one to four.
        trial: of each; of a run with fewer targets or noise seeds its last one.

    Raises:
        InvalidData: today's robots do not survive the physics of one's run.
    """
    lanes = []
    for robot in robots:
        n_targets, repeats = get_task(robot.config.task).n_targets, robot.config.trials.repeats
        known = dataclasses.replace(
            trial, target=min(trial.target, n_targets - 1), repeat=min(trial.repeat, repeats - 1)
        )
        lanes.append(Replay.of(robot.config, robot.evaluation, known))
    return SideBySideReplay(lanes, [differences.lane_name(robot, k) for k, robot in enumerate(robots)])
