"""What DM-ME and MAP-Elites share: random solutions first, then mutants of elites, batch by batch."""

from __future__ import annotations

import abc
import dataclasses
import itertools
import random
from collections import deque
from collections.abc import Mapping, Sequence
from typing import Any, Final, Literal

from engine.control.genome import Controller
from engine.errors import InvalidData
from engine.search.algorithm import Algorithm, Recall
from engine.search.archive import Cell, GridArchive
from engine.search.body_space import PUBLISHED_BODIES, BodySpace
from engine.search.descriptors import CONTROLLER_SHAPE
from engine.search.elite_records import Curiosity, Samples, SpecialistMemory
from engine.search.trajectory_archive import TrajectoryArchive
from engine.search.variation import (
    AGAIN,
    PUBLISHED,
    Fill,
    GivenRobot,
    Specialists,
    Variation,
    VariationConfig,
)
from engine.simulation.evaluation import Evaluation, Solution
from engine.tasks.sides import Sides

MAX_OVERLAP: Final = 200
MAX_CELL_CAPACITY: Final = 1000
MAX_CELLS: Final = 50
"""Most cells along an axis of the controller map."""
PAPER_REFITS: Final = (0, 50, 150, 350, 750, 1550)


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class MapSearchConfig:
    """Parameters of DM-ME and MAP-Elites; ViE-NEAT ignores them.

    Raises:
        InvalidData: a number is out of its range, or contradicts another field.
    """

    initial: int = 1080
    """Random solutions in generation 0."""
    fill: Fill = "random"
    """What fills generation 0 beside given robots: random ones, or mutants of the given ones."""
    batch_size: int = 24
    """Solutions per later generation."""
    controller_share: float = 0.5
    """Part of the parents that come from DM-ME's controller archive; the others are from the morphology's."""
    refit_generations: tuple[int, ...] = PAPER_REFITS
    """Generations at which standardiser and PCA are fitted anew."""
    sensory: Literal["positions", "displacements"] = "positions"
    """What describes a controller: the head's positions at 1 Hz, or its displacements between them."""
    controller_cells: tuple[int, int] = CONTROLLER_SHAPE
    """Cells of the controller map along its first and its second principal component."""
    parents: Literal["uniform", "curiosity"] = "uniform"
    """How parents are drawn from an archive: all alike, or by how many of their children found a place."""
    reevaluations: int = 0
    """Elites evaluated again, of a later generation's solutions; an elite then counts with its mean."""
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

        if not 0.0 <= self.controller_share <= 1.0:
            raise InvalidData(f"controller_share must be from 0 to 1, not {self.controller_share:g}")
        if self.cell_capacity > 1:
            if self.parents != "uniform":
                raise InvalidData(
                    "parents by curiosity need a cell_capacity of 1; a deep grid has its own rule"
                )
            if self.reevaluations:
                raise InvalidData("reevaluations need a cell_capacity of 1; a deep grid has its own rule")

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
        if not 0 <= self.reevaluations < self.batch_size:
            raise InvalidData(
                f"reevaluations must be from 0 to less than batch_size ({self.batch_size}),"
                f" not {self.reevaluations}"
            )
        if 0 not in self.refit_generations or min(self.refit_generations) < 0:
            raise InvalidData("refit_generations must include 0 and not be negative")


def check_overlap(overlap: int) -> None:
    """Check how many generations may be under way beyond the oldest.

    Raises:
        InvalidData: fewer than none, or so many that a run file's state would grow out of hand.
    """
    if not 0 <= overlap <= MAX_OVERLAP:
        raise InvalidData(f"overlap must be from 0 to {MAX_OVERLAP}, not {overlap}")


