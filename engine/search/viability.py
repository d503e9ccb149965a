"""Viability Evolution of bodies: those worse than a moving boundary leave the population.

After Maesani, Mattiussi and Floreano (2014), as Zardini et al. (2021) use it, where the fitness is the only
viability criterion. The paper gives the two population sizes; the published configuration adds how far the
boundary moves and when. The other rules are:

- Every founder starts a new family; a mutant belongs to its parent's family.
- A parent is drawn in two steps: a family with probability inverse to its size, then one of its members
  uniformly. A mutation is repeated until the body differs from its parent's.
- The boundary starts at the worst fitness of the founders, so that all of them are viable. Being as bad
  as the boundary is viable.
- After each generation the mutants join, the unviable leave. Then, as long as the population has twice
  its initial size or more, the boundary moves by a tenth of its distance to the best and the unviable
  leave: it may move several times in a generation, and not at all in another.
- A body keeps the fitness it got when it was new; it is not tried again with other controllers.
- Once nothing but a tie lies between boundary and best (``TIE``), the boundary cannot tell bodies apart any
  more. The population is then cut back to its initial size: the best stay, of equals the younger.
- A body that failed in all its simulations is not viable. If no body is left, which takes a first
  generation without a single success, the population is founded again.
"""

from __future__ import annotations

import dataclasses
import random
from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any, Final, Literal

from engine.body.morphology import Morphology, mutate_morphology, random_morphology

TIE: Final = 1e-10
"""A distance of fitnesses in m that counts as none, that of the published configuration."""
NEAREST: Final = 0.01
"""Below this fitness in m, 1 / fitness goes on as a straight line: a bonus may make a fitness negative."""

Merit = Literal["negative", "inverse"]
"""What a population maximises: minus the fitness, or 1 / fitness as published."""


def merit(fitness: float, kind: Merit) -> float:
    """Return what a population maximises, of a fitness in m that is to be minimised."""
    if kind == "negative":
        return -fitness
    if fitness >= NEAREST:
        return 1.0 / fitness
    return 1.0 / NEAREST + (NEAREST - fitness) / NEAREST**2


def fitness_of_merit(value: float, kind: Merit) -> float:
    """Return the fitness in m that has a merit, but for rounding."""
    if kind == "negative":
        return -value
    if value <= 1.0 / NEAREST:
        return 1.0 / value
    return NEAREST - (value - 1.0 / NEAREST) * NEAREST**2


@dataclasses.dataclass(frozen=True, slots=True)
class Candidate:
    """A body to be evaluated.

    Attributes:
        morphology: the body.
        family: whose lineage it is of.
        parent: number of its parent's evaluation, None for a founder.
    """

    morphology: Morphology
    family: int
    parent: int | None


@dataclasses.dataclass(frozen=True, slots=True)
class Member:
    """A body of the population.

    Attributes:
        morphology: the body.
        family: whose lineage it is of.
        number: of its evaluation.
        fitness: in m, to be minimised.
    """

    morphology: Morphology
    family: int
    number: int
    fitness: float


class ViabilityPopulation:
    """A population of bodies under a viability boundary.

    Args:
        size: number of founders.
        n_mutants: mutants per generation.
        boundary_rate: how much of its distance to the best the boundary moves at a time, in (0, 1].
        maximise: the scale of that distance.
        draw: draws a founder.
        mutate: returns a mutated copy, which may equal its parent.
    """

    def __init__(
        self,
        *,
        size: int = 48,
        n_mutants: int = 48,
        boundary_rate: float = 0.1,
        maximise: Merit = "negative",
        draw: Callable[[random.Random], Morphology] = random_morphology,
        mutate: Callable[[Morphology, random.Random], Morphology] = mutate_morphology,
    ) -> None:
        self._size = size
        self._n_mutants = n_mutants
        self._boundary_rate = boundary_rate
        self._maximise: Merit = maximise
        self._draw = draw
        self._mutate = mutate
        self._members: list[Member] = []
        self._boundary: float | None = None
        self._n_families = 0

    @property
    def members(self) -> tuple[Member, ...]:
        """The bodies, oldest first."""
        return tuple(self._members)

    @property
    def boundary(self) -> float | None:
        """The worst viable fitness in m, or None before the first success."""
        return self._boundary

    def family_probabilities(self) -> dict[int, float]:
        """Return by family the probability that the next parent is drawn from it."""
        sizes = Counter(m.family for m in self._members)
        total = sum(1 / n for n in sizes.values())
        return {family: 1 / sizes[family] / total for family in sorted(sizes)}

    def candidates(self, rng: random.Random) -> list[Candidate]:
        """Draw the bodies to try next: founders into an empty population, mutants otherwise."""
        if not self._members:
            first, self._n_families = self._n_families, self._n_families + self._size
            return [Candidate(self._draw(rng), first + i, None) for i in range(self._size)]
        probabilities = self.family_probabilities()
        families: dict[int, list[Member]] = {}
        for m in self._members:
            families.setdefault(m.family, []).append(m)
        drawn = rng.choices(list(probabilities), list(probabilities.values()), k=self._n_mutants)
        return [self._mutant(rng.choice(families[family]), rng) for family in drawn]

    def tell(self, judged: Sequence[Member]) -> None:
        """Add candidates whose fitness is known now, then remove the unviable.

        Args:
            judged: the candidates that did not fail, in the order of their numbers.
        """
        self._members += judged
        if not self._members:
            return
        if self._boundary is None:
            self._boundary = max(m.fitness for m in self._members)
        self._remove_unviable()
        while len(self._members) >= 2 * self._size:
            best = min(m.fitness for m in self._members)
            if self._boundary - best <= TIE:
                self._members.sort(key=lambda m: (m.fitness, -m.number))
                self._members = sorted(self._members[: self._size], key=lambda m: m.number)
                return
            # rounding must not move it past the best body, which would leave
            self._boundary = max(best, self._moved(self._boundary, best))
            self._remove_unviable()

    def state(self) -> dict[str, Any]:
        """Return everything ``restore`` needs, JSON-ready."""
        return {
            "boundary": self._boundary,
            "families": self._n_families,
            "members": [[m.morphology.to_json(), m.family, m.number, m.fitness] for m in self._members],
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Go back to what ``state`` returned."""
        self._boundary = state["boundary"]
        self._n_families = state["families"]
        self._members = [
            Member(Morphology.from_json(morphology), family, number, fitness)
            for morphology, family, number, fitness in state["members"]
        ]

    def _mutant(self, parent: Member, rng: random.Random) -> Candidate:
        morphology = parent.morphology
        while morphology == parent.morphology:
            morphology = self._mutate(parent.morphology, rng)
        return Candidate(morphology, parent.family, parent.number)

    def _moved(self, boundary: float, best: float) -> float:
        """Return the boundary a part of its way nearer to the best."""
        now, aim = (merit(f, self._maximise) for f in (boundary, best))
        return fitness_of_merit(now + self._boundary_rate * (aim - now), self._maximise)

    def _remove_unviable(self) -> None:
        assert self._boundary is not None
        self._members = [m for m in self._members if m.fitness <= self._boundary]
