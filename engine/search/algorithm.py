"""The contract between a search algorithm and the loop that runs it."""

from __future__ import annotations

import abc
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

from engine.errors import InvalidData
from engine.search.archive import Cell, GridArchive
from engine.search.axes import Axis
from engine.search.variation import GivenRobot
from engine.simulation.evaluation import Evaluation, Solution

Recall = Callable[[set[int]], Mapping[int, Evaluation]]
"""Looks up evaluations of a run by their numbers; raises RunFileError if one does not exist."""


class Snapshot(Protocol):
    """What a generation leaves behind, to be stored."""

    @property
    @abc.abstractmethod
    def generation(self) -> int:
        """Number of completed generations."""

    @property
    @abc.abstractmethod
    def archives(self) -> Mapping[str, GridArchive]:
        """The archives by name."""

    @abc.abstractmethod
    def axes(self, archive: str) -> tuple[Axis, ...]:
        """Describe the axes of an archive as they are now."""

    @abc.abstractmethod
    def state(self) -> dict[str, Any]:
        """Return the JSON-ready state at the end of a generation, archives' elites excluded.

        It is stored anew after every generation, so it should be small: evaluations as their numbers.
        Where cells hold more than their elite, ``members`` has them: by archive and by cell, written
        like ``3,7``, the numbers of all individuals.
        """


class Algorithm(Snapshot, abc.ABC):
    """A quality-diversity algorithm that neither evaluates nor stores; a ``Snapshot`` after every ``tell``.

    ``ask`` and ``tell`` alternate: one pair of calls is one generation. An algorithm with an overlap may be
    asked for more generations before the oldest is told; they are told in the order of asking. ``state``
    after a ``tell``, together with the archives' contents and the run's evaluations, is all that ``restore``
    needs to continue identically.
    """

    def begin_with(self, given: Sequence[GivenRobot]) -> None:
        """Ask for given robots first, in place of the first random ones.

        Called before the first ``ask``, and before that is repeated after an interruption.

        Raises:
            InvalidData: they are too many, or the algorithm cannot begin with robots.
        """
        if given:
            raise InvalidData("this algorithm cannot start from given robots")

    @property
    def outstanding(self) -> tuple[tuple[Solution, ...], ...]:
        """The generations that have been asked for and not yet told, the oldest first."""
        return ()

    @abc.abstractmethod
    def ask(self) -> list[Solution]:
        """Return the solutions to evaluate next; none if others must be told first or the budget is spent."""

    @abc.abstractmethod
    def tell(self, evaluations: Sequence[Evaluation]) -> None:
        """Take in the evaluations of exactly the solutions of the oldest ``ask``, in any order.

        Raises:
            ValueError: they are not the evaluations of the solutions asked for.
        """

    @abc.abstractmethod
    def restore(
        self,
        state: dict[str, Any],
        contents: Mapping[str, Mapping[Cell, Evaluation]],
        recall: Recall,
    ) -> None:
        """Go back to the end of a generation.

        Args:
            state: what ``state`` returned then.
            contents: the archives' elites then, by archive and cell.
            recall: looks up other evaluations that the state refers to.
        """
