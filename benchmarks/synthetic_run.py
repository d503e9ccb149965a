"""Run files with valid contents that nobody simulated, to try the explorer on runs of any length."""

from __future__ import annotations

import random
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Self

import numpy as np

from engine.body.module import MAX_MODULES, MIN_MODULES, N_STIFFNESS_LEVELS
from engine.body.morphology import Morphology
from engine.body.servo import N_RHYTHMS
from engine.config import RunConfig, bodies_of, preset, replaced
from engine.control.genome import Controller
from engine.control.operators import Neat
from engine.search.archive import Cell, GridArchive
from engine.search.axes import Axis
from engine.search.descriptors import CONTROLLER_SHAPE
from engine.simulation.evaluation import Evaluation, Solution
from engine.simulation.provenance import versions
from engine.storage.rows import statistics
from engine.storage.writer import RunWriter
from engine.tasks import fitness, get_task

N_CONTROLLERS = 48
N_MUTATIONS = 10


class SyntheticRun:
    """A DM-ME run of random robots with made-up outcomes, written by the store as any run is.

    Bodies and controllers are valid genotypes: a click on a cell simulates a real robot. The fitness
    gets better over the run, so that elites keep changing as they do in an evolution.

    Args:
        path: of the run file, which must not exist.
        config: of the run.
        modules: of every robot; None for 2 to 10.
        controllers: that the robots have; None for evolved ones.
    """

    def __init__(
        self,
        path: Path,
        config: RunConfig,
        *,
        modules: int | None = None,
        controllers: Sequence[Controller] | None = None,
    ) -> None:
        self._config, self._modules = config, modules
        self._bodies = bodies_of(config)
        self._task = get_task(config.task)
        self._rng = random.Random(config.seed)
        self._numbers = np.random.default_rng(config.seed)
        neat = Neat(n_inputs=self._task.n_inputs)
        self._controllers = [neat.random(self._rng) for _ in range(N_CONTROLLERS)]
        for _ in range(N_MUTATIONS):
            self._controllers = [neat.mutate(c, self._rng) for c in self._controllers]
        self._controllers = list(controllers or self._controllers)
        self.archives = {
            "morphology": self._bodies.archive(),
            "controller": GridArchive(shape=CONTROLLER_SHAPE),
        }
        self.generation = 0
        self.n_evaluations = 0
        self._writer = RunWriter.create(path, config, versions(config.task, config.physics.simulator))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._writer.close()

    def axes(self, archive: str) -> tuple[Axis, ...]:
        """Describe the axes of an archive."""
        if archive == "morphology":
            return self._bodies.axes
        return tuple(Axis(f"PCA {i + 1}", -4.5, 4.5, n) for i, n in enumerate(CONTROLLER_SHAPE))

    def state(self) -> dict[str, Any]:
        """Return nothing: such a run is not gone on with."""
        return {}

    def add_generation(self) -> None:
        """Add a generation and close it."""
        wanted = self._config.map_search.batch_size if self.generation else self._config.map_search.initial
        n = min(wanted, self._config.evaluations - self.n_evaluations)
        found = [self._evaluation(self.n_evaluations + k) for k in range(n)]
        self.n_evaluations += n
        self._writer.add_evaluations(self.generation, found)
        for e in found:
            self.archives["morphology"].add(self._bodies.cell(e.solution.morphology), e)
            self.archives["controller"].add(self._behaviour(), e)
        self.generation += 1
        figures = statistics(self, self._task.target_distance)
        self._writer.close_generation(self, figures, 60.0 * self.generation)

    def _evaluation(self, number: int) -> Evaluation:
        rng, trials = self._rng, self._config.trials
        n = self._modules or rng.randint(MIN_MODULES, MAX_MODULES)
        evolves = self._config.head_search == "rhythms"
        body = Morphology(
            rng.randint(1, N_STIFFNESS_LEVELS),
            tuple(rng.randint(1, 8) for _ in range(n)),
            tuple(rng.randrange(N_RHYTHMS) for _ in range(n)) if evolves else (),
        )
        part = number / self._config.evaluations
        shape = (self._task.n_targets, trials.repeats)
        distances = self._numbers.uniform(0.35 - 0.25 * part, 0.55 - 0.25 * part, size=shape)
        steps = self._numbers.normal(0.0, 0.005, size=(shape[0], int(trials.trial_time), 2))
        return Evaluation(
            solution=Solution(
                number=number,
                morphology=body,
                controller=rng.choice(self._controllers),
                parent=rng.randrange(number) if self.generation else None,
                operator="both" if self.generation else "random",
                source=rng.choice(list(self.archives)) if self.generation else None,
            ),
            fitness=fitness(distances),
            distances=distances,
            trajectory=np.cumsum(steps, axis=1).astype(np.float32),
            head_is_end=rng.random() < 0.5,
        )

    def _behaviour(self) -> Cell:
        return tuple(self._rng.randrange(n) for n in CONTROLLER_SHAPE)


def write_run(
    path: Path,
    *,
    evaluations: int,
    initial: int = 1080,
    modules: int | None = None,
    controllers: Sequence[Controller] | None = None,
) -> RunConfig:
    """Write a finished run with trials as long and as many as the published ones.

    Args:
        path: of the run file, which must not exist.
        evaluations: in all.
        initial: of them in generation 0.
        modules: of every robot; None for 2 to 10.
        controllers: that the robots have; None for evolved ones.
    """
    config = replaced(preset("atlas"), evaluations=evaluations, initial=min(initial, evaluations))
    with SyntheticRun(path, config, modules=modules, controllers=controllers) as run:
        while run.n_evaluations < evaluations:
            run.add_generation()
    return config
