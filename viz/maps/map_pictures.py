"""The maps of a run as pictures: contents, views and colours put together."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence

from engine.search.archive import Cell
from engine.search.axes import Axis
from viz import words
from viz.maps import heatmap, nested
from viz.maps.coloring import Coloring
from viz.maps.contents import Content, ShownElite
from viz.maps.heatmap import Heatmap
from viz.maps.layouts import MapView
from viz.maps.map_parts import Ring, Tile
from viz.maps.nested import NestedMap
from viz.maps.scale import Palette, Scale


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class MapPicture:
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

    view: MapView
    axes: tuple[Axis, ...]
    outer: Cell | None
    elites: Mapping[Cell, ShownElite]
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


@dataclasses.dataclass(frozen=True, slots=True)
class _Shown:
    """A view, what it is of and the elites that it shows."""

    view: MapView
    content: Content
    outer: Cell | None
    sources: Mapping[Cell, Cell]
    elites: Mapping[Cell, ShownElite]

    @property
    def axes(self) -> tuple[Axis, ...]:
        return tuple(self.content.axes[a] for a in self.view.axes)

    @classmethod
    def of(cls, view: MapView, content: Content, chosen: int | None) -> _Shown:
        outer = outer_cell(content, chosen) if view.kind == "section" else None
        sources = view.cells(content, outer)
        elites = {cell: content.elites[source] for cell, source in sources.items()}
        return cls(view, content, outer, sources, elites)


def pictures(
    contents: Mapping[str, Content],
    views: Sequence[MapView],
    coloring: Coloring,
    *,
    chosen: int | None = None,
    before: Sequence[MapPicture] = (),
    palette: Palette = Palette(),  # noqa: B008  it cannot be changed
    fitted_to: tuple[Mapping[str, Content], Coloring] | None = None,
    least: float | None = None,
    robust: Mapping[int, float] = {},
) -> list[MapPicture]:
    """Return the pictures of some views, the scale of each fitted to its archive.

    Args:
        contents: the archives by name.
        views: what to draw.
        coloring: what the colours stand for.
        chosen: number of the chosen robot: a section lies within the cell that it holds, or else
            within that of the best robot.
        before: the pictures of an earlier generation: cells that have been won since are fresh.
        palette: how to colour.
        fitted_to: the archives, and their colouring, that an automatic scale fits; None for the shown
            ones. With a run's last generation the colours of all others mean the same.
        least: f_s in cm; robots of less are drawn pale. None for none.
        robust: f_s in cm under noise that they were not selected with, by the numbers of evaluations; hover
            cards say it of those that it is known of.
    """
    shown = [_Shown.of(view, contents[view.archive], chosen) for view in views]
    values = [coloring.values(s.axes, s.elites) for s in shown]
    reference, by = fitted_to or (contents, coloring)
    drawn = []
    for s, known in zip(shown, values, strict=True):
        ways = [v for v in views if v.archive == s.view.archive]
        scale = palette.apply(
            by.scale(_values(reference, by, ways, chosen)),
            _values(contents, coloring, ways, chosen),
            lengths=coloring.lengths,
        )
        picture = MapPicture(
            view=s.view,
            axes=s.axes,
            outer=s.outer,
            elites=s.elites,
            sources=s.sources,
            title=s.view.title(s.content.axes, s.outer),
            figures=coloring.unknown
            if s.elites and not known
            else _figures(s.view, s.content, s.axes, s.elites),
            tiles={
                c: Tile(
                    _hint(e, coloring, known.get(c), robust.get(e.number)),
                    e.number,
                    e.body,
                    e.lies_still,
                    least is not None and e.f_s < least,
                )
                for c, e in s.elites.items()
            },
            values=known,
            scale=scale,
        )
        drawn.append(_with_fresh(picture, before))
    return drawn


def outer_cell(content: Content, chosen: int | None) -> Cell | None:
    """Return the cell of all axes but the last two that a section lies within; None for an empty archive."""
    cell = None if chosen is None else content.cell_of(chosen)
    if cell is None:
        cell = min(content.elites, key=lambda c: (-content.elites[c].f_s, c), default=None)
    return None if cell is None else cell[:-2]


def _values(
    contents: Mapping[str, Content], coloring: Coloring, views: Sequence[MapView], chosen: int | None
) -> list[float]:
    """Return the values of the views' whole archives; where a colouring has none, those of the views."""
    names = {view.archive for view in views} & set(contents)
    whole = [v for n in names for v in coloring.values(contents[n].axes, contents[n].elites).values()]
    if whole:
        return whole
    shown = [_Shown.of(view, contents[view.archive], chosen) for view in views if view.archive in contents]
    return [v for s in shown for v in coloring.values(s.axes, s.elites).values()]


def _hint(elite: ShownElite, coloring: Coloring, value: float | None, robust: float | None) -> str:
    lines = elite.hint.split("\n")
    if robust is not None:
        lines.insert(1, f"{words.gained(robust, elite.still_below)} under fresh noise")
    if coloring.hint is not None and value is not None:
        lines.append(coloring.hint(value))
    return "\n".join(lines)


def _figures(
    view: MapView, content: Content, axes: tuple[Axis, ...], elites: Mapping[Cell, ShownElite]
) -> str:
    coverage = len(elites) / math.prod(a.n for a in axes)
    if view.kind in ("whole", "nested") and content.coverage is not None:
        coverage = content.coverage
    cells = f"{len(elites)} cell{'' if len(elites) == 1 else 's'}, {coverage:.0%}"
    if view.kind == "section":
        return cells
    return f"{cells} · QD score {sum(e.f_s for e in elites.values()):.0f} cm"


def _with_fresh(picture: MapPicture, before: Sequence[MapPicture]) -> MapPicture:
    """Mark the cells whose robot is another one than before; if the axes have moved, the new robots."""
    old = next((p for p in before if p.view == picture.view), None)
    if old is None or old.outer != picture.outer:
        return picture
    if old.axes == picture.axes:
        numbers = {cell: e.number for cell, e in old.elites.items()}
        fresh = frozenset(c for c, e in picture.elites.items() if numbers.get(c) != e.number)
    else:
        known = {e.number for e in old.elites.values()}
        fresh = frozenset(c for c, e in picture.elites.items() if e.number not in known)
    return dataclasses.replace(picture, fresh=fresh)
