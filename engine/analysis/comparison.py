"""Runs side by side: grouped by task and algorithm, described and tested.

A note, one sentence, names everything that makes the comparison less than fair.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any, Final

from engine.analysis.elite_maps import MORPHOLOGY
from engine.analysis.run_result import ALGORITHM_NAMES, NothingToCompareError, RunResult, load_result
from engine.analysis.statistics import RankSum, Statistics, Trend, describe, rank_sum, trend
from engine.config import to_json
from engine.errors import InvalidData
from engine.storage.schema import SUFFIX

ReadingObserver = Callable[[Path, int, int], None]
"""Receives the run that is read, how many are done, and how many there are."""

TESTED: Final = ("best", "qd_score")
"""Measures that algorithms are tested on, as in the paper."""


@dataclasses.dataclass(frozen=True, slots=True)
class Group:
    """The runs of one algorithm on one task.

    Attributes:
        name: as shown.
        algorithm: name of the algorithm; empty for a variant that the paper says nothing of.
        runs: at least one.
    """

    name: str
    algorithm: str
    runs: tuple[RunResult, ...]

    def values(self, measure: str) -> list[float]:
        """Return a measure of each run; runs without it are left out."""
        return [v for r in self.runs if (v := r.measure(measure)) is not None]

    def statistics(self, measure: str) -> Statistics | None:
        """Return the statistics of a measure over the runs, or None if no run has it."""
        values = self.values(measure)
        return describe(values) if values else None

    def trend(self, measure: str) -> Trend:
        """Return ``best`` (cm), ``qd_score`` (cm) or ``coverage`` (%) over evaluations."""
        steps = []
        for run in self.runs:
            points = [p for p in run.points if getattr(p, measure) is not None]
            steps.append(([p.n_evaluations for p in points], [100.0 * getattr(p, measure) for p in points]))
        return trend(steps)

    @property
    def map_shape(self) -> tuple[int, ...]:
        """Cells along each axis of the runs' morphology maps."""
        return tuple(a.n for a in self.runs[0].maps[MORPHOLOGY].axes)


@dataclasses.dataclass(frozen=True, slots=True)
class PairTest:
    """The rank-sum test of two groups on one measure."""

    measure: str
    first: Group
    second: Group
    result: RankSum


@dataclasses.dataclass(frozen=True, slots=True)
class TaskComparison:
    """The groups of one task, in the paper's order of the algorithms."""

    task: str
    groups: tuple[Group, ...]

    @property
    def runs(self) -> list[RunResult]:
        """All runs of the task."""
        return [r for g in self.groups for r in g.runs]

    def tests(self) -> list[PairTest]:
        """Return the tests of all pairs of algorithms on ``TESTED``.

        QD scores of maps with different numbers of cells are sums of different lengths, and not tested.
        """
        return [
            PairTest(m, a, b, rank_sum(a.values(m), b.values(m)))
            for m in TESTED
            for a, b in itertools.combinations(self.groups, 2)
            if a.values(m) and b.values(m) and (m != "qd_score" or a.map_shape == b.map_shape)
        ]


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
    places: Sequence[Path], *, at: int | None = None, observer: ReadingObserver | None = None
) -> Comparison:
    """Read runs and group them by task and algorithm.

    A run without a finished generation is left out and noted.

    Args:
        places: run files, and folders whose run files are taken.
        at: evaluations to compare at, see ``load_result``.
        observer: told about every run that is read.

    Raises:
        RunFileError: a file is no run or is damaged, or no run remains to be compared.
        InvalidData: ``at`` is not positive, or there is nothing to compare.
    """
    if at is not None and at < 1:
        raise InvalidData(f"the number of evaluations to compare at must be positive, not {at}")
    paths, notes = _run_files(places)
    runs: list[RunResult] = []
    left_out: NothingToCompareError | None = None
    for k, path in enumerate(paths):
        if observer:
            observer(path, k, len(paths))
        try:
            runs.append(load_result(path, at))
        except NothingToCompareError as e:
            left_out = e
            notes.append(f"{e}; it is left out.")
    if not runs:
        raise left_out or InvalidData("name at least one run file to compare")
    tasks = tuple(
        TaskComparison(task, _groups([r for r in runs if r.config.task == task]))
        for task in sorted({r.config.task for r in runs})
    )
    labels = _labels([r.path for r in runs])
    if len(tasks) > 1:
        named = ", ".join(t.task for t in tasks)
        notes.append(f"The runs are of {len(tasks)} tasks ({named}); each is compared on its own.")
    for t in tasks:
        notes += _fairness(t, labels, at)
    return Comparison(tasks, labels, tuple(notes), at)