@dataclasses.dataclass(frozen=True, slots=True)
class _Mates:
    """The individuals of a parent's archive, and the specialists of its cell of the morphology map."""

    parent: Evaluation
    archive: GridArchive
    samples: Samples
    rng: random.Random
    remembered: SpecialistMemory | None
    cell: Cell

    def pair(self) -> tuple[Controller, Controller]:
        """Return the controllers of the parent and of another individual, the fitter's first."""
        fitter, other = sorted((self.parent, *self._draw(1)), key=self.archive.judge)
        return fitter.solution.controller, other.solution.controller

    def donor(self, n: int) -> Controller:
        """Return the controller of the fittest of n individuals."""
        return min(self._draw(n), key=self.archive.judge).solution.controller

    def specialists(self) -> Specialists | None:
        """Return the specialists of a body that shares the parent's cell of the morphology map."""
        return None if self.remembered is None else self.remembered.draw(self.cell, self.rng)

    def _draw(self, n: int) -> list[Evaluation]:
        return [self.samples.first(e) for e in self.archive.sample(n, self.rng)]


class MapSearch(Algorithm):
    """A search whose parents are drawn from archives, one of them a ``TrajectoryArchive``.

    Solutions stay random until there are two evaluations to project. All draws come from the generator of
    ``variation``, in an order that depends on the evaluations alone.

    Args:
        config: sizes of the generations and what describes a controller.
        n_inputs: how many numbers the controllers sense.
        budget: total number of solutions; the last generation may be smaller.
        seed: of all the algorithm's draws.
        bodies: those that there are.
        overlap: how many more generations may be asked for before the oldest is told. Parents are then drawn
            from archives that are as many generations old.
        variation: how new solutions come about.
        sides: how the task tells left from right; None if it does not.

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
        bodies: BodySpace = PUBLISHED_BODIES,
        overlap: int = 0,
        variation: VariationConfig = PUBLISHED,
        sides: Sides | None = None,
    ) -> None:
        config.check_schedule(budget)
        check_overlap(overlap)
        self._config = config
        self._bodies = bodies
        self._budget = budget
        self._specialists = SpecialistMemory(sides) if variation.switch_weight and sides is not None else None
        self._variation = Variation(
            n_inputs=n_inputs,
            bodies=bodies,
            seed=seed,
            config=variation,
            sides=sides,
        )
        self._generation = 0
        self._overlap = overlap
        self._asked: deque[list[Solution]] = deque()
        self._curiosity = Curiosity() if config.parents == "curiosity" else None
        self._samples = Samples()
        self._create_archives()
        if config.reevaluations:
            for archive in self.archives.values():
                archive.judge = self._samples.fitness

    @property
    def generation(self) -> int:
        """Number of completed generations."""
        return self._generation

    def begin_with(self, given: Sequence[GivenRobot]) -> None:
        """Ask for given robots first.

        Raises:
            InvalidData: they are more than generation 0 has robots, or mutants of none are to fill it.
        """
        if len(given) > self._config.initial:
            raise InvalidData(
                f"initial ({self._config.initial}) must be at least the number of robots that the run starts"
                f" from ({len(given)})"
            )
        self._variation.begin_with(given, self._config.fill)

    @property
    def outstanding(self) -> tuple[tuple[Solution, ...], ...]:
        """The generations that have been asked for and not yet told, the oldest first."""
        return tuple(map(tuple, self._asked))

    def ask(self) -> list[Solution]:
        """Return generation 0, the given solutions before those that fill it; then mutants of elites."""
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
            asked = [self._variation.first() for _ in range(n)]
        else:
            n = min(self._config.batch_size, remaining)
            under_way = itertools.chain.from_iterable(self._asked)
            chosen = self._samples.choose(self._elites(), self._config.reevaluations, under_way)
            asked = [self._variation.again(elite) for elite in chosen[:n]]
            asked += self._mutants(n - len(asked))
        self._asked.append(asked)
        return list(asked)

    def tell(self, evaluations: Sequence[Evaluation]) -> None:
        """Offer every evaluation of the oldest generation asked for to every archive."""
        ordered = sorted(evaluations, key=lambda e: e.solution.number)
        if not self._asked or [e.solution for e in ordered] != self._asked[0]:
            raise ValueError("tell takes the evaluations of exactly the solutions asked for")
        told = self._asked.popleft()
        self._take_samples([e for e in ordered if e.solution.operator == AGAIN])
        whole = [e for e in ordered if e.fitness is not None and e.solution.operator != AGAIN]
        self._offer(whole)
        if self._specialists is not None:
            for e in whole:
                self._specialists.tell(self._body_cell(e), e)
        held = set(map(self._samples.number, self._elites()))
        self._samples.forget(held)
        if self._curiosity is not None:
            self._curiosity.learn([s for s in told if s.operator != AGAIN], held)
        self._generation += 1

    def state(self) -> dict[str, Any]:
        """Return counters, random state and descriptor, what is known of the elites, and open generations."""
        state = {
            "generation": self._generation,
            **self._variation.state(),
            "descriptor": self._trajectories.state(),
        }
        if self._overlap:
            state["asked"] = [[s.to_json() for s in asked] for asked in self._asked]
        if self._curiosity is not None:
            state["curiosity"] = self._curiosity.state()
        if self._config.reevaluations:
            state["samples"] = self._samples.state()
        if self._specialists is not None:
            state["specialists"] = self._specialists.state()
        return state

    def restore(
        self,
        state: dict[str, Any],
        contents: Mapping[str, Mapping[Cell, Evaluation]],
        recall: Recall,
    ) -> None:
        """Go back to the end of a generation."""
        self._generation = state["generation"]
        self._variation.restore(state)
        self._trajectories.restore(state["descriptor"])
        for name, archive in self.archives.items():
            archive.reinsert(contents[name].items())
        if self._curiosity is not None:
            self._curiosity.restore(state["curiosity"])
        if self._config.reevaluations:
            self._samples.restore(state["samples"], recall)
        if self._specialists is not None:
            self._specialists.restore(state["specialists"], recall)
        self._asked = deque([Solution.from_json(data) for data in asked] for asked in state.get("asked", ()))

    def _sample(self, archive: str, n: int) -> list[Solution]:
        """Draw parents from an archive and mutate each."""
        rng, held = self._variation.rng, self.archives[archive]
        if self._curiosity is None:
            parents = held.sample(n, rng)
        else:
            parents = self._curiosity.draw(list(map(self._samples.first, held.elites())), n, rng)
        firsts = map(self._samples.first, parents)
        mates = (
            _Mates(parent, held, self._samples, rng, self._specialists, self._body_cell(parent))
            for parent in firsts
        )
        return [self._variation.mutate(of.parent.solution, archive, of) for of in mates]

    def _body_cell(self, e: Evaluation) -> Cell:
        """Return the cell of the morphology map that the body of an evaluation belongs to."""
        return self._bodies.cell(e.solution.morphology)

    def _elites(self) -> list[Evaluation]:
        """Return the elites of all archives; one that holds several cells, several times."""
        return [e for archive in self.archives.values() for e in archive.elites()]

    def _take_samples(self, again: Sequence[Evaluation]) -> None:
        """Let elites count with what they did under other noise; one that failed loses its cells."""
        if not again:
            return
        number = self._samples.number
        held = {number(e): e for e in self._elites()}
        lost = {number(e) for e in again if e.fitness is None}
        for e in again:
            if number(e) in held and number(e) not in lost:
                self._samples.add(held[number(e)], e)
        for archive in self.archives.values():
            kept = [(cell, e) for cell, e in archive if number(e) not in lost]
            archive.reinsert((cell, self._samples.representative(e)) for cell, e in kept)

    @abc.abstractmethod
    def _create_archives(self) -> None:
        """Create the archives, empty; ``_trajectories`` is one of them."""

    @abc.abstractmethod
    def _mutants(self, n: int) -> list[Solution]:
        """Return n mutants of individuals of the archives."""

    @abc.abstractmethod
    def _offer(self, whole: Sequence[Evaluation]) -> None:
        """Offer the evaluations of this generation that did not fail to the archives."""
