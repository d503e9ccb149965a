"""Evaluates a run's elites again under fresh noise; an interrupted call can be continued."""

from __future__ import annotations

import contextlib
import dataclasses
import hashlib
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from engine.analysis.elite_maps import CountObserver, archive_maps, load_maps
from engine.analysis.robustness import (
    MAX_REPEATS,
    MapRobustness,
    Robustness,
    load_robust_of,
    map_robustness,
    robust_path,
    save_robust,
)
from engine.analysis.verify import with_noise
from engine.config import RunConfig
from engine.errors import InvalidData, RunFileError
from engine.files import compact_json
from engine.runs.evolve import check_physics
from engine.simulation.evaluation import Evaluation, Solution
from engine.simulation.physics import Physics, physics_to_json
from engine.simulation.provenance import versions
from engine.storage.lock import RunLock
from engine.storage.reader import RunReader
from engine.tasks import get_task, task_version
from engine.workers.evaluator import create_evaluator

_SAVE_INTERVAL: Final = 5.0
"""Most seconds of work that a killed process loses, besides the group under way."""
_DECISIVE: Final = ("mujoco", "numpy", "tensatlas", "machine", "physics")
"""Versions that decide results; results of different versions are not mixed. A task's file is one more."""


BuiltOf = tuple[str, Callable[[int], Physics]]
"""What robots are built from, and by the stiffness level of a body, 1 to 10, how it is simulated then."""


def reevaluate(
    run: Path,
    *,
    repeats: int,
    archive: str | None = None,
    robots: BuiltOf | None = None,
    n_threads: int = 1,
    observer: CountObserver | None = None,
) -> tuple[Robustness, list[MapRobustness]]:
    """Evaluate a run's elites again under fresh noise, and keep the results beside the run.

    What the file beside the run already has is not simulated again. The results are saved as they come, and
    the next call with the same file continues an interrupted one.

    Args:
        run: run file.
        repeats: evaluations of each elite, all targets and the run's repeats each.
        archive: the only archive whose elites are evaluated, or ``morphology`` or ``controller`` for a map of
            a 4-D archive; None for all archives.
        robots: what the robots are built from, and how they are simulated then; they keep their heads. None
            for robots as evolved.
        n_threads: threads inside MuJoCo; the result does not depend on it.
        observer: told about progress.

    Returns:
        Everything that is known now, and the figures of each archive asked for.

    Raises:
        InvalidData: the number of repeats is out of range, results from before are of another run or of
            other versions, or today's robots do not survive the run's physics.
        RunFileError: the run cannot be read or has no such archive, or the results cannot be written or are
            being written by another process.
    """
    if not 1 <= repeats <= MAX_REPEATS:
        raise InvalidData(f"repeats must be from 1 to {MAX_REPEATS}, not {repeats}")
    built = robots is not None
    with RunReader(run) as reader, _alone(robust_path(run, as_built=built)) as path:
        config = reader.config
        if robots is not None:
            config = dataclasses.replace(config, physics=robots[1](1))
        check_physics(config)
        last = reader.finished_generation()
        if archive in last.archives or archive is None:
            maps = archive_maps(reader, last)
        else:
            maps = load_maps(reader, last)
        if archive is not None and archive not in maps:
            reader.finished_generation(archive)  # says which there are
        maps = {name: maps[name] for name in ([archive] if archive else sorted(maps))}
        elites = {n: fitness for m in maps.values() for fitness, n in m.elites.values()}
        before = load_robust_of(reader, as_built=built)
        decisive = _decisive(config.task, robots)
        _check_versions(before, path, decisive)
        recorded = dict(before.recorded if before else {}) | elites
        samples = {n: dict(k) for n, k in (before.samples if before else {}).items()}
        missing = [
            (n, k) for n in sorted(elites) for k in range(1, repeats + 1) if k not in samples.get(n, {})
        ]
        known = reader.evaluations({n for n, _ in missing})
        jobs: dict[int, tuple[int, int]] = {}
        solutions = []
        for n, k in missing:
            solution: Solution = with_noise(known[n].solution, k)
            jobs[solution.number] = (n, k)
            solutions.append(solution)

        def result() -> Robustness:
            return Robustness(
                reader.created_at,
                decisive,
                dict(sorted(recorded.items())),
                {n: dict(sorted(samples.get(n, {}).items())) for n in sorted(recorded)},
            )

        saved_at, n_done = time.monotonic(), 0
        try:
            for group in _evaluated(config, solutions, known, jobs, robots, n_threads):
                for e in group:
                    n, k = jobs[e.solution.number]
                    samples.setdefault(n, {})[k] = e.fitness
                n_done += len(group)
                if time.monotonic() - saved_at > _SAVE_INTERVAL:
                    save_robust(result(), path)
                    saved_at = time.monotonic()
                if observer:
                    observer(n_done, len(solutions))
        finally:
            if n_done:
                save_robust(result(), path)
        robust = result()
        distance = get_task(reader.config.task).target_distance
        return robust, [map_robustness(name, m, robust, distance) for name, m in maps.items()]


def _evaluated(
    config: RunConfig,
    solutions: Sequence[Solution],
    known: Mapping[int, Evaluation],
    jobs: Mapping[int, tuple[int, int]],
    robots: BuiltOf | None,
    n_threads: int,
) -> Iterator[list[Evaluation]]:
    """Yield the evaluations of solutions; built robots have their own masses, and the heads of the run."""
    if robots is None:
        yield from create_evaluator(config, n_threads).evaluate(solutions)
        return
    alike: dict[tuple[int, bool], list[Solution]] = {}
    for s in solutions:
        level = round(float(np.mean(s.morphology.stiffness_levels)))
        alike.setdefault((level, known[jobs[s.number][0]].head_is_end), []).append(s)
    for (level, is_end), own in sorted(alike.items()):
        of_level = dataclasses.replace(config, physics=robots[1](level))
        yield from create_evaluator(of_level, n_threads, head_is_end=is_end).evaluate(own)


@contextlib.contextmanager
def _alone(path: Path) -> Iterator[Path]:
    """Lock a file for a ``with`` block: two writers would overwrite each other's results."""
    try:
        lock = RunLock.acquire(path)
    except OSError as e:
        raise RunFileError(f"{path} cannot be written: {e.strerror}") from None
    try:
        yield path
    finally:
        lock.release()


def _decisive(task: str, robots: BuiltOf | None) -> dict[str, str]:
    now = versions(task)
    found = {name: now[name] for name in _DECISIVE} | task_version(task)
    if robots is not None:
        digest = hashlib.sha256(compact_json(physics_to_json(robots[1](1))).encode()).hexdigest()
        found["robots of"] = f"{robots[0]} ({digest[:12]})"
    return found


def _check_versions(before: Robustness | None, path: Path, decisive: Mapping[str, str]) -> None:
    for name, now in decisive.items() if before else ():
        then = before.versions.get(name) if before else None
        if then != now:
            raise InvalidData(f"{path} was made with {name} {then}, this is {now}; delete it to begin anew")
