"""What the tables of every format hold, and how they are read and written whatever the format is."""

from __future__ import annotations

import dataclasses
import hashlib
import sqlite3
import struct
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, Final, Protocol, Self

import numpy as np

from engine.body.morphology import Morphology
from engine.config import MAX_EVALUATIONS
from engine.control.genome import Controller
from engine.errors import InvalidData
from engine.simulation.evaluation import Evaluation, Solution
from engine.simulation.provenance import Origin
from engine.tasks import LARGEST_SCORE

MAX_NAME: Final = 100
"""Characters of a name in a run file, which may be a stranger's."""
MAX_FAILURE: Final = 10_000
"""Characters of the reason of a failure."""
LARGEST_FIGURE: Final = 1e15
"""What sums of scores stay below, and times in seconds and ends of axes too."""
CHUNK: Final = 500
"""Numbers in one query."""

_HEAD: Final = struct.Struct(">cQ").pack
_FLOAT: Final = struct.Struct(">cQd").pack
_NULL: Final = _HEAD(b"n", 0)

Query = Callable[..., list[sqlite3.Row]]
"""Runs a statement, given as SQL and a tuple of parameters, and returns its rows."""
Change = tuple[int, str, str, int | None]
"""A change of a map: generation, archive, cell, and the evaluation there from then on, if any."""


def short(text: str, what: str, most: int = MAX_NAME) -> str:
    """Return a text that can be shown as it is.

    Raises:
        InvalidData: it is too long, or has characters that a terminal would obey.
    """
    if len(text) > most:
        raise InvalidData(f"{what} has {len(text)} characters; {most} are the most")
    if not text.isprintable():
        raise InvalidData(f"{what} has characters that cannot be shown")
    return text


def figure(value: Any) -> float:
    """Return a number of a file as a float, one that can be added up and shown in centimetres.

    Raises:
        InvalidData: it is not a number, or beyond ``LARGEST_FIGURE``.
    """
    number = float(value)
    if not abs(number) <= LARGEST_FIGURE:
        raise InvalidData(f"expected a finite number of at most {LARGEST_FIGURE:g}, not {number!r}")
    return number


def score(value: Any) -> float:
    """Return a fitness of a file as a float.

    Raises:
        InvalidData: it is not a number, or beyond ``LARGEST_SCORE``.
    """
    number = figure(value)
    if abs(number) > LARGEST_SCORE:
        raise InvalidData(f"a fitness is beyond {LARGEST_SCORE:g} m: {number!r}")
    return number


def count(value: int) -> int:
    """Return a number of evaluations or of generations, to which one can count.

    Raises:
        InvalidData: it is negative, or no run has that many.
    """
    if not 0 <= value <= 2 * MAX_EVALUATIONS:
        raise InvalidData(f"no run has {value} evaluations or generations")
    return value


@dataclasses.dataclass(frozen=True, slots=True)
class Record:
    """An evaluation without what is large: controller, distances and trajectory.

    Attributes: as of ``Solution`` and ``Evaluation``, and the generation.
    """

    number: int
    generation: int
    morphology: Morphology
    parent: int | None
    operator: str
    source: str | None
    fitness: float | None
    head_is_end: bool
    failure: str | None

    def __post_init__(self) -> None:
        for what, text in (("operator", self.operator), ("source", self.source)):
            if text is not None:
                short(text, f"its {what}")
        if self.failure is not None:  # a task's own words may have several lines
            short(self.failure.replace("\n", " "), "its failure", MAX_FAILURE)
        fitness = self.fitness
        if fitness is not None:
            if not isinstance(fitness, float):
                raise InvalidData(f"fitness must be a number, not {fitness!r:.60}")
            score(fitness)

    @classmethod
    def of(cls, generation: int, e: Evaluation) -> Self:
        """Return the record of an evaluation."""
        s = e.solution
        return cls(
            s.number,
            generation,
            s.morphology,
            s.parent,
            s.operator,
            s.source,
            e.fitness,
            e.head_is_end,
            e.failure,
        )

    def evaluation(self, controller: Controller, distances: np.ndarray, trajectory: np.ndarray) -> Evaluation:
        """Return the evaluation, once the rest of it is known.

        Raises:
            InvalidData: a distance is beyond ``LARGEST_SCORE``; or the trajectory is, or is not finite,
                although no simulation failed.
        """
        if (np.abs(distances) > LARGEST_SCORE).any():
            raise InvalidData(f"a distance is beyond {LARGEST_SCORE:g} m")
        if self.fitness is not None and not (np.abs(trajectory) <= LARGEST_SCORE).all():
            raise InvalidData(f"its trajectory is not finite, or beyond {LARGEST_SCORE:g} m")
        solution = Solution(
            number=self.number,
            morphology=self.morphology,
            controller=controller,
            parent=self.parent,
            operator=self.operator,
            source=self.source,
        )
        return Evaluation(
            solution=solution,
            fitness=self.fitness,
            distances=distances,
            trajectory=trajectory,
            head_is_end=self.head_is_end,
            failure=self.failure,
        )


