"""An archive as a heatmap in SVG, every cell of which can be clicked."""

from __future__ import annotations

import dataclasses
import functools
import html
import math
from collections.abc import Mapping

import numpy as np

from engine.algorithms.base import Axis
from engine.archive import Cell
from engine.records import cell_name
from viz import theme

CELL_WIDTH = 30
CELL_HEIGHT = 21
LEFT = 46
TOP = 8
BOTTOM = 34
BAR_GAP = 12
BAR_WIDTH = 12
RIGHT = 44


@dataclasses.dataclass(frozen=True, slots=True)
class Tile:
    """A filled cell: its value in cm, the lines of its hover card, the number of its evaluation."""

    value: float
    hint: str
    number: int


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Heatmap:
    """What to draw.

    Attributes:
        name: the archive; clicks report ``name:i,j``.
        axes: first along x, second along y.
        tiles: the filled cells.
        limits: values at the ends of the colour scale, in cm.
        selected: the cell to ring.
        linked: the cell that holds the same robot as the selection in another map.
        fresh: cells to flash because they have just been won.
        colormap: one of ``theme.MAPS``.
    """

    name: str
    axes: tuple[Axis, Axis]
    tiles: Mapping[Cell, Tile]
    limits: tuple[float, float]
    selected: Cell | None = None
    linked: Cell | None = None
    fresh: frozenset[Cell] = frozenset()
    colormap: str = "viridis"


def color_limits(values: list[float]) -> tuple[float, float]:
    """Return the ends of a colour scale for values in cm, rounded outwards to whole centimetres.

    The scale ends at the best value and begins at the 5th percentile: a few robots that run away from
    their targets would otherwise take the colours from all others.
    """
    if not values:
        return (0.0, 1.0)
    low, high = math.floor(np.percentile(values, 5)), math.ceil(max(values))
    return (float(low), float(max(high, low + 1)))


def with_fresh(heatmap: Heatmap, before: Heatmap | None) -> Heatmap:
    """Mark the cells that a heatmap's predecessor did not hold alike."""
    if before is None or before.axes != heatmap.axes:
        return heatmap
    fresh = frozenset(c for c, t in heatmap.tiles.items() if before.tiles.get(c) != t)
    return dataclasses.replace(heatmap, fresh=fresh)


def describe_cell(heatmap: Heatmap, cell: Cell) -> str:
    """Return what the cell of a map stands for."""
    parts = []
    for axis, i in zip(heatmap.axes, cell, strict=True):
        value = axis.lower + (i + 0.5) * (axis.upper - axis.lower) / axis.n
        text = f"{value:.0f}" if axis.name == "modules" else f"{value:.1f}"
        parts.append(f"{axis.name} {text}")
    return " and ".join(parts)


def render(heatmap: Heatmap, on_pointer_down: str) -> str:
    """Return a heatmap as SVG.

    Args:
        heatmap: what to draw.
        on_pointer_down: JavaScript, already escaped for an attribute; the clicked element or one
            around it has ``data-c`` = ``name:i,j``.
    """
    x_axis, y_axis = heatmap.axes
    width = LEFT + x_axis.n * CELL_WIDTH + BAR_GAP + BAR_WIDTH + RIGHT
    height = TOP + y_axis.n * CELL_HEIGHT + BOTTOM
    parts = [
        f'<svg class="ta-map" data-map="{html.escape(heatmap.name)}" viewBox="0 0 {width} {height}"'
        f' width="100%" style="display:block;font:11px system-ui,sans-serif;touch-action:manipulation"'
        f' onpointerdown="{on_pointer_down}">',
        "<style>.ta-map .c{cursor:pointer}.ta-map .c:hover rect{stroke:currentColor;stroke-width:1.5;"
        "stroke-dasharray:none}@keyframes ta-flash{from{fill:#fff}}"
        ".ta-map .f{animation:ta-flash 1.2s ease-out}</style>",
    ]
    for i in range(x_axis.n):
        for j in range(y_axis.n):
            parts.append(_cell(heatmap, (i, j)))
    for cell, color in ((heatmap.linked, theme.LINKED), (heatmap.selected, theme.SELECTED)):
        if cell is not None:
            x, y = _corner(heatmap, cell)
            parts.append(
                f'<rect x="{x - 0.5}" y="{y - 0.5}" width="{CELL_WIDTH}" height="{CELL_HEIGHT}"'
                f' rx="4" fill="none" stroke="{color}" stroke-width="2.5" pointer-events="none"/>'
            )
    parts += [_x_labels(x_axis, y_axis), _y_labels(y_axis), _color_bar(heatmap), "</svg>"]
    return "".join(parts)


def _corner(heatmap: Heatmap, cell: Cell) -> tuple[int, int]:
    return (
        LEFT + cell[0] * CELL_WIDTH,
        TOP + (heatmap.axes[1].n - 1 - cell[1]) * CELL_HEIGHT,
    )


