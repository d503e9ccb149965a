"""A 2-D map as a heatmap in SVG, every cell of which can be clicked."""

from __future__ import annotations

import dataclasses
import html
import math
from collections.abc import Mapping, Sequence

from engine.search.archive import Cell, cell_name
from engine.search.axes import Axis
from viz.maps import axis_labels
from viz.maps.map_parts import LEFT, PALE, SHARED_STYLE, TOP, Ring, Tile, attributes, text, upright_text
from viz.maps.scale import Scale, bar

CELL_WIDTH = 30
CELL_HEIGHT = 21
BOTTOM = 34
BAR_GAP = 12
BAR_WIDTH = 12
RIGHT = 40


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Heatmap:
    """A plain map to draw.

    Attributes:
        name: of the map; clicks report ``name:i,j``.
        axes: first along x, second along y.
        tiles: the filled cells.
        values: what is coloured, by cell; a filled cell without a value is grey.
        scale: the colours.
        ring: around the chosen robot's cell.
        fresh: cells to flash because they have just been won.
    """

    name: str
    axes: tuple[Axis, Axis]
    tiles: Mapping[Cell, Tile]
    values: Mapping[Cell, float]
    scale: Scale
    ring: Ring | None = None
    fresh: frozenset[Cell] = frozenset()

    @property
    def start(self) -> Cell | None:
        """Where the keyboard begins: at the chosen robot, or else at the most coloured cell."""
        if self.ring is not None and self.ring.cell in self.tiles:
            return self.ring.cell
        return max(self.tiles, key=lambda c: (self.values.get(c, -math.inf), c), default=None)


def render(heatmap: Heatmap, on_pointer_down: str) -> str:
    """Return a heatmap as SVG.

    Args:
        heatmap: what to draw.
        on_pointer_down: JavaScript, already escaped for an attribute; the clicked element or one
            around it has ``data-c`` = ``name:i,j``. Empty where a script of the page listens.
    """
    x_axis, y_axis = heatmap.axes
    width = LEFT + x_axis.n * CELL_WIDTH + BAR_GAP + BAR_WIDTH + RIGHT
    height = TOP + y_axis.n * CELL_HEIGHT + BOTTOM
    ringed = heatmap.ring is not None and heatmap.ring.cell in heatmap.tiles
    described = attributes(heatmap.name, (CELL_WIDTH, CELL_HEIGHT), heatmap.start)
    described += ' data-ring="1"' if ringed else ""
    handler = f' onpointerdown="{on_pointer_down}"' if on_pointer_down else ""
    parts = [
        f'<svg class="ta-map" {described} viewBox="0 0 {width} {height}"'
        f' width="100%" style="display:block;font:11px system-ui,sans-serif;touch-action:manipulation"'
        f"{handler}>",
        "<style>.ta-map .c{cursor:pointer}.ta-map .c:hover rect{stroke:currentColor;stroke-width:1.5;"
        "stroke-dasharray:none;stroke-opacity:1}.ta-map .e{fill:currentColor;fill-opacity:.03;"
        "stroke:currentColor;stroke-opacity:.28;stroke-width:.8;stroke-dasharray:2 2}"
        f"{SHARED_STYLE}</style>",
    ]
    parts += [_cell(heatmap, (i, j)) for i in range(x_axis.n) for j in range(y_axis.n)]
    parts.append(
        f'<rect class="ta-near" width="{CELL_WIDTH - 7}" height="{CELL_HEIGHT - 7}" rx="2" stroke-width="1.5"'
        f' transform="translate(2.75 2.75)" {MARK_STYLE.format("#fff")} visibility="hidden"/>'
    )
    if heatmap.ring is not None:
        ring = heatmap.ring
        x, y = _corner(heatmap, ring.cell)
        dashes = ' stroke-dasharray="4 2.5"' if ring.covered else ""
        parts.append(
            f'<rect class="ta-ring" x="{x - 0.75}" y="{y - 0.75}" width="{CELL_WIDTH}" height="{CELL_HEIGHT}"'
            f' rx="4" stroke-width="2.5"{dashes} {MARK_STYLE.format(ring.color)}/>'
        )
    parts += [_x_labels(x_axis, y_axis), _y_labels(y_axis), _color_bar(heatmap), "</svg>"]
    return "".join(parts)


