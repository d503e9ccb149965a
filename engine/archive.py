"""The grid archive: at most one elite per cell, the best that was ever offered to it."""

from __future__ import annotations

import random
from collections.abc import Iterable, Iterator

from engine.evaluation import Evaluation

Cell = tuple[int, ...]


class GridArchive:
    """A map from the cells of a grid to elites; the smaller fitness wins, on a tie the older one.

    Args:
        shape: number of cells along each axis.

    Raises:
        ValueError: an axis has no cell.
    """

    def __init__(self, *, shape: tuple[int, ...]) -> None:
        if not shape or min(shape) < 1:
            raise ValueError(f"an archive needs at least one cell along each axis, not {shape}")
        self.shape = shape
        self._elites: dict[Cell, Evaluation] = {}

    def __len__(self) -> int:
        return len(self._elites)

    def __iter__(self) -> Iterator[tuple[Cell, Evaluation]]:
        """Iterate over (cell, elite) in the order of the cells."""
        for cell in sorted(self._elites):
            yield cell, self._elites[cell]

    def get(self, cell: Cell) -> Evaluation | None:
        """Return a cell's elite, or None if the cell is empty."""
        return self._elites.get(cell)

    def elites(self) -> list[Evaluation]:
        """Return the elites in the order of their cells."""
        return [elite for _, elite in self]

    def add(self, cell: Cell, candidate: Evaluation) -> bool:
        """Offer a candidate to a cell and tell whether it was taken.

        Raises:
            ValueError: the cell lies outside the grid or the candidate has no fitness.
        """
        if len(cell) != len(self.shape) or not all(0 <= i < n for i, n in zip(cell, self.shape, strict=True)):
            raise ValueError(f"cell {cell} lies outside an archive of shape {self.shape}")
        if candidate.fitness is None:
            raise ValueError("a failed evaluation cannot enter an archive")
        held = self._elites.get(cell)
        if held is not None and _rank(held) <= _rank(candidate):
            return False
        self._elites[cell] = candidate
        return True

    def reinsert(self, placed: Iterable[tuple[Cell, Evaluation]]) -> None:
        """Empty the archive and fill it with re-described elites; those that collide compete."""
        self._elites = {}
        for cell, elite in placed:
            self.add(cell, elite)

    def sample(self, n: int, rng: random.Random) -> list[Evaluation]:
        """Draw n elites uniformly, with replacement.

        Raises:
            IndexError: the archive is empty.
        """
        elites = self.elites()
        return [rng.choice(elites) for _ in range(n)]

    def best(self) -> Evaluation | None:
        """Return the elite with the smallest fitness, or None if the archive is empty."""
        return min(self._elites.values(), key=_rank, default=None)

    @property
    def n_cells(self) -> int:
        """Number of all cells."""
        n = 1
        for size in self.shape:
            n *= size
        return n

    @property
    def coverage(self) -> float:
        """Filled cells over all cells."""
        return len(self._elites) / self.n_cells

    def qd_score(self, initial_distance: float) -> float:
        """Return the sum over filled cells of f_s = initial distance - fitness, in m."""
        return float(sum(initial_distance - e.fitness for e in self.elites() if e.fitness is not None))


def _rank(evaluation: Evaluation) -> tuple[float, int]:
    assert evaluation.fitness is not None
    return evaluation.fitness, evaluation.solution.number
