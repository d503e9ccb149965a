"""The maps that one browser looks at: which run and generation, drawn how, with which robot marked."""

from __future__ import annotations

import contextlib
import dataclasses
from collections.abc import Callable, Mapping

from app.maps.archives_panel import ArchivesPanel
from app.maps.color_controls import ALL_RUNS, FIXED, ColorWish, checked_limits
from app.maps.elites_panel import ElitesPanel
from engine.analysis.robustness import robust_stamp
from engine.errors import InvalidData
from engine.search.archive import Cell
from engine.storage.reader import RunReader
from engine.storage.rows import Generation
from viz import theme
from viz.maps import axis_labels
from viz.maps.coloring import FITNESS, USUAL, Coloring, colorings, robust_fitness
from viz.maps.contents import Content, best_elite, load_contents
from viz.maps.layouts import layouts
from viz.maps.map_parts import Ring
from viz.maps.map_pictures import MapPicture, pictures
from viz.maps.scale import Palette

MakeColoring = Callable[[RunReader, int], Coloring]
"""Returns the colouring of a run at the end of a generation."""


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


@dataclasses.dataclass(frozen=True, slots=True)
class Subject:
    """What is drawn.

    Attributes:
        reader: of the run.
        generation: that the maps show.
        last: the run's last generation, which automatic scales fit.
        contents, last_contents: of the archives at the end of the two.
    """

    reader: RunReader
    generation: Generation
    last: Generation
    contents: Mapping[str, Content]
    last_contents: Mapping[str, Content]


