"""An archive of three or four axes as a map of maps in SVG.

Four axes: a grid of the first two, in each of whose cells lies a map of the last two, as the paper draws
its single archives. Three axes: a map of the last two for every cell of the first.

There can be thousands of cells, so they are no elements of their own: cells of one colour are one path,
and ``viz.maps.interaction`` finds the filled cell nearest to the pointer in the table ``data-cells``.
"""

from __future__ import annotations

import dataclasses
import html
import json
import math
import re
from collections import defaultdict
from collections.abc import Mapping

from engine.search.archive import Cell
from engine.search.axes import Axis
from viz.maps import axis_labels
from viz.maps.map_parts import (
    LEFT,
    PALE,
    SHARED_STYLE,
    TOP,
    WIDTH,
    Ring,
    Tile,
    attributes,
    text,
    upright_text,
)
from viz.maps.scale import Scale, bar

RIGHT = 2
GAP = 3
"""Between the maps of a grid."""
FACET_COLUMNS = 3
FACET_GAP = 14
FACET_TITLE = 12
AXIS_HEIGHT = 32
BAR_HEIGHT = 8
LEGEND_HEIGHT = 28
MARK = "\ue000"
"""Stands for a number in a text of ``data-hints``."""
_NUMBER = re.compile(r"-?\d+(?:\.\d+)?")


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class NestedMap:
    """A nested map to draw.

    Attributes:
        name: of the map; clicks report ``name:i,j,k,l``.
        axes: three or four.
        tiles: the filled cells.
        values: what is coloured, by cell; a filled cell without a value is grey.
        scale: the colours.
        fresh: cells to flash because they have just been won.
    """

    name: str
    axes: tuple[Axis, ...]
    tiles: Mapping[Cell, Tile]
    values: Mapping[Cell, float]
    scale: Scale
    fresh: frozenset[Cell] = frozenset()


