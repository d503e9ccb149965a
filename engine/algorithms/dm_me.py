"""Double-Map MAP-Elites (Zardini et al., GECCO 2021, algorithm 2).

Two independent archives see every solution: one is laid out by the body, the other by the trajectory
of the head, projected on its first two principal components. Half of the parents come from each.
"""

from __future__ import annotations

import random
from collections.abc import Mapping, Sequence
from typing import Any, Final

from engine.algorithms.base import Algorithm, Axis
from engine.archive import Cell, GridArchive
from engine.controller import Neat
from engine.descriptors import (
    CONTROLLER_SHAPE,
    MORPHOLOGY_SHAPE,
    TrajectoryDescriptor,
    morphology_cell,
    sensory_data,
)
from engine.errors import InvalidData
from engine.evaluation import Evaluation, Solution
from engine.morphology import mutate_morphology, random_morphology
from engine.tensegrity import MAX_MODULES, MIN_MODULES

MUTATIONS: Final = ("morphology", "controller", "both")
PAPER_REFITS: Final = (0, 50, 150, 350, 750, 1550)


def check_schedule(evaluations: int, initial: int, batch_size: int, refit_generations: Sequence[int]) -> None:
    """Check that the numbers of a schedule fit together.

    Raises:
        InvalidData: they contradict each other; the message says which.
    """
    if evaluations < 2:
        raise InvalidData(f"evaluations must be at least 2, not {evaluations}")
    if not 2 <= initial <= evaluations:
        raise InvalidData(f"initial ({initial}) must be from 2 to evaluations ({evaluations})")
    if batch_size < 2 or batch_size % 2:
        raise InvalidData(f"batch_size must be an even number from 2, not {batch_size}")
    if 0 not in refit_generations or min(refit_generations) < 0:
        raise InvalidData("refit_generations must include 0 and not be negative")


