"""Archives seen along other axes: a 4-D archive as its two 2-D maps, two 2-D archives as one 4-D map.

Downwards a projected cell shows the best of all elites that fall into it. Upwards every elite of both
archives is placed by its body and, with the final PCA and the final bounds, by its trajectory (Zardini
et al. 2021, section 5).
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Final

import numpy as np

from engine.errors import InvalidData, RunFileError
from engine.search.archive import Cell
from engine.search.axes import Axis, body_axes, body_cell, project, trajectory_axes
from engine.search.descriptors import TrajectoryDescriptor, sensory_data
from engine.simulation.evaluation import Evaluation
from engine.storage.reader import RunReader
from engine.storage.rows import Generation
from engine.tasks import get_task

MORPHOLOGY: Final = "morphology"
CONTROLLER: Final = "controller"
GRID: Final = "grid"

CountObserver = Callable[[int, int], None]
"""Receives how many robots are done, and how many there are."""

Elite = tuple[float, int]
"""Fitness in m and number of an evaluation; the smaller pair is the better elite."""


@dataclasses.dataclass(frozen=True, slots=True)
class EliteMap:
    """The elites of an archive, or of a projection of one.

    Attributes:
        axes: what the cells mean.
        elites: of the filled cells.
        projected: whether no archive of the run holds it in this form.
    """

    axes: tuple[Axis, ...]
    elites: Mapping[Cell, Elite]
    projected: bool = False

    @property
    def coverage(self) -> float:
        """Filled cells over all that can be filled."""
        return len(self.elites) / self.n_cells

    @property
    def n_cells(self) -> int:
        """Number of cells that can be filled: no body's softest module is stiffer than its stiffest."""
        by_name = {a.name: a.n for a in self.axes}
        n = math.prod(by_name.values())
        if {"softest", "stiffest"} <= set(by_name):
            n = n // by_name["stiffest"] * (by_name["softest"] + 1) // 2
        return n

    def qd_score(self, initial_distance: float) -> float:
        """Return the sum over filled cells of f_s = initial distance - fitness, in m."""
        return float(sum(initial_distance - fitness for fitness, _ in self.elites.values()))

    def best(self, initial_distance: float) -> float | None:
        """Return the largest f_s in m, None while the map is empty."""
        return max((initial_distance - fitness for fitness, _ in self.elites.values()), default=None)

    def values(self, initial_distance: float) -> dict[Cell, float]:
        """Return the f_s of each filled cell, in m."""
        return {cell: initial_distance - fitness for cell, (fitness, _) in self.elites.items()}

    def project(self, keep: Sequence[int]) -> EliteMap:
        """Return the map along some of its axes, the best elite in each cell.

        Args:
            keep: indices of the axes, in order.
        """
        shown = project(self.elites, keep, rank=lambda elite: elite)
        return EliteMap(
            tuple(self.axes[i] for i in keep),
            {onto: self.elites[cell] for onto, cell in sorted(shown.items())},
            projected=True,
        )


def best_per_cell(placed: Iterable[tuple[Cell, Elite]]) -> dict[Cell, Elite]:
    """Return the best of the elites that were placed in each cell, in the order of the cells."""
    best: dict[Cell, Elite] = {}
    for cell, elite in placed:
        best[cell] = min(elite, best.get(cell, elite))
    return dict(sorted(best.items()))


def archive_maps(reader: RunReader, generation: Generation) -> dict[str, EliteMap]:
    """Return what every archive of a run held at the end of a generation.

    Raises:
        RunFileError: the run is damaged.
    """
    return {
        name: EliteMap(
            generation.archives[name].axes, {c: (s.fitness, n) for c, (n, s) in sorted(cells.items())}
        )
        for name, cells in reader.elites(generation).items()
    }


def load_maps(reader: RunReader, generation: Generation) -> dict[str, EliteMap]:
    """Return all archives of a run, and the morphology and the controller map of a 4-D archive.

    Raises:
        RunFileError: the run is damaged.
    """
    maps = archive_maps(reader, generation)
    grid = maps.get(GRID)
    if grid is not None:
        maps.setdefault(MORPHOLOGY, grid.project(body_axes(grid.axes)))
        maps.setdefault(CONTROLLER, grid.project(trajectory_axes(grid.axes)))
    return maps


