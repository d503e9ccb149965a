"""The controller's genotype: a NEAT genome, immutable here, evolved by NEAT-Python's own operators."""

from __future__ import annotations

import contextlib
import dataclasses
import math
import random
import sys
from collections.abc import Collection, Iterable, Iterator, Sequence
from random import Random
from typing import Any, Final, Literal, Self

import neat
from neat.genome import DefaultGenomeConfig
from neat.innovation import InnovationTracker

from engine.body.module import MAX_MODULES
from engine.control.neat_092 import Genome092
from engine.errors import InvalidData
from engine.exact import cosine_and_sine, exponential, logarithm

N_OUTPUTS: Final = 2 * MAX_MODULES
"""A frequency and a phase for each module of the largest robot."""
MAX_NODES: Final = 2_000
MAX_CONNECTIONS: Final = 20_000
MAX_DEPTH: Final = 200
"""Connections in a row. A network beyond one of the three costs too much to be shown: files may come from
strangers. Evolved ones have some 30 nodes, 80 connections and 3 in a row."""
MAX_HIDDEN: Final = 100
LEAST: Final = 0.001
"""Smallest rate and power of the biases. Every controller has biases, so every one can be mutated."""
MAX_POWER: Final = 30.0
"""Largest power of a mutation: the range of weights and biases."""

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


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class NeatRates:
    """How controllers begin and how NEAT mutates them. The defaults change a controller gently.

    Raises:
        InvalidData: a number is out of its range.
    """

    hidden: int = 3
    """Hidden neurons of a new network, between all inputs and all outputs; with 0, inputs lead to outputs."""
    weight_rate: float = 0.2
    """Probability, for each weight, that a Gaussian number is added to it."""
    weight_power: float = 0.2
    """Standard deviation of what is added to a weight."""
    weight_replace: float = 0.02
    """Probability, for each weight, that it is drawn anew."""
    bias_rate: float = 0.2
    """Probability, for each neuron's bias, that a Gaussian number is added to it."""
    bias_power: float = 0.2
    """Standard deviation of what is added to a bias."""
    bias_replace: float = 0.02
    """Probability, for each bias, that it is drawn anew."""
    link_add: float = 0.1
    """Probability that a link is added."""
    link_remove: float = 0.1
    """Probability that a link is removed."""
    link_toggle: float = 0.002
    """Probability, for each link, that chance decides anew whether it is enabled."""
    neuron_add: float = 0.04
    """Probability that a hidden neuron is added, in the middle of a link."""
    neuron_remove: float = 0.04
    """Probability that a hidden neuron is removed, with its links."""
    version: Literal["2.0", "0.92"] = "2.0"
    """NEAT-Python whose rules add links and neurons and cross controllers; 0.92 is the paper's."""

    def __post_init__(self) -> None:
        if not 0 <= self.hidden <= MAX_HIDDEN:
            raise InvalidData(f"hidden must be from 0 to {MAX_HIDDEN}, not {self.hidden}")
        for field in (f for f in dataclasses.fields(self) if f.type == "float"):
            least = LEAST if field.name in ("bias_rate", "bias_power", "weight_power") else 0.0
            most = MAX_POWER if field.name.endswith("power") else 1.0
            if not least <= getattr(self, field.name) <= most:
                raise InvalidData(
                    f"{field.name} must be from {least:g} to {most:g}, not {getattr(self, field.name)}"
                )
        for gene in ("weight", "bias"):
            if getattr(self, f"{gene}_rate") + getattr(self, f"{gene}_replace") > 1.0 + 1e-9:
                raise InvalidData(f"{gene}_rate and {gene}_replace must be at most 1 together")

    def parameters(self) -> dict[str, str]:
        """Return these numbers as NEAT-Python's parameters."""
        values = {
            "num_hidden": self.hidden,
            "conn_add_prob": self.link_add,
            "conn_delete_prob": self.link_remove,
            "node_add_prob": self.neuron_add,
            "node_delete_prob": self.neuron_remove,
            "weight_mutate_rate": self.weight_rate,
            "weight_mutate_power": self.weight_power,
            "weight_replace_rate": self.weight_replace,
            "bias_mutate_rate": self.bias_rate,
            "bias_mutate_power": self.bias_power,
            "bias_replace_rate": self.bias_replace,
            "enabled_mutate_rate": self.link_toggle,
        }
        return {name: str(value) for name, value in values.items()}


PUBLISHED_RATES: Final = NeatRates(
    weight_rate=0.8,
    weight_power=0.5,
    weight_replace=0.1,
    bias_rate=0.7,
    bias_power=0.5,
    bias_replace=0.1,
    link_add=0.5,
    link_remove=0.5,
    link_toggle=0.01,
    neuron_add=0.2,
    neuron_remove=0.2,
)
"""The rates of the authors' published configuration; ``paper`` has NEAT-Python 0.92 as well."""


_KINDS: Final = {"2.0": neat.DefaultGenome, "0.92": Genome092}


def logistic(z: float) -> float:
    """Return 1 / (1 + exp(-z)), the same bits everywhere. NEAT-Python's ``sigmoid`` is five times steeper."""
    return 1.0 / (1.0 + exponential(-max(-60.0, min(60.0, z))))


def within_range(value: float) -> float:
    """Return a bias or weight, or the end of NEAT's range that it lies beyond."""
    return min(max(value, -MAX_POWER), MAX_POWER)


@dataclasses.dataclass(frozen=True, slots=True)
class NodeGene:
    """A neuron: output keys are 0..19, hidden keys above; its output is logistic(bias + response x sum)."""

    key: int
    bias: float
    response: float = 1.0


