"""Controllers compiled for evaluating many different networks at once on arrays."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Final

import numpy as np

from engine.control.genome import N_OUTPUTS, Controller

SILENT: Final = -60.0
"""A bias that makes an output 0 to rounding: the logistic function of it is 1e-26."""


def silenced(controller: Controller) -> Controller:
    """Return a controller as NEAT-Python 0.92 evaluates it: what lacks an input is 0.

    There a neuron is evaluated after all that it has enabled links from. One without an enabled link is never
    evaluated, nor is any that hangs on it, and an output that is not evaluated is 0. In version 2 the neuron
    is the logistic function of its bias.
    """
    outgoing: dict[int, list[int]] = {}
    waiting: dict[int, int] = {}
    for c in controller.connections:
        if c.enabled:
            outgoing.setdefault(c.source, []).append(c.target)
            waiting[c.target] = waiting.get(c.target, 0) + 1
    evaluated = {-1 - i for i in range(controller.n_inputs)}
    ready = list(evaluated)
    while ready:
        for target in outgoing.get(ready.pop(), []):
            waiting[target] -= 1
            if not waiting[target]:
                evaluated.add(target)
                ready.append(target)
    silent = set(range(N_OUTPUTS)) - evaluated
    if not silent:
        return controller
    return Controller(
        n_inputs=controller.n_inputs,
        nodes=tuple(dataclasses.replace(n, bias=SILENT) if n.key in silent else n for n in controller.nodes),
        connections=tuple(c for c in controller.connections if c.target not in silent),
    )


class NetworkBatch:
    """Several networks, evaluated together.

    The order of summation depends on the network alone, so its outputs are the same bits whichever networks
    share the batch. Work and memory grow with the number of links.

    Args:
        controllers: the networks, all with the same number of inputs.
        n_outputs: how many of the 20 outputs to compute.
    """

    def __init__(self, controllers: Sequence[Controller], *, n_outputs: int = N_OUTPUTS) -> None:
        plans = [Plan(c, n_outputs) for c in controllers]
        self.n_inputs = n = controllers[0].n_inputs
        # one row of values for each input and node, one network after the other
        begins = np.cumsum([0, *(n + len(plan.bias) for plan in plans)])
        self._n_rows = int(begins[-1])
        self._inputs = begins[:-1, None] + np.arange(n)
        self._outputs = begins[1:, None] + np.arange(-n_outputs, 0)
        parts = list(zip(begins.tolist(), plans, strict=False))
        row = np.concatenate([begin + n + np.arange(len(plan.bias)) for begin, plan in parts])
        bias = np.concatenate([plan.bias for plan in plans])
        n_links = np.concatenate([np.diff(plan.first) for plan in plans])
        source = np.concatenate([begin + plan.source for begin, plan in parts])
        weight = np.concatenate([plan.weight for plan in plans])
        first = np.cumsum([0, *n_links.tolist()])
        # the outputs come last: some have no links, some lead from the deepest hidden nodes
        deepest = max(plan.depth for plan in plans)
        levels = [[*(plan.level[k] for k in plan.hidden), *[deepest + 1] * n_outputs] for plan in plans]
        level = np.concatenate(levels)
        self._layers = []
        for number in range(1, deepest + 2):
            nodes = np.flatnonzero(level == number)
            nodes = nodes[np.argsort(-n_links[nodes], kind="stable")]  # those with most links first
            self._layers.append(_Layer(row[nodes], bias[nodes], n_links[nodes], first[nodes], source, weight))

    def activate(self, inputs: np.ndarray) -> np.ndarray:
        """Evaluate every network on its own inputs.

        Args:
            inputs: (networks, samples, n_inputs) array.

        Returns:
            (networks, samples, n_outputs) array of outputs, each in (0, 1).
        """
        return np.ascontiguousarray(self.values(inputs)[self._outputs].transpose(0, 2, 1))

    def values(self, inputs: np.ndarray) -> np.ndarray:
        """Evaluate every network on its own inputs and return all its values.

        Args:
            inputs: (networks, samples, n_inputs) array.

        Returns:
            (rows, samples) values: of each network its inputs, then the hidden nodes that its outputs depend
            on, in the order of ``Plan.hidden``, then its outputs.
        """
        values = np.empty((self._n_rows, inputs.shape[1]))
        values[self._inputs] = inputs.transpose(0, 2, 1)
        for layer in self._layers:
            layer.evaluate(values)
        return values


class _Layer:
    """Nodes that depend on inputs and earlier layers alone.

    Args:
        row: (nodes,) where their values are.
        bias: (nodes,) of each.
        n_links: (nodes,) that lead to each, falling.
        first: (nodes,) index of the first of them; the others of a node follow it.
        source, weight: (links,) of all links.
    """

    def __init__(
        self,
        row: np.ndarray,
        bias: np.ndarray,
        n_links: np.ndarray,
        first: np.ndarray,
        source: np.ndarray,
        weight: np.ndarray,
    ) -> None:
        self._row, self._bias = row, bias[:, None]
        self._steps = []
        for k in range(max(n_links, default=0)):
            links = first[: np.count_nonzero(n_links > k)] + k
            self._steps.append((source[links], weight[links, None]))

    def evaluate(self, values: np.ndarray) -> None:
        """Set the nodes' values to logistic(bias + weighted sum), added up in the order of their sources."""
        total = np.zeros((len(self._row), values.shape[1]))
        for source, weight in self._steps:
            total[: len(source)] += values[source] * weight
        total += self._bias
        np.clip(total, -60.0, 60.0, out=total)
        values[self._row] = 1.0 / (1.0 + np.exp(-total))


