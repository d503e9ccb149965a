"""Two controllers in one: the first acts while its target is at the left, the second at the right.

Three neurons tell the sides apart. Everything else is copied from the two networks, and each copied neuron is
held down by the neuron of the other side, so that the networks never act together. Close to straight ahead
one hands over to the other within some degrees.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

from engine.control.genome import MAX_POWER, N_OUTPUTS, ConnectionGene, Controller, NodeGene, within_range
from engine.control.simplify import simplified

MOST_HIDDEN: Final = 60
"""Hidden neurons of the largest network that is made."""
EDGE: Final = 0.03
"""Part of the bearing's reach around straight ahead in which one network hands over to the other."""
_STEEP: Final = MAX_POWER
"""Weight of a link that decides. 30 x 30 / 4 times the input passes through the sides' neurons, which turns
within 3 degrees where the bearing is told as a part of pi."""
_TELLING: Final = (0.0, -_STEEP / 2.0, _STEEP / 2.0)
"""Biases of the neurons that tell the sides apart: which side, at the left, at the right."""
_LINEAR: Final = 4.0
"""A neuron without bias is 0.5 + input / 4 near 0, so that its output, times this, is the input."""


def switched(
    left: Controller,
    right: Controller,
    *,
    bearing: int,
    reach: Sequence[float],
    new_node: Callable[[], int],
    new_innovation: Callable[[], int],
) -> Controller | None:
    """Join two controllers by the side that the target is at.

    Neurons that never change while the target is at their side are left out: of a network that is a switch
    itself only one half remains.

    Args:
        left: acts while the bearing is above 0.
        right: acts while it is below.
        bearing: which input is the bearing of the target, positive at the left.
        reach: (n_inputs,) the largest magnitude of each input.
        new_node: returns the number of a new neuron.
        new_innovation: returns that of a new link.

    Returns:
        The controller, or None if it would have more than ``MOST_HIDDEN`` hidden neurons.
    """
    parts = [
        simplified(controller, _senses(reach, bearing, sign)) for controller, sign in ((left, 1), (right, -1))
    ]
    if len(_TELLING) + sum(len(part.nodes) - N_OUTPUTS for part in parts) > MOST_HIDDEN:
        return None
    side, at_left, at_right = (new_node() for _ in _TELLING)
    biases = dict.fromkeys(range(N_OUTPUTS), 0.0) | dict(
        zip((side, at_left, at_right), _TELLING, strict=True)
    )
    weights = {(-1 - bearing, side): _STEEP, (side, at_left): _STEEP, (side, at_right): -_STEEP}

    def link(source: int, target: int, weight: float) -> None:
        weights[source, target] = weights.get((source, target), 0.0) + weight

    for part, own, other in zip(parts, (at_left, at_right), (at_right, at_left), strict=True):
        response = {n.key: n.response for n in part.nodes}
        copy: dict[int, int] = {}
        for n in part.nodes:
            if n.key < N_OUTPUTS:
                link(own, n.key, n.bias)
            else:
                copy[n.key] = new_node()
                biases[copy[n.key]] = n.bias
                link(other, copy[n.key], -_STEEP)
        through: dict[int, int] = {}
        for c in part.connections:
            weight = c.weight * response[c.target]
            if c.source >= 0 or c.target >= N_OUTPUTS:
                link(copy.get(c.source, c.source), copy.get(c.target, c.target), weight)
                continue
            # from an input straight to an output: through a neuron, which can be held down
            if c.source not in through:
                through[c.source] = new_node()
                biases[through[c.source]] = 0.0
                link(c.source, through[c.source], 1.0)
                link(other, through[c.source], -_STEEP)
            weight = min(max(weight, -MAX_POWER / _LINEAR), MAX_POWER / _LINEAR)
            link(through[c.source], c.target, _LINEAR * weight)
            link(own, c.target, -_LINEAR / 2.0 * weight)
    return Controller(
        n_inputs=left.n_inputs,
        nodes=tuple(NodeGene(key, within_range(bias)) for key, bias in sorted(biases.items())),
        connections=tuple(
            ConnectionGene(*ends, within_range(weight), True, new_innovation())
            for ends, weight in weights.items()
        ),
    )


def _senses(reach: Sequence[float], bearing: int, sign: int) -> list[tuple[float, float]]:
    """Return the limits of the inputs while the target is at one side."""
    senses = [(-most, most) for most in reach]
    near, far = sorted((sign * EDGE * reach[bearing], sign * reach[bearing]))
    senses[bearing] = near, far
    return senses