def _cell(heatmap: Heatmap, cell: Cell) -> str:
    x, y = _corner(heatmap, cell)
    tile = heatmap.tiles.get(cell)
    box = f'x="{x}" y="{y}" width="{CELL_WIDTH - 1.5}" height="{CELL_HEIGHT - 1.5}" rx="3"'
    if tile is None:
        look = 'fill="currentColor" fill-opacity="0.03" stroke="currentColor" stroke-opacity="0.28"'
        look += ' stroke-width="0.8" stroke-dasharray="2 2"'
        hint = "empty cell"
    else:
        look = f'fill="{_color(tile.value, heatmap.limits, heatmap.colormap)}"'
        hint = tile.hint
    state = "f" if cell in heatmap.fresh else ""
    return (
        f'<g class="c" data-c="{html.escape(heatmap.name)}:{cell_name(cell)}"'
        f' data-filled="{int(tile is not None)}">'
        f'<rect class="{state}" {box} {look}/><title>{html.escape(hint)}</title></g>'
    )


def _color(value: float, limits: tuple[float, float], colormap: str) -> str:
    low, high = limits
    return _step_color(round(255 * (value - low) / (high - low)), colormap)


@functools.lru_cache(maxsize=1024)
def _step_color(step: int, colormap: str) -> str:
    return theme.color_at(step / 255, colormap)


def _tick(value: float) -> str:
    return f"{value:.3g}"


def _x_labels(x_axis: Axis, y_axis: Axis) -> str:
    y = TOP + y_axis.n * CELL_HEIGHT
    labels = _axis_labels(x_axis)
    ticks = "".join(
        f'<text x="{LEFT + (i + 0.5) * CELL_WIDTH}" y="{y + 12}" text-anchor="middle"'
        f' fill="currentColor" fill-opacity="0.75" font-size="10">{label}</text>'
        for i, label in enumerate(labels)
        if label
    )
    middle = LEFT + x_axis.n * CELL_WIDTH / 2
    return (
        ticks
        + f'<text x="{middle}" y="{y + 27}" text-anchor="middle" fill="currentColor">'
        + f"{html.escape(axis_title(x_axis))}</text>"
    )


def _y_labels(y_axis: Axis) -> str:
    labels = _axis_labels(y_axis)
    ticks = "".join(
        f'<text x="{LEFT - 5}" y="{TOP + (y_axis.n - 0.5 - j) * CELL_HEIGHT + 3.5}"'
        f' text-anchor="end" fill="currentColor" fill-opacity="0.75" font-size="10">{label}</text>'
        for j, label in enumerate(labels)
        if label
    )
    middle = TOP + y_axis.n * CELL_HEIGHT / 2
    return (
        ticks
        + f'<text transform="translate(11 {middle}) rotate(-90)" text-anchor="middle"'
        + f' fill="currentColor">{html.escape(axis_title(y_axis))}</text>'
    )


def axis_title(axis: Axis) -> str:
    """Return an axis's title for people."""
    return {"modules": "modules", "stiffness": "relative stiffness"}.get(axis.name, axis.name)


def _axis_labels(axis: Axis) -> list[str]:
    """Return a label for the centre of each cell, some of them empty where they would crowd."""
    step = (axis.upper - axis.lower) / axis.n
    centres = [axis.lower + (i + 0.5) * step for i in range(axis.n)]
    if axis.name == "modules":
        return [f"{c:.0f}" for c in centres]
    if axis.name == "stiffness":
        return [f"{c:.1f}" for c in centres]
    return [f"{c:.1f}" if i % 2 == 0 else "" for i, c in enumerate(centres)]


def _color_bar(heatmap: Heatmap) -> str:
    x_axis, y_axis = heatmap.axes
    x = LEFT + x_axis.n * CELL_WIDTH + BAR_GAP
    height = y_axis.n * CELL_HEIGHT
    low, high = heatmap.limits
    steps = 32
    bar = "".join(
        f'<rect x="{x}" y="{TOP + height * k / steps:.2f}" width="{BAR_WIDTH}"'
        f' height="{height / steps + 0.4:.2f}"'
        f' fill="{_step_color(round(255 * (1 - (k + 0.5) / steps)), heatmap.colormap)}"/>'
        for k in range(steps)
    )
    below = any(t.value < low for t in heatmap.tiles.values())
    labels = {part: _tick(low + part * (high - low)) for part in (0.0, 0.25, 0.5, 0.75, 1.0)}
    if below:
        labels[0.0] = f"≤{labels[0.0]}"
    ticks = "".join(
        f'<text x="{x + BAR_WIDTH + 4}" y="{TOP + height * (1 - part) + 3.5}" fill="currentColor"'
        f' fill-opacity="0.75" font-size="10">{label}</text>'
        for part, label in labels.items()
    )
    title = (
        f'<text x="{x + BAR_WIDTH / 2}" y="{TOP + height + 27}" text-anchor="middle"'
        f' fill="currentColor">f<tspan dy="3" font-size="8">s</tspan><tspan dy="-3"> cm</tspan></text>'
    )
    return bar + ticks + title