class DoubleMapMapElites(Algorithm):
    """DM-ME.

    Args:
        n_inputs: what the controllers sense.
        n_initial: random solutions of generation 0.
        batch_size: solutions per later generation, an even number.
        refit_generations: when standardiser and PCA are fitted anew.
        sensory: ``positions`` or ``displacements``, see ``descriptors.sensory_data``.
        seed: of all the algorithm's draws.
        budget: total number of solutions; the last generation may be smaller.

    Raises:
        InvalidData: the numbers contradict each other.
    """

    def __init__(
        self,
        *,
        n_inputs: int,
        n_initial: int = 1080,
        batch_size: int = 24,
        refit_generations: Sequence[int] = PAPER_REFITS,
        sensory: str = "positions",
        seed: int = 0,
        budget: int = 45_000,
    ) -> None:
        check_schedule(budget, n_initial, batch_size, refit_generations)
        self._n_initial = n_initial
        self._batch_size = batch_size
        self._refits = frozenset(refit_generations)
        self._sensory = sensory
        self._budget = budget
        self._rng = random.Random(seed)
        self._neat = Neat(n_inputs=n_inputs)
        self._descriptor = TrajectoryDescriptor(shape=CONTROLLER_SHAPE)
        self._morphology = GridArchive(shape=MORPHOLOGY_SHAPE)
        self._controller = GridArchive(shape=CONTROLLER_SHAPE)
        self._generation = 0
        self._n_asked = 0
        self._asked: list[Solution] = []

    @property
    def generation(self) -> int:
        """Number of completed generations."""
        return self._generation

    @property
    def archives(self) -> Mapping[str, GridArchive]:
        """The morphology and the controller archive."""
        return {"morphology": self._morphology, "controller": self._controller}

    def axes(self, archive: str) -> tuple[Axis, ...]:
        """Describe the axes of an archive as they are now."""
        if archive == "morphology":
            modules, levels = MORPHOLOGY_SHAPE
            return (
                Axis("modules", MIN_MODULES - 0.5, MAX_MODULES + 0.5, modules),
                Axis("stiffness", 0.05, 0.05 + levels / 10, levels),
            )
        d = self._descriptor
        return tuple(
            Axis(f"PCA {i + 1}", float(d.lower[i]), float(d.upper[i]), d.shape[i])
            for i in range(len(d.shape))
        )

    def ask(self) -> list[Solution]:
        """Return the random solutions of generation 0, then mutants of elites of both archives."""
        if self._asked:
            raise ValueError("tell the evaluations of the last ask first")
        remaining = self._budget - self._n_asked
        if remaining <= 0:
            return []
        self._neat.new_generation()
        if not self._descriptor.fitted:
            self._asked = [self._random() for _ in range(min(self._n_initial, remaining))]
        else:
            self._asked = self._mutants(min(self._batch_size, remaining))
        return list(self._asked)

    def tell(self, evaluations: Sequence[Evaluation]) -> None:
        """Offer every evaluation to both archives."""
        ordered = sorted(evaluations, key=lambda e: e.solution.number)
        if not self._asked or [e.solution for e in ordered] != self._asked:
            raise ValueError("tell takes the evaluations of exactly the solutions asked for")
        self._asked = []
        whole = [e for e in ordered if e.fitness is not None]
        for e in whole:
            self._morphology.add(morphology_cell(e.solution.morphology), e)
        self._tell_controller_archive(whole)
        self._generation += 1

    def state(self) -> dict[str, Any]:
        """Return the generation, the random state, NEAT's counters and the descriptor."""
        version, internal, gauss = self._rng.getstate()
        return {
            "generation": self._generation,
            "n_asked": self._n_asked,
            "rng": [version, list(internal), gauss],
            "neat": self._neat.state(),
            "descriptor": self._descriptor.state() if self._descriptor.fitted else None,
        }

    def restore(self, state: dict[str, Any], contents: Mapping[str, Mapping[Cell, Evaluation]]) -> None:
        """Go back to the end of a generation."""
        self._generation = state["generation"]
        self._n_asked = state["n_asked"]
        version, internal, gauss = state["rng"]
        self._rng.setstate((version, tuple(internal), gauss))
        self._neat.restore(state["neat"])
        if state["descriptor"] is not None:
            self._descriptor.restore(state["descriptor"])
        for name, archive in self.archives.items():
            archive.reinsert(contents[name].items())
        self._asked = []

    def _tell_controller_archive(self, whole: list[Evaluation]) -> None:
        descriptor, archive = self._descriptor, self._controller
        if not descriptor.fitted:
            if len(whole) < 2:
                return  # every simulation failed: the next generation is random again
            descriptor.fit(self._data(whole))
        elif self._generation in self._refits and len(archive) >= 2:
            descriptor.fit(self._data(archive.elites()))
            self._redescribe()
        if not whole:
            return
        described = descriptor.transform(self._data(whole))
        if descriptor.out_of_bounds(described):
            everyone = [*archive.elites(), *whole]
            descriptor.set_bounds(descriptor.transform(self._data(everyone)))
            self._redescribe()
        for e, d in zip(whole, described, strict=True):
            archive.add(descriptor.cell(d), e)

    def _redescribe(self) -> None:
        elites = self._controller.elites()
        if elites:
            described = self._descriptor.transform(self._data(elites))
            self._controller.reinsert(
                (self._descriptor.cell(d), e) for d, e in zip(described, elites, strict=True)
            )

    def _data(self, evaluations: Sequence[Evaluation]) -> Any:
        return sensory_data([e.trajectory for e in evaluations], self._sensory)

    def _random(self) -> Solution:
        return Solution(
            number=self._next_number(),
            morphology=random_morphology(self._rng),
            controller=self._neat.random(self._rng),
        )

    def _mutants(self, n: int) -> list[Solution]:
        share = {"morphology": n - n // 2, "controller": n // 2}
        return [
            self._mutate(parent.solution, name)
            for name, archive in self.archives.items()
            for parent in archive.sample(share[name], self._rng)
        ]

    def _mutate(self, parent: Solution, source: str) -> Solution:
        operator = self._rng.choice(MUTATIONS)
        morphology, controller = parent.morphology, parent.controller
        while (morphology, controller) == (parent.morphology, parent.controller):
            if operator != "controller":
                morphology = mutate_morphology(parent.morphology, self._rng)
            if operator != "morphology":
                controller = self._neat.mutate(parent.controller, self._rng)
        return Solution(
            number=self._next_number(),
            morphology=morphology,
            controller=controller,
            parent=parent.number,
            operator=operator,
            source=source,
        )

    def _next_number(self) -> int:
        self._n_asked += 1
        return self._n_asked - 1
