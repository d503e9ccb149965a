"""A network without the neurons that never change while what it senses stays within limits."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import Final

from engine.control.genome import MAX_POWER, N_OUTPUTS, Controller
from engine.control.network import Plan
from engine.exact import exponential

Range = tuple[float, float]
"""The least and the largest value of something."""
STILL: Final = 0.01
"""A neuron whose output changes by less counts as one that never changes."""


def simplified(controller: Controller, senses: Sequence[Range]) -> Controller:
    """Return a controller that gives nearly the same outputs with fewer neurons.

    Hidden neurons that no output depends on are left out, and so are those that hardly change, which become
    part of biases. What a neuron can be follows from the limits of what leads to it.

    Args:
        controller: the network.
        senses: (n_inputs,) the limits of each input.
    """
    plan = Plan(controller, N_OUTPUTS)
    genes = {n.key: n for n in controller.nodes}
    limits = {-1 - i: limit for i, limit in enumerate(senses)}
    incoming: dict[int, list[tuple[int, float]]] = {}
    for c in controller.connections:
        if c.enabled:
            incoming.setdefault(c.target, []).append((c.source, c.weight))
    still: dict[int, float] = {}
    for key in plan.hidden:
        ends = [_ends(weight, limits[source]) for source, weight in incoming.get(key, [])]
        sums = math.fsum(least for least, _ in ends), math.fsum(most for _, most in ends)
        least, most = sorted(_logistic(genes[key].bias + genes[key].response * s) for s in sums)
        limits[key] = (least, most)
        if most - least < STILL:
            still[key] = (least + most) / 2.0
    outputs, inputs = set(range(N_OUTPUTS)), {-1 - i for i in range(controller.n_inputs)}
    kept = {k for k in plan.hidden if k not in still} | outputs
    shift = dict.fromkeys(kept, 0.0)
    for c in controller.connections:
        if c.enabled and c.target in kept and c.source in still:
            shift[c.target] += genes[c.target].response * c.weight * still[c.source]
    smaller = Controller(
        n_inputs=controller.n_inputs,
        nodes=tuple(
            dataclasses.replace(n, bias=min(max(n.bias + shift[n.key], -MAX_POWER), MAX_POWER))
            for n in controller.nodes
            if n.key in kept
        ),
        connections=tuple(
            c for c in controller.connections if c.enabled and c.target in kept and c.source in kept | inputs
        ),
    )
    # what led to still neurons alone leads nowhere now
    used = outputs | set(Plan(smaller, N_OUTPUTS).hidden)
    return dataclasses.replace(
        smaller,
        nodes=tuple(n for n in smaller.nodes if n.key in used),
        connections=tuple(c for c in smaller.connections if c.target in used),
    )


def _logistic(z: float) -> float:
    """Return ``genome.logistic`` with the same bits everywhere: they become genes."""
    return 1.0 / (1.0 + exponential(-max(-60.0, min(60.0, z))))


def _ends(weight: float, limits: Range) -> Range:
    """Return the limits of something times a weight."""
    a, b = weight * limits[0], weight * limits[1]
    return min(a, b), max(a, b)
