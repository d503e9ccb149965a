"""NEAT-Python's own population of controllers, told fitnesses from outside.

Population, reproduction with crossover, species and stagnation are the library's classes, and one
generation here is one pass of its ``Population.run``. What this module adds:

- NEAT maximises, so it is told the negated fitness, or 1 / fitness.
- NEAT-Python draws from Python's global ``random``; it is lent the caller's generator, as in ``Neat``.
- The library's own checkpoints are pickles, which a run file never holds. The state here is JSON: genomes,
  species with their histories, and every counter. It leaves out what the library works out anew before
  it reads it: the species' own fitness and adjusted fitness, the innovations of the last generation.
- NEAT-Python 2 forces the population to its nominal size and gives up when the species' smallest
  sizes do not fit in. In the version that the paper used the size floats a little around the nominal one, as
  the species' shares are rounded ("the population is not fixed in size"), and so it does here. Only a
  population that outgrows it ``MAX_GROWTH`` times, by splitting into too many species, is given up.
- A controller keeps its fitness when it survives as an elite: only new ones are ``waiting`` to be tried. In
  the published numbers, two species with three elites each leave 48 new ones of 54, one for each mutant.
- A controller of which every simulation failed has no fitness. For the reproduction the worst fitness of
  its generation stands in, as the library needs a number; if it survives, it is tried again.

As in the library, the hidden nodes of the first genomes all have different keys. That makes the distance
of two random controllers of goal reaching about 2.75, which is why a threshold of 2.85 is "relatively low".
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from random import Random
from typing import Any, Final, Self

import neat
from neat.genome import DefaultGenomeConfig
from neat.innovation import InnovationTracker
from neat.species import Species

from engine.control.genome import N_OUTPUTS, Controller
from engine.control.operators import Neat, from_genome, lend_random, to_genome
from engine.control.rates import PUBLISHED_RATES, NeatRates
from engine.errors import InvalidData
from engine.search.viability import Merit, fitness_of_merit, merit

MAX_STAGNATION: Final = 15
"""Generations without improvement after which a species may die out; the library's default."""
SURVIVAL_THRESHOLD: Final = 0.2
"""Part of a species that may have offspring; the library's default."""
MIN_SPECIES_SIZE: Final = 2
"""Smallest size of a species, of the published configuration; a larger elitism takes its place."""
MAX_GROWTH: Final = 4
"""A population larger than this many times its nominal size is a mistake in the parameters."""


class _Counter:
    """Counts up like ``itertools.count``, with a readable position."""

    def __init__(self, next_value: int) -> None:
        self.next_value = next_value

    def __iter__(self) -> Self:
        return self

    def __next__(self) -> int:
        self.next_value += 1
        return self.next_value - 1


class FloatingSizeReproduction(neat.DefaultReproduction):
    """The library's reproduction, without the correction to the exact size that version 2 added."""

    def _adjust_spawn_exact(self, spawn_amounts: list[int], *_: int) -> list[int]:
        return spawn_amounts


@dataclasses.dataclass(slots=True)
class _Config:
    """What ``neat.Config`` reads from a file, under the names that the library looks for."""

    pop_size: int
    genome_config: DefaultGenomeConfig
    reproduction_config: Any
    stagnation_config: Any
    species_set_config: Any
    genome_type: type = neat.DefaultGenome
    reproduction_type: type = FloatingSizeReproduction
    stagnation_type: type = neat.DefaultStagnation
    species_set_type: type = neat.DefaultSpeciesSet
    fitness_criterion: str = "max"
    no_fitness_termination: bool = True
    reset_on_extinction: bool = True