MARK_STYLE = 'fill="none" stroke="{}" pointer-events="none" style="filter:drop-shadow(0 0 1px #000)"'
"""Attributes of a mark around a cell, but for its colour; the shadow sets it off against any ground."""


def _corner(heatmap: Heatmap, cell: Cell) -> tuple[int, int]:
    return (
        LEFT + cell[0] * CELL_WIDTH,
        TOP + (heatmap.axes[1].n - 1 - cell[1]) * CELL_HEIGHT,
    )


def _cell(heatmap: Heatmap, cell: Cell) -> str:
    x, y = _corner(heatmap, cell)
    tile = heatmap.tiles.get(cell)
    if tile is None:
        look, hint = 'class="e"', f"empty cell\n{axis_labels.describe(heatmap.axes, cell)}"
    else:
        look = f'fill="{heatmap.scale.color(heatmap.values.get(cell))}"'
        marks = (("f", cell in heatmap.fresh), ("z", tile.still and not tile.pale))
        kinds = [kind for kind, holds in marks if holds]
        look += f' class="{" ".join(kinds)}"' if kinds else ""
        look += f' fill-opacity="{PALE}"' if tile.pale else ""
        hint = tile.hint
    robot = "" if tile is None else f' data-n="{tile.number}"'
    return (
        f'<g class="c" data-c="{html.escape(heatmap.name)}:{cell_name(cell)}"{robot}'
        f' data-filled="{int(tile is not None)}"{_body(tile)} data-h="{html.escape(hint)}">'
        f'<rect x="{x}" y="{y}" width="{CELL_WIDTH - 1.5}" height="{CELL_HEIGHT - 1.5}" rx="3" {look}/></g>'
    )


def _body(tile: Tile | None) -> str:
    return f' data-b="{html.escape(tile.body)}"' if tile and tile.body else ""


def _x_labels(x_axis: Axis, y_axis: Axis) -> str:
    y = TOP + y_axis.n * CELL_HEIGHT
    ticks = [
        text(LEFT + place * CELL_WIDTH - 0.75, y + 12, label, anchor="middle", small=True)
        for place, label in axis_labels.ticks(x_axis)
    ]
    title = html.escape(axis_labels.title(x_axis))
    return "".join(ticks) + text(LEFT + x_axis.n * CELL_WIDTH / 2, y + 27, title, anchor="middle")


def _y_labels(y_axis: Axis) -> str:
    def column(x: float, ticks: Sequence[tuple[float, str]]) -> list[str]:
        bottom = TOP + y_axis.n * CELL_HEIGHT + 2.75
        return [text(x, bottom - p * CELL_HEIGHT, t, anchor="end", small=True) for p, t in ticks]

    parts = column(LEFT - 5, axis_labels.ticks(y_axis))
    if stiffness := axis_labels.newtons_per_metre(y_axis):
        x = LEFT - 26
        parts += [
            *column(x, stiffness),
            text(x, TOP - 4, axis_labels.STIFFNESS_UNIT, anchor="end", small=True),
        ]
    title = html.escape(axis_labels.title(y_axis))
    return "".join(parts) + upright_text(11, TOP + y_axis.n * CELL_HEIGHT / 2, title)


def _color_bar(heatmap: Heatmap) -> str:
    x_axis, y_axis = heatmap.axes
    x = LEFT + x_axis.n * CELL_WIDTH + BAR_GAP
    height = y_axis.n * CELL_HEIGHT
    ticks = [
        text(x + BAR_WIDTH + 4, TOP + height * (1 - part) + 3.5, label, small=True)
        for part, label in heatmap.scale.ticks().items()
    ]
    title = text(x + BAR_WIDTH / 2, TOP + height + 27, heatmap.scale.title_markup(), anchor="middle")
    return bar(heatmap.scale, x, TOP, BAR_WIDTH, height) + "".join(ticks) + title
