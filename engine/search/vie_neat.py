"""ViE-NEAT (Zardini et al., GECCO 2021, algorithm 1): bodies and controllers as two populations.

Bodies evolve by Viability Evolution (``viability``), controllers by NEAT (``neat_population``). They meet
only when they are evaluated, in random pairs. What the paper leaves open:

- **What is tried.** The bodies and the controllers that have no fitness yet: in generation 0 all founders and
  all first controllers, later the mutants and the controllers that are not elites. Each is tried at least
  once; members of the smaller side take turns. A generation has as many evaluations as the larger side has
  members. If NEAT has only elites, all of them are tried, and judged, again.
- **What counts.** The fitness of a body or controller is ``paired_fitness`` of its pairs without a failed
  simulation. A body with none does not join; a controller with none is tried again if it survives.
- **Lineage.** ``parent`` of a solution is the evaluation in which the parent of its body was tried, the
  best one of several; ``operator`` is ``random`` for founders and ``paired`` for a mutant with a controller
  from NEAT's population, which need not descend from the parent's.
- **The last generation** may be cut short by the budget. What is not tried then has no fitness.

A run cannot start from given robots: each is a body with its controller, and they would be taken apart.

There is no map inside the algorithm. The morphology archive is the reconstruction that the paper compares
with the others: every evaluation is offered to it.
"""

from __future__ import annotations

import dataclasses
import random
from collections.abc import Mapping, Sequence
from typing import Any

from engine.errors import InvalidData
from engine.search.algorithm import Algorithm, Recall
from engine.search.archive import Cell, GridArchive
from engine.search.axes import Axis
from engine.search.body_space import PUBLISHED_BODIES, BodySpace
from engine.search.neat_population import NeatPopulation
from engine.search.variation import PUBLISHED, VariationConfig, restore_rng, rng_state
from engine.search.viability import Candidate, Member, Merit, ViabilityPopulation
from engine.simulation.evaluation import Evaluation, Solution

MAX_SIZE = 10_000
"""Populations larger than this are refused."""


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class VieNeatConfig:
    """Parameters of ViE-NEAT; other algorithms ignore them.

    Raises:
        InvalidData: a number is out of its range.
    """

    morphologies: int = 48
    """Bodies that found the population; at twice as many the viability boundary moves."""
    mutants: int = 48
    """New bodies per generation."""
    boundary_rate: float = 0.1
    """How much of its distance to the best fitness the viability boundary moves at a time."""
    maximise: Merit = "negative"
    """What both populations maximise: minus the fitness (negative), or 1 / fitness (inverse) as published."""
    controllers: int = 54
    """Nominal size of NEAT's population."""
    elitism: int = 3
    """Controllers that survive unchanged, of each species."""
    species_elitism: int = 2
    """Species that never die out."""
    compatibility_threshold: float = 2.85
    """Distance at which two controllers are of different species."""

    def __post_init__(self) -> None:
        for name, least in (
            ("morphologies", 2),
            ("mutants", 1),
            ("controllers", 2),
            ("elitism", 0),
            ("species_elitism", 0),
        ):
            if not least <= getattr(self, name) <= MAX_SIZE:
                raise InvalidData(f"{name} must be from {least} to {MAX_SIZE}, not {getattr(self, name)}")
        if self.elitism * max(self.species_elitism, 1) >= self.controllers:
            # these survive for ever and would leave no place for new controllers
            raise InvalidData(
                f"elitism x species_elitism ({self.elitism} x {self.species_elitism}) must be smaller than"
                f" controllers ({self.controllers})"
            )
        if not 0.0 < self.boundary_rate <= 1.0:
            raise InvalidData(f"boundary_rate must be in (0, 1], not {self.boundary_rate}")
        if not 0.0 < self.compatibility_threshold <= 1e6:
            raise InvalidData(
                "compatibility_threshold must be positive and at most 1e6,"
                f" not {self.compatibility_threshold}"
            )

    def check_budget(self, evaluations: int) -> None:
        """Check that a budget is enough for the first generation.

        Raises:
            InvalidData: the budget is too small.
        """
        least = max(self.morphologies, self.controllers)
        if evaluations < least:
            raise InvalidData(
                f"evaluations ({evaluations}) must be at least the {least} of ViE-NEAT's first generation;"
                " smaller populations need fewer"
            )


@dataclasses.dataclass(frozen=True, slots=True)
class _Pair:
    candidate: int
    controller: int
    solution: Solution


