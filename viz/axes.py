"""What the axes of an archive mean to people."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from engine.algorithms.base import Axis
from engine.archive import Cell
from engine.measures import body_axes, trajectory_axes

TITLES: Final = {
    "stiffness": "relative stiffness",
    "softest": "softest module",
    "stiffest": "stiffest module",
}


def title(axis: Axis) -> str:
    """Return an axis's title for people."""
    return TITLES.get(axis.name, axis.name)


def value(axis: Axis, index: int) -> str:
    """Return the centre of a cell as text."""
    centre = axis.lower + (index + 0.5) * (axis.upper - axis.lower) / axis.n
    return f"{centre:.0f}" if axis.name == "modules" else f"{centre:.1f}"


def labels(axis: Axis) -> list[str]:
    """Return a label for the centre of each cell, some of them empty where they would crowd."""
    crowded = not axis.name.startswith(("modules", "stiff", "soft"))
    return ["" if crowded and i % 2 else value(axis, i) for i in range(axis.n)]


def describe(axes: Sequence[Axis], cell: Cell) -> str:
    """Return what a cell stands for."""
    parts = []
    for axis, i in zip(axes, cell, strict=True):
        text = value(axis, i)
        parts.append(f"{text} modules" if axis.name == "modules" else f"{title(axis)} {text}")
    return ", ".join(parts)


def family(axes: Sequence[Axis]) -> str | None:
    """Return which of the two maps of the method some axes belong to, if to one."""
    if is_body(axes):
        return "morphology"
    return "controller" if len(trajectory_axes(axes)) == len(axes) else None


def is_body(axes: Sequence[Axis]) -> bool:
    """Tell whether the body alone decides the cell."""
    return len(body_axes(axes)) == len(axes)
