"""Configuration + algorithm + evaluator + store: start a run, go on with one, finish it."""

from __future__ import annotations

import contextlib
import dataclasses
import time
from collections import defaultdict, deque
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from engine.body.module import MIN_MODULES, N_STIFFNESS_LEVELS
from engine.body.morphology import Morphology
from engine.config import RunConfig, create_algorithm
from engine.errors import InvalidData, RunFileError
from engine.replay.dump import DumpFolder
from engine.search.algorithm import Algorithm, Snapshot
from engine.search.archive import GridArchive
from engine.simulation.evaluation import Evaluation, Evaluator, LocalEvaluator, Solution
from engine.simulation.model import build_robot
from engine.simulation.physics import check_timestep
from engine.simulation.provenance import versions
from engine.storage.reader import RunReader
from engine.storage.writer import RunWriter
from engine.tasks import get_task
from engine.workers.evaluator import LocalStream, Stream
from engine.workers.job import world_of
from engine.workers.pool import PoolEvaluator, Workers


@dataclasses.dataclass(frozen=True, slots=True)
class Progress:
    """How far a run is.

    Attributes:
        generation: the generation under way, or the last one when it has just been closed.
        n_evaluations: finished evaluations of the whole run.
        budget: evaluations when the run is finished.
        n_new: evaluations that this process finished.
        seconds: computing time of this process.
        n_failed: evaluations in which a simulation failed, in this process.
        archives: the archives after the last closed generation.
        initial_distance: d_init of f_s, in m.
    """

    generation: int
    n_evaluations: int
    budget: int
    n_new: int
    seconds: float
    n_failed: int
    archives: dict[str, GridArchive]
    initial_distance: float


Observer = Callable[[Progress], None]


def failures_folder(path: Path) -> Path:
    """Return the folder beside a run file where the dumps of its failed simulations are kept."""
    return path.with_name(f"{path.stem}.failures")


def create_evaluator(config: RunConfig, n_threads: int, dumps: DumpFolder | None = None) -> Evaluator:
    """Return an evaluator on this machine's threads that keeps failures in a folder, if any."""
    return LocalEvaluator(
        task=get_task(config.task),
        physics=config.physics,
        trials=config.trials,
        run_seed=config.seed,
        n_threads=n_threads,
        keep_failure=None if dumps is None else dumps.keep,
    )


def evolve(
    path: Path,
    config: RunConfig,
    *,
    n_threads: int = 1,
    workers: Workers | None = None,
    observer: Observer | None = None,
) -> None:
    """Start a run and work until its budget is spent.

    Args:
        path: of the run file to create.
        config: of the run.
        n_threads: threads of this process that simulate, where there are no workers.
        workers: processes here or elsewhere that evaluate instead; they stay open.
        observer: told of the progress.

    Raises:
        ClusterError: the workers cannot be reached any more; what is finished is saved.
        RunFileError: the file exists or cannot be written.
        InvalidData: robots do not survive the physics.
    """
    check_physics(config)
    with RunWriter.create(path, config, versions(config.task)) as writer:
        _work(writer, config, create_algorithm(config), 0.0, _streams(n_threads, workers), observer)


def check_physics(config: RunConfig) -> None:
    """Make sure that robots can be simulated, before a file is made for them or work goes on.

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
    path: Path, *, n_threads: int = 1, workers: Workers | None = None, observer: Observer | None = None
) -> None:
    """Go on with an interrupted run, exactly as if it had never stopped; nothing if it is finished.

    Args as of ``evolve``.

    Raises:
        ClusterError: the workers cannot be reached any more; what is finished is saved.
        RunFileError: the file is no run file, is damaged, or another process is writing it.
        InvalidData: it is not finished, and today's robots do not survive its physics.
    """
    with contextlib.ExitStack() as stack:
        # The reader comes first: it opens and closes the file once more to look at its header, and
        # closing any descriptor of a file drops the locks that this process holds on it.
        reader = stack.enter_context(RunReader(path))
        if reader.projection is not None:
            raise RunFileError(
                f"{path} is a projection of {reader.projection.get('source', 'another run')};"
                " resume that one and project it again"
            )
        if reader.n_evaluations() < reader.config.evaluations:
            check_physics(reader.config)
        if reader.lacks_trajectories():
            raise RunFileError(f"{path} has robots without a trajectory and cannot be gone on with")
        with RunWriter.open(path) as writer:
            # read under the lock: nobody else moves the run on between reading and going on
            algorithm, seconds = _restore(reader)
            stack.close()
            _work(writer, reader.config, algorithm, seconds, _streams(n_threads, workers), observer)


def _restore(reader: RunReader) -> tuple[Algorithm, float]:
    algorithm = create_algorithm(reader.config)
    last = reader.last_closed()
    state = reader.algorithm_state()
    if last is None or state is None:
        return algorithm, 0.0
    contents = {name: reader.contents(name, last.number) for name in algorithm.archives}
    with reader.guard():
        algorithm.restore(state, contents, reader.evaluations)
    return algorithm, last.seconds


def _streams(n_threads: int, workers: Workers | None) -> Callable[[RunConfig, DumpFolder], Stream]:
    """Return what makes the stream of a run's evaluations, which keeps failures in a folder."""

    def make(config: RunConfig, dumps: DumpFolder) -> Stream:
        if workers is None:
            return LocalStream(create_evaluator(config, n_threads, dumps))
        return PoolEvaluator(workers=workers, world=world_of(config), keep_failure=dumps.keep)

    return make


