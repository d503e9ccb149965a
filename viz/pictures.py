"""The maps of a run as pictures: contents, views and colours put together."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence

from engine.algorithms.base import Axis
from engine.archive import Cell
from viz import heatmap, nested
from viz.coloring import FITNESS, Coloring
from viz.heatmap import Heatmap, Ring, Tile
from viz.maps import Content, Elite
from viz.nested import NestedMap
from viz.scale import Scale
from viz.views import View


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Picture:
    """A map to be drawn.

    Attributes:
        view: what it is a picture of.
        axes: of its cells.
        outer: the cell of the archive that a section lies within.
        elites: what its cells show.
        sources: by its cell the cell of the archive.
        title, figures: for the line above it.
        values, scale: its colours.
        fresh: cells that have just been won.
    """

    view: View
    axes: tuple[Axis, ...]
    outer: Cell | None
    elites: Mapping[Cell, Elite]
    sources: Mapping[Cell, Cell]
    title: str
    figures: str
    tiles: Mapping[Cell, Tile]
    values: Mapping[Cell, float]
    scale: Scale
    fresh: frozenset[Cell] = frozenset()

    def render(self, ring: Ring | None, on_pointer_down: str) -> str:
        """Return it as SVG; a nested one is without the ring, see ``ring_style``."""
        drawn = self._map(ring)
        if isinstance(drawn, NestedMap):
            return nested.render(drawn, on_pointer_down)
        return heatmap.render(drawn, on_pointer_down)

    def ring_style(self, ring: Ring | None) -> str:
        """Return the style sheet that rings a cell of a nested map; empty for others."""
        drawn = self._map(ring)
        return nested.ring_style(drawn, ring) if isinstance(drawn, NestedMap) else ""

    def ring(self, cell: Cell | None, *, linked: bool) -> Ring | None:
        """Return the mark for a robot, if it lies on this map.

        Args:
            cell: of the archive that the robot is an elite of, None if of none.
            linked: whether it was chosen in another archive.
        """
        here = None if cell is None else self.view.cell_of(cell, self.outer)
        return None if here is None else Ring(here, linked=linked, covered=self.sources.get(here) != cell)

    def _map(self, ring: Ring | None) -> Heatmap | NestedMap:
        common = {"name": self.view.name, "tiles": self.tiles, "values": self.values, "scale": self.scale}
        if self.view.kind == "nested":
            return NestedMap(axes=self.axes, fresh=self.fresh, **common)  # type: ignore[arg-type]
        x, y = self.axes
        return Heatmap(axes=(x, y), ring=ring, fresh=self.fresh, **common)  # type: ignore[arg-type]


def pictures(
    contents: Mapping[str, Content],
    views: Sequence[View],
    coloring: Coloring,
    *,
    chosen: int | None = None,
    before: Sequence[Picture] = (),
) -> list[Picture]:
    """Return the pictures of some views.

    Args:
        contents: the archives by name.
        views: what to draw.
        coloring: what the colours stand for.
        chosen: number of the chosen robot: a section lies within the cell that it holds, or else
            within that of the best robot.
        before: the pictures of an earlier generation: cells that have been won since are fresh.
    """
    shown: list[tuple[View, Content, Cell | None, dict[Cell, Cell], dict[Cell, Elite], tuple[Axis, ...]]] = []
    for view in views:
        content = contents[view.archive]
        outer = outer_cell(content, chosen) if view.kind == "section" else None
        sources = view.cells(content, outer)
        elites = {cell: content.elites[source] for cell, source in sources.items()}
        shown.append((view, content, outer, sources, elites, tuple(content.axes[a] for a in view.axes)))
    values = [coloring.values(axes, elites) for _, _, _, _, elites, axes in shown]
    scale = coloring.scale(_all_values(coloring, contents) or [v for known in values for v in known.values()])
    fallback = FITNESS.scale(_all_values(FITNESS, contents))
    drawn = []
    for (view, content, outer, sources, elites, axes), known in zip(shown, values, strict=True):
        picture = Picture(
            view=view,
            axes=axes,
            outer=outer,
            elites=elites,
            sources=sources,
            title=view.title(content.axes, outer),
            figures=_figures(view, axes, elites),
            tiles={c: Tile(_hint(e, coloring, known.get(c)), e.number) for c, e in elites.items()},
            values=known or FITNESS.values(axes, elites),
            scale=scale if known or not elites else fallback,
        )
        drawn.append(_with_fresh(picture, before))
    return drawn


def outer_cell(content: Content, chosen: int | None) -> Cell | None:
    """Return the cell of all axes but the last two that a section lies within; None if nobody is there."""
    cell = None if chosen is None else content.cell_of(chosen)
    if cell is None:
        cell = min(content.elites, key=lambda c: (-content.elites[c].f_s, c), default=None)
    return None if cell is None else cell[:-2]


def _all_values(coloring: Coloring, contents: Mapping[str, Content]) -> list[float]:
    return [v for c in contents.values() for v in coloring.values(c.axes, c.elites).values()]


def _hint(elite: Elite, coloring: Coloring, value: float | None) -> str:
    if coloring.hint is None or value is None:
        return elite.hint
    return f"{elite.hint}\n{coloring.hint(value)}"


def _figures(view: View, axes: tuple[Axis, ...], elites: Mapping[Cell, Elite]) -> str:
    cells = f"{len(elites)} cells, {len(elites) / math.prod(a.n for a in axes):.0%}"
    if view.kind == "section":
        return cells
    return f"{cells} · QD score {sum(e.f_s for e in elites.values()):.0f} cm"


def _with_fresh(picture: Picture, before: Sequence[Picture]) -> Picture:
    """Mark the cells that another robot held before, unless the cells mean something else now."""
    old = next((p for p in before if p.view == picture.view), None)
    if old is None or (old.axes, old.outer) != (picture.axes, picture.outer):
        return picture
    numbers = {cell: e.number for cell, e in old.elites.items()}
    fresh = frozenset(c for c, e in picture.elites.items() if numbers.get(c) != e.number)
    return dataclasses.replace(picture, fresh=fresh)
