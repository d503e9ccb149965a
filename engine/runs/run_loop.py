"""The loop of a run: ask, evaluate, save, tell, close the generation; again until the budget is spent."""

from __future__ import annotations

import dataclasses
import time
from collections import defaultdict, deque
from collections.abc import Callable, Sequence
from pathlib import Path

from engine.config import RunConfig
from engine.errors import RunFileError
from engine.search.algorithm import Algorithm
from engine.search.archive import GridArchive
from engine.simulation.evaluation import Evaluation, Solution
from engine.storage.rows import statistics
from engine.storage.writer import RunWriter
from engine.tasks import get_task
from engine.workers.evaluator import EvaluationQueue


@dataclasses.dataclass(frozen=True, slots=True)
class Progress:
    """The progress of a run.

    Attributes:
        generation: number of generations closed so far.
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


ProgressObserver = Callable[[Progress], None]
"""Receives a run's progress."""


@dataclasses.dataclass(slots=True)
class _Generation:
    """A generation that has been asked for and not yet told."""

    number: int
    solutions: Sequence[Solution]
    finished: dict[int, Evaluation]


class RunLoop:
    """Works on a run until its budget is spent.

    Evaluations that an interrupted process left of an unfinished generation are used. Every evaluation is
    saved as soon as it is finished, every generation as soon as it is told.

    Args:
        writer: of the run's file.
        config: of the run.
        algorithm: in its state after the last closed generation.
        seconds_before: computing time of earlier processes.
        queue: evaluates the solutions.
        observer: receives the progress.
    """

    def __init__(
        self,
        writer: RunWriter,
        config: RunConfig,
        algorithm: Algorithm,
        *,
        seconds_before: float,
        queue: EvaluationQueue,
        observer: ProgressObserver | None,
    ) -> None:
        self._writer = writer
        self._config = config
        self._algorithm = algorithm
        self._seconds_before = seconds_before
        self._queue = queue
        self._observer = observer
        self._initial_distance = get_task(config.task).target_distance
        self._started = time.monotonic()
        self._n_told = writer.n_told(algorithm.generation)
        self._n_new = self._n_failed = 0
        self._under_way: deque[_Generation] = deque()
        self._generation_of: dict[int, _Generation] = {}

    def run(self) -> None:
        """Work until the budget is spent.

        Raises:
            ClusterError: the workers cannot be reached any more; what is finished is saved.
            RunFileError: the file cannot be written, or an interrupted generation is not what the
                algorithm asks for now.
        """
        for solutions in self._algorithm.outstanding:
            self._begin(solutions)
        while True:
            while len(self._under_way) <= self._config.overlap and (asked := self._algorithm.ask()):
                self._begin(asked)
            self._report()
            if not self._under_way:
                return
            self._finish_oldest()

    def _begin(self, solutions: Sequence[Solution]) -> None:
        """Submit a generation, except the evaluations that an interrupted process has finished."""
        number = self._algorithm.generation + len(self._under_way)
        finished = {e.solution.number: e for e in self._writer.pending(number)}
        _check_pending(self._writer.path, finished, solutions)
        generation = _Generation(number, solutions, finished)
        self._under_way.append(generation)
        waiting = [s for s in solutions if s.number not in finished]
        self._generation_of.update((s.number, generation) for s in waiting)
        self._queue.submit(waiting)

    def _finish_oldest(self) -> None:
        """Collect evaluations until the oldest generation is complete, tell it and close it."""
        oldest = self._under_way[0]
        while len(oldest.finished) < len(oldest.solutions):
            self._save(self._queue.collect())
            self._report()
        self._algorithm.tell(list(oldest.finished.values()))
        self._under_way.popleft()
        self._n_told += len(oldest.solutions)
        self._writer.close_generation(
            self._algorithm,
            statistics(self._algorithm, self._initial_distance),
            self._seconds_before + time.monotonic() - self._started,
        )

    def _save(self, evaluations: Sequence[Evaluation]) -> None:
        """Save finished evaluations, of whichever generations under way."""
        by_generation: dict[int, list[Evaluation]] = defaultdict(list)
        for e in evaluations:
            generation = self._generation_of.pop(e.solution.number)
            generation.finished[e.solution.number] = e
            by_generation[generation.number].append(e)
        for number, ours in by_generation.items():
            origins = [self._queue.origin(e.solution.number) for e in ours]
            self._writer.add_evaluations(number, ours, origins)
        self._n_new += len(evaluations)
        self._n_failed += sum(e.failure is not None for e in evaluations)

    def _report(self) -> None:
        if self._observer is None:
            return
        self._observer(
            Progress(
                generation=self._algorithm.generation,
                n_evaluations=self._n_told + sum(len(g.finished) for g in self._under_way),
                budget=self._config.evaluations,
                n_new=self._n_new,
                seconds=time.monotonic() - self._started,
                n_failed=self._n_failed,
                archives=dict(self._algorithm.archives),
                initial_distance=self._initial_distance,
            )
        )


def _check_pending(path: Path, finished: dict[int, Evaluation], solutions: Sequence[Solution]) -> None:
    """Make sure that what an interrupted generation left behind belongs to the solutions asked for."""
    asked = {s.number: s for s in solutions}
    for number, e in finished.items():
        if asked.get(number) != e.solution:
            raise RunFileError(
                f"{path} cannot be resumed: solution {number} comes out differently with the"
                " versions installed now; 'tensatlas info' shows those it was started with"
            )
