"""How the axes of an archive are labelled."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from engine.body.feet import FEET, FEET_TEXT
from engine.body.module import stiffness_n_per_m
from engine.search.archive import Cell
from engine.search.axes import Axis, body_axes, cell_centre, trajectory_axes

TITLES: Final = {
    "stiffness": "relative stiffness",
    "softest": "softest module",
    "stiffest": "stiffest module",
}
"""Of axes of stiffness."""
STIFFNESS_UNIT: Final = "N/m"
MAX_CENTRES: Final = 12
"""Most labels along an axis of the body."""
MAX_BOUNDS: Final = 6
"""Most labels along an axis of the trajectory, at bounds of cells."""


def title(axis: Axis) -> str:
    """Return an axis's title for people."""
    return TITLES.get(axis.name, axis.name)


def value(axis: Axis, index: int) -> str:
    """Return the centre of a cell as text."""
    centre = cell_centre(axis, index)
    if axis.name == "feet":
        return FEET[round(centre)] if 0 <= round(centre) < len(FEET) else "?"
    return f"{centre:.0f}" if axis.name == "modules" else _signed(centre, 1)


def ticks(axis: Axis) -> list[tuple[float, str]]:
    """Return the labels of an axis with their places in cells, from its lower end.

    A cell of a body's axis stands for one value and is labelled at its centre. Along another axis some of the
    cells' bounds are labelled, with the axis's own two.
    """
    if is_body([axis]):
        return [(i + 0.5, value(axis, i)) for i in range(0, axis.n, -(-axis.n // MAX_CENTRES))]
    step = next(s for s in range(1, axis.n + 1) if axis.n % s == 0 and axis.n // s < MAX_BOUNDS)
    return [(float(i), _bound(axis, i)) for i in range(0, axis.n + 1, step)]


def newtons_per_metre(axis: Axis) -> list[tuple[float, str]] | None:
    """Return labels in N/m with their places in cells for an axis of stiffness, None for another one."""
    if axis.name not in TITLES:
        return None
    centres = [cell_centre(axis, i) for i in range(axis.n)]
    return [(i + 0.5, f"{stiffness_n_per_m(c):.0f}") for i, c in enumerate(centres)]


def describe(axes: Sequence[Axis], cell: Cell) -> str:
    """Return what a cell stands for."""
    return ", ".join(_describe(axis, i) for axis, i in zip(axes, cell, strict=True))


def family(axes: Sequence[Axis]) -> str | None:
    """Return which of the method's two maps has these axes, None if neither has."""
    if is_body(axes):
        return "morphology"
    return "controller" if len(trajectory_axes(axes)) == len(axes) else None


def is_body(axes: Sequence[Axis]) -> bool:
    """Tell whether the body alone decides the cell."""
    return len(body_axes(axes)) == len(axes)


def _describe(axis: Axis, index: int) -> str:
    text = value(axis, index)
    if axis.name == "modules":
        return f"{text} modules"
    if axis.name == "feet":
        return f"feet {FEET_TEXT[FEET[index]]}"
    if axis.name in TITLES:
        return f"{title(axis)} {text} ({stiffness_n_per_m(cell_centre(axis, index)):.0f} {STIFFNESS_UNIT})"
    return f"{title(axis)} {_bound(axis, index)} to {_bound(axis, index + 1)}"


def _bound(axis: Axis, index: int) -> str:
    bound = axis.lower + index * (axis.upper - axis.lower) / axis.n
    return _signed(bound, 0 if axis.upper - axis.lower >= 30 else 1)


def _signed(number: float, digits: int) -> str:
    """Return a number as text; a zero has no sign."""
    text = f"{number:.{digits}f}"
    return text.lstrip("-") if float(text) == 0 else text
