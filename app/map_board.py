"""The maps that one browser looks at: which run and generation, drawn how, with which robot marked."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

from app.archives_panel import ArchivesPanel
from engine.archive import Cell
from engine.reader import Generation, RunReader
from viz import axes as axis_text
from viz.coloring import Coloring, colorings
from viz.heatmap import Ring
from viz.maps import Content, load_contents
from viz.pictures import Picture, pictures
from viz.views import layouts


@dataclasses.dataclass(frozen=True, slots=True)
class Picked:
    """What a click on a map hit.

    Attributes:
        archive: the map's.
        cell: of the archive; of the map if it is empty.
        number: of the evaluation there, None if the cell is empty.
        meaning: what the cell stands for.
    """

    archive: str
    cell: Cell
    number: int | None
    meaning: str


class MapBoard:
    """Draws the maps on a panel.

    Args:
        panel: where.
    """

    def __init__(self, panel: ArchivesPanel) -> None:
        self._panel = panel
        self._layout = ""
        self._coloring = ""
        self.clear()

    def clear(self) -> None:
        """Show no run; how maps are drawn stays as chosen."""
        self._reader: RunReader | None = None
        self._generation: Generation | None = None
        self._contents: dict[str, Content] = {}
        self._pictures: list[Picture] = []
        self._chosen: tuple[str, int] | None = None
        self._colors: tuple[tuple[str, int], Coloring] | None = None

    @property
    def generation(self) -> int | None:
        """Number of the generation that is shown."""
        return None if self._generation is None else self._generation.number

    def show(self, reader: RunReader, generation: Generation) -> None:
        """Draw the maps of a generation; cells that have been won since an earlier one flash.

        Raises:
            RunFileError: the file cannot be read.
        """
        later = self._generation is not None and self._generation.number < generation.number
        self._contents = load_contents(reader, generation)
        self._reader, self._generation = reader, generation
        self._redraw(self._pictures if later else [])

    def choose(self, archive: str, number: int) -> None:
        """Mark a robot that was chosen in an archive."""
        self._chosen = (archive, number)
        self._redraw()

    def set_layout(self, name: str) -> None:
        """See the archives another way; an unknown way is the usual one."""
        self._layout = name
        self._redraw()

    def set_coloring(self, name: str) -> None:
        """Colour by something else; something unknown is the fitness."""
        self._coloring = name
        self._redraw()

    def pick(self, map_name: str, cell: Cell) -> Picked | None:
        """Return what lies at a cell of a map, None if there is no such cell."""
        picture = next((p for p in self._pictures if p.view.name == map_name), None)
        if picture is None or len(cell) != len(picture.axes):
            return None
        if any(i >= a.n for i, a in zip(cell, picture.axes, strict=True)):
            return None
        elite = picture.elites.get(cell)
        return Picked(
            archive=picture.view.archive,
            cell=picture.sources.get(cell, cell),
            number=None if elite is None else elite.number,
            meaning=axis_text.describe(picture.axes, cell),
        )

    def holder(self, archive: str, cell: Cell) -> int | None:
        """Return the number of the evaluation that a cell of an archive holds in the shown generation."""
        content = self._contents.get(archive)
        elite = None if content is None else content.elites.get(cell)
        return None if elite is None else elite.number

    def _redraw(self, before: list[Picture] | None = None) -> None:
        if self._reader is None or self._generation is None:
            return
        ways = layouts({name: c.axes for name, c in self._contents.items()})
        colors = colorings(self._reader)
        layout = self._layout if self._layout in ways else next(iter(ways), "")
        color = self._coloring if self._coloring in colors else next(iter(colors))
        self._panel.offer_views(tuple(ways) or ("-",), layout or "-", tuple(colors), color)
        self._pictures = pictures(
            self._contents,
            ways.get(layout, ()),
            self._made(color, colors[color]),
            chosen=None if self._chosen is None else self._chosen[1],
            before=before or [],
        )
        self._panel.show_maps(self._pictures, [self._ring(p) for p in self._pictures])

    def _made(self, name: str, make: Callable[[RunReader, int], Coloring]) -> Coloring:
        """Return a colouring of the shown generation: what it takes may be long to read."""
        assert self._reader is not None
        assert self._generation is not None
        key = (name, self._generation.number)
        if self._colors is None or self._colors[0] != key:
            self._colors = (key, make(self._reader, self._generation.number))
        return self._colors[1]

    def _ring(self, picture: Picture) -> Ring | None:
        if self._chosen is None:
            return None
        archive, number = self._chosen
        shown = picture.view.archive
        return picture.ring(self._contents[shown].cell_of(number), linked=shown != archive)
