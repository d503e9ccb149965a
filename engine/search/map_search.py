"""What DM-ME and MAP-Elites share: random solutions first, then mutants of elites, batch by batch."""

from __future__ import annotations

import abc
import dataclasses
from collections import deque
from collections.abc import Mapping, Sequence
from typing import Any, Final, Literal

from engine.body.morphology import StiffnessMode
from engine.errors import InvalidData
from engine.search.algorithm import Algorithm, Recall
from engine.search.archive import Cell
from engine.search.descriptors import CONTROLLER_SHAPE
from engine.search.trajectory_archive import TrajectoryArchive
from engine.search.variation import PUBLISHED, Variation, VariationConfig
from engine.simulation.evaluation import Evaluation, Solution

MAX_OVERLAP: Final = 200
MAX_CELL_CAPACITY: Final = 1000
MAX_CELLS: Final = 50
"""Most cells along an axis of the controller map."""
PAPER_REFITS: Final = (0, 50, 150, 350, 750, 1550)


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class MapSearchConfig:
    """Parameters of DM-ME and MAP-Elites; ViE-NEAT ignores them.

    Raises:
        InvalidData: a cell's capacity or a map's number of cells is out of its range.
    """

    initial: int = 1080
    """Random solutions in generation 0."""
    batch_size: int = 24
    """Solutions per later generation; half of the parents come from each archive of DM-ME."""
    refit_generations: tuple[int, ...] = PAPER_REFITS
    """Generations at which standardiser and PCA are fitted anew."""
    sensory: Literal["positions", "displacements"] = "positions"
    """What describes a controller: the head's positions at 1 Hz, or its displacements between them."""
    controller_cells: tuple[int, int] = CONTROLLER_SHAPE
    """Cells of the controller map along its first and its second principal component."""
    cell_capacity: int = 1
    """Individuals per cell of DM-ME's controller archive; the published deep grid: 50."""

    def __post_init__(self) -> None:
        cells = self.controller_cells
        if len(cells) != 2 or not all(1 <= n <= MAX_CELLS for n in cells):
            raise InvalidData(
                f"controller_cells must be two numbers from 1 to {MAX_CELLS},"
                f" not {', '.join(map(str, cells))}"
            )
        if not 1 <= self.cell_capacity <= MAX_CELL_CAPACITY:
            raise InvalidData(
                f"cell_capacity must be from 1 to {MAX_CELL_CAPACITY}, not {self.cell_capacity}"
            )

    def check_schedule(self, evaluations: int) -> None:
        """Check that the generations fit a budget.

        Raises:
            InvalidData: the numbers contradict each other; the message says which.
        """
        if evaluations < 2:
            raise InvalidData(f"evaluations must be at least 2, not {evaluations}")
        if not 2 <= self.initial <= evaluations:
            raise InvalidData(f"initial ({self.initial}) must be from 2 to evaluations ({evaluations})")
        if self.batch_size < 2 or self.batch_size % 2:
            raise InvalidData(f"batch_size must be an even number from 2, not {self.batch_size}")
        if 0 not in self.refit_generations or min(self.refit_generations) < 0:
            raise InvalidData("refit_generations must include 0 and not be negative")


def check_overlap(overlap: int) -> None:
    """Check how many generations may be under way beyond the oldest.

    Raises:
        InvalidData: fewer than none, or so many that a run file's state would grow out of hand.
    """
    if not 0 <= overlap <= MAX_OVERLAP:
        raise InvalidData(f"overlap must be from 0 to {MAX_OVERLAP}, not {overlap}")


