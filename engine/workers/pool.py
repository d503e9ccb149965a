"""An evaluator whose jobs are computed by workers that may die."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from typing import Final, Protocol

from engine.simulation.evaluation import Evaluation, FailureKeeper, Solution
from engine.simulation.provenance import Origin
from engine.workers.job import Result, World, unfinished

MAX_DEATHS: Final = 2
"""A job whose worker has died this often is not tried again."""


@dataclasses.dataclass(frozen=True, slots=True)
class Died:
    """A job's worker has died before it finished the job.

    Attributes:
        reason: how it died, in a few words.
    """

    reason: str


class Workers(Protocol):
    """Processes that compute jobs, here or elsewhere."""

    @property
    def n_workers(self) -> int:
        """Number of workers now."""
        ...

    def submit(self, world: World, solution: Solution) -> None:
        """Submit a solution; jobs are begun in the order of submission."""
        ...

    def wait(self) -> list[tuple[Solution, Result | Died]]:
        """Return the jobs finished since the last call; wait for at least one.

        Raises:
            TensAtlasError: a job fails by an error that the user can mend, or the workers cannot be reached
                any more.
        """
        ...


class PoolQueue:
    """Evaluates solutions one by one on workers; lost ones are repeated.

    Args:
        workers: compute the jobs; they stay open.
        world: of the run.
        keep_failure: called once for every evaluation in which a simulation failed.
    """

    def __init__(self, *, workers: Workers, world: World, keep_failure: FailureKeeper | None = None) -> None:
        self._workers = workers
        self._world = world
        self._keep_failure = keep_failure
        self._deaths: dict[int, int] = {}
        self._n_open = 0
        self._origins: dict[int, Origin] = {}

    def evaluate(self, solutions: Sequence[Solution]) -> Iterator[list[Evaluation]]:
        """Yield the evaluations of all solutions in groups, in whatever order they are finished."""
        self.submit(solutions)
        while self._n_open:
            yield self.collect()

    def submit(self, solutions: Sequence[Solution]) -> None:
        """Have solutions evaluated after those submitted before."""
        # the longest jobs first, so that no worker is left with one at the end
        for solution in sorted(solutions, key=lambda s: -s.morphology.n_modules):
            self._workers.submit(self._world, solution)
            self._n_open += 1

    def collect(self) -> list[Evaluation]:
        """Return evaluations that are finished, at least one; none only if none is under way."""
        found: list[Evaluation] = []
        while self._n_open and not found:
            for solution, outcome in self._workers.wait():
                if isinstance(outcome, Result):
                    found.append(self._kept(outcome))
                elif (evaluation := self._repeat(solution, outcome)) is not None:
                    found.append(evaluation)
        self._n_open -= len(found)
        return found

    def origin(self, number: int) -> Origin | None:
        """Return an evaluation's origin, once; None if no worker finished it."""
        return self._origins.pop(number, None)

    def _repeat(self, solution: Solution, death: Died) -> Evaluation | None:
        """Submit a lost job again; if too many workers have died of it, return a failed evaluation."""
        deaths = self._deaths[solution.number] = self._deaths.get(solution.number, 0) + 1
        if deaths < MAX_DEATHS:
            self._workers.submit(self._world, solution)
            return None
        return unfinished(self._world.config, solution, f"its worker died each time: {death.reason}")

    def _kept(self, result: Result) -> Evaluation:
        """Store a job's failure, if any, and return its evaluation."""
        evaluation = result.evaluation
        self._origins[evaluation.solution.number] = result.origin
        if result.failed is None or self._keep_failure is None:
            return evaluation
        failure = f"{evaluation.failure}{self._keep_failure(result.failed)}"
        return dataclasses.replace(evaluation, failure=failure)