class MapBoard:
    """Draws the maps on a panel.

    Args:
        panel: where.
        notify: tells the user something, by title and text.
        limits_of_all: returns the ends, in cm, of a scale that all runs of a run's task share.
        elites: lists what the maps show.
    """

    def __init__(
        self,
        panel: ArchivesPanel,
        notify: Callable[[str, str], None],
        limits_of_all: Callable[[RunReader], tuple[float, float]],
        elites: ElitesPanel,
    ) -> None:
        self._elites = elites
        self._panel = panel
        self._notify = notify
        self._limits_of_all = limits_of_all
        self._layout = ""
        self._wish = ColorWish()
        self._complained: set[tuple[object, ...]] = set()
        self.clear()

    def clear(self) -> None:
        """Show no run; how maps are drawn stays as chosen."""
        self._subject: Subject | None = None
        self._pictures: list[MapPicture] = []
        self._chosen: tuple[str, int] | None = None
        self._colors: dict[tuple[object, ...], Coloring] = {}
        self._stamp: object = None
        self._known_robust: tuple[object, Mapping[int, float]] = (None, {})

    @property
    def generation(self) -> int | None:
        """Number of the generation that is shown."""
        return None if self._subject is None else self._subject.generation.number

    def show(self, reader: RunReader, generation: Generation, last: Generation | None = None) -> None:
        """Draw the maps of a generation; cells that have been won since an earlier one flash.

        Args:
            reader: of the run.
            generation: to be shown.
            last: the run's last generation, None if that is the same.

        Raises:
            RunFileError: the file cannot be read.
        """
        before, last = self._subject, last or generation
        later = before is not None and before.generation.number < generation.number
        contents = load_contents(reader, generation)
        if last.number == generation.number:
            last_contents: Mapping[str, Content] = contents
        elif before is not None and before.last.number == last.number:
            last_contents = before.last_contents
        else:
            last_contents = load_contents(reader, last)
        self._subject = Subject(reader, generation, last, contents, last_contents)
        self._redraw(self._pictures if later else [])

    def refresh(self) -> None:
        """Draw the maps again if what lies beside the run has changed."""
        if self._subject is not None and robust_stamp(self._subject.reader.path) != self._stamp:
            self._redraw()

    def choose(self, archive: str, number: int) -> None:
        """Mark a robot that was chosen in an archive."""
        self._chosen = (archive, number)
        self._redraw()

    def filter(self, _least: float | None = None) -> None:
        """Draw robots pale that the list of elites leaves out."""
        self._redraw()

    def set_layout(self, name: str) -> None:
        """See the archives another way; an unknown way is the usual one."""
        self._layout = name
        self._redraw()

    def set_colors(self, wish: ColorWish) -> None:
        """Colour another way; to colour by something unknown is to colour by the fitness.

        Raises:
            InvalidData: a scale with impossible ends; the rest is done, and the scale stays as it was.
        """
        refused: InvalidData | None = None
        if wish.scale == FIXED:
            try:
                wish = dataclasses.replace(wish, limits=checked_limits(wish.limits))
            except InvalidData as e:
                refused = e
                wish = dataclasses.replace(wish, scale=self._wish.scale, limits=self._wish.limits)
        if wish.colormap not in theme.MAPS:
            wish = dataclasses.replace(wish, colormap=ColorWish().colormap)
        self._wish = wish
        self._redraw()
        if refused is not None:
            raise refused

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
            meaning=axis_labels.describe(picture.axes, cell),
        )

    def holder(self, archive: str, cell: Cell) -> int | None:
        """Return the number of the evaluation that a cell of an archive holds in the shown generation."""
        content = None if self._subject is None else self._subject.contents.get(archive)
        elite = None if content is None else content.elites.get(cell)
        return None if elite is None else elite.number

    def best(self) -> tuple[str, Cell, int] | None:
        """Return archive, cell and number of the best robot that is shown; None for none.

        That is the one of the greatest f_s under noise that it was not selected with, if that is known.
        """
        if self._subject is None:
            return None
        found = best_elite(self._subject.contents, self._robust())
        return None if found is None else (*found[:2], found[2].number)

    def _robust(self) -> Mapping[int, float]:
        """Return the elites' f_s in cm under noise that they were not selected with, where it is known."""
        assert self._subject is not None
        stamp = (self._subject.reader, robust_stamp(self._subject.reader.path))
        if self._known_robust[0] != stamp:
            found: Mapping[int, float] = {}
            with contextlib.suppress(InvalidData):  # what is damaged is told by the maps
                found = robust_fitness(self._subject.reader)
            self._known_robust = (stamp, found)
        return self._known_robust[1]

    def _redraw(self, before: list[MapPicture] | None = None) -> None:
        subject = self._subject
        if subject is None:
            return
        ways = layouts({name: c.axes for name, c in subject.contents.items()})
        self._stamp = robust_stamp(subject.reader.path)
        colors = colorings(subject.reader)
        layout = self._layout if self._layout in ways else next(iter(ways), "")
        wanted = self._wish.coloring if self._wish.coloring in colors else USUAL
        name, shown, latest = self._colorings(colors, wanted)
        self._panel.offer_views(tuple(ways) or ("-",), layout or "-", tuple(colors), name)
        self._pictures = pictures(
            subject.contents,
            ways.get(layout, ()),
            shown,
            chosen=None if self._chosen is None else self._chosen[1],
            before=before or [],
            palette=Palette(self._wish.colormap, self._limits()),
            fitted_to=(subject.last_contents, latest),
            least=self._elites.least,
            robust=self._robust(),
        )
        self._elites.show(subject.contents, None if self._chosen is None else self._chosen[1], self._robust())
        self._panel.show_maps(self._pictures, [self._ring(p) for p in self._pictures])

    def _colorings(self, offered: Mapping[str, MakeColoring], wanted: str) -> tuple[str, Coloring, Coloring]:
        """Return a colouring for the shown and for the last generation; by f_s if it cannot be had."""
        assert self._subject is not None
        numbers = (self._subject.generation.number, self._subject.last.number)
        try:
            shown, latest = (self._made(wanted, offered[wanted], number) for number in numbers)
        except InvalidData as e:
            complaint = (self._subject.reader, self._stamp)
            if complaint not in self._complained:
                self._complained.add(complaint)
                self._notify("The maps show f_s instead", str(e))
            wanted, shown, latest = USUAL, FITNESS, FITNESS
        return wanted, shown, latest

    def _made(self, name: str, make: MakeColoring, generation: int) -> Coloring:
        """Return a colouring for a generation; what it is made from takes long to read, and may change."""
        assert self._subject is not None
        key = (name, generation, self._stamp)
        if key not in self._colors:
            made = make(self._subject.reader, generation)
            # those of the last generation and of one other are enough
            kept = (self._subject.last.number, generation)
            self._colors = {k: c for k, c in self._colors.items() if k[0] == name and k[1] in kept}
            self._colors[key] = made
        return self._colors[key]

    def _limits(self) -> tuple[float, float] | None:
        assert self._subject is not None
        if self._wish.scale == ALL_RUNS:
            return self._limits_of_all(self._subject.reader)
        return self._wish.limits if self._wish.scale == FIXED else None

    def _ring(self, picture: MapPicture) -> Ring | None:
        if self._chosen is None or self._subject is None:
            return None
        archive, number = self._chosen
        shown = picture.view.archive
        return picture.ring(self._subject.contents[shown].cell_of(number), linked=shown != archive)
