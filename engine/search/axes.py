"""What an archive's axes measure: which of them describe the body, which the way its head moves."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final, TypeVar

import numpy as np

from engine.body.feet import FEET
from engine.body.morphology import Morphology
from engine.errors import InvalidData
from engine.search.archive import Cell

TRAJECTORY_PREFIX: Final = "PCA"
"""Prefix of the name of every axis that is a principal component of the head's trajectory."""


_BODY: Final[Mapping[str, Callable[[Morphology], float]]] = {
    "modules": lambda body: float(body.n_modules),
    "stiffness": lambda body: body.stiffness,
    "softest": lambda body: min(body.stiffnesses),
    "stiffest": lambda body: max(body.stiffnesses),
    "feet": lambda body: float(FEET.index(body.feet)),
}


def body_axes(axes: Sequence[Axis]) -> tuple[int, ...]:
    """Return the indices of the axes that describe the body."""
    return tuple(i for i, axis in enumerate(axes) if not axis.name.startswith(TRAJECTORY_PREFIX))


def trajectory_axes(axes: Sequence[Axis]) -> tuple[int, ...]:
    """Return the indices of the axes that describe how the head moves."""
    return tuple(i for i, axis in enumerate(axes) if axis.name.startswith(TRAJECTORY_PREFIX))


def body_measure(axis: Axis, body: Morphology) -> float:
    """Return a body's value on an axis that describes bodies.

    Raises:
        InvalidData: the axis is unknown.
    """
    if axis.name not in _BODY:
        raise InvalidData(f"an archive's axis {axis.name!r} is unknown; update TensAtlas")
    return _BODY[axis.name](body)


def body_cell(axes: Sequence[Axis], body: Morphology) -> Cell:
    """Return a body's cell along axes that all describe bodies.

    Raises:
        InvalidData: an axis is unknown or the body lies outside it.
    """
    cell = tuple(cell_index(axis, body_measure(axis, body)) for axis in axes)
    for axis, i in zip(axes, cell, strict=True):
        if not 0 <= i < axis.n:
            raise InvalidData(f"a body lies outside the archive's axis {axis.name!r}")
    return cell


def cell_index(axis: Axis, value: float) -> int:
    """Return the index of the cell that a value falls into, also beyond the axis's ends."""
    return int(np.floor((value - axis.lower) / (axis.upper - axis.lower) * axis.n))


def cell_centre(axis: Axis, index: int) -> float:
    """Return the value at the centre of a cell."""
    return axis.lower + (index + 0.5) * (axis.upper - axis.lower) / axis.n


@dataclasses.dataclass(frozen=True, slots=True)
class Axis:
    """One axis of an archive, as shown: n equal cells from lower to upper."""

    name: str
    lower: float
    upper: float
    n: int


E = TypeVar("E")


def project(elites: Mapping[Cell, E], axes: Sequence[int], rank: Callable[[E], Any]) -> dict[Cell, Cell]:
    """Return the cells of an archive that a projection of it shows: the best along the other axes.

    Args:
        elites: (n axes) cells of the archive and whatever they hold.
        axes: the axes to keep, in the projection's order.
        rank: what to compare by, the smallest wins; for evaluations (fitness, number), as in an archive.

    Returns:
        For each (len(axes)) cell of the projection the (n axes) cell of the archive whose elite it shows. On
        a tie that is the first in the order of the cells, whatever the order of the mapping.
    """
    shown: dict[Cell, Cell] = {}
    for cell in sorted(elites):
        onto = tuple(cell[a] for a in axes)
        if onto not in shown or rank(elites[cell]) < rank(elites[shown[onto]]):
            shown[onto] = cell
    return shown


def section(elites: Mapping[Cell, E], fixed: Mapping[int, int]) -> dict[Cell, Cell]:
    """Return the cells of an archive that a section through it shows.

    Args:
        elites: (n axes) cells of the archive and whatever they hold.
        fixed: by axis the index at which it is cut.

    Returns:
        For each cell of the section, along the other axes in their order, the cell of the archive.
    """
    return {
        tuple(i for axis, i in enumerate(cell) if axis not in fixed): cell
        for cell in sorted(elites)
        if all(cell[axis] == i for axis, i in fixed.items())
    }
