"""Evaluations as they are finished, of solutions submitted at any time."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from typing import Protocol

from engine.simulation.evaluation import Evaluation, Evaluator, Solution
from engine.simulation.provenance import Origin, this_computer


class Stream(Protocol):
    """Takes solutions and gives back evaluations, in any order."""

    def submit(self, solutions: Sequence[Solution]) -> None:
        """Have solutions evaluated after those submitted before."""
        ...

    def collect(self) -> list[Evaluation]:
        """Return evaluations that are finished, at least one; none only if none is under way."""
        ...

    def origin(self, number: int) -> Origin | None:
        """Return where an evaluation comes from, once; None if that is not known."""
        ...


class LocalStream:
    """The evaluations of an evaluator of this process, which begins with each submission after the last.

    Args:
        evaluator: that computes.
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
        """Return this computer; its threads work together, so that nobody knows an evaluation's share."""
        return Origin(this_computer())
