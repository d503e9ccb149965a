"""The grid archives: one elite per cell, or a deep grid of many individuals per cell."""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Final

from engine.errors import InvalidData
from engine.simulation.evaluation import Evaluation

Cell = tuple[int, ...]

LEAST_WEIGHED_FITNESS: Final = 0.01
"""Smallest fitness in m that the best individual of a deep cell counts with when parents are drawn."""


class GridArchive:
    """A map from the cells of a grid to elites; the smaller fitness wins, on a tie the older one.

    Args:
        shape: number of cells along each axis.
        n_possible: how many of the cells a solution can lie in, if not in all.

    Raises:
        ValueError: an axis has no cell.
    """

    def __init__(self, *, shape: tuple[int, ...], n_possible: int | None = None) -> None:
        if not shape or min(shape) < 1:
            raise ValueError(f"an archive needs at least one cell along each axis, not {shape}")
        self.shape = shape
        self.n_cells = math.prod(shape) if n_possible is None else n_possible
        """Number of cells that can be filled."""
        self.judge: Callable[[Evaluation], float] = fitness_of
        """What an individual counts with where it competes for a cell; the smaller wins."""
        self._elites: dict[Cell, Evaluation] = {}

    def __len__(self) -> int:
        """Return the number of filled cells."""
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

    def individuals(self) -> list[Evaluation]:
        """Return all individuals of the archive in the order of their cells: here, the elites."""
        return self.elites()

    def add(self, cell: Cell, candidate: Evaluation) -> bool:
        """Offer a candidate to a cell and tell whether it became its elite.

        Raises:
            ValueError: the cell lies outside the grid or the candidate has no fitness.
        """
        self._check(cell, candidate)
        held = self._elites.get(cell)
        if held is not None and self._standing(held) <= self._standing(candidate):
            return False
        self._elites[cell] = candidate
        return True

    def reinsert(self, placed: Iterable[tuple[Cell, Evaluation]]) -> None:
        """Empty the archive and fill it with re-described individuals; those that collide compete."""
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
    def coverage(self) -> float:
        """Filled cells over all that can be filled."""
        return len(self._elites) / self.n_cells

    def qd_score(self, initial_distance: float) -> float:
        """Return the sum over filled cells of f_s = initial distance - fitness, in m."""
        return float(sum(initial_distance - e.fitness for e in self.elites() if e.fitness is not None))

    def _standing(self, evaluation: Evaluation) -> tuple[float, int]:
        return self.judge(evaluation), evaluation.solution.number

    def _check(self, cell: Cell, candidate: Evaluation) -> None:
        if len(cell) != len(self.shape) or not all(0 <= i < n for i, n in zip(cell, self.shape, strict=True)):
            raise ValueError(f"cell {cell} lies outside an archive of shape {self.shape}")
        if candidate.fitness is None:
            raise ValueError("a failed evaluation cannot enter an archive")


class DeepGridArchive(GridArchive):
    """A grid whose cells hold several individuals (Flageat and Cully, ALIFE 2020).

    A new individual is appended to its cell or, where the cell is full, replaces a uniformly drawn one, be it
    better or worse. Lucky evaluations therefore do not last. The elite of a cell, which maps and figures
    show, is the best of the individuals that it holds now; unlike a plain archive's it may get worse.

    Args:
        shape: number of cells along each axis.
        capacity: individuals per cell.
        rng: draws the individual to replace.
    """

    def __init__(self, *, shape: tuple[int, ...], capacity: int, rng: random.Random) -> None:
        super().__init__(shape=shape)
        self.capacity = capacity
        self._rng = rng
        self._cells: dict[Cell, list[Evaluation]] = {}

    def individuals(self) -> list[Evaluation]:
        """Return all individuals of the archive, in the order of the cells and of their places."""
        return [e for cell in sorted(self._cells) for e in self._cells[cell]]

    def add(self, cell: Cell, candidate: Evaluation) -> bool:
        """Put a candidate into a cell and tell whether it became its elite.

        Raises:
            ValueError: the cell lies outside the grid or the candidate has no fitness.
        """
        self._check(cell, candidate)
        held = self._cells.setdefault(cell, [])
        if len(held) < self.capacity:
            held.append(candidate)
        else:
            held[self._rng.randrange(self.capacity)] = candidate
        self._elites[cell] = min(held, key=_rank)
        return self._elites[cell] is candidate

    def reinsert(self, placed: Iterable[tuple[Cell, Evaluation]]) -> None:
        """Empty the archive and add re-described individuals by the same rule as new ones."""
        self._cells = {}
        super().reinsert(placed)

    def sample(self, n: int, rng: random.Random) -> list[Evaluation]:
        """Draw n times a cell uniformly, and one of its individuals by ``parent_weights``.

        Raises:
            IndexError: the archive is empty.
        """
        cells = sorted(self._cells)
        drawn = []
        for _ in range(n):
            held = self._cells[rng.choice(cells)]
            drawn += rng.choices(held, weights=parent_weights(held))
        return drawn

    def members(self) -> dict[Cell, list[Evaluation]]:
        """Return the individuals of every filled cell, in their places."""
        return {cell: list(self._cells[cell]) for cell in sorted(self._cells)}

    def restore(self, members: Mapping[Cell, Sequence[Evaluation]]) -> None:
        """Go back to what ``members`` returned.

        Raises:
            InvalidData: a cell lies outside the grid or holds no individual, too many, or a failed one.
        """
        self._cells, self._elites = {}, {}
        for cell, held in members.items():
            if not 1 <= len(held) <= self.capacity:
                raise InvalidData(f"cell {cell} of a deep grid of {self.capacity} holds {len(held)}")
            for e in held:
                self._check(cell, e)
            self._cells[cell] = list(held)
            self._elites[cell] = min(held, key=_rank)


def parent_weights(held: Sequence[Evaluation]) -> list[float]:
    """Return the weights by which a deep cell's individuals are drawn as parents.

    A weight is 1 / fitness, as in the published code. The fitness is the remaining distance, so it is
    positive where f_s is negative, and no weight is zero. Only a fitness below 1 cm, which a bonus can bring
    about, would give negative or huge weights: then the same amount is added to all, so that the best counts
    as 1 cm.
    """
    values = [e.fitness for e in held if e.fitness is not None]
    raised = max(LEAST_WEIGHED_FITNESS - min(values), 0.0)
    return [1.0 / (v + raised) for v in values]


def fitness_of(evaluation: Evaluation) -> float:
    """Return the fitness of an evaluation that did not fail."""
    assert evaluation.fitness is not None
    return evaluation.fitness


def _rank(evaluation: Evaluation) -> tuple[float, int]:
    return fitness_of(evaluation), evaluation.solution.number


def cell_name(cell: Cell) -> str:
    """Return a cell as written on the command line and in a run file: ``i,j``."""
    return ",".join(map(str, cell))


def parse_cell(text: str) -> Cell:
    """Read ``i,j`` back.

    Raises:
        InvalidData: it is not whole numbers separated by commas.
    """
    parts = text.split(",")
    if not all(p.strip().isdecimal() and len(p) < 10 for p in parts):
        raise InvalidData(f"a cell is written like 3,7, not {text!r}")
    return tuple(int(p) for p in parts)
