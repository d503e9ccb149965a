"""What the generations of a run file say: the figures of archives and what a map shows of an evaluation."""

from __future__ import annotations

import dataclasses
import json
import math
import sqlite3
from typing import Any, Final, Self

from engine.body.morphology import Morphology
from engine.errors import InvalidData
from engine.search.algorithm import Axis

MAX_CELLS_PER_AXIS: Final = 200


@dataclasses.dataclass(frozen=True, slots=True)
class ArchiveFigures:
    """An archive at the end of a generation; lengths in m.

    Attributes:
        best, mean: of the elites' f_s; None while the archive is empty.
        qd_score: sum of f_s over filled cells.
        coverage: filled over all cells.
        axes: what the cells mean.
    """

    best: float | None
    mean: float | None
    qd_score: float
    coverage: float
    axes: tuple[Axis, ...]

    @classmethod
    def from_json(cls, data: Any) -> Self:
        """Read figures as a run file holds them.

        Raises:
            InvalidData: an axis or a number is impossible; other errors of ``UNEXPECTED_DATA`` if it is
                something else altogether.
        """
        return cls(
            best=None if data["best"] is None else finite(data["best"]),
            mean=None if data["mean"] is None else finite(data["mean"]),
            qd_score=finite(data["qd_score"]),
            coverage=finite(data["coverage"]),
            axes=tuple(map(_axis, data["axes"])),
        )


@dataclasses.dataclass(frozen=True, slots=True)
class Generation:
    """A closed generation.

    Attributes:
        number: counts from 0.
        n_evaluations, n_failed: of the run so far.
        archives: by name.
        seconds: computing time of the run so far.
    """

    number: int
    n_evaluations: int
    n_failed: int
    archives: dict[str, ArchiveFigures]
    seconds: float

    @classmethod
    def from_row(cls, row: sqlite3.Row) -> Self:
        """Read a row of the table ``generations``.

        Raises:
            InvalidData: as ``ArchiveFigures.from_json``, and as it others.
        """
        return cls(
            number=int(row["generation"]),
            n_evaluations=int(row["n_evaluations"]),
            n_failed=int(row["n_failed"]),
            archives={k: ArchiveFigures.from_json(v) for k, v in json.loads(row["archives"]).items()},
            seconds=float(row["seconds"]),
        )


@dataclasses.dataclass(frozen=True, slots=True)
class Summary:
    """What a map shows of an evaluation: its generation, its fitness in m, its body."""

    generation: int
    fitness: float
    morphology: Morphology

    @classmethod
    def from_row(cls, row: sqlite3.Row) -> Self:
        """Read generation, fitness and morphology of a row of the table ``evaluations``.

        Raises:
            InvalidData: as ``ArchiveFigures.from_json``, and as it others.
        """
        return cls(
            generation=int(row["generation"]),
            fitness=finite(row["fitness"]),
            morphology=Morphology.from_json(json.loads(row["morphology"])),
        )


def _axis(data: Any) -> Axis:
    axis = Axis(str(data["name"]), finite(data["lower"]), finite(data["upper"]), int(data["n"]))
    if not (axis.lower < axis.upper and 1 <= axis.n <= MAX_CELLS_PER_AXIS):
        raise InvalidData(f"an archive's axis is impossible: {axis}")
    return axis


def finite(value: Any) -> float:
    """Return a number of a file as a float.

    Raises:
        InvalidData: it is infinite or not a number.
    """
    number = float(value)
    if not math.isfinite(number):
        raise InvalidData(f"expected a finite number, not {value!r}")
    return number