class NeatPopulation:
    """A population of controllers.

    Args:
        n_inputs: how many numbers the controllers sense.
        size: nominal number of controllers.
        elitism: how many of the best of each species survive unchanged.
        species_elitism: how many of the best species never die out.
        compatibility_threshold: genomes farther apart than this are of different species.
        rates: how the controllers begin and mutate.
        maximise: what is told to NEAT.
        rng: draws the first controllers.
    """

    def __init__(
        self,
        *,
        n_inputs: int,
        size: int = 54,
        elitism: int = 3,
        species_elitism: int = 2,
        compatibility_threshold: float = 2.85,
        rates: NeatRates = PUBLISHED_RATES,
        maximise: Merit = "negative",
        rng: Random,
    ) -> None:
        self._maximise: Merit = maximise
        operators = Neat(n_inputs=n_inputs, rates=rates)
        self._genome_config = operators.config
        self._genome_config.node_indexer = _Counter(N_OUTPUTS)
        self._config = _Config(
            pop_size=size,
            genome_config=self._genome_config,
            genome_type=operators.kind,
            reproduction_config=FloatingSizeReproduction.parse_config(
                {
                    "elitism": elitism,
                    "survival_threshold": SURVIVAL_THRESHOLD,
                    "min_species_size": MIN_SPECIES_SIZE,
                }
            ),
            stagnation_config=neat.DefaultStagnation.parse_config(
                {
                    "species_fitness_func": "mean",
                    "max_stagnation": MAX_STAGNATION,
                    "species_elitism": species_elitism,
                }
            ),
            species_set_config=neat.DefaultSpeciesSet.parse_config(
                {"compatibility_threshold": compatibility_threshold}
            ),
        )
        with lend_random(rng):
            self._population = neat.Population(self._config)
        self._population.reproduction.genome_indexer = _Counter(max(self._population.population) + 1)
        self._population.species.indexer = _Counter(max(self._population.species.species) + 1)

    @property
    def generation(self) -> int:
        """Number of completed generations."""
        return int(self._population.generation)

    @property
    def controllers(self) -> dict[int, Controller]:
        """The controllers by their key."""
        n_inputs = self._genome_config.num_inputs
        return {k: from_genome(g, n_inputs) for k, g in self._population.population.items()}

    @property
    def waiting(self) -> list[int]:
        """The keys of the controllers without a fitness."""
        return [k for k, g in self._population.population.items() if g.fitness is None]

    @property
    def fitnesses(self) -> dict[int, float]:
        """By key the fitness, to be minimised, of the controllers that have one."""
        genomes = self._population.population.items()
        return {k: fitness_of_merit(g.fitness, self._maximise) for k, g in genomes if g.fitness is not None}

    @property
    def species(self) -> dict[int, list[int]]:
        """By species the keys of its controllers."""
        return {s.key: list(s.members) for s in self._population.species.species.values()}

    def evolve(self, fitnesses: Mapping[int, float], rng: Random) -> None:
        """Take in fitnesses and advance to the next generation; without any, the population stays.

        Args:
            fitnesses: by key, in m, to be minimised; of new controllers, or anew of known ones.
            rng: draws the offspring.

        Raises:
            InvalidData: the population has split into so many species that it outgrew its size.
        """
        if not fitnesses:
            return
        told = {k: merit(f, self._maximise) for k, f in fitnesses.items()}
        kept = {k: g.fitness for k, g in self._population.population.items() if g.fitness is not None}
        worst = min((kept | told).values())
        unknown: list[int] = []

        def tell(genomes: list[tuple[int, neat.DefaultGenome]], _: Any) -> None:
            for key, genome in genomes:
                if key in told:
                    genome.fitness = told[key]
                elif genome.fitness is None:
                    genome.fitness = worst
                    unknown.append(key)

        with lend_random(rng):
            self._population.run(tell, 1)
        # the library only adds to this family tree
        self._population.reproduction.ancestors.clear()
        n, n_species = len(self._population.population), len(self._population.species.species)
        if n > MAX_GROWTH * self._config.pop_size:
            raise InvalidData(
                f"NEAT's {self._config.pop_size} controllers have become {n} in {n_species} species; choose a"
                " larger compatibility_threshold or a smaller elitism"
            )
        for key in unknown:
            if key in self._population.population:
                self._population.population[key].fitness = None

    def state(self) -> dict[str, Any]:
        """Return everything ``restore`` needs, JSON-ready."""
        population = self._population
        controllers = self.controllers
        return {
            "generation": population.generation,
            "genomes": [
                [key, genome.fitness, controllers[key].to_json()]
                for key, genome in population.population.items()
            ],
            "species": [
                {
                    "key": s.key,
                    "created": s.created,
                    "last_improved": s.last_improved,
                    "history": list(s.fitness_history),
                    "representative": s.representative.key,
                    "members": list(s.members),
                }
                for s in population.species.species.values()
            ],
            "next_genome": population.reproduction.genome_indexer.next_value,
            "next_species": population.species.indexer.next_value,
            "next_node": self._genome_config.node_indexer.next_value,
            "innovations": population.reproduction.innovation_tracker.global_counter,
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Go back to what ``state`` returned."""
        genomes: dict[int, neat.DefaultGenome] = {}
        for key, fitness, controller in state["genomes"]:
            genome = to_genome(
                Controller.from_json(controller), self._genome_config, self._config.genome_type
            )
            genome.key, genome.fitness = key, fitness
            genomes[key] = genome
        species = neat.DefaultSpeciesSet(self._config.species_set_config, None)
        for s in state["species"]:
            one = Species(s["key"], s["created"])
            one.last_improved = s["last_improved"]
            one.fitness_history = list(s["history"])
            one.update(genomes[s["representative"]], {key: genomes[key] for key in s["members"]})
            species.species[one.key] = one
            species.genome_to_species |= dict.fromkeys(s["members"], one.key)
        species.indexer = _Counter(state["next_species"])
        self._population = neat.Population(self._config, (genomes, species, state["generation"]))
        reproduction = self._population.reproduction
        reproduction.genome_indexer = _Counter(state["next_genome"])
        reproduction.innovation_tracker = InnovationTracker(state["innovations"])
        self._genome_config.node_indexer = _Counter(state["next_node"])
