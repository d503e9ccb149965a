"""Run files with a 4-D archive, written as an algorithm with such an archive would write them."""

import dataclasses

import numpy as np

from engine.search.archive import GridArchive
from engine.search.axes import Axis
from engine.storage.rows import statistics
from engine.storage.writer import RunWriter
from tests.support.made_up import MADE_UP, evaluation

SHAPE = (9, 10, 9, 10)
AXES = (
    Axis("modules", 1.5, 10.5, 9),
    Axis("stiffness", 0.05, 1.05, 10),
    Axis("PCA 1", -4.5, 4.5, 9),
    Axis("PCA 2", -5.0, 5.0, 10),
)


@dataclasses.dataclass
class Snapshot:
    """What a generation leaves behind."""

    generation: int
    archives: dict
    all_axes: dict
    saved: dict = dataclasses.field(default_factory=dict)

    def axes(self, archive):
        return self.all_axes[archive]

    def state(self):
        return self.saved


def write_grid_run(path, generations, config=MADE_UP, axes=AXES):
    """Write a run whose archive ``grid`` is filled as told.

    Args:
        path: of the file.
        generations: of each the offers (cell, evaluation) in order, or a function that takes the archive.
        config: of the run.
        axes: of the archive.
    """
    archive = GridArchive(shape=tuple(a.n for a in axes))
    with RunWriter.create(path, config, {"tensatlas": "0", "mujoco": "0"}) as writer:
        for k, offers in enumerate(generations):
            if callable(offers):
                offers(archive)
                offers = []
            writer.add_evaluations(k, [e for _, e in offers])
            for cell, e in offers:
                archive.add(cell, e)
            snapshot = Snapshot(k + 1, {"grid": archive}, {"grid": axes})
            writer.close_generation(snapshot, statistics(snapshot, 0.45), 3600.0 * (k + 1))
    return path


def random_offers(rng, n, first=0):
    """Return offers of random evaluations to few of the cells, so that some collide."""
    return [
        (
            tuple(int(i) for i in rng.integers(0, 3, size=4)),
            evaluation(first + k, fitness=float(rng.uniform(0.1, 0.6))),
        )
        for k in range(n)
    ]


def random_grid_run(path, seed=0, sizes=(20, 6, 6), **kwargs):
    """Write a run of random offers in generations of some sizes."""
    rng = np.random.default_rng(seed)
    firsts = np.cumsum([0, *sizes])
    return write_grid_run(
        path, [random_offers(rng, n, int(first)) for n, first in zip(sizes, firsts, strict=False)], **kwargs
    )
