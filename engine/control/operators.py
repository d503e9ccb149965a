"""NEAT's operators for controllers: NEAT-Python draws, mutates and crosses them, without a population."""

from __future__ import annotations

import contextlib
import math
import random
from collections.abc import Iterable, Iterator
from random import Random
from typing import Any, Final

import neat
from neat.genome import DefaultGenomeConfig
from neat.innovation import InnovationTracker

from engine.control.genome import (
    N_OUTPUTS,
    ConnectionGene,
    Controller,
    NodeGene,
    is_within_limits,
    logistic,
)
from engine.control.neat_092 import Genome092
from engine.control.rates import PUBLISHED_RATES, NeatRates
from engine.exact import cosine_and_sine, logarithm

NEAT_PARAMETERS: Final = {
    "feed_forward": "True",
    "initial_connection": "full_nodirect",
    "compatibility_disjoint_coefficient": "1.0",
    "compatibility_weight_coefficient": "0.5",
    "activation_default": "logistic",
    "activation_options": "logistic",
    "activation_mutate_rate": "0.0",
    "aggregation_default": "sum",
    "aggregation_options": "sum",
    "aggregation_mutate_rate": "0.0",
    "weight_init_mean": "0.0",
    "weight_init_stdev": "1.0",
    "weight_min_value": "-30",
    "weight_max_value": "30",
    "bias_init_mean": "0.0",
    "bias_init_stdev": "1.0",
    "bias_min_value": "-30",
    "bias_max_value": "30",
    "response_init_mean": "1.0",
    "response_init_stdev": "0.0",
    "response_min_value": "-30",
    "response_max_value": "30",
    "response_mutate_rate": "0.0",
    "response_mutate_power": "0.0",
    "response_replace_rate": "0.0",
    "enabled_default": "True",
    "single_structural_mutation": "False",
}
"""NEAT-Python's other parameters, from the authors' published configuration."""

_KINDS: Final = {"2.0": neat.DefaultGenome, "0.92": Genome092}


class Neat:
    """Creates and mutates controllers with NEAT-Python, without a population.

    NEAT-Python draws from Python's global ``random``; every call lends it the caller's generator and
    puts the global one back. Node keys and innovation numbers are counted here; ``state`` and
    ``restore`` carry the counters over an interruption.

    Args:
        n_inputs: how many numbers the controllers sense.
        rates: how they begin and mutate.
    """

    def __init__(self, *, n_inputs: int, rates: NeatRates = PUBLISHED_RATES) -> None:
        parameters: dict[str, Any] = {
            **NEAT_PARAMETERS,
            **rates.parameters(),
            "num_inputs": str(n_inputs),
            "num_outputs": str(N_OUTPUTS),
        }
        parameters["node_gene_type"] = neat.genes.DefaultNodeGene
        parameters["connection_gene_type"] = neat.genes.DefaultConnectionGene
        self.config = DefaultGenomeConfig(parameters)
        self.config.add_activation("logistic", logistic)
        self.config.innovation_tracker = InnovationTracker()
        self.kind: type[neat.DefaultGenome] = _KINDS[rates.version]
        """The library's genome, with the operators asked for."""
        self._next_node = N_OUTPUTS + rates.hidden

    def random(self, rng: Random) -> Controller:
        """Draw a new controller, its hidden nodes between all inputs and all outputs."""
        self.config.node_indexer = iter(range(N_OUTPUTS, N_OUTPUTS + self.config.num_hidden))
        genome = self.kind(0)
        with lend_random(rng):
            genome.configure_new(self.config)
        return from_genome(genome, self.config.num_inputs)

    def mutate(self, parent: Controller, rng: Random) -> Controller:
        """Return a mutated copy: NEAT's structural mutations, then weights and biases.

        A network that would grow too large for a controller grows no further.
        """
        self.config.node_indexer = self._count_nodes()
        with lend_random(rng):
            genome = to_genome(parent, self.config, self.kind)
            genome.mutate(self.config)
            if not is_within_limits(genome.nodes, genome.connections):
                genome = to_genome(parent, self.config, self.kind)
                with self._without_growth():
                    genome.mutate(self.config)
        return from_genome(genome, self.config.num_inputs)

    @contextlib.contextmanager
    def _without_growth(self) -> Iterator[None]:
        names = ("node_add_prob", "conn_add_prob")
        usual = {name: getattr(self.config, name) for name in names}
        for name in names:
            setattr(self.config, name, 0.0)
        try:
            yield
        finally:
            for name, value in usual.items():
                setattr(self.config, name, value)

    def cross(self, fitter: Controller, other: Controller, rng: Random) -> Controller:
        """Return a child of two controllers.

        Links of one innovation (in version 0.92, between the same nodes) and nodes of one key come from
        either; what only one has, from the fitter.
        """
        parents = [to_genome(c, self.config) for c in (fitter, other)]
        parents[0].fitness, parents[1].fitness = 1.0, 0.0
        child = self.kind(0)
        with lend_random(rng):
            child.configure_crossover(*parents, self.config)
        return from_genome(child, self.config.num_inputs)

    def next_node(self) -> int:
        """Return the number of a new hidden neuron."""
        return next(self._count_nodes())

    def next_innovation(self) -> int:
        """Return the number of a new link."""
        self.config.innovation_tracker.global_counter += 1
        return int(self.config.innovation_tracker.global_counter)

    def new_generation(self) -> None:
        """Forget which innovations arose together: equal ones share a number within a generation."""
        self.config.innovation_tracker.reset_generation()

    def count_beyond(self, controllers: Iterable[Controller]) -> None:
        """Give no new node or innovation a number that one of some controllers has."""
        for c in controllers:
            self._next_node = max(self._next_node, *(1 + n.key for n in c.nodes))
            tracker = self.config.innovation_tracker
            innovations = (link.innovation for link in c.connections)
            tracker.global_counter = max(tracker.global_counter, *innovations, 0)

    def state(self) -> dict[str, int]:
        """Return the counters, to be stored at the end of a generation."""
        return {
            "next_node": self._next_node,
            "innovations": self.config.innovation_tracker.global_counter,
        }

    def restore(self, state: dict[str, int]) -> None:
        """Set the counters to what ``state`` returned."""
        self._next_node = state["next_node"]
        self.config.innovation_tracker = InnovationTracker(state["innovations"])

    def _count_nodes(self) -> Iterator[int]:
        while True:
            self._next_node += 1
            yield self._next_node - 1


