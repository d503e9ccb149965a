"""Which maps show an archive: one of more than two axes can be shown in several ways."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Mapping
from typing import Final, Literal

from engine.search.archive import Cell
from engine.search.axes import Axis, project, section
from viz.maps import axis_labels
from viz.maps.contents import Content

PROJECTED: Final = "projected"
BY_BODY: Final = "body by body"
NESTED: Final = "nested"
ONLY: Final = "plain"

Kind = Literal["whole", "projection", "section", "nested"]
Layout = tuple["MapView", ...]


@dataclasses.dataclass(frozen=True, slots=True)
class MapView:
    """One map of an archive.

    Attributes:
        name: what clicks on the map report; of small letters, digits and dashes.
        archive: the archive's name.
        kind: the archive itself; the best along all axes but two; the last two axes within one cell of
            the others; or all axes, maps within a map.
        axes: indices of the archive's axes that it shows.
    """

    name: str
    archive: str
    kind: Kind
    axes: tuple[int, ...]

    def title(self, axes: tuple[Axis, ...], outer: Cell | None) -> str:
        """Return a heading.

        Args:
            axes: of the archive.
            outer: the cell of the first axes that a section lies within.
        """
        if self.kind == "section" and outer is not None:
            return f"Within {axis_labels.describe(axes[: len(outer)], outer)}"
        archive = f"{self.archive[:1].upper()}{self.archive[1:]} archive"
        if self.kind == "projection":
            family = axis_labels.family([axes[a] for a in self.axes])
            name = f"{family.capitalize()} map" if family else archive
            x, y = self.axes
            # one that skips an axis is not the first of its family
            return f"{name}, projected" if y == x + 1 else f"{name} by {axis_labels.title(axes[y])}"
        return archive

    def cells(self, content: Content, outer: Cell | None) -> dict[Cell, Cell]:
        """Return the archive's cells that the map shows, by its own cells."""
        if self.kind == "projection":
            return project(content.elites, self.axes, lambda e: (-e.f_s, e.number))
        if self.kind == "section":
            return section(content.elites, dict(enumerate(outer))) if outer is not None else {}
        return {tuple(cell[a] for a in self.axes): cell for cell in content.elites}

    def cell_of(self, cell: Cell, outer: Cell | None) -> Cell | None:
        """Return the map's cell that a cell of the archive lies in, None if it lies in none."""
        if self.kind == "section" and cell[:-2] != outer:
            return None
        return tuple(cell[a] for a in self.axes)


def layouts(archives: Mapping[str, tuple[Axis, ...]]) -> dict[str, Layout]:
    """Return the ways to see a run's archives, each a few maps; the first one is the usual one.

    Args:
        archives: their axes by name.
    """
    most = max(map(len, archives.values()), default=0)
    offered = {4: [PROJECTED, BY_BODY, NESTED], 3: [PROJECTED, NESTED]}.get(most, [ONLY])
    if most > 4:  # maps within a map have four
        offered = [PROJECTED, BY_BODY]
    slugs: dict[str, str] = {}
    for archive in archives:
        slug = re.sub(r"[^a-z0-9]+", "-", archive.lower())[:20].strip("-") or "archive"
        slugs[archive] = slug if slug not in slugs.values() else f"{slug}-{len(slugs)}"
    found = {
        layout: tuple(v for name, a in archives.items() for v in _views(name, slugs[name], a, layout))
        for layout in offered
    }
    return {layout: views for layout, views in found.items() if views}


def _views(archive: str, slug: str, axes: tuple[Axis, ...], layout: str) -> list[MapView]:
    n_axes = len(axes)
    if n_axes == 2:
        return [MapView(slug, archive, "whole", (0, 1))]
    if n_axes < 2:
        return []
    # the first axis, modules, by every other one of the body; in a grid the last two are the controller's
    last = n_axes if n_axes == 3 else n_axes - 2
    pairs = [(0, k) for k in range(1, last)] + ([(last, last + 1)] if n_axes > 3 else [])
    projections = [MapView(f"{slug}-{a}{b}", archive, "projection", (a, b)) for a, b in pairs]
    order = tuple(range(n_axes))
    if axes[-1].name == "feet":  # a map of the body for each kind of feet
        order = (order[-1], *order[:-1])
    nested = MapView(f"{slug}-nested", archive, "nested", order)
    if layout == PROJECTED:
        return projections
    if n_axes == 3:
        return [nested]
    inner = MapView(f"{slug}-section", archive, "section", (last, last + 1))
    return [nested if layout == NESTED else projections[0], inner]
