"""What a terminal shows while a command works: an evolution as it goes, or a bar that counts."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator
from typing import Self

from rich.console import Console, Group
from rich.live import Live
from rich.progress import BarColumn, MofNCompleteColumn, TaskID, TextColumn, TimeRemainingColumn
from rich.progress import Progress as Bar
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from engine.runs.run_loop import Progress
from engine.storage.rows import archive_figures

PLAIN_INTERVAL = 30.0
"""Seconds between two lines where the output is no terminal."""


class ProgressDisplay:
    """Shows a run's progress; as a context manager."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._live = Live(console=console, refresh_per_second=4, transient=False)
        self._last_line = -PLAIN_INTERVAL

    def __enter__(self) -> Self:
        if self._console.is_terminal:
            self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._live.stop()

    def update(self, progress: Progress) -> None:
        """Show a new state."""
        if self._console.is_terminal:
            self._live.update(_panel(progress))
            return
        now = time.monotonic()
        if now - self._last_line >= PLAIN_INTERVAL or progress.n_evaluations >= progress.budget:
            self._last_line = now
            self._console.print(_line(progress), markup=False)


@contextlib.contextmanager
def counting(console: Console, what: str) -> Iterator[Callable[[int, int], None]]:
    """Show a bar from the first count on; yield a function to call with how many of how many are done.

    Where the output is not a terminal, print a line from time to time instead.
    """
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Bar(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        tasks: list[TaskID] = []
        last_line = time.monotonic()

        def update(n: int, total: int) -> None:
            nonlocal last_line
            if not tasks:
                tasks.append(bar.add_task(what, total=total))
            bar.update(tasks[0], completed=n)
            if not console.is_terminal and time.monotonic() - last_line >= PLAIN_INTERVAL:
                last_line = time.monotonic()
                console.print(f"{what}: {n} of {total}", markup=False)

        yield update


def _rate_and_time_left(progress: Progress) -> tuple[float, float | None]:
    """Return evaluations per second and the seconds left, None before the first evaluation."""
    if not progress.n_new or progress.seconds <= 0.0:
        return 0.0, None
    rate = progress.n_new / progress.seconds
    return rate, (progress.budget - progress.n_evaluations) / rate


def _duration(seconds: float | None) -> str:
    """Return a duration as text, such as 1:02:03."""
    if seconds is None:
        return "--:--"
    minutes, s = divmod(round(seconds), 60)
    hours, m = divmod(minutes, 60)
    return f"{hours}:{m:02d}:{s:02d}" if hours else f"{m}:{s:02d}"


def _line(p: Progress) -> str:
    rate, left = _rate_and_time_left(p)
    first = next(iter(p.archives.values()))
    best = archive_figures(first, p.initial_distance)["best"]
    return (
        f"generation {p.generation}  {p.n_evaluations}/{p.budget} evaluations"
        f"  {rate:.2f}/s  {_duration(left)} left"
        f"  best f_s {'-' if best is None else f'{100 * best:.2f} cm'}"
    )


def _panel(p: Progress) -> Group:
    rate, left = _rate_and_time_left(p)
    head = Text(
        f"generation {p.generation}   {p.n_evaluations} of {p.budget} evaluations"
        f"   {rate:.2f} per s   {_duration(left)} left" + (f"   {p.n_failed} failed" if p.n_failed else "")
    )
    table = Table(box=None, padding=(0, 2, 0, 0))
    for title in ("archive", "best f_s", "mean f_s", "QD score", "coverage"):
        table.add_column(title, justify="left" if title == "archive" else "right")
    for name, archive in p.archives.items():
        f = archive_figures(archive, p.initial_distance)
        table.add_row(
            name,
            _cm(f["best"]),
            _cm(f["mean"]),
            _cm(f["qd_score"], 1),
            f"{len(archive)}/{archive.n_cells}",
        )
    return Group(head, ProgressBar(total=p.budget, completed=p.n_evaluations, width=60), table)


def _cm(value: float | None, digits: int = 2) -> str:
    return "-" if value is None else f"{100 * value:.{digits}f} cm"
