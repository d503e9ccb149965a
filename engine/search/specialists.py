"""Which controllers of one body do best for targets at its left, and for targets at its right."""

from __future__ import annotations

import dataclasses
import random
from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np

from engine.body.morphology import Morphology
from engine.search.algorithm import Recall
from engine.search.archive import Cell, cell_name, parse_cell
from engine.search.variation import Specialists
from engine.simulation.evaluation import Evaluation

BODIES: Final = 8
"""Bodies that are remembered for each cell of the morphology map: those whose specialists promise most."""


@dataclasses.dataclass(frozen=True, slots=True)
class Sides:
    """How a task tells left from right.

    Attributes:
        bearing: which input of the controllers is the bearing of the target, positive at the left.
        left, right: which targets lie at which side; both have those straight ahead.
    """

    bearing: int
    left: tuple[int, ...]
    right: tuple[int, ...]

    def remaining(self, e: Evaluation) -> tuple[float, float]:
        """Return the mean remaining distances to the targets at the left and at the right, in m."""
        by_target = e.distances.mean(axis=1)
        left, right = (float(np.mean(by_target[list(side)])) for side in (self.left, self.right))
        return left, right


@dataclasses.dataclass(slots=True)
class _Pair:
    """The specialists of a body, and whether they have been joined."""

    left: Evaluation
    right: Evaluation
    joined: bool = False


class SpecialistMemory:
    """Remembers specialists by the cells of the morphology map.

    Args:
        sides: how the task tells left from right.
    """

    def __init__(self, sides: Sides) -> None:
        self.sides = sides
        self._pairs: dict[Cell, dict[Morphology, _Pair]] = {}

    def tell(self, cell: Cell, e: Evaluation) -> None:
        """Take in an evaluation that did not fail, of a body of a cell."""
        bodies = self._pairs.setdefault(cell, {})
        pair = bodies.setdefault(e.solution.morphology, _Pair(e, e))
        left, right = self.sides.remaining(e)
        if left < self.sides.remaining(pair.left)[0]:
            pair.left, pair.joined = e, False
        if right < self.sides.remaining(pair.right)[1]:
            pair.right, pair.joined = e, False
        if len(bodies) > BODIES:
            del bodies[max(bodies, key=lambda body: self._promise(bodies[body]))]

    def draw(self, cell: Cell, rng: random.Random) -> Specialists | None:
        """Return the specialists of a body of a cell, or None if no body has two.

        First those that have not been joined, the most promising first; then any.
        """
        pairs = [p for p in self._pairs.get(cell, {}).values() if p.left is not p.right]
        if not pairs:
            return None
        new = [p for p in pairs if not p.joined]
        pair = min(new, key=self._promise) if new else rng.choice(pairs)
        again, pair.joined = pair.joined, True
        return Specialists(pair.left.solution, pair.right.solution, again)

    def state(self) -> dict[str, list[list[int]]]:
        """Return what ``restore`` needs, JSON-ready: by cell every pair's numbers, and if it was joined."""
        return {
            cell_name(cell): [
                [p.left.solution.number, p.right.solution.number, int(p.joined)] for p in bodies.values()
            ]
            for cell, bodies in self._pairs.items()
        }

    def restore(self, state: Mapping[str, Any], recall: Recall) -> None:
        """Go back to what ``state`` returned."""
        known = recall(
            {int(n) for pairs in state.values() for left, right, _ in pairs for n in (left, right)}
        )
        self._pairs = {
            parse_cell(cell): {
                known[left].solution.morphology: _Pair(known[left], known[right], bool(joined))
                for left, right, joined in pairs
            }
            for cell, pairs in state.items()
        }

    def _promise(self, pair: _Pair) -> float:
        """Return the distance in m that would remain in the mean if both specialists kept their word."""
        return self.sides.remaining(pair.left)[0] + self.sides.remaining(pair.right)[1]


def sides_of(inputs: Sequence[str], bearings: Sequence[float]) -> Sides | None:
    """Return how a task tells left from right, or None if it does not.

    Args:
        inputs: the names of what its controllers sense.
        bearings: of its targets, in rad, positive at the left.
    """
    if "bearing" not in inputs:
        return None
    left = tuple(k for k, b in enumerate(bearings) if b >= 0.0)
    right = tuple(k for k, b in enumerate(bearings) if b <= 0.0)
    if not left or not right:
        return None
    return Sides(inputs.index("bearing"), left, right)
