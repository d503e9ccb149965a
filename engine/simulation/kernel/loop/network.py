"""Controllers' networks, evaluated for all lanes at once. Every network has the lanes of its robot.

A node's value is logistic(sum + bias). The sum begins with 0 and adds value times weight source by source:
the inputs in their order, then the hidden nodes in the order of their evaluation. ``NetworkBatch`` of
``engine.control.network`` adds in the same order: the two differ by the rounding of the exponential alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from engine.control.genome import Controller
from engine.control.network import Plan
from engine.simulation.kernel.lanes.compiling import inlined
from engine.simulation.kernel.lanes.simd import (
    Integers,
    Real,
    Reals,
    by_lane,
    integers,
    load,
    maximum,
    minimum,
    splat,
    store,
)
from engine.simulation.kernel.lanes.transcendental import exponential

LIMIT: Final = 60.0
"""Sums beyond this are taken for this: the logistic function is then 0 or 1 to rounding."""


class Networks(NamedTuple):
    """Links of networks, by network and node: hidden nodes in the order of their evaluation, then outputs.

    Attributes:
        first: (nodes + 1,) where the links into each node begin; the last is how many links there are.
        source: (links,) where each link comes from: an input, or the number of inputs plus a node.
        weight: (links,) of each link, times the response of the node it leads to.
        bias: (nodes,) of each node.
        n_inputs: how many numbers each network takes.
        end: (networks,) the node after a network's last.
        lanes: (networks,) vectors of integers: 1 in the lanes that a network drives.
    """

    first: np.ndarray
    source: np.ndarray
    weight: np.ndarray
    bias: np.ndarray
    n_inputs: int
    end: np.ndarray
    lanes: Integers


def compile_networks(controllers: Sequence[Controller], lanes: np.ndarray, n_outputs: int) -> Networks:
    """Return the parts of networks that their first ``n_outputs`` outputs depend on.

    Args:
        controllers: whose networks; all take equally many numbers.
        lanes: (controllers, lanes) whether one drives a lane.
        n_outputs: how many outputs.
    """
    plans = [Plan(c, n_outputs) for c in controllers]
    n_inputs, n_nodes = controllers[0].n_inputs, 0
    counts, sources, weights, ends = [], [], [], []
    for plan in plans:
        counts.append(np.diff(plan.first))
        weights.append(plan.weight)
        sources.append(np.where(plan.source < n_inputs, plan.source, plan.source + n_nodes))
        n_nodes += len(plan.bias)
        ends.append(n_nodes)
    driven = integers(*lanes.shape[:1], width=lanes.shape[1])
    by_lane(driven)[:] = lanes
    return Networks(
        first=np.concatenate([[0], np.cumsum(np.concatenate(counts))]),
        source=np.concatenate(sources),
        weight=np.concatenate(weights),
        bias=np.concatenate([plan.bias for plan in plans]),
        n_inputs=n_inputs,
        end=np.array(ends),
        lanes=driven,
    )


def no_networks(width: int) -> Networks:
    """Return no networks."""
    whole, numbers = np.zeros(0, np.int64), np.zeros(0)
    return Networks(np.zeros(1, np.int64), whole, numbers, numbers, 0, whole, integers(0, width=width))


@inlined
def logistic(x: Real) -> Real:
    """Return 1 / (1 + exp(-x)), at most 3 ulp off for x up to ``LIMIT`` in size, beyond which it stays."""
    return 1.0 / (1.0 + exponential(-maximum(minimum(x, LIMIT), -LIMIT)))


@inlined
def activate(networks: Networks, values: Reals) -> None:
    """Evaluate networks, each in all lanes.

    Args:
        networks: the networks.
        values: (inputs + nodes,) vectors: the inputs, which must be there, and room for the nodes' values.
    """
    n = networks.n_inputs
    for node in range(len(networks.bias)):
        total = splat(values, 0.0)
        for link in range(networks.first[node], networks.first[node + 1]):
            total = total + load(values, networks.source[link]) * networks.weight[link]
        store(values, n + node, logistic(total + networks.bias[node]))