def _run_files(places: Sequence[Path]) -> tuple[list[Path], list[str]]:
    """Return the run files of files and folders, each once, and a note on those named twice."""
    found: dict[Path, Path] = {}
    notes = []
    for place in places:
        files = sorted(place.glob(f"*{SUFFIX}")) if place.is_dir() else [place]
        if not files:
            raise InvalidData(f"the folder {place} has no run files (*{SUFFIX})")
        for file in files:
            if found.setdefault(file.resolve(), file) is not file:
                notes.append(f"{file} is named more than once; it counts once.")
    return list(found.values()), notes


def _groups(runs: list[RunResult]) -> tuple[Group, ...]:
    order = list(ALGORITHM_NAMES)
    by_name: dict[str, list[RunResult]] = {}
    for run in sorted(
        runs,
        key=lambda r: (
            order.index(r.config.algorithm) if r.config.algorithm in order else len(order),
            r.variant,
            r.config.seed,
        ),
    ):
        by_name.setdefault(run.variant, []).append(run)
    return tuple(
        Group(
            name,
            members[0].config.algorithm
            if name == ALGORITHM_NAMES.get(members[0].config.algorithm, name)
            else "",
            tuple(members),
        )
        for name, members in by_name.items()
    )


def _labels(paths: list[Path]) -> dict[Path, str]:
    stems = [p.stem for p in paths]
    return {p: p.stem if stems.count(p.stem) == 1 else str(p.with_suffix("")) for p in paths}


def _fairness(task: TaskComparison, labels: dict[Path, str], at: int | None) -> list[str]:
    """Return a sentence for each property that the runs of a task should share but do not."""
    runs, notes = task.runs, []
    reached = sorted({r.n_evaluations for r in runs})
    if len(reached) > 1:
        notes.append(
            f"Runs of {task.task} have {reached[0]:,} to {reached[-1]:,} evaluations: tables and tests"
            f" use their last. To compare them at equal cost: --at {reached[0]}, in the explorer Equal cost."
        )
    for r in runs:
        if not r.finished and at is None:
            notes.append(
                f"{labels[r.path]} is not finished: {r.n_evaluations:,} of"
                f" {r.config.evaluations:,} evaluations count."
            )
        if r.projected_from is not None:
            notes.append(
                f"{labels[r.path]} is a projection of {r.projected_from}, not an independent run: compared"
                " beside that run it counts twice."
            )
        if r.no_grid is not None:
            notes.append(f"{labels[r.path]} is not drawn as a 4-D map: {r.no_grid}.")
    experiment = _differences(runs, lambda key: key.startswith(("physics.", "trials.")))
    if experiment:
        notes.append(f"Runs of {task.task} are not of the same experiment: they differ in {experiment}.")
    decisive = {
        "mujoco": "mujoco",
        "tensatlas": "tensatlas",
        "physics": "body model",
        f"task {task.task}": "task file",
    }
    for key, what in decisive.items():
        versions = sorted({r.versions.get(key, "unknown") for r in runs})
        if len(versions) > 1:
            notes.append(f"Runs of {task.task} were made with {what} {' and '.join(versions)}.")
    for group in task.groups:
        inside = _differences(
            group.runs,
            lambda key: not key.startswith(("physics.", "trials.")) and key not in ("seed", "evaluations"),
        )
        if inside:
            notes.append(f"Runs of {group.name} on {task.task} differ in {inside}.")
        seeds = [r.config.seed for r in group.runs]
        if twice := sorted({s for s in seeds if seeds.count(s) > 1}):
            notes.append(
                f"Runs of {group.name} on {task.task} share the seed {', '.join(map(str, twice))}: they are"
                " not independent repetitions."
            )
    if len({g.map_shape for g in task.groups}) > 1:
        notes.append(
            f"Morphology maps of {task.task} have different numbers of cells: their QD scores and coverages"
            " cannot be compared, and are not tested."
        )
    return notes


def _differences(runs: Iterable[RunResult], counts: Callable[[str], bool]) -> str:
    """Return the fields in which configurations differ, with their values, or nothing."""
    flat = [dict(_flatten(to_json(r.config))) for r in runs]
    parts = []
    for key in flat[0]:
        values = sorted({str(f.get(key)) for f in flat})
        if counts(key) and len(values) > 1:
            parts.append(f"{key} ({', '.join(values)})")
    return ", ".join(parts)


def _flatten(data: dict[str, Any], prefix: str = "") -> Iterable[tuple[str, Any]]:
    for key, value in data.items():
        if isinstance(value, dict):
            yield from _flatten(value, f"{prefix}{key}.")
        else:
            yield prefix + key, value
