"""What a search remembers of its elites besides their fitness."""

from __future__ import annotations

import random
from collections.abc import Collection, Mapping, Sequence
from typing import Final

from engine.simulation.evaluation import Evaluation, Solution

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
