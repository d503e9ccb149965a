"""Runs side by side: read, and put into groups by what they differ in."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from pathlib import Path

from engine.analysis.comparison.fairness import fairness
from engine.analysis.comparison.run_result import NothingToCompareError, RunResult, load_result
from engine.analysis.comparison.task_comparison import Group, TaskComparison, make_groups
from engine.analysis.run_files import run_files
from engine.errors import InvalidData, printable

ReadingObserver = Callable[[Path, int, int], None]
"""Receives the run that is read, how many are done, and how many there are."""


@dataclasses.dataclass(frozen=True, slots=True)
class Comparison:
    """Everything that is compared.

    Attributes:
        tasks: each on its own.
        labels: a short name for each run, by path.
        notes: sentences on what makes the comparison less than fair, and on what was left out.
        at: evaluations that runs were cut at, or None.
    """

    tasks: tuple[TaskComparison, ...]
    labels: dict[Path, str]
    notes: tuple[str, ...]
    at: int | None = None


def compare_runs(
    places: Sequence[Path],
    *,
    at: int | None = None,
    above: float | None = None,
    baseline: str | None = None,
    observer: ReadingObserver | None = None,
) -> Comparison:
    """Read runs and group them by task and by what their configurations differ in.

    A run without a finished generation is left out and noted.

    Args:
        places: run files, and folders whose run files are taken.
        at: evaluations to compare at, see ``load_result``.
        above: f_s in m above which cells are counted; None: what the task says.
        baseline: the group that all others of its task are tested against: its name, or the label of one of
            its runs. None: all groups are tested against each other.
        observer: told about every run that is read.

    Raises:
        RunFileError: a file is no run or is damaged, or no run remains to be compared.
        InvalidData: ``at`` is not positive, there is nothing to compare, or no such baseline.
    """
    if at is not None and at < 1:
        raise InvalidData(f"the number of evaluations to compare at must be positive, not {at}")
    paths, notes = run_files(places)
    runs: list[RunResult] = []
    left_out: NothingToCompareError | None = None
    for k, path in enumerate(paths):
        if observer:
            observer(path, k, len(paths))
        try:
            runs.append(load_result(path, at, above))
        except NothingToCompareError as e:
            left_out = e
            notes.append(f"{e}; it is left out.")
    if not runs:
        raise left_out or InvalidData("name at least one run file to compare")
    labels = _labels([r.path for r in runs])
    tasks = _tasks(runs, labels, at, baseline)
    if len(tasks) > 1:
        named = ", ".join(t.task for t in tasks)
        notes.append(f"The runs are of {len(tasks)} tasks ({named}); each is compared on its own.")
    for t in tasks:
        notes += fairness(t, labels, at)
    return Comparison(tasks, labels, tuple(notes), at)


def _labels(paths: list[Path]) -> dict[Path, str]:
    stems = [p.stem for p in paths]
    return {p: printable(p.stem if stems.count(p.stem) == 1 else str(p.with_suffix(""))) for p in paths}


def _tasks(
    runs: list[RunResult], labels: dict[Path, str], at: int | None, baseline: str | None
) -> tuple[TaskComparison, ...]:
    by_task = {
        task: make_groups([r for r in runs if r.config.task == task], at)
        for task in sorted({r.config.task for r in runs})
    }
    if baseline is None:
        return tuple(TaskComparison(task, groups) for task, groups in by_task.items())
    every = [g for groups in by_task.values() for g in groups]
    meant = [g for g in every if _is_called(g, baseline, labels)]
    if not meant:
        names = "; ".join(dict.fromkeys(g.name for g in every))
        raise InvalidData(f"no group is called {baseline!r}, and no run; the groups are: {names}")
    # a run is of one task, and a group may be called otherwise in another: there its settings tell
    alike = meant + [g for g in every if any(g.settings == m.settings for m in meant)]
    return tuple(
        TaskComparison(task, groups, next((g for g in alike if g in groups), None))
        for task, groups in by_task.items()
    )


def _is_called(group: Group, name: str, labels: dict[Path, str]) -> bool:
    return group.name.casefold() == name.casefold() or any(labels[r.path] == name for r in group.runs)
