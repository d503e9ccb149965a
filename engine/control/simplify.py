"""A network without the neurons that never change while what it senses stays within limits."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import Final

from engine.control.genome import N_OUTPUTS, Controller, logistic, within_range
from engine.control.network import Plan

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
    limits, still = list(senses), {}
    for k, key in enumerate(plan.hidden):
        own = slice(plan.first[k], plan.first[k + 1])
        links = zip(plan.weight[own].tolist(), plan.source[own].tolist(), strict=True)
        ends = [_ends(weight, limits[source]) for weight, source in links]
        least, most = (
            logistic(float(plan.bias[k]) + math.fsum(end[side] for end in ends)) for side in (0, 1)
        )
        limits.append((least, most))
        if most - least < STILL:
            still[key] = (least + most) / 2.0
    genes = {n.key: n for n in controller.nodes}
    outputs, inputs = set(range(N_OUTPUTS)), {-1 - i for i in range(controller.n_inputs)}
    kept = {k for k in plan.hidden if k not in still} | outputs
    shift = dict.fromkeys(kept, 0.0)
    for c in controller.connections:
        if c.enabled and c.target in kept and c.source in still:
            shift[c.target] += genes[c.target].response * c.weight * still[c.source]
    smaller = Controller(
        n_inputs=controller.n_inputs,
        nodes=tuple(
            dataclasses.replace(n, bias=within_range(n.bias + shift[n.key]))
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


def _ends(weight: float, limits: Range) -> Range:
    """Return the limits of something times a weight."""
    a, b = weight * limits[0], weight * limits[1]
    return min(a, b), max(a, b)
