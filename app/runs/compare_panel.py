"""The window of one browser where runs are chosen and compared; the comparison opens in a window."""

from __future__ import annotations

import html
import threading
from collections.abc import Callable, Sequence
from pathlib import Path

import viser

from app.gui.actions import Actions
from app.gui.click_channel import ClickChannel
from app.gui.widgets import ignoring_event, put_html
from app.runs.comparison_window import ComparisonWindow
from app.runs.run_names import label_paths
from engine.analysis.comparison import Comparison, compare_runs
from engine.errors import Cancelled, InvalidData, printable
from viz.report.report import render_page, report_sections
from viz.report.style import DARK
from viz.runs.run_list import RunFacts, render_choices


class ComparePanel:
    """Lets runs be chosen, compares them and offers the report.

    Args:
        client: the browser.
        window: to be filled.
        facts: returns what is known of a run on offer.
        actions: of the browser.
    """

    def __init__(
        self,
        client: viser.ClientHandle,
        window: viser.GuiTabHandle,
        facts: Callable[[Path], RunFacts],
        actions: Actions,
    ) -> None:
        gui = client.gui
        self._client, self._facts, self._actions = client, facts, actions
        self._choice = RunChoice()
        self._offered: tuple[tuple[Path, ...], Path | None] | None = None
        self._busy = threading.Lock()
        self._comparison: Comparison | None = None
        self._window = ComparisonWindow(client, download=self._in_background(self._download))
        with window:
            gui.add_html(
                '<div style="font-size:12.5px;line-height:1.5;opacity:.85;padding:6px 10px 0">Runs side by'
                " side: what each group reaches, whether the difference could be luck, the trends, all"
                " maps, and the published figures beside ours.</div>"
            )
            self._list = gui.add_html("")
            self._handler = ClickChannel(gui, actions.guarded(self._clicked), label="runs to compare").handler
            self._equal_cost = gui.add_checkbox(
                "Equal cost",
                False,
                hint="Compare all runs as they were when each had as many evaluations as the shortest has",
            )
            self._start = gui.add_button(
                "Compare these runs",
                icon=viser.Icon.CHART_BAR,
                hint="The chosen runs: trends, maps, tests, tables",
            )
            self._status = gui.add_html("")
            self._again = gui.add_button(
                "Show again",
                icon=viser.Icon.WINDOW_MAXIMIZE,
                color="gray",
                visible=False,
                hint="Open the last comparison again",
            )
        self._start.on_click(ignoring_event(actions.guarded(self._compare_chosen)))
        self._again.on_click(ignoring_event(self._in_background(self._show)))

    def offer(self, paths: Sequence[Path], shown: Path | None) -> None:
        """Offer runs, at first those of the shown run's task; the list holds still while nothing changes."""
        offered = (tuple(paths), shown)
        if offered == self._offered:
            return
        self._offered = offered
        facts = {path: self._facts(path) for path in paths}
        self._choice.offer(facts, facts[shown].task if shown in facts else "")
        self._draw()

    def _clicked(self, name: str, index: tuple[int, ...]) -> None:
        if name == "run":
            self._choice.toggle(index[0])
        elif name in ("all", "none"):
            self._choice.set_all(name == "all")
        self._draw()

    def _draw(self) -> None:
        labels = {path: label for label, path in label_paths(list(self._choice.facts)).items()}
        runs = [(labels[path], facts) for path, facts in self._choice.facts.items()]
        chosen = {k for k, path in enumerate(self._choice.facts) if path in self._choice.chosen}
        put_html(self._list, render_choices(runs, chosen, self._handler))

    def _compare_chosen(self) -> None:
        paths = self._choice.chosen_paths()
        if not paths:
            raise InvalidData("Choose at least one run to compare.")
        at = equal_cost([self._facts(p) for p in paths]) if self._equal_cost.value is True else None
        self._in_background(lambda: self._compare(paths, at))()

    def _in_background(self, action: Callable[[], None]) -> Callable[[], None]:
        """Return an action that is done beside all else, unless another is already."""

        def work() -> None:
            try:
                action()
            finally:
                self._tell("")
                self._start.disabled = False
                self._busy.release()

        def start() -> None:
            if self._busy.acquire(blocking=False):
                self._start.disabled = True
                self._actions.slow(work)()

        return start

    def _compare(self, paths: Sequence[Path], at: int | None) -> None:
        comparison = compare_runs(paths, at=at, observer=self._reading)
        self._tell("Drawing the figures …")
        self._comparison = comparison
        self._show()
        self._again.visible = True

    def _reading(self, path: Path, n: int, total: int) -> None:
        if self._actions.closed:
            raise Cancelled
        self._tell(f"Reading {n + 1} of {total}: {printable(path.stem)} …")

    def _show(self) -> None:
        if self._comparison is not None:
            self._window.show(title(self._comparison), report_sections(self._comparison, DARK))

    def _download(self) -> None:
        if self._comparison is not None:
            page = render_page(self._comparison, report_sections(self._comparison))
            self._client.send_file_download("report.html", page.encode(), save_immediately=True)

    def _tell(self, text: str) -> None:
        line = f'<div style="font-size:12.5px;opacity:.8;padding:2px 10px">{html.escape(text)}</div>'
        put_html(self._status, line if text else "")


class RunChoice:
    """The choice of the runs to compare.

    They are those of one task until the user chooses otherwise; looking at a run of another task starts over.
    """

    def __init__(self) -> None:
        self.facts: dict[Path, RunFacts] = {}
        self.chosen: set[Path] = set()
        self._task = ""
        self._by_hand = False

    def offer(self, facts: dict[Path, RunFacts], task: str) -> None:
        """Offer runs, those of a task by default."""
        if task != self._task:
            self._task, self._by_hand = task, False
        self.facts = facts
        if self._by_hand:
            self.chosen &= set(facts)
        else:
            self.chosen = {p for p, f in facts.items() if f.task == task and f.problem is None}

    def toggle(self, index: int) -> None:
        """Add a run to those chosen or take it away; one that cannot be read, or is not there, stays out."""
        paths = list(self.facts)
        if index < len(paths) and self.facts[paths[index]].problem is None:
            self.chosen ^= {paths[index]}
            self._by_hand = True

    def set_all(self, chosen: bool) -> None:
        """Choose all runs that can be read, or none."""
        self.chosen = {p for p, f in self.facts.items() if f.problem is None} if chosen else set()
        self._by_hand = True

    def chosen_paths(self) -> list[Path]:
        """Return the chosen runs in the order of the list."""
        return [p for p in self.facts if p in self.chosen]


def equal_cost(runs: Sequence[RunFacts]) -> int | None:
    """Return the number of evaluations that every run with any has reached, None if no run has any."""
    return min((f.n_closed for f in runs if f.n_closed), default=None)


def title(comparison: Comparison) -> str:
    """Return what is compared, in a few words."""
    n = sum(len(t.runs) for t in comparison.tasks)
    tasks = " and ".join(t.task.replace("-", " ") for t in comparison.tasks)
    at = f", at {comparison.at:,} evaluations at most" if comparison.at is not None else ""
    return f"{n} {'run' if n == 1 else 'runs'} of {tasks}{at}"