@dataclasses.dataclass(slots=True)
class _UnderWay:
    """A generation that has been asked for and not yet told."""

    number: int
    solutions: Sequence[Solution]
    finished: dict[int, Evaluation]


def _work(
    writer: RunWriter,
    config: RunConfig,
    algorithm: Algorithm,
    seconds_before: float,
    stream_for: Callable[[RunConfig, DumpFolder], Stream],
    observer: Observer | None,
) -> None:
    dumps = DumpFolder(
        failures_folder(writer.path),
        config=config,
        versions=versions(config.task),
        n_failed=writer.n_failed(),
    )
    stream = stream_for(config, dumps)
    distance = get_task(config.task).target_distance
    started = time.monotonic()
    n_new = n_failed = 0
    n_told = writer.n_told(algorithm.generation)
    under_way: deque[_UnderWay] = deque()
    generation_of: dict[int, _UnderWay] = {}

    def report() -> None:
        if observer:
            observer(
                Progress(
                    generation=algorithm.generation,
                    n_evaluations=n_told + sum(len(g.finished) for g in under_way),
                    budget=config.evaluations,
                    n_new=n_new,
                    seconds=time.monotonic() - started,
                    n_failed=n_failed,
                    archives=dict(algorithm.archives),
                    initial_distance=distance,
                )
            )

    def begin(solutions: Sequence[Solution]) -> None:
        number = algorithm.generation + len(under_way)
        finished = {e.solution.number: e for e in writer.pending(number)}
        _check_pending(writer.path, finished, solutions)
        generation = _UnderWay(number, solutions, finished)
        under_way.append(generation)
        waiting = [s for s in solutions if s.number not in finished]
        generation_of.update((s.number, generation) for s in waiting)
        stream.submit(waiting)

    def save(group: Sequence[Evaluation]) -> None:
        by_generation: dict[int, list[Evaluation]] = defaultdict(list)
        for e in group:
            generation = generation_of.pop(e.solution.number)
            generation.finished[e.solution.number] = e
            by_generation[generation.number].append(e)
        for number, ours in by_generation.items():
            writer.add_evaluations(number, ours, [stream.origin(e.solution.number) for e in ours])

    for solutions in algorithm.outstanding:
        begin(solutions)
    while True:
        while len(under_way) <= config.overlap and (asked := algorithm.ask()):
            begin(asked)
        report()
        if not under_way:
            return
        oldest = under_way[0]
        while len(oldest.finished) < len(oldest.solutions):
            group = stream.collect()
            save(group)
            n_new += len(group)
            n_failed += sum(e.failure is not None for e in group)
            report()
        algorithm.tell(list(oldest.finished.values()))
        under_way.popleft()
        n_told += len(oldest.solutions)
        writer.close_generation(
            algorithm,
            statistics(algorithm, distance),
            seconds_before + time.monotonic() - started,
        )


def _check_pending(path: Path, finished: dict[int, Evaluation], solutions: Sequence[Solution]) -> None:
    """Make sure that what an interrupted generation left behind belongs to the solutions asked for."""
    asked = {s.number: s for s in solutions}
    for number, e in finished.items():
        if asked.get(number) != e.solution:
            raise RunFileError(
                f"{path} cannot be gone on with: solution {number} comes out differently with the"
                " versions installed now; 'tensatlas info' shows those it was started with"
            )


def statistics(algorithm: Snapshot, initial_distance: float) -> dict[str, Any]:
    """Return the JSON-ready figures of an algorithm's archives, as ``reader.ArchiveFigures`` has them."""
    return {
        name: {
            **archive_figures(archive, initial_distance),
            "axes": [dataclasses.asdict(a) for a in algorithm.axes(name)],
        }
        for name, archive in algorithm.archives.items()
    }


def archive_figures(archive: GridArchive, initial_distance: float) -> dict[str, float | None]:
    """Return best and mean f_s, QD score (m) and coverage of an archive."""
    best: Evaluation | None = archive.best()
    qd_score = archive.qd_score(initial_distance)
    return {
        "best": None if best is None or best.fitness is None else initial_distance - best.fitness,
        "mean": qd_score / len(archive) if len(archive) else None,
        "qd_score": qd_score,
        "coverage": archive.coverage,
    }
