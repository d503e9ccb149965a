"""Evaluations as rows of a run file, and back, with every value checked on the way in."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import math
import sqlite3
import struct
from collections.abc import Sequence
from typing import Any, Final, Self

import numpy as np

from engine.body.morphology import Morphology
from engine.control.genome import Controller
from engine.errors import UNEXPECTED_DATA, InvalidData
from engine.files import compact_json
from engine.search.algorithm import Snapshot
from engine.search.archive import GridArchive
from engine.search.axes import Axis
from engine.simulation.evaluation import Evaluation, Solution
from engine.tasks import LARGEST_SCORE


def to_row(generation: int, e: Evaluation) -> tuple[Any, ...]:
    """Return an evaluation in the order of the columns of the table ``evaluations``."""
    s = e.solution
    return (
        s.number,
        generation,
        compact_json(s.morphology.to_json()),
        compact_json(s.controller.to_json()),
        s.parent,
        s.operator,
        s.source,
        e.fitness,
        compact_json(_finite(e.distances)),
        e.trajectory.astype("<f4").tobytes(),
        int(e.head_is_end),
        e.failure,
    )


def from_row(row: Any) -> Evaluation:
    """Read an evaluation back from its row, whose columns are found by name.

    Raises:
        InvalidData: a value is not what ``to_row`` writes.
    """
    where = f"evaluation {row['number']}"
    try:
        distances = np.array(json.loads(row["distances"]), dtype=float)
        trajectory = np.frombuffer(row["trajectory"], dtype="<f4")
        if distances.ndim != 2 or not distances.size or trajectory.size % (2 * len(distances)):
            raise InvalidData(f"{where}: distances or trajectory have the wrong size")
        fitness = row["fitness"]
        if (np.abs(distances) > LARGEST_SCORE).any():
            raise InvalidData(f"{where}: a distance is beyond {LARGEST_SCORE:g} m")
        if fitness is not None:
            if not isinstance(fitness, float):
                raise InvalidData(f"{where}: its fitness is no number")
            score(fitness)
            if not (np.abs(trajectory) <= LARGEST_SCORE).all():
                raise InvalidData(f"{where}: its trajectory is not finite, or beyond {LARGEST_SCORE:g} m")
        solution = Solution(
            number=int(row["number"]),
            morphology=Morphology.from_json(json.loads(row["morphology"])),
            controller=Controller.from_json(json.loads(row["controller"])),
            parent=None if row["parent"] is None else int(row["parent"]),
            operator=str(row["operator"]),
            source=None if row["source"] is None else str(row["source"]),
        )
        return Evaluation(
            solution=solution,
            fitness=fitness,
            distances=distances,
            trajectory=trajectory.reshape(len(distances), -1, 2),
            head_is_end=bool(row["head_is_end"]),
            failure=None if row["failure"] is None else str(row["failure"]),
        )
    except InvalidData as e:
        raise e if str(e).startswith(where) else InvalidData(f"{where}: {e}") from None
    except UNEXPECTED_DATA as e:
        raise InvalidData(f"{where} is damaged: {e}") from None


def digest(row: Sequence[Any]) -> bytes:
    """Return the digest of a row of the table ``evaluations``, which shows when its bytes have changed.

    Args:
        row: as ``to_row`` returns it or the table holds it.
    """
    found = hashlib.blake2b(digest_size=8)
    for value in row:
        match value:
            case None:
                kind, content = b"n", b""
            case bytes():
                kind, content = b"b", value
            case float():
                kind, content = b"f", struct.pack(">d", value)
            case _:
                kind, content = b"t", str(value).encode(errors="surrogateescape")
        found.update(kind + len(content).to_bytes(8, "big") + content)
    return found.digest()


def _finite(values: np.ndarray) -> list[list[float | None]]:
    """Return nested lists, None for what a diverged simulation left undefined."""
    return [[float(v) if math.isfinite(v) else None for v in row] for row in values]


MAX_CELLS_PER_AXIS: Final = 200
LARGEST_FIGURE: Final = 1e15
"""What sums of scores stay below, and times in seconds and ends of axes too."""


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
            InvalidData: an axis or a number is impossible; other errors of ``UNEXPECTED_DATA`` if the data
                has another form altogether.
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
            seconds=finite(row["seconds"]),
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
            fitness=score(row["fitness"]),
            morphology=Morphology.from_json(json.loads(row["morphology"])),
        )


def _axis(data: Any) -> Axis:
    axis = Axis(str(data["name"]), finite(data["lower"]), finite(data["upper"]), int(data["n"]))
    if not (axis.lower < axis.upper and 1 <= axis.n <= MAX_CELLS_PER_AXIS):
        raise InvalidData(f"an archive's axis is impossible: {axis}")
    return axis


def finite(value: Any) -> float:
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
    number = finite(value)
    if abs(number) > LARGEST_SCORE:
        raise InvalidData(f"a fitness is beyond {LARGEST_SCORE:g} m: {number!r}")
    return number


@dataclasses.dataclass(frozen=True, slots=True)
class Ancestor:
    """One robot of a lineage.

    Attributes:
        number: of its evaluation.
        parent: number of the robot that it descends from, None for a random one.
        generation: of its evaluation.
        operator: how it came about, as in ``Solution``.
        fitness: in m, None if a simulation failed.
        morphology: its body.
    """

    number: int
    parent: int | None
    generation: int
    operator: str
    fitness: float | None
    morphology: Morphology

    @property
    def is_founder(self) -> bool:
        """Whether it has no parent: its genes were drawn at random."""
        return self.parent is None


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