@dataclasses.dataclass(frozen=True, slots=True)
class Closed:
    """A closed generation as it is recorded.

    Attributes:
        generation: its number.
        n_evaluations, n_failed: of the run so far.
        archives: JSON, as ``rows.statistics`` returns it.
        finished_at: UTC date and time.
        seconds: computing time of the run so far.
    """

    generation: int
    n_evaluations: int
    n_failed: int
    archives: str
    finished_at: str
    seconds: float

    def __post_init__(self) -> None:
        for n in (self.generation, self.n_evaluations, self.n_failed):
            count(n)
        figure(self.seconds)


class Tables(Protocol):
    """The tables of one run file.

    Everything that is read is checked against its digest, as far as the format has one. Errors of the query
    pass through.

    Raises:
        InvalidData, and the other errors of ``UNEXPECTED_DATA``: what is read is damaged.
    """

    def meta(self) -> dict[str, Any]:
        """Return the facts about the whole run, by key."""

    def n_evaluations(self) -> int:
        """Return the number of evaluations, those of an open generation included."""

    def last_generation(self) -> int | None:
        """Return the number of the last closed generation, or None if there is none yet."""

    def closed(self, after: int) -> list[Closed]:
        """Return the closed generations with a greater number, in order."""

    def changes(self, after: int) -> list[Change]:
        """Return all changes of maps after a generation, in the order of the generations."""

    def state(self) -> tuple[int, str] | None:
        """Return the generation and the JSON that resuming needs, or None if there is none."""

    def computers(self) -> list[tuple[str, int]]:
        """Return the facts about each computer that took part, JSON, and its number of evaluations."""

    def records(self, condition: str, parameters: tuple[Any, ...]) -> list[Record]:
        """Return the records of the rows of ``evaluations`` that a condition in SQL chooses, by number."""

    def evaluations(self, numbers: Iterable[int]) -> Iterator[tuple[int, Evaluation]]:
        """Yield the generation of each evaluation that exists, and the evaluation, by number."""

    def origins(self, numbers: Iterable[int]) -> dict[int, Origin]:
        """Return what computed each evaluation, as far as that is known, by number."""

    def lacks_trajectories(self) -> bool:
        """Tell whether any evaluation is without its trajectory."""

    def check_numbers(self) -> None:
        """Make sure that no evaluation is missing, as far as the format tells."""

    def differing(self) -> Iterator[tuple[str, list[Any]]]:
        """Yield a table's name and the keys of its rows that are not what was written."""

    def add_evaluations(
        self, generation: int, evaluations: Sequence[Evaluation], origins: Sequence[Origin | None]
    ) -> None:
        """Save evaluations of a generation, and what computed each; fewer origins if others are unknown."""

    def add_generation(self, closed: Closed, changes: Sequence[Change]) -> None:
        """Save a closed generation and its changes of maps."""

    def set_state(self, generation: int, algorithm: str) -> None:
        """Save what resuming needs, JSON, in place of what was saved before."""


def digest(row: Iterable[Any], table: str = "") -> bytes:
    """Return the digest of the values of a row, which shows when they have changed.

    Args:
        row: its values, in their order, as SQLite holds them.
        table: that they belong to; none in format 2.
    """
    parts = []
    for value in row:
        match value:
            case None:
                parts.append(_NULL)
            case float():
                parts.append(_FLOAT(b"f", 8, value))
            case bytes():
                parts += (_HEAD(b"b", len(value)), value)
            case _:
                content = str(value).encode(errors="surrogateescape")
                parts += (_HEAD(b"t", len(content)), content)
    return hashlib.blake2b(b"".join(parts), digest_size=8, person=table.encode()).digest()


def in_chunks(numbers: Iterable[int]) -> Iterator[tuple[str, tuple[int, ...]]]:
    """Yield condition and parameters of queries for evaluations, in the order of their numbers."""
    ordered = sorted(numbers)
    for i in range(0, len(ordered), CHUNK):
        part = tuple(ordered[i : i + CHUNK])
        yield f"number IN ({','.join('?' * len(part))})", part
