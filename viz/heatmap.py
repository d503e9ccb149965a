"""A 2-D map as a heatmap in SVG, every cell of which can be clicked."""

from __future__ import annotations

import dataclasses
import html
from collections.abc import Mapping

from engine.algorithms.base import Axis
from engine.archive import Cell
from engine.records import cell_name
from viz import axes as axis_text
from viz import theme
from viz.scale import Scale, bar

CELL_WIDTH = 30
CELL_HEIGHT = 21
LEFT = 46
TOP = 8
BOTTOM = 34
BAR_GAP = 12
BAR_WIDTH = 12
RIGHT = 44
WIDTH = 384
"""Of a map of 9 columns, the usual one: other pictures keep to it, so that their texts match."""


@dataclasses.dataclass(frozen=True, slots=True)
class Tile:
    """A filled cell: the lines of its hover card, the number of its evaluation."""

    hint: str
    number: int


@dataclasses.dataclass(frozen=True, slots=True)
class Ring:
    """A mark around the cell of the chosen robot.

    Attributes:
        cell: where the robot lies.
        linked: whether it was chosen in another archive.
        covered: whether the cell shows another, better robot.
    """

    cell: Cell
    linked: bool = False
    covered: bool = False

    @property
    def color(self) -> str:
        """Its colour."""
        return theme.LINKED if self.linked else theme.SELECTED


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Heatmap:
    """What to draw.

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
        "stroke-dasharray:none;stroke-opacity:1}.ta-map .e{fill:currentColor;fill-opacity:.03;"
        "stroke:currentColor;stroke-opacity:.28;stroke-width:.8;stroke-dasharray:2 2}"
        "@keyframes ta-flash{from{fill:#fff}}.ta-map .f{animation:ta-flash 1.2s ease-out}</style>",
    ]
    parts += [_cell(heatmap, (i, j)) for i in range(x_axis.n) for j in range(y_axis.n)]
    if heatmap.ring is not None:
        ring = heatmap.ring
        x, y = _corner(heatmap, ring.cell)
        dashes = ' stroke-dasharray="4 2.5"' if ring.covered else ""
        parts.append(
            f'<rect x="{x - 0.5}" y="{y - 0.5}" width="{CELL_WIDTH}" height="{CELL_HEIGHT}"'
            f' rx="4" fill="none" stroke="{ring.color}" stroke-width="2.5"{dashes} pointer-events="none"/>'
        )
    parts += [_x_labels(x_axis, y_axis), _y_labels(y_axis), _color_bar(heatmap), "</svg>"]
    return "".join(parts)


def text(x: float, y: float, content: str, *, anchor: str = "start", small: bool = False) -> str:
    """Return a label as SVG; the content is markup."""
    look = ' fill-opacity="0.75" font-size="10"' if small else ""
    place = "" if anchor == "start" else f' text-anchor="{anchor}"'
    return f'<text x="{x:g}" y="{y:g}"{place} fill="currentColor"{look}>{content}</text>'


def upright_text(x: float, y: float, content: str) -> str:
    """Return an axis's title that reads upwards, centred; the content is markup."""
    return (
        f'<text transform="translate({x:g} {y:g}) rotate(-90)" text-anchor="middle" fill="currentColor">'
        f"{content}</text>"
    )


def _corner(heatmap: Heatmap, cell: Cell) -> tuple[int, int]:
    return (
        LEFT + cell[0] * CELL_WIDTH,
        TOP + (heatmap.axes[1].n - 1 - cell[1]) * CELL_HEIGHT,
    )


def _cell(heatmap: Heatmap, cell: Cell) -> str:
    x, y = _corner(heatmap, cell)
    tile = heatmap.tiles.get(cell)
    if tile is None:
        look, hint = 'class="e"', f"empty cell\n{axis_text.describe(heatmap.axes, cell)}"
    else:
        look = f'fill="{heatmap.scale.color(heatmap.values.get(cell))}"'
        look += ' class="f"' if cell in heatmap.fresh else ""
        hint = tile.hint
    return (
        f'<g class="c" data-c="{html.escape(heatmap.name)}:{cell_name(cell)}"'
        f' data-filled="{int(tile is not None)}" data-h="{html.escape(hint)}">'
        f'<rect x="{x}" y="{y}" width="{CELL_WIDTH - 1.5}" height="{CELL_HEIGHT - 1.5}" rx="3" {look}/></g>'
    )


def _x_labels(x_axis: Axis, y_axis: Axis) -> str:
    y = TOP + y_axis.n * CELL_HEIGHT
    ticks = [
        text(LEFT + (i + 0.5) * CELL_WIDTH, y + 12, label, anchor="middle", small=True)
        for i, label in enumerate(axis_text.labels(x_axis))
        if label
    ]
    title = html.escape(axis_text.title(x_axis))
    return "".join(ticks) + text(LEFT + x_axis.n * CELL_WIDTH / 2, y + 27, title, anchor="middle")


def _y_labels(y_axis: Axis) -> str:
    ticks = [
        text(LEFT - 5, TOP + (y_axis.n - 0.5 - j) * CELL_HEIGHT + 3.5, label, anchor="end", small=True)
        for j, label in enumerate(axis_text.labels(y_axis))
        if label
    ]
    title = html.escape(axis_text.title(y_axis))
    return "".join(ticks) + upright_text(11, TOP + y_axis.n * CELL_HEIGHT / 2, title)


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
