"""The maps of a run at one of its generations, ready to be drawn."""

from __future__ import annotations

from engine.archive import Cell
from engine.errors import RunFileError
from engine.reader import Generation, RunReader
from engine.tasks import get_task
from viz.heatmap import Heatmap, Tile, color_limits


def load_maps(reader: RunReader, generation: Generation) -> dict[str, Heatmap]:
    """Return the 2-D archives of a run as heatmaps that share one colour scale.

    Raises:
        RunFileError: the file cannot be read.
    """
    distance = get_task(reader.config.task).target_distance
    placed = {name: reader.placements(name, generation.number) for name in generation.archives}
    known = reader.summaries({n for cells in placed.values() for n in cells.values()})
    tiles: dict[str, dict[Cell, Tile]] = {}
    for name, cells in placed.items():
        tiles[name] = {}
        for cell, number in cells.items():
            if number not in known:
                raise RunFileError(f"{reader.path} is damaged: evaluation {number} holds a cell of a map")
            s = known[number]
            f_s = 100 * (distance - s.fitness)
            body = s.morphology
            tiles[name][cell] = Tile(
                value=f_s,
                hint=f"f_s {f_s:.2f} cm\n{body.n_modules} modules, stiffness {body.stiffness_text}\n"
                f"robot {number}, generation {s.generation}",
                number=number,
            )
    limits = color_limits([t.value for cells in tiles.values() for t in cells.values()])
    return {
        name: Heatmap(name=name, axes=(axes[0], axes[1]), tiles=tiles[name], limits=limits)
        for name, figures in generation.archives.items()
        if len(axes := figures.axes) == 2
    }
