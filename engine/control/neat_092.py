"""The operators of NEAT-Python 0.92, which the paper used, where those of version 2 differ.

- A **link** is added between two nodes drawn from all of them. Version 2 leaves the outputs out of those that
  it may come from. With two inputs and three hidden nodes it adds a link from an input to an output five
  times as often.
- An added **node** has a random bias, in version 2 a bias of 0.
- **Crossover** lines links up by the nodes that they join, version 2 by innovation numbers; and where a link
  is disabled in a parent, version 2 disables it in three of four children.

In 0.92 a link could also lead from an output to a hidden node, if that closed no circle. Controllers cannot
hold such a link, and none is added.
"""

from __future__ import annotations

from collections.abc import Sequence
from random import choice, random
from typing import Any

import neat
from neat.graphs import creates_cycle


class Genome092(neat.DefaultGenome):
    """A genome of NEAT-Python 2 with the operators of 0.92."""

    def mutate_add_connection(self, config: Any) -> None:
        """Try to add a link between two nodes, the first of which may be an input."""
        key = (source, target) = self._draw_link(config)
        if key in self.connections or source in config.output_keys:
            return
        if creates_cycle(list(self.connections), key):
            return
        innovation = config.innovation_tracker.get_innovation_number(source, target, "add_connection")
        self.connections[key] = self.create_connection(config, source, target, innovation)

    def mutate_add_node(self, config: Any) -> None:
        """Add a node in the middle of a link."""
        before = set(self.nodes)
        super().mutate_add_node(config)
        for key in self.nodes.keys() - before:
            self.nodes[key].bias = self.create_node(config, key).bias

    def configure_crossover(self, genome1: Any, genome2: Any, config: Any) -> None:  # noqa: ARG002
        """Become the child of two genomes; what only one has comes from the fitter, on a tie the second."""
        fitter, other = (genome1, genome2) if genome1.fitness > genome2.fitness else (genome2, genome1)
        for ours, theirs, mine, attributes in (
            (fitter.connections, other.connections, self.connections, ("weight", "enabled")),
            (fitter.nodes, other.nodes, self.nodes, ("bias", "response")),
        ):
            for key, gene in ours.items():
                mine[key] = gene.copy()
                if key in theirs:
                    _cross(mine[key], theirs[key], attributes)

    def _draw_link(self, config: Any) -> tuple[int, int]:
        target = choice(list(self.nodes))
        return choice([*self.nodes, *config.input_keys]), target


def _cross(gene: Any, other: Any, attributes: Sequence[str]) -> None:
    """Give a gene about half of its attributes from another; it keeps its innovation number."""
    for name in attributes:
        if random() <= 0.5:
            setattr(gene, name, getattr(other, name))
