"""An evaluator whose jobs are computed by workers that may die."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from typing import Final, Protocol

from engine.simulation.evaluation import Evaluation, FailureKeeper, Solution, in_groups, most_together
from engine.simulation.provenance import Origin
from engine.workers.job import Result, World, unfinished

MAX_DEATHS: Final = 2
"""A solution that its worker has died of this often, alone with it, is not tried again."""


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

    def submit(self, world: World, solutions: Sequence[Solution]) -> None:
        """Submit a job of some solutions; jobs are begun in the order of submission."""
        ...

    def wait(self) -> list[tuple[Sequence[Solution], list[Result] | Died]]:
        """Return the jobs finished since the last call; wait for at least one.

        Raises:
            TensAtlasError: a job fails by an error that the user can mend, or the workers cannot be reached
                any more.
        """
        ...


class PoolQueue:
    """Evaluates solutions on workers; those of lost jobs are evaluated again, each by itself.

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
        physics = self._world.config.physics
        for group in in_groups(solutions, most_together(len(solutions), self._workers.n_workers, physics)):
            self._workers.submit(self._world, group)
            self._n_open += len(group)

    def collect(self) -> list[Evaluation]:
        """Return evaluations that are finished, at least one; none only if none is under way."""
        found: list[Evaluation] = []
        while self._n_open and not found:
            for solutions, outcome in self._workers.wait():
                if not isinstance(outcome, Died):
                    found += [self._kept(result) for result in outcome]
                elif len(solutions) > 1:
                    # which of them it was comes out when each has a worker to itself
                    for solution in solutions:
                        self._workers.submit(self._world, [solution])
                elif (evaluation := self._repeat(solutions[0], outcome)) is not None:
                    found.append(evaluation)
        self._n_open -= len(found)
        return found

    def origin(self, number: int) -> Origin | None:
        """Return an evaluation's origin, once; None if no worker finished it."""
        return self._origins.pop(number, None)

    def _repeat(self, solution: Solution, death: Died) -> Evaluation | None:
        """Submit a lost solution again; if too many workers have died of it, return a failed evaluation."""
        deaths = self._deaths[solution.number] = self._deaths.get(solution.number, 0) + 1
        if deaths < MAX_DEATHS:
            self._workers.submit(self._world, [solution])
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
