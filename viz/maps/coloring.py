"""What a map's colours stand for: the fitness, the age of an elite, how often its cell was tried.

To colour by another quantity, write a function from axes and elites to ``values``: see ``by_number`` for a
quantity that is known by evaluation.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Final

from engine.analysis.robustness import load_robust_of, robust_path
from engine.search.archive import Cell
from engine.search.axes import Axis, body_cell
from engine.storage.reader import RunReader
from engine.tasks import get_task
from viz.maps import axis_labels
from viz.maps.contents import ShownElite
from viz.maps.scale import Scale, count_scale, fitness_scale

Values = Mapping[Cell, float]


@dataclasses.dataclass(frozen=True, slots=True)
class Coloring:
    """A quantity that a map is coloured by.

    Attributes:
        values: takes the axes of a map and the elites that it shows, returns the quantity by cell. Cells
            without a value are grey.
        scale: takes all values shown, returns the scale.
        hint: returns the line that a value adds to hover cards; None if they show the value anyway.
        lengths: whether the values are fitnesses in cm, which can share a scale.
        unknown: why a map may have no value at all.
    """

    values: Callable[[Sequence[Axis], Mapping[Cell, ShownElite]], Values]
    scale: Callable[[Collection[float]], Scale]
    hint: Callable[[float], str] | None = None
    lengths: bool = False
    unknown: str = ""


FITNESS: Final = Coloring(
    lambda _, elites: {c: e.f_s for c, e in elites.items()},
    functools.partial(fitness_scale, signed=True),
    lengths=True,
)


def by_age(generation: int) -> Coloring:
    """Return a colouring by how many generations ago an elite was found, as of a generation."""
    return Coloring(
        lambda _, elites: {c: float(generation - e.generation) for c, e in elites.items()},
        lambda values: Scale("age, gen.", 0.0, max([1.0, *values]), whole=True),
        lambda n: (
            "found in this generation" if n < 1 else f"found {n:.0f} generation{'s' if n > 1 else ''} ago"
        ),
    )


def by_number(values: Mapping[int, float], title: str) -> Coloring:
    """Return a colouring by fitnesses in cm that are known for some evaluations, by their numbers."""
    return Coloring(
        lambda _, elites: {c: values[e.number] for c, e in elites.items() if e.number in values},
        lambda shown: fitness_scale(shown, title, signed=True),
        lambda value: f"{title.removesuffix(' cm')} {value:.2f} cm",
        lengths=True,
        unknown="none of these was evaluated again",
    )


def by_visits(reader: RunReader, generation: int) -> Coloring:
    """Return a colouring by how many evaluations fell into a cell up to a generation.

    The number is known where the body decides the cell: other cells of earlier evaluations are not kept.

    Raises:
        RunFileError: the file cannot be read.
    """
    bodies = reader.bodies(generation)

    def values(axes: Sequence[Axis], elites: Mapping[Cell, ShownElite]) -> Values:
        if not axis_labels.is_body(axes):
            return {}
        counts = dict.fromkeys(elites, 0.0)
        for body, n in bodies.items():
            with reader.guard():
                cell = body_cell(axes, body)
            if cell in counts:
                counts[cell] += n
        return counts

    return Coloring(
        values,
        lambda shown: count_scale(shown, "visits"),
        lambda n: f"{n:.0f} evaluation{'' if n == 1 else 's'} here",
        unknown="visits are counted by body only",
    )


def by_robust_fitness(reader: RunReader) -> Coloring:
    """Return a colouring by the elites' mean f_s under noise that they were not selected with.

    Raises:
        InvalidData: what lies beside the run is damaged or of another run.
    """
    return by_number(robust_fitness(reader), "robust f_s cm")


def by_fitness_as_built(reader: RunReader) -> Coloring:
    """Return a colouring by the mean f_s of the elites as they would be built.

    Raises:
        InvalidData: what lies beside the run is damaged or of another run.
    """
    return by_number(robust_fitness(reader, as_built=True), "as-built f_s cm")


def robust_fitness(reader: RunReader, *, as_built: bool = False) -> dict[int, float]:
    """Return the elites' mean f_s in cm under noise that they were not selected with, by their numbers.

    Args:
        reader: of the run.
        as_built: whether as they would be built.

    Raises:
        InvalidData: what lies beside the run is damaged or of another run.
    """
    robust = load_robust_of(reader, as_built=as_built)
    found = {} if robust is None else robust.f_s(get_task(reader.config.task).target_distance)
    return {n: 100 * f_s for n, f_s in found.items()}


USUAL: Final = "fitness f_s"
ROBUST: Final = "robust fitness"
AS_BUILT: Final = "as-built fitness"
COLORINGS: Final[Mapping[str, Callable[[RunReader, int], Coloring]]] = {
    USUAL: lambda *_: FITNESS,
    "age": lambda _, generation: by_age(generation),
    "visits": by_visits,
}
"""The colourings on offer, by their names in the app. Each is made from a run and the generation shown."""


def colorings(reader: RunReader) -> dict[str, Callable[[RunReader, int], Coloring]]:
    """Return the colourings that a run can offer: after ``reevaluate`` also by robust or as-built fitness."""
    offered = dict(COLORINGS)
    if robust_path(reader.path).exists():
        offered[ROBUST] = lambda reader, _: by_robust_fitness(reader)
    if robust_path(reader.path, as_built=True).exists():
        offered[AS_BUILT] = lambda reader, _: by_fitness_as_built(reader)
    return offered