class Network:
    """One controller's expressed network, neuron by neuron, as a ``NetworkBatch`` evaluates it.

    Args:
        controller: the genotype.
        n_modules: how many modules it drives; the other outputs are left out.
    """

    def __init__(self, controller: Controller, n_modules: int) -> None:
        plan = Plan(controller, 2 * n_modules)
        self._batch = NetworkBatch([controller], n_outputs=2 * n_modules)
        self.n_inputs = controller.n_inputs
        self.outputs = list(range(2 * n_modules))
        """Keys of the outputs."""
        self.levels = {k: plan.level[k] for k in plan.hidden}
        """By key of a hidden node that some output depends on, how many links lie between it and the inputs
        at the most."""

    def neurons(self, sensed: np.ndarray) -> dict[int, float]:
        """Return the activation, in (0, 1), of every hidden node and output by its key.

        Args:
            sensed: (n_inputs,) what the controller senses.
        """
        values = self._batch.values(np.asarray(sensed, dtype=float)[None, None])[self.n_inputs :, 0]
        return dict(zip([*self.levels, *self.outputs], values.tolist(), strict=True))


class Plan:
    """One network's expressed part: hidden nodes in topological order, then outputs, and the links into each.

    Args:
        controller: the network.
        n_outputs: how many of the 20 outputs are wanted; nodes that only the others depend on are left out.

    Attributes:
        hidden: keys of the H hidden nodes that are used, each after all that it depends on.
        level: by key of a node that is used, links on the longest way to it from an input.
        depth: the largest level of a hidden node.
        bias: (H + n_outputs,) of the hidden nodes, then of the outputs.
        first: (H + n_outputs + 1,) where the links into each of them begin; the last is how many there are.
        source: (links,) where each comes from: an input, or n_inputs plus a hidden node. Those of one node
            rise.
        weight: (links,) of each, times the response of the node it leads to; never 0.
    """

    def __init__(self, controller: Controller, n_outputs: int) -> None:
        genes = {n.key: n for n in controller.nodes}
        links = [(c.source, c.target, c.weight) for c in controller.connections if c.enabled]
        incoming: dict[int, list[int]] = {}
        for source, target, _ in links:
            incoming.setdefault(target, []).append(source)
        level: dict[int, int] = {}
        # the nodes that the wanted outputs depend on, depth first without recursion
        stack = list(range(n_outputs))
        while stack:
            node = stack[-1]
            sources = [s for s in incoming.get(node, []) if s >= 0]
            waiting = [s for s in sources if s not in level]
            if waiting:
                stack.extend(waiting)
            else:
                level[node] = 1 + max((level[s] for s in sources), default=0)
                stack.pop()
        self.level = level
        self.hidden = sorted((k for k in level if k >= N_OUTPUTS), key=lambda k: (level[k], k))
        self.depth = max((level[k] for k in self.hidden), default=0)
        order = [*self.hidden, *range(n_outputs)]
        place = {k: i for i, k in enumerate(order)}
        value = {-1 - i: i for i in range(controller.n_inputs)}
        value |= {k: controller.n_inputs + i for i, k in enumerate(self.hidden)}
        used = sorted(
            (place[target], value[source], weight * genes[target].response)
            for source, target, weight in links
            if target in place and weight * genes[target].response
        )
        self.bias = np.array([genes[k].bias for k in order], dtype=float)
        self.first = np.searchsorted([node for node, _, _ in used], np.arange(len(order) + 1))
        self.source = np.array([source for _, source, _ in used], dtype=np.int64)
        self.weight = np.array([weight for _, _, weight in used], dtype=float)