def to_genome(
    controller: Controller, config: DefaultGenomeConfig, kind: type[neat.DefaultGenome] = neat.DefaultGenome
) -> neat.DefaultGenome:
    """Return a NEAT-Python genome, of one of its kinds, equal to a controller."""
    genome = kind(0)
    for n in controller.nodes:
        gene = config.node_gene_type(n.key)
        gene.bias, gene.response = n.bias, n.response
        gene.activation, gene.aggregation, gene.time_constant = "logistic", "sum", 1.0
        genome.nodes[n.key] = gene
    for c in controller.connections:
        key = (c.source, c.target)
        link = config.connection_gene_type(key, innovation=c.innovation)
        link.weight, link.enabled = c.weight, c.enabled
        genome.connections[key] = link
    return genome


def from_genome(genome: neat.DefaultGenome, n_inputs: int) -> Controller:
    """Return a controller equal to a NEAT-Python genome."""
    return Controller(
        n_inputs=n_inputs,
        nodes=tuple(NodeGene(k, g.bias, g.response) for k, g in genome.nodes.items()),
        connections=tuple(
            ConnectionGene(k[0], k[1], g.weight, g.enabled, g.innovation)
            for k, g in genome.connections.items()
        ),
    )


def _gauss(mu: float = 0.0, sigma: float = 1.0) -> float:
    """Draw from Python's global generator what its own ``gauss`` draws, with the same bits everywhere.

    That function asks the C library for a logarithm, a sine and a cosine, whose last bit may differ from one
    computer to another; this one rounds them to the nearest double.
    """
    generator = random.gauss.__self__  # type: ignore[attr-defined]
    z, generator.gauss_next = generator.gauss_next, None
    if z is None:
        cosine, sine = cosine_and_sine(random.random() * math.tau)
        radius = math.sqrt(-2.0 * logarithm(1.0 - random.random()))
        z, generator.gauss_next = cosine * radius, sine * radius
    return mu + z * sigma


neat.attributes.gauss = _gauss


@contextlib.contextmanager
def lend_random(rng: Random) -> Iterator[None]:
    """Return a context in which Python's global ``random`` draws from a generator; it restores its state."""
    outside = random.getstate()
    random.setstate(rng.getstate())
    try:
        yield
    finally:
        rng.setstate(random.getstate())
        random.setstate(outside)
