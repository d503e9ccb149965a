"""A run file with a 4-D archive: real evaluations, put where tests need them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from engine.search.archive import Cell, GridArchive
from engine.search.axes import Axis
from engine.search.body_space import PUBLISHED_BODIES
from engine.simulation.evaluation import Evaluation
from engine.simulation.provenance import versions
from engine.storage.reader import RunReader
from engine.storage.rows import statistics
from engine.storage.writer import RunWriter
from engine.tasks import get_task

AXES = (
    Axis("modules", 1.5, 10.5, 9),
    Axis("stiffness", 0.05, 1.05, 10),
    Axis("PCA 1", -4.5, 4.5, 9),
    Axis("PCA 2", -5.0, 5.0, 10),
)


def grid_cell(e: Evaluation) -> Cell:
    """Return the body's own cell and one of a few behaviours, so that some bodies share one."""
    return (*PUBLISHED_BODIES.cell(e.solution.morphology), e.solution.number % 3, 9 - e.solution.number % 2)


class Placed:
    """As much of an algorithm as a run file needs to close a generation."""

    def __init__(self) -> None:
        self.archives = {"grid": GridArchive(shape=tuple(a.n for a in AXES))}
        self.generation = 0

    def axes(self, _archive: str) -> tuple[Axis, ...]:
        """Return the axes of its only archive."""
        return AXES

    def state(self) -> dict[str, Any]:
        """Return nothing: such a run is not resumed."""
        return {}


def write_grid_run(source: Path, path: Path) -> None:
    """Write the evaluations of a run anew, as a run with a 4-D archive called ``grid``."""
    algorithm: Any = Placed()
    with RunReader(source) as reader:
        distance = get_task(reader.config.task).target_distance
        evaluations = reader.all_evaluations()
        generation_of = {e.solution.number: reader.generation_of(e.solution.number) for e in evaluations}
        last = reader.last_generation() or 0
        config = reader.config
    with RunWriter.create(path, config, versions() | {"mujoco": "3.0.0"}) as writer:
        for number in range(last + 1):
            batch = [e for e in evaluations if generation_of[e.solution.number] == number]
            writer.add_evaluations(number, batch)
            for e in batch:
                if e.fitness is not None:
                    algorithm.archives["grid"].add(grid_cell(e), e)
            algorithm.generation += 1
            writer.close_generation(algorithm, statistics(algorithm, distance), float(number))
