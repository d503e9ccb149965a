"""What is read of a run without its controllers: generations, figures of archives, summaries, ancestors."""

from __future__ import annotations

import dataclasses
import json
from typing import Any, Final, Self

from engine.body.morphology import Morphology
from engine.errors import InvalidData
from engine.search.algorithm import Snapshot
from engine.search.archive import GridArchive
from engine.search.axes import Axis
from engine.search.map_search import MAX_CELLS
from engine.simulation.evaluation import Evaluation
from engine.storage.layouts.tables import Closed, Record, figure, short

MAX_ARCHIVES: Final = 16
"""Archives of a run; algorithms have two at the most."""
MAX_FIGURES: Final = 100_000
"""Characters of the figures of a generation."""
MAX_LINE: Final = 2000
"""Robots of a lineage that are read; those of evolved robots are a tenth as long."""


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
            best=None if data["best"] is None else figure(data["best"]),
            mean=None if data["mean"] is None else figure(data["mean"]),
            qd_score=figure(data["qd_score"]),
            coverage=figure(data["coverage"]),
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
    def of(cls, closed: Closed) -> Self:
        """Return a generation as it is recorded.

        Raises:
            InvalidData: as ``ArchiveFigures.from_json``, and as it others.
        """
        if len(closed.archives) > MAX_FIGURES:
            raise InvalidData(f"the figures of a generation have {len(closed.archives)} characters")
        archives = json.loads(closed.archives)
        if len(archives) > MAX_ARCHIVES:
            raise InvalidData(f"a run has at most {MAX_ARCHIVES} archives, not {len(archives)}")
        return cls(
            number=closed.generation,
            n_evaluations=closed.n_evaluations,
            n_failed=closed.n_failed,
            archives={
                short(k, "an archive's name"): ArchiveFigures.from_json(v) for k, v in archives.items()
            },
            seconds=closed.seconds,
        )


@dataclasses.dataclass(frozen=True, slots=True)
class Summary:
    """What a map shows of an evaluation: its generation, its fitness in m, its body."""

    generation: int
    fitness: float
    morphology: Morphology


@dataclasses.dataclass(frozen=True, slots=True)
class Slimmed:
    """What a slimmed run says about itself.

    Attributes:
        hash: of the run that it was made from.
        n_kept: robots that it holds; of all others it has the figures alone.
    """

    hash: str
    n_kept: int

    @classmethod
    def from_json(cls, data: Any) -> Self:
        """Read it back from its fields.

        Raises:
            InvalidData: they are others.
        """
        match data:
            case {"hash": str(run), "n_kept": int(n)} if len(data) == 2:
                return cls(run, n)
        raise InvalidData("what it says of being slimmed is not as expected")


def _axis(data: Any) -> Axis:
    name = short(str(data["name"]), "an axis's name")
    axis = Axis(name, figure(data["lower"]), figure(data["upper"]), int(data["n"]))
    if not (axis.lower < axis.upper and 1 <= axis.n <= MAX_CELLS):
        raise InvalidData(f"an archive's axis is impossible: {axis}")
    return axis


@dataclasses.dataclass(frozen=True, slots=True)
class Ancestor:
    """One robot of a lineage, of which ``MAX_LINE`` are read.

    Attributes:
        number: of its evaluation.
        parent: number of the robot that it descends from, None for a random one.
        generation: of its evaluation.
        operator: how it came about, as in ``Solution``.
        fitness: in m, None if a simulation failed.
        morphology: its body.
        source: where a given robot is from.
    """

    number: int
    parent: int | None
    generation: int
    operator: str
    fitness: float | None
    morphology: Morphology
    source: str | None = None

    @classmethod
    def of(cls, r: Record) -> Self:
        """Return a robot as it is recorded."""
        return cls(r.number, r.parent, r.generation, r.operator, r.fitness, r.morphology, r.source)

    @property
    def is_founder(self) -> bool:
        """Whether it has no parent: its genes were drawn at random, or given."""
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