@dataclasses.dataclass(frozen=True, slots=True)
class Geometry:
    """Where the cells lie, in units of the picture.

    Attributes:
        shape: of the archive.
        cell: width and height of a cell.
        step: from one inner map to the next.
        columns, rows: of inner maps.
        top: of the first inner map.
    """

    shape: tuple[int, ...]
    cell: tuple[int, int]
    step: tuple[int, int]
    columns: int
    rows: int
    top: int

    @classmethod
    def of(cls, shape: tuple[int, ...]) -> Geometry:
        """Lay out an archive so that a usual one is as wide as a plain map."""
        faceted = len(shape) == 3
        nx, ny = shape[-2:]
        columns = min(FACET_COLUMNS, shape[0]) if faceted else shape[0]
        rows = -(-shape[0] // columns) if faceted else shape[1]
        gap = FACET_GAP if faceted else GAP
        width = max(round(((WIDTH - LEFT - RIGHT) / columns - gap) / nx), 1)
        height = max(round(0.8 * width), 1)
        title = FACET_TITLE if faceted else 0
        return cls(
            shape, (width, height), (nx * width + gap, ny * height + gap + title), columns, rows, TOP + title
        )

    @property
    def inner(self) -> tuple[int, int]:
        """Width and height of an inner map."""
        return self.shape[-2] * self.cell[0], self.shape[-1] * self.cell[1]

    @property
    def bottom(self) -> int:
        """Lower end of the last inner map."""
        return self.top + (self.rows - 1) * self.step[1] + self.inner[1]

    def outer_corner(self, outer: Cell) -> tuple[int, int]:
        """Return the upper left corner of the inner map of an (n - 2) outer cell."""
        if len(outer) == 1:
            row, column = divmod(outer[0], self.columns)
        else:
            column, row = outer[0], self.rows - 1 - outer[1]
        return LEFT + column * self.step[0], self.top + row * self.step[1]

    def corner(self, cell: Cell) -> tuple[int, int]:
        """Return the upper left corner of a cell."""
        x, y = self.outer_corner(cell[:-2])
        return x + cell[-2] * self.cell[0], y + (self.shape[-1] - 1 - cell[-1]) * self.cell[1]

    def outer_cells(self) -> list[Cell]:
        """Return all outer cells."""
        if len(self.shape) == 3:
            return [(i,) for i in range(self.shape[0])]
        return [(i, j) for i in range(self.shape[0]) for j in range(self.shape[1])]


def render(nested: NestedMap, on_pointer_down: str) -> str:
    """Return a nested map as SVG, without the ring, which ``ring_style`` moves.

    Args:
        nested: what to draw.
        on_pointer_down: JavaScript, already escaped for an attribute; the SVG has ``data-c`` =
            ``name:i,j,k,l`` while a filled cell is near the pointer.
    """
    g = Geometry.of(tuple(a.n for a in nested.axes))
    width, height = WIDTH, g.bottom + AXIS_HEIGHT + LEGEND_HEIGHT
    width = max(width, LEFT + g.columns * g.step[0] + RIGHT)  # rounded to whole units, it may be wider
    cells, hints = _table(nested, g)
    best = max(nested.tiles, key=lambda c: (nested.values.get(c, -math.inf), c), default=None)
    near = f'width="{g.cell[0]}" height="{g.cell[1]}"'
    return "".join(
        [
            f'<svg class="ta-map ta-nested" {attributes(nested.name, g.cell, best)}'
            f' viewBox="0 0 {width} {height}" width="100%"'
            f' data-cells="{cells}" data-hints="{html.escape(json.dumps(hints))}" data-mark="{MARK}"'
            ' style="display:block;font:11px system-ui,sans-serif;touch-action:manipulation"'
            f' onpointerdown="{on_pointer_down}">',
            "<style>.ta-nested[data-c]{cursor:pointer}.ta-nested .o{fill:currentColor;fill-opacity:.07}"
            ".ta-nested .e{fill:none;stroke:currentColor;stroke-opacity:.28;stroke-width:.8;"
            "stroke-dasharray:2 2}.ta-nested .ta-ring,.ta-nested .ta-outer{visibility:hidden;fill:none;"
            f"pointer-events:none;filter:drop-shadow(0 0 .8px #000)}}{SHARED_STYLE}</style>",
            _frames(nested, g),
            _paths(nested, g),
            f'<rect class="ta-near" {near} fill="none" stroke="currentColor" stroke-width="1"'
            ' pointer-events="none" visibility="hidden"/>',
            f'<rect class="ta-outer" x="-1.5" y="-1.5" width="{g.inner[0] + 3}" height="{g.inner[1] + 3}"'
            ' rx="2" stroke-width="1"/>',
            f'<rect class="ta-ring" x="-2.5" y="-2.5" width="{g.cell[0] + 5}" height="{g.cell[1] + 5}"'
            ' rx="2.5" stroke-width="2"/>',
            _labels(nested, g),
            _legend(nested, g),
            "</svg>",
        ]
    )


def ring_style(nested: NestedMap, ring: Ring | None) -> str:
    """Return a style sheet that rings the chosen robot, wherever the map is drawn: a click sends little."""
    if ring is None:
        return ""
    g = Geometry.of(tuple(a.n for a in nested.axes))
    name = "".join(c if c.isascii() and c.isalnum() else f"\\{ord(c):x} " for c in nested.name)
    where = f'.ta-nested[data-map="{name}"]'
    rules = []
    for kind, (x, y) in (("ring", g.corner(ring.cell)), ("outer", g.outer_corner(ring.cell[:-2]))):
        rules.append(
            f"{where} .ta-{kind}{{visibility:visible;stroke:{ring.color};transform:translate({x}px,{y}px)}}"
        )
    return "<style>" + "".join(rules) + "</style>"


def _table(nested: NestedMap, g: Geometry) -> tuple[str, list[str]]:
    """Return the filled cells as ``x,y,i.j.k.l,H,numbers,faces,robot;``... and the texts that H counts.

    The hover cards differ in hardly more than their numbers, so a text has marks in their places.
    """
    known: dict[str, int] = {}
    rows = []
    for cell in sorted(nested.tiles):
        x, y = g.corner(cell)
        hint = nested.tiles[cell].hint
        kind = known.setdefault(_NUMBER.sub(MARK, hint), len(known))
        numbers = " ".join(_NUMBER.findall(hint))
        tile = nested.tiles[cell]
        rows.append(f"{x},{y},{'.'.join(map(str, cell))},{kind},{numbers},{tile.body},{tile.number}")
    return ";".join(rows), list(known)


def _square(x: int, y: int, width: int, height: int) -> str:
    return f"M{x} {y}h{width}v{height}h-{width}z"


def _frames(nested: NestedMap, g: Geometry) -> str:
    filled = {cell[:-2] for cell in nested.tiles}
    paths = {"o": "", "e": ""}
    for outer in g.outer_cells():
        paths["o" if outer in filled else "e"] += _frame(nested, g, outer)
    return "".join(f'<path class="{kind}" d="{d}"/>' for kind, d in paths.items() if d)


def _frame(nested: NestedMap, g: Geometry, outer: Cell) -> str:
    """Return the outline of an inner map's cells, without those that no robot can lie in."""
    x, y = g.outer_corner(outer)
    if [a.name for a in nested.axes[-2:]] != ["softest", "stiffest"] or g.shape[-2] != g.shape[-1]:
        return _square(x, y, *g.inner)
    width, height = g.cell
    return f"M{x} {y}h{g.inner[0]}" + f"v{height}h-{width}" * g.shape[-1] + "z"


def _paths(nested: NestedMap, g: Geometry) -> str:
    groups: dict[tuple[int, str, bool], list[str]] = defaultdict(list)
    for cell in sorted(nested.tiles):
        step, tile = nested.scale.step(nested.values.get(cell)), nested.tiles[cell]
        kinds = "f" * (cell in nested.fresh) + " z" * (tile.still and not tile.pale)
        key = (-1 if step is None else step, kinds.strip(), tile.pale)
        groups[key].append(_square(*g.corner(cell), *g.cell))
    return "".join(
        f"<path{f' class={chr(34)}{kinds}{chr(34)}' if kinds else ''}"
        f"{f' fill-opacity={chr(34)}{PALE}{chr(34)}' if pale else ''}"
        f' fill="{nested.scale.step_color(None if step < 0 else step)}" d="{"".join(squares)}"/>'
        for (step, kinds, pale), squares in sorted(groups.items())
    )


def _labels(nested: NestedMap, g: Geometry) -> str:
    x_axis, y_axis = nested.axes[-2:] if len(g.shape) == 3 else nested.axes[:2]
    bottom = g.bottom
    width = g.columns * g.step[0]
    parts = [
        text(LEFT + width / 2, bottom + 26, html.escape(axis_labels.title(x_axis)), anchor="middle"),
        upright_text(11, (g.top + bottom) / 2, html.escape(axis_labels.title(y_axis))),
    ]
    if len(g.shape) == 4:
        inside = " · ".join(
            f"{axis_labels.title(a)} {arrow}" for a, arrow in zip(nested.axes[2:], "→↑", strict=True)
        )
        parts.append(
            text(LEFT + width - GAP, bottom + 25, f"in each: {html.escape(inside)}", anchor="end", small=True)
        )
        (left, top), step = g.outer_corner((0, g.rows - 1)), g.step
        middle, low = (g.inner[0] - step[0]) / 2, top + g.rows * step[1] + (g.inner[1] - step[1]) / 2 + 3.5
        parts += [
            text(left + place * step[0] + middle, bottom + 9, label, anchor="middle", small=True)
            for place, label in axis_labels.ticks(x_axis)
        ]
        columns = [(LEFT - 5, axis_labels.ticks(y_axis))]
        if stiffness := axis_labels.newtons_per_metre(y_axis):
            columns.append((LEFT - 26, stiffness))
            parts.append(text(LEFT - 26, top - 4, axis_labels.STIFFNESS_UNIT, anchor="end", small=True))
        parts += [
            text(x, low - place * step[1], label, anchor="end", small=True)
            for x, ticks in columns
            for place, label in ticks
        ]
        return "".join(parts)
    outer = nested.axes[0]
    for (i,) in g.outer_cells():
        x, y = g.outer_corner((i,))
        parts.append(text(x, y - 3, html.escape(axis_labels.describe((outer,), (i,))), small=True))
        if i % g.columns == 0:
            parts += [
                text(LEFT - 5, y + (y_axis.n - place) * g.cell[1] + 3.5, label, anchor="end", small=True)
                for place, label in _few(axis_labels.ticks(y_axis))
            ]
        if i + g.columns >= g.shape[0]:
            parts += [
                text(x + place * g.cell[0], y + g.inner[1] + 10, label, anchor="middle", small=True)
                for place, label in _few(axis_labels.ticks(x_axis))
            ]
    return "".join(parts)


def _legend(nested: NestedMap, g: Geometry) -> str:
    width = g.columns * g.step[0] - GAP
    y = g.bottom + AXIS_HEIGHT
    parts = [bar(nested.scale, LEFT, y, width, BAR_HEIGHT)]
    for part, label in nested.scale.ticks().items():
        anchor = {0.0: "start", 1.0: "end"}.get(part, "middle")
        parts.append(text(LEFT + part * width, y + BAR_HEIGHT + 11, label, anchor=anchor, small=True))
    parts.append(text(LEFT - 6, y + BAR_HEIGHT, nested.scale.title_markup(), anchor="end"))
    return "".join(parts)


def _few(ticks: list[tuple[float, str]]) -> list[tuple[float, str]]:
    """Return the first, a middle and the last label: more would crowd."""
    return [ticks[i] for i in sorted({0, (len(ticks) - 1) // 2, len(ticks) - 1})]