class VieNeat(Algorithm):
    """ViE-NEAT.

    Args:
        n_inputs: how many numbers the controllers sense.
        config: sizes and rates of the two populations.
        bodies: those that there are.
        seed: of all the algorithm's draws.
        budget: total number of solutions; the last generation may be smaller.
        variation: the rates of bodies and controllers; the weights of its operators do not count.

    Raises:
        InvalidData: the budget is too small for the first generation.
    """

    def __init__(
        self,
        config: VieNeatConfig,
        *,
        n_inputs: int,
        budget: int,
        seed: int = 0,
        bodies: BodySpace = PUBLISHED_BODIES,
        variation: VariationConfig = PUBLISHED,
    ) -> None:
        config.check_budget(budget)
        self._budget = budget
        self._rng = random.Random(seed)
        self._space = bodies
        self._bodies = ViabilityPopulation(
            size=config.morphologies,
            n_mutants=config.mutants,
            boundary_rate=config.boundary_rate,
            maximise=config.maximise,
            draw=bodies.draw,
            mutate=lambda parent, rng: bodies.mutate(parent, rng, variation.body),
        )
        self._controllers = NeatPopulation(
            n_inputs=n_inputs,
            size=config.controllers,
            elitism=config.elitism,
            species_elitism=config.species_elitism,
            compatibility_threshold=config.compatibility_threshold,
            rates=variation.neat,
            maximise=config.maximise,
            rng=self._rng,
        )
        self._archive = bodies.archive()
        self._generation = 0
        self._n_asked = 0
        self._candidates: list[Candidate] = []
        self._pairs: list[_Pair] = []

    @property
    def generation(self) -> int:
        """Number of completed generations."""
        return self._generation

    @property
    def archives(self) -> Mapping[str, GridArchive]:
        """The reconstructed morphology archive."""
        return {"morphology": self._archive}

    @property
    def bodies(self) -> ViabilityPopulation:
        """The population of bodies."""
        return self._bodies

    @property
    def controllers(self) -> NeatPopulation:
        """The population of controllers."""
        return self._controllers

    def axes(self, archive: str) -> tuple[Axis, ...]:
        """Describe the axes of the archive."""
        if archive not in self.archives:
            raise KeyError(archive)
        return self._space.axes

    def ask(self) -> list[Solution]:
        """Return random pairs of the bodies and controllers that are to be tried."""
        if self._pairs:
            raise ValueError("tell the evaluations of the last ask first")
        remaining = self._budget - self._n_asked
        if remaining <= 0:
            return []
        self._candidates = self._bodies.candidates(self._rng)
        controllers = self._controllers.controllers
        keys = self._controllers.waiting or list(controllers)
        pairs = pair_randomly(len(self._candidates), len(keys), self._rng)[:remaining]
        for i, k in pairs:
            candidate = self._candidates[i]
            solution = Solution(
                number=self._n_asked,
                morphology=candidate.morphology,
                controller=controllers[keys[k]],
                parent=candidate.parent,
                operator="random" if candidate.parent is None else "paired",
            )
            self._pairs.append(_Pair(i, keys[k], solution))
            self._n_asked += 1
        return [p.solution for p in self._pairs]

    def tell(self, evaluations: Sequence[Evaluation]) -> None:
        """Judge both populations by their pairs and advance each by its own rules."""
        ordered = sorted(evaluations, key=lambda e: e.solution.number)
        if not self._pairs or [e.solution for e in ordered] != [p.solution for p in self._pairs]:
            raise ValueError("tell takes the evaluations of exactly the solutions asked for")
        of_body: dict[int, list[tuple[float, int]]] = {}
        of_controller: dict[int, list[float]] = {}
        for pair, e in zip(self._pairs, ordered, strict=True):
            if e.fitness is None:
                continue
            self._archive.add(self._space.cell(e.solution.morphology), e)
            of_body.setdefault(pair.candidate, []).append((e.fitness, e.solution.number))
            of_controller.setdefault(pair.controller, []).append(e.fitness)
        self._bodies.tell(
            sorted((self._judge(i, known) for i, known in of_body.items()), key=lambda m: m.number)
        )
        self._controllers.evolve({k: paired_fitness(f) for k, f in of_controller.items()}, self._rng)
        self._candidates, self._pairs = [], []
        self._generation += 1

    def state(self) -> dict[str, Any]:
        """Return the generation, the random state and both populations."""
        return {
            "generation": self._generation,
            "n_asked": self._n_asked,
            "rng": rng_state(self._rng),
            "bodies": self._bodies.state(),
            "controllers": self._controllers.state(),
        }

    def restore(
        self,
        state: dict[str, Any],
        contents: Mapping[str, Mapping[Cell, Evaluation]],
        recall: Recall,  # noqa: ARG002 - the populations are all in the state
    ) -> None:
        """Go back to the end of a generation."""
        self._generation = state["generation"]
        self._n_asked = state["n_asked"]
        restore_rng(self._rng, state["rng"])
        self._bodies.restore(state["bodies"])
        self._controllers.restore(state["controllers"])
        self._archive.reinsert(contents["morphology"].items())
        self._candidates, self._pairs = [], []

    def _judge(self, index: int, known: list[tuple[float, int]]) -> Member:
        candidate = self._candidates[index]
        _, number = min(known)
        return Member(candidate.morphology, candidate.family, number, paired_fitness([f for f, _ in known]))


def pair_randomly(n_left: int, n_right: int, rng: random.Random) -> list[tuple[int, int]]:
    """Pair two populations at random, every member at least once.

    There are as many pairs as the larger population has members. Each member of the larger one is in one
    pair. Members of the smaller one take turns, so their numbers of pairs differ by one at most, and chance
    decides which have one more. For equal sizes the pairing is one-to-one.

    Returns:
        Pairs of indices, no pair twice; empty if a population is.
    """
    if not n_left or not n_right:
        return []
    left, right = list(range(n_left)), list(range(n_right))
    rng.shuffle(left)
    rng.shuffle(right)
    return [(left[i % n_left], right[i % n_right]) for i in range(max(n_left, n_right))]


def paired_fitness(fitnesses: Sequence[float]) -> float:
    """Return mean + 1/2 (max - mean) of an individual's fitnesses with its partners, to be minimised.

    Zardini et al. 2021, equation 2. With one partner it is that fitness, to the last bit.

    Raises:
        ValueError: there is none.
    """
    if not fitnesses:
        raise ValueError("an individual without a partner has no fitness")
    mean = sum(fitnesses) / len(fitnesses)
    # never -0.0, whose sign a run file would not keep
    return mean + 0.5 * (max(fitnesses) - mean) + 0.0
