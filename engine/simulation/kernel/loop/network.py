"""A controller's network, evaluated for all lanes at once; they share its weights.

A node's value is logistic(sum + bias). The sum begins with 0 and adds value times weight source by source:
the inputs in their order, then the hidden nodes in the order of their evaluation. ``NetworkBatch`` of
``engine.control.network`` adds in the same order: the two differ by the rounding of the exponential alone.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from engine.control.genome import Controller
from engine.control.network import Plan
from engine.simulation.kernel.lanes.compiling import inlined
from engine.simulation.kernel.lanes.simd import Real, Reals, load, maximum, minimum, splat, store
from engine.simulation.kernel.lanes.transcendental import exponential

LIMIT: Final = 60.0
"""Sums beyond this are taken for this: the logistic function is then 0 or 1 to rounding."""


class Network(NamedTuple):
    """A network's links, node by node: hidden nodes in the order of their evaluation, then outputs.

    Attributes:
        first: (nodes + 1,) where the links into each node begin; the last is how many links there are.
        source: (links,) where each link comes from: an input, or the number of inputs plus a hidden node.
        weight: (links,) of each link, times the response of the node it leads to.
        bias: (nodes,) of each node.
        n_inputs: how many numbers the network takes.
    """

    first: np.ndarray
    source: np.ndarray
    weight: np.ndarray
    bias: np.ndarray
    n_inputs: int


def compile_network(controller: Controller, n_outputs: int) -> Network:
    """Return the part of a controller's network that its first ``n_outputs`` outputs depend on."""
    plan = Plan(controller, n_outputs)
    return Network(plan.first, plan.source, plan.weight, plan.bias, controller.n_inputs)


def no_network() -> Network:
    """Return a network without nodes."""
    numbers = np.zeros(0)
    return Network(np.zeros(1, np.int64), np.zeros(0, np.int64), numbers, numbers, 0)


@inlined
def logistic(x: Real) -> Real:
    """Return 1 / (1 + exp(-x)), at most 3 ulp off for x up to ``LIMIT`` in size, beyond which it stays."""
    return 1.0 / (1.0 + exponential(-maximum(minimum(x, LIMIT), -LIMIT)))


@inlined
def activate(network: Network, values: Reals) -> None:
    """Evaluate a network.

    Args:
        network: the network.
        values: (inputs + nodes,) vectors: the inputs, which must be there, and room for the nodes' values.
    """
    n = network.n_inputs
    for node in range(len(network.bias)):
        total = splat(values, 0.0)
        for link in range(network.first[node], network.first[node + 1]):
            total = total + load(values, network.source[link]) * network.weight[link]
        store(values, n + node, logistic(total + network.bias[node]))
