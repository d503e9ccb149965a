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
    """Several networks, padded to one size, evaluated together.

    The order of summation depends on the network alone, so its outputs are the same bits whichever networks
    share the batch.

    Args:
        controllers: the networks, all with the same number of inputs.
        n_outputs: how many of the 20 outputs to compute.
    """

    def __init__(self, controllers: Sequence[Controller], *, n_outputs: int = N_OUTPUTS) -> None:
        plans = [Plan(c, n_outputs) for c in controllers]
        self.n_inputs = controllers[0].n_inputs
        self.hidden_keys = [tuple(p.hidden) for p in plans]
        """Per network the keys of the hidden nodes that its outputs depend on."""
        self._depth = max(p.depth for p in plans)
        n_hidden = max(len(p.hidden) for p in plans)
        shape = (len(plans), n_hidden)
        n_sources = self.n_inputs + n_hidden
        self._hidden_bias = np.zeros(shape)
        self._hidden_weights = np.zeros((n_sources, *shape))
        self._output_bias = np.zeros((len(plans), n_outputs))
        self._output_weights = np.zeros((n_sources, len(plans), n_outputs))
        for k, plan in enumerate(plans):
            h = len(plan.hidden)
            used = self.n_inputs + h
            self._hidden_bias[k, :h] = plan.bias[:h]
            self._hidden_weights[:used, k, :h] = plan.weights[:, :h]
            self._output_bias[k] = plan.bias[h:]
            self._output_weights[:used, k] = plan.weights[:, h:]

    def activate(self, inputs: np.ndarray) -> np.ndarray:
        """Evaluate every network on its own inputs.

        Args:
            inputs: (networks, samples, n_inputs) array.

        Returns:
            (networks, samples, n_outputs) array of outputs, each in (0, 1).
        """
        return self.activations(inputs)[1]

    def activations(self, inputs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Evaluate every network on its own inputs and return all its neurons.

        Args:
            inputs: (networks, samples, n_inputs) array.

        Returns:
            (networks, samples, n_hidden) hidden neurons, each network's in the order of ``hidden_keys`` and
            padded; (networks, samples, n_outputs) outputs. All in (0, 1).
        """
        n_hidden = self._hidden_bias.shape[1]
        hidden = np.zeros((*inputs.shape[:2], n_hidden))
        # hidden nodes `depth` links away from the inputs are final after `depth` sweeps
        for _ in range(self._depth):
            sources = np.concatenate([inputs, hidden], axis=2)
            hidden = _layer(sources, self._hidden_weights, self._hidden_bias)
        sources = np.concatenate([inputs, hidden], axis=2)
        return hidden, _layer(sources, self._output_weights, self._output_bias)


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
        hidden, outputs = self._batch.activations(np.asarray(sensed, dtype=float)[None, None])
        found = dict(zip(self._batch.hidden_keys[0], hidden[0, 0].tolist(), strict=False))
        return found | dict(zip(self.outputs, outputs[0, 0].tolist(), strict=True))


def _layer(sources: np.ndarray, weights: np.ndarray, bias: np.ndarray) -> np.ndarray:
    """Return logistic(bias + weighted sum), added up source by source."""
    total = np.zeros((*sources.shape[:2], bias.shape[1]))
    for j, w in enumerate(weights):
        total += sources[:, :, j, None] * w[:, None, :]
    total += bias[:, None, :]
    np.clip(total, -60.0, 60.0, out=total)
    return 1.0 / (1.0 + np.exp(-total))


class Plan:
    """One network's expressed part as dense arrays: hidden nodes in topological order, then outputs.

    Args:
        controller: the network.
        n_outputs: how many of the 20 outputs are wanted; nodes that only the others depend on are left out.

    Attributes:
        hidden: keys of the H hidden nodes that are used, each after all that it depends on.
        depth: links on the longest way from an input to a hidden node.
        bias: (H + n_outputs,) of the hidden nodes, then of the outputs.
        weights: (n_inputs + H, H + n_outputs) from the inputs and hidden nodes to hidden nodes and outputs,
            times the response of the node they lead to; 0 where there is no link.
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
        column = {k: i for i, k in enumerate(order)}
        row = {-1 - i: i for i in range(controller.n_inputs)}
        row |= {k: controller.n_inputs + i for i, k in enumerate(self.hidden)}
        self.bias = np.array([genes[k].bias for k in order])
        self.weights = np.zeros((controller.n_inputs + len(self.hidden), len(order)))
        for source, target, weight in links:
            if target in column:
                self.weights[row[source], column[target]] = weight * genes[target].response
