"""What the page of a run shows: which maps, in which colours, and which robots."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Final

from engine.analysis.robustness import Robustness, load_robust_of
from engine.config import task_of
from engine.errors import ExportError
from engine.search.archive import cell_name
from engine.storage.reader import RunReader
from viz.maps.coloring import AS_BUILT, ROBUST, USUAL, colorings, robust_fitness
from viz.maps.contents import ShownElite, best_elite, load_contents
from viz.maps.layouts import layouts
from viz.maps.map_pictures import MapPicture, pictures

COLORINGS: Final = (ROBUST, USUAL, AS_BUILT)
"""What a page colours maps by, of what is known; the first one as it opens."""


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Shown:
    """What a page shows.

    Attributes:
        maps: by what they are coloured by, the same maps each time.
        robots: by their numbers.
        best: the robot that it opens with: of the greatest f_s under noise that it was not selected with, if
            that is known.
        cells: of each robot, by the title of a map; of the archive if no map shows it.
        robust: what evaluating the elites again has shown, None if that was not done.
        seconds: of robots' time, to be simulated.
    """

    maps: Mapping[str, list[MapPicture]]
    robots: Mapping[int, ShownElite]
    best: ShownElite
    cells: Mapping[int, Mapping[str, str]]
    robust: Robustness | None
    seconds: float


def what_to_show(reader: RunReader) -> Shown:
    """Return what the page of a run shows after its last generation, maps of more than two axes projected.

    Raises:
        RunFileError: it has no finished generation, or is damaged.
        ExportError: it has no elite, or no map of its archives can be drawn.
        InvalidData: what lies beside it, of its elites evaluated again, is damaged or of another run.
    """
    generation = reader.finished_generation()
    contents = load_contents(reader, generation)
    robust = robust_fitness(reader)
    found = best_elite(contents, robust)
    if found is None:
        raise ExportError(f"{reader.path} has no elites to show")
    archive, cell, best = found
    views = next(iter(layouts({name: c.axes for name, c in contents.items()}).values()), ())
    offered = colorings(reader)
    maps: dict[str, list[MapPicture]] = {
        name: [
            p
            for p in pictures(contents, views, offered[name](reader, generation.number), robust=robust)
            if p.elites
        ]
        for name in COLORINGS
        if name in offered
    }
    cells: dict[int, dict[str, str]] = {}
    robots = {}
    for picture in maps[USUAL]:
        for c, e in picture.elites.items():
            robots[e.number] = e
            cells.setdefault(e.number, {})[picture.title.removesuffix(" archive")] = cell_name(c)
    if not robots:
        axes = max(len(c.axes) for c in contents.values())
        raise ExportError(f"{reader.path} has archives of {axes} axes, which no map of a page can show")
    if best.number not in robots:  # on a projected map the best is of what was recorded
        robots[best.number] = best
        cells[best.number] = {archive.capitalize(): cell_name(cell)}
    config = reader.config
    return Shown(
        maps=maps,
        robots=robots,
        best=best,
        cells=cells,
        robust=load_robust_of(reader),
        seconds=len(robots) * task_of(config).n_targets * config.trials.trial_time,
    )
