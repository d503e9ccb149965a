"""What makes a comparison less than fair: a sentence for each thing that runs should share but do not."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from engine.analysis.comparison.groups import differing, value_text
from engine.analysis.comparison.task_comparison import Group, TaskComparison


def fairness(task: TaskComparison, labels: dict[Path, str], at: int | None) -> list[str]:
    """Return a sentence for each property that the runs of a task should share but do not."""
    runs, notes = task.runs, []
    reached = sorted({r.n_evaluations for r in runs})
    if len(reached) > 1:
        notes.append(
            f"Runs of {task.task} have {reached[0]:,} to {reached[-1]:,} evaluations: tables and tests"
            f" use their last. At equal cost, each would be taken as it was at {reached[0]:,} evaluations."
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
    experiment = _differences(task.groups)
    if experiment:
        notes.append(f"Groups of {task.task} are not of the same experiment: they differ in {experiment}.")
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
        seeds = [r.config.seed for r in group.runs]
        if twice := sorted({s for s in seeds if seeds.count(s) > 1}):
            notes.append(
                f"Runs of {group.name} on {task.task} share the seed {', '.join(map(str, twice))}: they are"
                " not independent repetitions."
            )
    notes += _dependence(task) + _fresh_noise(task, labels)
    if len({g.map_shape for g in task.groups}) > 1:
        notes.append(
            f"Morphology maps of {task.task} have different numbers of cells: their QD scores and coverages"
            " cannot be compared, and are not tested."
        )
    return notes


def _dependence(task: TaskComparison) -> list[str]:
    """Return what the tests take as independent though it began with the same random robots."""
    apart = {(t.first.name, t.second.name): t for t in task.tests if t.result.kind == "rank-sum"}
    notes = []
    for test in apart.values():
        seeds = sorted({r.config.seed for r in test.first.runs if any(map(r.repeats, test.second.runs))})
        if seeds:
            notes.append(
                f"Some runs of {test.first.name} and {test.second.name} on {task.task} began with the same"
                f" random robots (seed {', '.join(map(str, seeds))}): the rank-sum test takes them as"
                " independent. Give all runs seeds of their own, or both groups the same seeds."
            )
    return notes


def _fresh_noise(task: TaskComparison, labels: Mapping[Path, str]) -> list[str]:
    """Return what is uneven about the elites that were evaluated again."""
    runs = task.runs
    known = [r for r in runs if r.robust is not None]
    notes = [
        f"The figures of {labels[r.path]} under fresh noise are left out: {r.no_robust} were evaluated again."
        " 'tensatlas reevaluate' adds the others, but only of a run's last generation."
        for r in runs
        if r.no_robust is not None
    ]
    if known and len(known) < len(runs):
        notes.append(
            f"{len(known)} of {len(runs)} runs of {task.task} have all elites evaluated again: figures under"
            " fresh noise are of these alone."
        )
    repeats = sorted({r.robust.n_repeats for r in known if r.robust is not None})
    if len(repeats) > 1:
        notes.append(
            f"Elites of {task.task} were evaluated again {repeats[0]} to {repeats[-1]} times: the fewer,"
            " the more luck is left in their means."
        )
    return notes


def _differences(groups: Sequence[Group]) -> str:
    """Return the settings of the experiment, not of the search, that groups differ in, or nothing."""
    parts = []
    for key in differing(g.settings for g in groups):
        if key.startswith(("physics.", "trials.")):
            values = dict.fromkeys(value_text(g.settings.get(key)) for g in groups)
            parts.append(f"{key} ({', '.join(sorted(values))})")
    return ", ".join(parts)
