"""What a comparison takes from one run: its figures over evaluations and its maps."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from engine.analysis.elite_maps import (
    CONTROLLER,
    GRID,
    MORPHOLOGY,
    Elite,
    EliteMap,
    double_elites,
    lift,
    load_maps,
)
from engine.config import RunConfig
from engine.errors import InvalidData, RunFileError
from engine.search.archive import Cell
from engine.search.axes import body_axes
from engine.storage.reader import RunReader
from engine.storage.rows import Generation
from engine.tasks import get_task

ALGORITHM_NAMES: Final = {"vie-neat": "ViE-NEAT", "map-elites": "MAP-Elites", "dm-me": "DM-ME"}
"""For people, in the paper's order."""


class NothingToCompareError(RunFileError):
    """A run that has not finished a generation, or none within the evaluations to compare at."""


@dataclasses.dataclass(frozen=True, slots=True)
class Point:
    """The morphology map after some evaluations; lengths in m, ``best`` None while it is empty."""

    n_evaluations: int
    best: float | None
    qd_score: float
    coverage: float


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class RunResult:
    """One run of a comparison.

    Attributes:
        path: of its file.
        config: of the run.
        versions: that it was started with.
        projected_from: name of the run that its archives were projected from, or None.
        points: of the morphology map at the end of each generation; at least one.
        seconds: computing time.
        maps: by name: ``morphology``, and where the run has them ``controller`` and ``grid``.
        no_grid: why ``grid`` is missing, if it could have been expected.
    """

    path: Path
    config: RunConfig
    versions: Mapping[str, str]
    projected_from: str | None
    points: tuple[Point, ...]
    seconds: float
    maps: Mapping[str, EliteMap]
    no_grid: str | None = None

    @property
    def variant(self) -> str:
        """The algorithm's name, with whatever differs from the published one."""
        name = ALGORITHM_NAMES.get(self.config.algorithm, self.config.algorithm)
        if self.config.map_search.cell_capacity > 1:
            name += " deep grid"
        if self.config.stiffness != "shared":
            name += ", stiffness per module"
        return name

    @property
    def initial_distance(self) -> float:
        """d_init of f_s, in m."""
        return get_task(self.config.task).target_distance

    @property
    def n_evaluations(self) -> int:
        """Number of evaluations that its figures cover."""
        return self.points[-1].n_evaluations

    @property
    def finished(self) -> bool:
        """Whether its budget is spent."""
        return self.n_evaluations >= self.config.evaluations

    def measure(self, name: str) -> float | None:
        """Return a figure of the end of the run; None for the best of an empty map.

        Args:
            name: ``best`` or ``qd_score`` (in cm), ``coverage`` (in %), ``evaluations`` or ``hours``.

        Raises:
            KeyError: there is no such figure.
        """
        last = self.points[-1]
        match name:
            case "best":
                return None if last.best is None else 100.0 * last.best
            case "qd_score":
                return 100.0 * last.qd_score
            case "coverage":
                return 100.0 * last.coverage
            case "evaluations":
                return float(last.n_evaluations)
            case "hours":
                return self.seconds / 3600.0
        raise KeyError(name)


def load_result(path: Path, at: int | None = None) -> RunResult:
    """Read a run for a comparison.

    Args:
        path: run file.
        at: evaluations to compare at: generations that end later do not count. None: all of them.

    Raises:
        NothingToCompareError: it has no finished generation within those evaluations.
        RunFileError: it is no run file, is damaged, or has no morphology archive to compare.
    """
    with RunReader(path) as reader:
        every = reader.generations()
        generations = [g for g in every if at is None or g.n_evaluations <= at]
        if not generations:
            raise NothingToCompareError(
                f"{path} has no finished generation" + (f" within {at} evaluations" if every else " yet")
            )
        last = generations[-1]
        maps = load_maps(reader, last)
        if MORPHOLOGY not in maps:
            raise RunFileError(f"{path} has no morphology archive to compare")
        no_grid = None
        if GRID not in maps and CONTROLLER in maps:
            if last is every[-1]:
                maps, no_grid = _with_grid(reader, last, maps)
            else:
                no_grid = "its PCA is kept as of its last generation only"
        return RunResult(
            path=path,
            config=reader.config,
            versions=reader.versions,
            projected_from=None if reader.projection is None else reader.projection.get("source", ""),
            points=_points(reader, generations),
            seconds=last.seconds,
            maps=maps,
            no_grid=no_grid,
        )


def _with_grid(
    reader: RunReader, last: Generation, maps: dict[str, EliteMap]
) -> tuple[dict[str, EliteMap], str | None]:
    """Return the maps, with the 4-D map of two 2-D archives or the reason why there is none."""
    elites = double_elites(reader, last)
    try:
        return maps | {GRID: lift(reader, last, elites).map}, None
    except InvalidData as e:
        return maps, f"{e}; 'tensatlas project' simulates it again"


def _points(reader: RunReader, generations: list[Generation]) -> tuple[Point, ...]:
    if MORPHOLOGY in generations[-1].archives:
        return tuple(
            Point(g.n_evaluations, f.best, f.qd_score, f.coverage)
            for g in generations
            if (f := g.archives.get(MORPHOLOGY)) is not None
        )
    return _projected_points(reader, generations)


def _projected_points(reader: RunReader, generations: list[Generation]) -> tuple[Point, ...]:
    """Return the figures of a 4-D archive's projection on the body at the end of each generation.

    An elite only ever makes way for a better one in its own cell, whose body has the same measures,
    so that the projection holds the best of all that was ever placed.
    """
    distance = get_task(reader.config.task).target_distance
    changes = [(g, cell, n) for g, cell, n in reader.placement_changes(GRID) if n is not None]
    known = reader.summaries({n for _, _, n in changes})
    best: dict[Cell, Elite] = {}
    points: list[Point] = []
    position = 0
    for generation in generations:
        with reader.guard():
            axes = generation.archives[GRID].axes
            keep = body_axes(axes)
            while position < len(changes) and changes[position][0] <= generation.number:
                _, cell, n = changes[position]
                elite, part = (known[n].fitness, n), tuple(cell[i] for i in keep)
                if part not in best or elite < best[part]:
                    best[part] = elite
                position += 1
        shown = EliteMap(tuple(axes[i] for i in keep), best, True)
        points.append(
            Point(generation.n_evaluations, shown.best(distance), shown.qd_score(distance), shown.coverage)
        )
    return tuple(points)
