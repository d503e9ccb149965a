"""The controller's genotype: a NEAT genome, immutable here; ``operators`` draws, mutates and crosses it."""

from __future__ import annotations

import dataclasses
import sys
from collections.abc import Collection, Sequence
from typing import Any, Final, Self

from engine.body.module import MAX_MODULES
from engine.errors import InvalidData
from engine.exact import exponential

N_OUTPUTS: Final = 2 * MAX_MODULES
"""A frequency and a phase for each module of the largest robot."""
MAX_NODES: Final = 2_000
MAX_CONNECTIONS: Final = 20_000
MAX_DEPTH: Final = 200
"""Connections in a row. A network beyond one of the three costs too much to be shown: files may come from
strangers. Evolved ones have some 30 nodes, 80 connections and 3 in a row."""
MAX_POWER: Final = 30.0
"""Largest power of a mutation: the range of weights and biases."""


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


def is_within_limits(nodes: Collection[int], pairs: Collection[tuple[int, int]]) -> bool:
    """Tell whether a network is no larger than a controller may be.

    Args:
        nodes: the keys of its neurons.
        pairs: its connections, as source and target.

    Raises:
        InvalidData: they form a cycle.
    """
    return len(nodes) <= MAX_NODES and len(pairs) <= MAX_CONNECTIONS and _depth(pairs) <= MAX_DEPTH


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
