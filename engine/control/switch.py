"""Two controllers in one: the first acts while the target is at the left, the second while it is right.

Three neurons tell the sides apart. Everything else is copied from the two networks, and each copied neuron is
held down by the neuron of the other side, so that the networks never act together. Close to straight ahead
one hands over to the other within some degrees.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from engine.control.genome import MAX_POWER, N_OUTPUTS, ConnectionGene, Controller, NodeGene

MOST_HIDDEN: Final = 60
"""Hidden neurons of the largest network that is made: those of a switch of switches would double for ever."""
_STEEP: Final = MAX_POWER
"""Weight of a link that decides. 30 x 30 / 4 times the input passes through the sides' neurons, which turns
within 3 degrees where the bearing is told as a part of pi."""
_LINEAR: Final = 4.0
"""A neuron without bias is 0.5 + input / 4 near 0, so that its output, times this, is the input."""


def switched(
    left: Controller,
    right: Controller,
    *,
    bearing: int,
    new_node: Callable[[], int],
    new_innovation: Callable[[], int],
) -> Controller | None:
    """Join two controllers by the side that the target is at.

    The parts of each that no output depends on are left out, and so are disabled links.

    Args:
        left: acts while the bearing is above 0.
        right: acts while it is below.
        bearing: which input is the bearing of the target, positive at the left.
        new_node: returns the number of a new neuron.
        new_innovation: returns that of a new link.

    Returns:
        The controller, or None if it would have more than ``MOST_HIDDEN`` hidden neurons.
    """
    parts = [(left, _used(left)), (right, _used(right))]
    if len(_TELLING) + sum(len(used) for _, used in parts) > MOST_HIDDEN:
        return None
    side, at_left, at_right = (new_node() for _ in _TELLING)
    nodes = dict(zip((side, at_left, at_right), _TELLING, strict=True))
    weights = {
        (-1 - bearing, side): _STEEP,
        (side, at_left): _STEEP,
        (side, at_right): -_STEEP,
    }

    def link(source: int, target: int, weight: float) -> None:
        weights[source, target] = weights.get((source, target), 0.0) + weight

    for (controller, used), own, other in zip(parts, (at_left, at_right), (at_right, at_left), strict=True):
        genes = {n.key: n for n in controller.nodes}
        copy = {k: new_node() for k in used}
        for k, new in copy.items():
            nodes[new] = genes[k].bias
            link(other, new, -_STEEP)
        for o in range(N_OUTPUTS):
            link(own, o, genes[o].bias)
        through: dict[int, int] = {}
        for c in controller.connections:
            if not c.enabled or (c.target >= N_OUTPUTS and c.target not in copy):
                continue
            weight = c.weight * genes[c.target].response
            if c.target >= N_OUTPUTS:
                link(copy.get(c.source, c.source), copy[c.target], weight)
            elif c.source >= 0:
                link(copy[c.source], c.target, weight)
            else:
                # from an input straight to an output: through a neuron, which can be held down
                if c.source not in through:
                    through[c.source] = new_node()
                    nodes[through[c.source]] = 0.0
                    link(c.source, through[c.source], 1.0)
                    link(other, through[c.source], -_STEEP)
                weight = min(max(weight, -MAX_POWER / _LINEAR), MAX_POWER / _LINEAR)
                link(through[c.source], c.target, _LINEAR * weight)
                link(own, c.target, -_LINEAR / 2.0 * weight)
    biases = dict.fromkeys(range(N_OUTPUTS), 0.0) | nodes
    return Controller(
        n_inputs=left.n_inputs,
        nodes=tuple(NodeGene(key, _within(bias)) for key, bias in sorted(biases.items())),
        connections=tuple(
            ConnectionGene(*ends, _within(weight), True, new_innovation()) for ends, weight in weights.items()
        ),
    )


_TELLING: Final = (0.0, -_STEEP / 2.0, _STEEP / 2.0)
"""Biases of the neurons that tell the sides apart: which side, at the left, at the right."""


def _used(controller: Controller) -> list[int]:
    """Return the hidden neurons that an output depends on."""
    incoming: dict[int, list[int]] = {}
    for c in controller.connections:
        if c.enabled and c.source >= N_OUTPUTS:
            incoming.setdefault(c.target, []).append(c.source)
    found, waiting = set(), list(range(N_OUTPUTS))
    while waiting:
        for source in incoming.get(waiting.pop(), []):
            if source not in found:
                found.add(source)
                waiting.append(source)
    return sorted(found)


def _within(value: float) -> float:
    """Return a bias or weight within NEAT's range."""
    return min(max(value, -MAX_POWER), MAX_POWER)
