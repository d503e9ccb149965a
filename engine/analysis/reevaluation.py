"""Evaluates a run's elites again under fresh noise; an interrupted call can be continued."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Final

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
from engine.errors import InvalidData, RunFileError
from engine.runs.evolve import check_physics
from engine.simulation.evaluation import Solution
from engine.simulation.provenance import versions
from engine.storage.lock import RunLock
from engine.storage.reader import RunReader
from engine.tasks import get_task, task_version
from engine.workers.evaluator import create_evaluator

_SAVE_INTERVAL: Final = 5.0
"""Most seconds of work that a killed process loses, besides the group under way."""
_DECISIVE: Final = ("mujoco", "numpy", "tensatlas", "machine", "physics")
"""Versions that decide results; results of different versions are not mixed. A task's file is one more."""


def reevaluate(
    run: Path,
    *,
    repeats: int,
    archive: str | None = None,
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
    with RunReader(run) as reader, _alone(robust_path(run)) as path:
        check_physics(reader.config)
        last = reader.finished_generation()
        if archive in last.archives or archive is None:
            maps = archive_maps(reader, last)
        else:
            maps = load_maps(reader, last)
        if archive is not None and archive not in maps:
            reader.finished_generation(archive)  # says which there are
        maps = {name: maps[name] for name in ([archive] if archive else sorted(maps))}
        elites = {n: fitness for m in maps.values() for fitness, n in m.elites.values()}
        before = load_robust_of(reader)
        _check_versions(before, path, reader.config.task)
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
                _decisive(reader.config.task),
                dict(sorted(recorded.items())),
                {n: dict(sorted(samples.get(n, {}).items())) for n in sorted(recorded)},
            )

        saved_at, n_done = time.monotonic(), 0
        try:
            for group in create_evaluator(reader.config, n_threads).evaluate(solutions):
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


def _decisive(task: str) -> dict[str, str]:
    now = versions(task)
    return {name: now[name] for name in _DECISIVE} | task_version(task)


def _check_versions(before: Robustness | None, path: Path, task: str) -> None:
    for name, now in _decisive(task).items() if before else ():
        then = before.versions.get(name) if before else None
        if then != now:
            raise InvalidData(f"{path} was made with {name} {then}, this is {now}; delete it to begin anew")