@dataclasses.dataclass(frozen=True, slots=True)
class ConnectionGene:
    """A weighted link from a node (or an input, keys -1, -2, ...) to a node."""

    source: int
    target: int
    weight: float
    enabled: bool
    innovation: int


@dataclasses.dataclass(frozen=True, slots=True)
class Controller:
    """A feed-forward network's genotype. The order of its genes matters to NEAT's draws and is kept.

    Raises:
        InvalidData: genes are missing, repeated, dangling, cyclic or not finite.
    """

    n_inputs: int
    nodes: tuple[NodeGene, ...]
    connections: tuple[ConnectionGene, ...]

    def __post_init__(self) -> None:
        _validate(self)

    def to_json(self) -> dict[str, Any]:
        """Return the genotype as JSON-ready values; floats survive the trip exactly."""
        return {
            "n_inputs": self.n_inputs,
            "nodes": [[n.key, n.bias, n.response] for n in self.nodes],
            "connections": [
                [c.source, c.target, c.weight, c.enabled, c.innovation] for c in self.connections
            ],
        }

    def sensing(self, told: Sequence[str], tells: Sequence[str]) -> Self:
        """Return this controller for a task that senses other things: inputs keep their names.

        Links from inputs that the other task does not have are left out; its further inputs lead nowhere
        until a mutation links them.

        Args:
            told: the names of this controller's inputs.
            tells: the names of the other task's.
        """
        key_of = {-1 - i: -1 - tells.index(name) for i, name in enumerate(told) if name in tells}
        links = tuple(
            dataclasses.replace(link, source=key_of.get(link.source, link.source))
            for link in self.connections
            if link.source >= 0 or link.source in key_of
        )
        return dataclasses.replace(self, n_inputs=len(tells), connections=links)

    @classmethod
    def from_json(cls, data: Any) -> Self:
        """Read a genotype back from ``to_json``'s form.

        Raises:
            InvalidData: the data is not a genotype; the message says why.
        """
        if not isinstance(data, dict) or set(data) != {"n_inputs", "nodes", "connections"}:
            raise InvalidData("a controller needs exactly 'n_inputs', 'nodes' and 'connections'")
        try:
            nodes = tuple(NodeGene(*row) for row in data["nodes"])
            connections = tuple(ConnectionGene(*row) for row in data["connections"])
        except TypeError:
            raise InvalidData("a controller's genes do not have the expected fields") from None
        return cls(n_inputs=data["n_inputs"], nodes=nodes, connections=connections)


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
            if not _fits(genome):
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


def _fits(genome: neat.DefaultGenome) -> bool:
    """Tell whether a genome is no larger than a controller may be."""
    return (
        len(genome.nodes) <= MAX_NODES
        and len(genome.connections) <= MAX_CONNECTIONS
        and _depth(genome.connections) <= MAX_DEPTH
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


def _validate(c: Controller) -> None:
    if type(c.n_inputs) is not int or not 1 <= c.n_inputs <= 100:
        raise InvalidData(f"a controller has 1 to 100 inputs, not {c.n_inputs!r}")
    if len(c.nodes) > MAX_NODES or len(c.connections) > MAX_CONNECTIONS:
        raise InvalidData(
            f"a controller has at most {MAX_NODES} nodes and {MAX_CONNECTIONS} connections,"
            f" not {len(c.nodes)} and {len(c.connections)}"
        )
    for n in c.nodes:
        if type(n.key) is not int or not 0 <= n.key < 2**53:
            raise InvalidData(f"a node's key must be a whole number from 0, not {n.key!r}")
        _check_finite(n.bias, n.response)
    keys = {n.key for n in c.nodes}
    if len(keys) != len(c.nodes) or not keys.issuperset(range(N_OUTPUTS)):
        raise InvalidData(f"a controller needs each output node 0..{N_OUTPUTS - 1} once")
    sources = keys - set(range(N_OUTPUTS)) | {-1 - i for i in range(c.n_inputs)}
    seen: set[tuple[int, int]] = set()
    for link in c.connections:
        _check_finite(link.weight)
        if type(link.enabled) is not bool or type(link.innovation) is not int:
            raise InvalidData("a connection's 'enabled' is true or false, its innovation a number")
        pair = (link.source, link.target)
        if any(type(k) is not int for k in pair):
            raise InvalidData("a connection's ends must be whole numbers")
        if link.source not in sources or link.target not in keys or pair in seen:
            raise InvalidData(f"connection {pair} is repeated or does not join two of the nodes")
        seen.add(pair)
    if (depth := _depth(seen)) > MAX_DEPTH:
        raise InvalidData(f"a controller has at most {MAX_DEPTH} connections in a row, not {depth}")


def _depth(pairs: Collection[tuple[int, int]]) -> int:
    """Return how many connections, given as source and target, lie in a row at the most.

    Raises:
        InvalidData: they form a cycle.
    """
    incoming: dict[int, int] = {}
    outgoing: dict[int, list[int]] = {}
    for source, target in pairs:
        incoming[target] = incoming.get(target, 0) + 1
        outgoing.setdefault(source, []).append(target)
    ready = [k for k in outgoing if k not in incoming]
    level = dict.fromkeys(ready, 0)
    removed = 0
    while ready:
        node = ready.pop()
        for target in outgoing.get(node, []):
            removed += 1
            incoming[target] -= 1
            level[target] = max(level.get(target, 0), level[node] + 1)
            if not incoming[target]:
                ready.append(target)
    if removed != len(pairs):
        raise InvalidData("a controller's network must have no cycle")
    return max(level.values(), default=0)


def _check_finite(*values: Any) -> None:
    for v in values:
        # isfinite fails on whole numbers that are too large for a float
        if type(v) not in (float, int) or not abs(v) <= sys.float_info.max:
            raise InvalidData(f"a gene's value must be a finite number, not {v!r}")
