"""Projections and sections of archives with more than two axes: which elite each of their cells shows."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar

from engine.search.archive import Cell

E = TypeVar("E")


def project(elites: Mapping[Cell, E], axes: Sequence[int], rank: Callable[[E], Any]) -> dict[Cell, Cell]:
    """Return the cells of an archive that a projection of it shows: the best along the other axes.

    Args:
        elites: (n axes) cells of the archive and whatever they hold.
        axes: the axes that remain, in the order in which the projection has them.
        rank: what to compare by, the smallest wins; for evaluations (fitness, number), as in an archive.

    Returns:
        By (len(axes)) cell of the projection the (n axes) cell of the archive whose elite it shows. On
        a tie it is the first in the order of the cells, whatever the order of the mapping.
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
        By cell of the section, which has the other axes in their order, the cell of the archive.
    """
    return {
        tuple(i for axis, i in enumerate(cell) if axis not in fixed): cell
        for cell in sorted(elites)
        if all(cell[axis] == i for axis, i in fixed.items())
    }
