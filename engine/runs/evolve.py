"""Starts a run, or resumes one, and works on it until its budget is spent."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from pathlib import Path

from engine.body.module import MIN_MODULES, N_STIFFNESS_LEVELS
from engine.body.morphology import Morphology
from engine.config import RunConfig, create_algorithm
from engine.errors import InvalidData, RunFileError
from engine.replay.dump import DumpFolder
from engine.runs.run_loop import ProgressObserver, RunLoop
from engine.search.algorithm import Algorithm
from engine.search.variation import GivenRobot
from engine.simulation.evaluation import FailureKeeper
from engine.simulation.model import build_robot
from engine.simulation.physics import check_timestep
from engine.simulation.provenance import versions
from engine.storage.reader import RunReader
from engine.storage.schema import failures_folder
from engine.storage.writer import RunWriter
from engine.workers.evaluator import EvaluationQueue, LocalQueue, create_evaluator
from engine.workers.job import world_of
from engine.workers.pool import PoolQueue, Workers


def evolve(
    path: Path,
    config: RunConfig,
    *,
    given: Sequence[GivenRobot] = (),
    n_threads: int = 1,
    workers: Workers | None = None,
    observer: ProgressObserver | None = None,
) -> None:
    """Start a run and work until its budget is spent.

    Args:
        path: of the run file to create.
        config: of the run.
        given: robots that are evaluated first, in place of the first random ones.
        n_threads: threads of this process that simulate, where there are no workers.
        workers: processes here or elsewhere that evaluate instead; they stay open.
        observer: told of the progress.

    Raises:
        ClusterError: the workers cannot be reached any more; what is finished is saved.
        RunFileError: the file exists or cannot be written.
        InvalidData: robots do not survive the physics, or given ones do not fit the configuration.
    """
    check_physics(config)
    algorithm = create_algorithm(config, given)
    now = versions(config.task, config.physics.simulator)
    with RunWriter.create(path, config, now, given=given) as writer:
        _work(writer, config, algorithm, n_threads=n_threads, workers=workers, observer=observer)


def check_physics(config: RunConfig) -> None:
    """Make sure that robots can be simulated, before a file is made for them or work continues.

    Raises:
        InvalidData: the time step is too large, or MuJoCo refuses this configuration.
    """
    check_timestep(config.physics)
    body = Morphology(stiffness_level=N_STIFFNESS_LEVELS, faces=(1,) * MIN_MODULES)
    try:
        build_robot(body, config.physics)
    except ValueError as e:
        raise InvalidData(f"physics: MuJoCo refuses this robot: {str(e).splitlines()[0]}") from None


def resume(
    path: Path,
    *,
    n_threads: int = 1,
    workers: Workers | None = None,
    observer: ProgressObserver | None = None,
) -> None:
    """Resume an interrupted run exactly as if it had never stopped; do nothing if it is finished.

    Arguments: as for ``evolve``.

    Raises:
        ClusterError: the workers cannot be reached any more; what is finished is saved.
        RunFileError: the file is no run file, is damaged, or another process is writing it.
        InvalidData: it is not finished, and today's robots do not survive its physics.
    """
    with contextlib.ExitStack() as stack:
        reader = stack.enter_context(RunReader(path))
        if reader.projection is not None:
            raise RunFileError(
                f"{path} is a projection of {reader.projection.get('source', 'another run')};"
                " resume that one and project it again"
            )
        if reader.slimmed is not None:
            raise RunFileError(f"{path} is slimmed and cannot be resumed; resume the run it was made from")
        if reader.n_evaluations() < reader.config.evaluations:
            check_physics(reader.config)
        if reader.lacks_trajectories():
            raise RunFileError(f"{path} has robots without a trajectory and cannot be resumed")
        with RunWriter.open(path) as writer:
            # read under the lock, so that no other process advances the run between reading and writing
            algorithm, seconds = _restore(reader)
            stack.close()
            _work(
                writer,
                reader.config,
                algorithm,
                seconds_before=seconds,
                n_threads=n_threads,
                workers=workers,
                observer=observer,
            )


def _restore(reader: RunReader) -> tuple[Algorithm, float]:
    with reader.guard():
        algorithm = create_algorithm(reader.config, reader.given())
    last = reader.last_closed()
    state = reader.algorithm_state()
    if last is None:
        return algorithm, 0.0
    if state is None:
        raise RunFileError(f"{reader.path} has lost its state and cannot be resumed; it can be viewed")
    contents = {name: reader.contents(name, last.number) for name in algorithm.archives}
    with reader.guard():
        algorithm.restore(state, contents, reader.evaluations)
    return algorithm, last.seconds


def _work(
    writer: RunWriter,
    config: RunConfig,
    algorithm: Algorithm,
    *,
    seconds_before: float = 0.0,
    n_threads: int,
    workers: Workers | None,
    observer: ProgressObserver | None,
) -> None:
    dumps = DumpFolder(
        failures_folder(writer.path),
        config=config,
        versions=versions(config.task, config.physics.simulator),
        n_failed=writer.n_failed(),
    )
    queue = create_queue(config, dumps.keep, n_threads=n_threads, workers=workers)
    RunLoop(writer, config, algorithm, seconds_before=seconds_before, queue=queue, observer=observer).run()


def create_queue(
    config: RunConfig, keep_failure: FailureKeeper, *, n_threads: int, workers: Workers | None
) -> EvaluationQueue:
    """Return what evaluates a run's solutions: the workers, or without any the threads of this process."""
    if workers is None:
        return LocalQueue(create_evaluator(config, n_threads, keep_failure))
    return PoolQueue(workers=workers, world=world_of(config), keep_failure=keep_failure)
