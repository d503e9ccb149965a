"""The two contracts: an ``Evaluator`` evaluates a group, an ``EvaluationQueue`` takes more at any time."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from typing import Protocol

from engine.config import RunConfig, task_of
from engine.simulation.evaluation import Evaluation, FailureKeeper, LocalEvaluator, Solution
from engine.simulation.provenance import Origin, this_computer


class Evaluator(Protocol):
    """Computes evaluations, on this machine or elsewhere."""

    def evaluate(self, solutions: Sequence[Solution]) -> Iterator[list[Evaluation]]:
        """Yield the evaluations of all solutions in groups, in whatever order they are finished."""
        ...


class EvaluationQueue(Protocol):
    """Takes solutions at any time and gives back their evaluations, in any order."""

    def submit(self, solutions: Sequence[Solution]) -> None:
        """Have solutions evaluated after those submitted before."""
        ...

    def collect(self) -> list[Evaluation]:
        """Return evaluations that are finished, at least one; none only if none is under way."""
        ...

    def origin(self, number: int) -> Origin | None:
        """Return an evaluation's origin, once; None if it is not known."""
        ...


class LocalQueue:
    """A queue for an evaluator of this process, which takes one submission after the other.

    Args:
        evaluator: computes the evaluations.
    """

    def __init__(self, evaluator: Evaluator) -> None:
        self._evaluator = evaluator
        self._submitted: deque[Sequence[Solution]] = deque()
        self._current: Iterator[list[Evaluation]] = iter(())

    def submit(self, solutions: Sequence[Solution]) -> None:
        """Have solutions evaluated after those submitted before."""
        if solutions:
            self._submitted.append(solutions)

    def collect(self) -> list[Evaluation]:
        """Return evaluations that are finished, at least one; none only if none is under way."""
        while True:
            for group in self._current:
                return group
            if not self._submitted:
                return []
            self._current = iter(self._evaluator.evaluate(self._submitted.popleft()))

    def origin(self, number: int) -> Origin:  # noqa: ARG002
        """Return this computer; its threads work together, so an evaluation's share is not known."""
        return Origin(this_computer())


def create_evaluator(
    config: RunConfig,
    n_threads: int = 1,
    keep_failure: FailureKeeper | None = None,
    *,
    head_is_end: bool | None = None,
) -> LocalEvaluator:
    """Return an evaluator of a run's solutions on this machine's threads.

    Args:
        config: of the run.
        n_threads: that simulate.
        keep_failure: called once for every evaluation in which a simulation failed.
        head_is_end: which end of every robot is its head, if that is known.
    """
    return LocalEvaluator(
        task=task_of(config),
        physics=config.physics,
        trials=config.trials,
        run_seed=config.seed,
        n_threads=n_threads,
        keep_failure=keep_failure,
        head_is_end=head_is_end,
    )
