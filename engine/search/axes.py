"""What an archive's axes measure: which of them describe the body, which the way its head moves."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Final

import numpy as np

from engine.body.morphology import Morphology
from engine.errors import InvalidData
from engine.search.algorithm import Axis
from engine.search.archive import Cell

TRAJECTORY_PREFIX: Final = "PCA"
"""Begins the name of every axis that is a principal component of the head's trajectory."""


_BODY: Final[Mapping[str, Callable[[Morphology], float]]] = {
    "modules": lambda body: float(body.n_modules),
    "stiffness": lambda body: body.stiffness,
    "softest": lambda body: min(body.stiffnesses),
    "stiffest": lambda body: max(body.stiffnesses),
}


def body_axes(axes: Sequence[Axis]) -> tuple[int, ...]:
    """Return the indices of the axes that describe the body."""
    return tuple(i for i, axis in enumerate(axes) if not axis.name.startswith(TRAJECTORY_PREFIX))


def trajectory_axes(axes: Sequence[Axis]) -> tuple[int, ...]:
    """Return the indices of the axes that describe how the head moves."""
    return tuple(i for i, axis in enumerate(axes) if axis.name.startswith(TRAJECTORY_PREFIX))


def body_measure(axis: Axis, body: Morphology) -> float:
    """Return where on an axis that describes bodies a body lies.

    Raises:
        InvalidData: the axis is none that is known.
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
