"""What a search remembers besides the fitness of its elites."""

from __future__ import annotations

import dataclasses
import math
import random
from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Any, Final, NamedTuple

from engine.body.morphology import Morphology
from engine.search.algorithm import Recall
from engine.search.archive import Cell, cell_name, fitness_of, parse_cell
from engine.search.variation import AGAIN, Specialists
from engine.simulation.evaluation import Evaluation, Solution
from engine.tasks.sides import Sides

FIRST_SCORE: Final = 1.0
LEAST_SCORE: Final = 0.1
"""Nobody's score falls below this: a child may always find a place."""
MOST_SCORE: Final = 1000.0


class Curiosity:
    """How well the children of every elite do, after Cully and Demiris (2018).

    A score rises by 1 for a child that holds a cell after its generation, and falls by 0.5 for one that
    does not. Parents are drawn in proportion to their scores. In the paper scores begin at 0; here new elites
    begin at 1, so that they are drawn before they have children.
    """

    def __init__(self) -> None:
        self._scores: dict[int, float] = {}

    def score(self, number: int) -> float:
        """Return the score of the elite with a number."""
        return self._scores.get(number, FIRST_SCORE)

    def learn(self, told: Sequence[Solution], held: Collection[int]) -> None:
        """Take in which children of a generation found a place.

        Args:
            told: its solutions.
            held: the numbers of all elites now; what is known of others is forgotten.
        """
        for child in told:
            if child.parent is not None:
                step = 1.0 if child.number in held else -0.5
                self._scores[child.parent] = min(
                    max(LEAST_SCORE, self.score(child.parent) + step), MOST_SCORE
                )
        self._scores = {number: s for number, s in sorted(self._scores.items()) if number in held}

    def draw(self, elites: Sequence[Evaluation], n: int, rng: random.Random) -> list[Evaluation]:
        """Draw n of some elites, with replacement.

        Raises:
            IndexError: there are none.
        """
        return rng.choices(elites, [self.score(e.solution.number) for e in elites], k=n)

    def state(self) -> dict[str, float]:
        """Return what ``restore`` needs, JSON-ready."""
        return {str(number): score for number, score in self._scores.items()}

    def restore(self, state: Mapping[str, float]) -> None:
        """Go back to what ``state`` returned."""
        self._scores = {int(n): max(LEAST_SCORE, min(float(s), MOST_SCORE)) for n, s in state.items()}


MAX_SAMPLES: Final = 10
"""An elite that was evaluated this often is not evaluated again."""


class Samples:
    """The evaluations of elites under other noise, and what an elite counts with: their mean.

    All evaluations of one elite go by the number of its first. In an archive, the one whose fitness is
    nearest to the mean stands for them, of equals the worse.
    """

    def __init__(self) -> None:
        self._known: dict[int, list[Evaluation]] = {}

    @staticmethod
    def number(e: Evaluation) -> int:
        """Return the number of an elite's first evaluation."""
        s = e.solution
        return s.number if s.operator != AGAIN or s.parent is None else s.parent

    def first(self, e: Evaluation) -> Evaluation:
        """Return an elite's first evaluation."""
        return self._known[self.number(e)][0] if self.number(e) in self._known else e

    def fitness(self, e: Evaluation) -> float:
        """Return the mean fitness of an elite's evaluations in m."""
        known = self._known.get(self.number(e), [e])
        return math.fsum(map(fitness_of, known)) / len(known)

    def representative(self, e: Evaluation) -> Evaluation:
        """Return the evaluation that stands for all of an elite's."""
        mean, known = self.fitness(e), self._known.get(self.number(e), [e])
        # two are equally far from their mean, but for rounding
        return min(
            known, key=lambda s: (round(abs(fitness_of(s) - mean), 12), -fitness_of(s), s.solution.number)
        )

    def add(self, held: Evaluation, sample: Evaluation) -> None:
        """Take in another evaluation of a held elite, one that did not fail."""
        self._known.setdefault(self.number(held), [held]).append(sample)

    def choose(self, elites: Iterable[Evaluation], n: int, under_way: Iterable[Solution]) -> list[Solution]:
        """Return the n elites that should be evaluated next: those with the fewest samples, then the best.

        Args:
            elites: of all archives.
            n: how many at most.
            under_way: solutions that are being evaluated.
        """
        more = Counter(s.parent for s in under_way if s.operator == AGAIN)
        known = {self.number(e): e for e in elites}
        counts = {k: len(self._known.get(k, [e])) + more[k] for k, e in known.items()}
        waiting = sorted((counts[k], self.fitness(e), k) for k, e in known.items() if counts[k] < MAX_SAMPLES)
        return [self.first(known[k]).solution for *_, k in waiting[:n]]

    def forget(self, held: Collection[int]) -> None:
        """Forget elites that are not held any more, given the numbers of those that are."""
        self._known = {k: known for k, known in self._known.items() if k in held}

    def state(self) -> list[list[int]]:
        """Return what ``restore`` needs, JSON-ready: the numbers of each elite's evaluations."""
        return [[e.solution.number for e in known] for known in self._known.values()]

    def restore(self, state: Sequence[Sequence[int]], recall: Recall) -> None:
        """Go back to what ``state`` returned."""
        known = recall({number for numbers in state for number in numbers})
        self._known = {numbers[0]: [known[number] for number in numbers] for numbers in state}


BODIES: Final = 8
"""Bodies that are remembered for each cell of the morphology map: those whose specialists promise most."""


class _Specialist(NamedTuple):
    """A solution, and the mean distance that it left to the targets at its side, in m."""

    solution: Solution
    remaining: float


@dataclasses.dataclass(slots=True)
class _Pair:
    """The specialists of a body, and whether they have been joined."""

    left: _Specialist
    right: _Specialist
    joined: bool = False

    @property
    def promise(self) -> float:
        """Twice the mean distance in m that would remain if both kept their word."""
        return self.left.remaining + self.right.remaining


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
        left, right = self._of_sides(e)
        pair = bodies.setdefault(e.solution.morphology, _Pair(left, right))
        if left.remaining < pair.left.remaining:
            pair.left, pair.joined = left, False
        if right.remaining < pair.right.remaining:
            pair.right, pair.joined = right, False
        if len(bodies) > BODIES:
            del bodies[max(bodies, key=lambda body: bodies[body].promise)]

    def draw(self, cell: Cell, rng: random.Random) -> Specialists | None:
        """Return the specialists of a body of a cell, or None if no body has two.

        First those that have not been joined, the most promising first; then any.
        """
        pairs = [p for p in self._pairs.get(cell, {}).values() if p.left.solution is not p.right.solution]
        if not pairs:
            return None
        new = [p for p in pairs if not p.joined]
        pair = min(new, key=lambda p: p.promise) if new else rng.choice(pairs)
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
                known[left].solution.morphology: _Pair(
                    self._of_sides(known[left])[0], self._of_sides(known[right])[1], bool(joined)
                )
                for left, right, joined in pairs
            }
            for cell, pairs in state.items()
        }

    def _of_sides(self, e: Evaluation) -> tuple[_Specialist, _Specialist]:
        """Return an evaluation as the specialist for the left and for the right."""
        left, right = self.sides.remaining(e.distances)
        return _Specialist(e.solution, left), _Specialist(e.solution, right)