class MapSearch(Algorithm):
    """A search whose parents are drawn from archives, one of them a ``TrajectoryArchive``.

    Solutions stay random until there are two evaluations to project. All draws come from the generator of
    ``variation``, in an order that depends on the evaluations alone.

    Args:
        config: sizes of the generations and what describes a controller.
        n_inputs: how many numbers the controllers sense.
        budget: total number of solutions; the last generation may be smaller.
        seed: of all the algorithm's draws.
        stiffness: whether a body's modules share one stiffness.
        overlap: how many more generations may be asked for before the oldest is told. Parents are then drawn
            from archives that are as many generations old.
        variation: how new solutions come about.

    Raises:
        InvalidData: the numbers contradict each other.
    """

    _trajectories: TrajectoryArchive

    def __init__(
        self,
        config: MapSearchConfig,
        *,
        n_inputs: int,
        budget: int,
        seed: int = 0,
        stiffness: StiffnessMode = "shared",
        overlap: int = 0,
        variation: VariationConfig = PUBLISHED,
    ) -> None:
        config.check_schedule(budget)
        check_overlap(overlap)
        self._config = config
        self._stiffness: StiffnessMode = stiffness
        self._budget = budget
        self._variation = Variation(n_inputs=n_inputs, stiffness=stiffness, seed=seed, config=variation)
        self._generation = 0
        self._overlap = overlap
        self._asked: deque[list[Solution]] = deque()
        self._create_archives()

    @property
    def generation(self) -> int:
        """Number of completed generations."""
        return self._generation

    @property
    def outstanding(self) -> tuple[tuple[Solution, ...], ...]:
        """The generations that have been asked for and not yet told, the oldest first."""
        return tuple(map(tuple, self._asked))

    def ask(self) -> list[Solution]:
        """Return the random solutions of generation 0, then mutants of elites."""
        if len(self._asked) > self._overlap:
            raise ValueError("tell the evaluations of the last ask first")
        remaining = self._budget - self._variation.n_drawn
        if remaining <= 0:
            return []
        if not self._trajectories.fitted and self._asked:
            return []  # there are no parents before the first generation is told
        self._variation.new_generation()
        if not self._trajectories.fitted:
            n = min(self._config.initial, remaining)
            asked = [self._variation.random() for _ in range(n)]
        else:
            asked = self._mutants(min(self._config.batch_size, remaining))
        self._asked.append(asked)
        return list(asked)

    def tell(self, evaluations: Sequence[Evaluation]) -> None:
        """Offer every evaluation of the oldest generation asked for to every archive."""
        ordered = sorted(evaluations, key=lambda e: e.solution.number)
        if not self._asked or [e.solution for e in ordered] != self._asked[0]:
            raise ValueError("tell takes the evaluations of exactly the solutions asked for")
        self._asked.popleft()
        self._offer([e for e in ordered if e.fitness is not None])
        self._generation += 1

    def state(self) -> dict[str, Any]:
        """Return the generation, the random state, NEAT's counters, the descriptor and open generations."""
        state = {
            "generation": self._generation,
            **self._variation.state(),
            "descriptor": self._trajectories.state(),
        }
        if self._overlap:
            state["asked"] = [[s.to_json() for s in asked] for asked in self._asked]
        return state

    def restore(
        self,
        state: dict[str, Any],
        contents: Mapping[str, Mapping[Cell, Evaluation]],
        recall: Recall,  # noqa: ARG002
    ) -> None:
        """Go back to the end of a generation."""
        self._generation = state["generation"]
        self._variation.restore(state)
        self._trajectories.restore(state["descriptor"])
        for name, archive in self.archives.items():
            archive.reinsert(contents[name].items())
        self._asked = deque([Solution.from_json(data) for data in asked] for asked in state.get("asked", ()))

    def _sample(self, archive: str, n: int) -> list[Solution]:
        """Draw parents from an archive and mutate each."""
        parents = self.archives[archive].sample(n, self._variation.rng)
        return [self._variation.mutate(parent.solution, archive) for parent in parents]

    @abc.abstractmethod
    def _create_archives(self) -> None:
        """Create the archives, empty; ``_trajectories`` is one of them."""

    @abc.abstractmethod
    def _mutants(self, n: int) -> list[Solution]:
        """Return n mutants of individuals of the archives."""

    @abc.abstractmethod
    def _offer(self, whole: Sequence[Evaluation]) -> None:
        """Offer the evaluations of this generation that did not fail to the archives."""
