"""Run control of one browser, in two windows: the progress of the shown run, and new runs."""

from __future__ import annotations

import os
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final

import viser

from app.gui.actions import Actions
from app.gui.click_channel import ClickChannel
from app.gui.top_bar import TopBar
from app.gui.widgets import put, put_html
from app.runs import launcher
from app.runs.run_care import CareEvents, RunCare
from app.runs.run_form import RunForm
from app.state import ShownRun
from engine.config import RunConfig
from engine.errors import InvalidData, printable
from engine.replay.dump import SUFFIX as DUMP_SUFFIX
from engine.storage.rows import Generation, Slimmed
from engine.storage.schema import failures_folder
from viz.runs import run_progress

RECENT: Final = 5
"""Generations, or checks of the run, over which its speed is measured."""
LAST_WORDS_DELAY: Final = 1.5
"""Seconds within which a process that has let go of its run writes the last line of its log."""
MAX_DUMPS: Final = 20
"""Failed simulations that are listed."""


class RunPanel:
    """Starts, pauses, resumes and stops runs, and shows the progress of one.

    Args:
        client: the browser.
        bar: of the browser; it gets a window for this run, and one for new runs.
        actions: of the browser.
        run: that is shown.
        show: called with a run that was started.
        replay_dump: called with a failed simulation that the user wants to see.
        moved: called when a run has been moved, from here to there; None for the bin.
        read_only: whether the browser may only look.
    """

    def __init__(
        self,
        client: viser.ClientHandle,
        bar: TopBar,
        actions: Actions,
        run: ShownRun,
        *,
        show: Callable[[Path], None],
        replay_dump: Callable[[Path], None],
        moved: Callable[[Path, Path | None], None],
        read_only: bool = False,
    ) -> None:
        gui = client.gui
        self._actions, self._run, self._show = actions, run, show
        self._replay_dump = replay_dump
        self._seen: deque[tuple[float, int]] = deque(maxlen=RECENT)
        self._seen_path: Path | None = None
        self._dumps: list[Path] = []
        self._form: RunForm | None = None
        self._bar = bar
        with bar.window("Run", viser.Icon.ACTIVITY, "How far this run is; pause, resume or stop it"):
            self._progress = gui.add_progress_bar(0.0)
            self._text = gui.add_html("")
            self._trouble = gui.add_html("")
            self._failed = gui.add_html("")
            self._handler = ClickChannel(
                gui, actions.guarded(self._dump_clicked), label="failed simulations"
            ).handler
            self._pause = gui.add_button(
                "Pause run",
                icon=viser.Icon.PLAYER_PAUSE,
                visible=False,
                hint="Save what is finished and end the process; Resume run continues exactly there, also"
                " after the machine was switched off",
            )
            self._resume = gui.add_button(
                "Resume run",
                icon=viser.Icon.PLAYER_TRACK_NEXT,
                visible=False,
                hint="Resume this run, exactly as if it had never stopped",
            )
            self._stop = gui.add_button(
                "Stop run",
                icon=viser.Icon.PLAYER_STOP,
                color="gray",
                visible=False,
                hint="Save what is finished and end this run",
            )
            self._care = RunCare(gui, actions, CareEvents(self._start_another, moved), read_only=read_only)
        if read_only:
            return
        self._form = RunForm(
            gui,
            bar.window("New run", viser.Icon.ROCKET, "Evolve an atlas of your own"),
            actions.slow(self.start_run),
        )
        self._pause.on_click(actions.slow(self.pause_run))
        self._stop.on_click(actions.slow(self.stop_run))
        self._resume.on_click(actions.slow(self.resume_run))

    def show_run(
        self,
        path: Path,
        config: RunConfig,
        n: int,
        generations: Sequence[Generation],
        *,
        live: bool,
        slimmed: Slimmed | None = None,
    ) -> None:
        """Show the progress of a run and what can be done with it.

        Args:
            path: of its file.
            config: of the run.
            n: evaluations that it holds.
            generations: the closed ones.
            live: whether it is being written.
            slimmed: what is left in a slimmed run; None for others.
        """
        budget = config.evaluations
        self._care.show(path, config)
        last = generations[-1] if generations else None
        complete = last is not None and last.n_evaluations >= budget
        if path != self._seen_path or not live:
            self._seen.clear()
            self._seen_path = path
        self._seen.append((time.monotonic(), n))
        put(self._progress, 100.0 * min(n / budget, 1.0))
        self._bar.tell("Run", f"{min(n / budget, 1.0):.0%}" if live else "")
        speed = _speed(generations, self._seen) if live else None
        n_failed = 0 if last is None else last.n_failed
        n_kept = None if slimmed is None else slimmed.n_kept
        text = run_progress.render(n, budget, speed=speed, n_failed=n_failed, n_kept=n_kept)
        put_html(self._text, text)
        if self._form is not None:
            put(self._pause, live, "visible")
            put(self._stop, live, "visible")
            put(self._resume, not live and not complete and slimmed is None, "visible")
        self._list_dumps(path)
        put_html(self._trouble, "")
        if self._form is not None and not live and not complete:  # no visitor's business
            timer = threading.Timer(LAST_WORDS_DELAY, self._actions.guarded(self._show_trouble), [path])
            timer.daemon = True
            timer.start()

    def start_run(self) -> None:
        """Start the run that the form holds and show it."""
        if self._form is None:
            raise InvalidData("This atlas is for looking only.")
        new = self._form.value()
        self._form.start.disabled = True
        try:
            path = launcher.start(new)
        finally:
            self._form.start.disabled = False
        with self._actions.mutex:
            self._show(path)
        self._bar.open("Run")
        self._actions.notify("Started", f"{printable(path.name)} evolves in a separate process.")

    def _start_another(self, config: RunConfig, name: str) -> None:
        """Fill the form with a configuration, but for the seed, and show it."""
        if self._form is not None:
            self._form.fill(config, name)
            self._bar.open("New run")

    def pause_run(self) -> None:
        """Pause the shown run."""
        path = self._path()
        launcher.pause(path)
        name = printable(path.name)
        self._actions.notify("Pausing", f"{name} saves what is finished. Resume run continues there.")

    def stop_run(self) -> None:
        """Stop the shown run."""
        path = self._path()
        launcher.stop(path)
        self._actions.notify("Stopping", f"{printable(path.name)} saves what is finished and stops.")

    def resume_run(self) -> None:
        """Resume the shown run."""
        self._resume.disabled = True
        try:
            launcher.resume(self._path(), workers=os.cpu_count() or 1)
        finally:
            self._resume.disabled = False

    def _path(self) -> Path:
        path = self._run.path
        if self._form is None:
            raise InvalidData("This atlas is for looking only.")
        if path is None:
            raise InvalidData("Choose a run first.")
        return path

    def _show_trouble(self, path: Path) -> None:
        if path == self._run.path:
            words = launcher.last_words(path)
            put_html(self._trouble, "" if words is None else run_progress.render_trouble(words))

    def _list_dumps(self, path: Path) -> None:
        folder = failures_folder(path)
        found = sorted(folder.glob(f"*{DUMP_SUFFIX}"))[:MAX_DUMPS] if folder.is_dir() else []
        self._dumps = found
        names = [printable(p.stem) for p in found]
        put_html(self._failed, run_progress.render_failures(names, self._handler) if names else "")

    def _dump_clicked(self, name: str, index: tuple[int, ...]) -> None:
        if name == "dump" and index[0] < len(self._dumps):
            self._replay_dump(self._dumps[index[0]])


def _speed(generations: Sequence[Generation], seen: Sequence[tuple[float, int]]) -> float | None:
    """Return evaluations per second, None while they are unknown.

    The speed is measured over the last generations, in the first one over what was seen of it.
    """
    if len(generations) > 1:
        first, last = generations[max(-len(generations), -RECENT)], generations[-1]
        seconds, n = last.seconds - first.seconds, last.n_evaluations - first.n_evaluations
    elif len(seen) > 1:
        seconds, n = seen[-1][0] - seen[0][0], seen[-1][1] - seen[0][1]
    else:
        return None
    return n / seconds if n > 0 and seconds > 0.5 else None
