"""The contract between an algorithm and whoever runs it."""

from __future__ import annotations

import abc
import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

from engine.archive import GridArchive
from engine.evaluation import Evaluation, Solution


@dataclasses.dataclass(frozen=True, slots=True)
class Axis:
    """One axis of an archive, for people: n equal cells from lower to upper."""

    name: str
    lower: float
    upper: float
    n: int


class Algorithm(abc.ABC):
    """A quality-diversity algorithm that neither evaluates nor stores.

    ``ask`` and ``tell`` alternate: one pair of calls is one generation. ``state`` after a ``tell``,
    together with the archives' contents, is all that ``restore`` needs to go on identically.
    """

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
    def ask(self) -> list[Solution]:
        """Return the solutions to evaluate next."""

    @abc.abstractmethod
    def tell(self, evaluations: Sequence[Evaluation]) -> None:
        """Take in the evaluations of exactly the solutions asked for, in any order.

        Raises:
            ValueError: they are not the evaluations of the solutions asked for.
        """

    @abc.abstractmethod
    def state(self) -> dict[str, Any]:
        """Return the JSON-ready state at the end of a generation, archives excluded."""

    @abc.abstractmethod
    def restore(
        self, state: dict[str, Any], contents: Mapping[str, Mapping[tuple[int, ...], Evaluation]]
    ) -> None:
        """Go back to the end of a generation.

        Args:
            state: what ``state`` returned then.
            contents: what the archives held then, by archive and cell.
        """