@dataclasses.dataclass(frozen=True, slots=True)
class Lifted:
    """Two 2-D archives as one 4-D map.

    Attributes:
        map: along the axes of the morphology, then those of the controller archive.
        elites: the evaluations of both archives that compete for its cells, by number.
        n_clipped: how many of them lie outside the final bounds and went to the nearest cell.
    """

    map: EliteMap
    elites: Mapping[int, Evaluation]
    n_clipped: int


def lift(reader: RunReader, generation: Generation, elites: Mapping[int, Evaluation]) -> Lifted:
    """Place the elites of two 2-D archives in one 4-D map.

    The final bounds are cut around the controller archive's elites. A robot of the morphology archive
    whose trajectory lies outside them goes to the nearest cell.

    Args:
        reader: of the run.
        generation: its last one, to which the saved PCA belongs.
        elites: every elite of both archives, by number, each with its trajectory.

    Raises:
        RunFileError: the run has no such archives or no PCA.
        InvalidData: an elite has no trajectory.
    """
    body, movement = _double(reader, generation)
    descriptor = final_descriptor(reader, movement)
    if descriptor is None:
        raise RunFileError(f"{reader.path} holds no PCA of trajectories, so that it has no 4-D map")
    ordered = [elites[n] for n in sorted(elites)]
    if missing := [e for e in ordered if not e.trajectory.size]:
        raise InvalidData(f"robot {missing[0].solution.number} has no trajectory")
    placed: list[tuple[Cell, Elite]] = []
    n_clipped = 0
    if ordered:
        data = sensory_data([e.trajectory for e in ordered], reader.config.map_search.sensory)
        with reader.guard():
            described = descriptor.transform(data)
            n_clipped = sum(descriptor.out_of_bounds(d[None]) for d in described)
            placed = [
                (
                    body_cell(body, e.solution.morphology) + descriptor.cell(d),
                    (_fitness(e), e.solution.number),
                )
                for e, d in zip(ordered, described, strict=True)
            ]
    axes = (*body, *movement)
    return Lifted(EliteMap(axes, best_per_cell(placed), projected=True), dict(elites), n_clipped)


def double_elites(reader: RunReader, generation: Generation) -> dict[int, Evaluation]:
    """Return the elites of a run's morphology and controller archives by number.

    Raises:
        RunFileError: it does not have both archives, or is damaged.
    """
    _double(reader, generation)
    numbers: set[int] = set()
    for archive in (MORPHOLOGY, CONTROLLER):
        numbers |= set(reader.placements(archive, generation.number).values())
    found = reader.evaluations(numbers)
    for n, e in found.items():
        if e.fitness is None:
            raise RunFileError(f"{reader.path} is damaged: evaluation {n} holds a cell of a map")
    return found


def final_descriptor(reader: RunReader, axes: Sequence[Axis]) -> TrajectoryDescriptor | None:
    """Return the fitted standardiser, PCA and bounds that a run ended with, or None if it has none.

    Args:
        reader: of the run.
        axes: of its archive of trajectories, the principal components alone.

    Raises:
        RunFileError: they are damaged.
    """
    state = reader.algorithm_state()
    with reader.guard():
        saved = None if state is None else state.get("descriptor")
        if saved is None:
            return None
        task, trials = get_task(reader.config.task), reader.config.trials
        n_features = task.n_targets * math.floor(trials.trial_time + 1e-9) * 2
        dims = len(axes)
        shapes = {
            "mean": (n_features,),
            "scale": (n_features,),
            "components": (dims, n_features),
            "lower": (dims,),
            "width": (dims,),
        }
        for name, shape in shapes.items():
            values = np.array(saved[name], dtype=float)
            if values.shape != shape or not np.isfinite(values).all():
                raise InvalidData(f"the saved PCA's {name} is not as expected")
            if name in ("scale", "width") and values.min() <= 0.0:
                raise InvalidData(f"the saved PCA's {name} is not positive")
        descriptor = TrajectoryDescriptor(shape=tuple(a.n for a in axes))
        descriptor.restore(saved)
        return descriptor


def _double(reader: RunReader, generation: Generation) -> tuple[tuple[Axis, ...], tuple[Axis, ...]]:
    archives = generation.archives
    if MORPHOLOGY not in archives or CONTROLLER not in archives:
        raise RunFileError(
            f"{reader.path} cannot be projected: a run of {reader.config.algorithm} has no archive of"
            " trajectories"
        )
    return archives[MORPHOLOGY].axes, archives[CONTROLLER].axes


def _fitness(e: Evaluation) -> float:
    assert e.fitness is not None
    return e.fitness
