"""New solutions: given ones, random ones, mutants, and the random state behind them."""

from __future__ import annotations

import dataclasses
import random
from collections.abc import Sequence
from typing import Any, Final, Literal, Protocol, Self

from engine.body.morphology import BodyRates, Morphology
from engine.control.genome import Controller
from engine.control.operators import Neat
from engine.control.rates import PUBLISHED_RATES, NeatRates
from engine.control.switch import switched
from engine.errors import InvalidData
from engine.search.body_space import PUBLISHED_BODIES, BodySpace
from engine.simulation.evaluation import Solution
from engine.tasks.sides import Sides

OPERATORS: Final = ("morphology", "controller", "both", "exchange", "switch")
"""What makes a child of an elite: mutations, another elite's controller, or two joined to one."""
AGAIN: Final = "again"
"""The operator of an elite that is evaluated under other noise; its parent is its first evaluation."""
GIVEN: Final = "given"
"""The operator of a robot that the user gave to start from; its source says where it is from."""
MAX_WEIGHT: Final = 100
MAX_DONORS: Final = 1000
Fill = Literal["random", "mutants"]
"""What stands beside given robots in generation 0."""


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class VariationConfig:
    """How new solutions come about. ViE-NEAT ignores the weights and ``crossover``.

    Raises:
        InvalidData: a number is out of its range.
    """

    body: BodyRates = BodyRates()
    """How bodies are mutated."""
    neat: NeatRates = NeatRates()
    """How controllers begin and are mutated."""
    morphology_weight: int = 1
    """How often the body alone is mutated, relative to the other weights."""
    controller_weight: int = 1
    """How often the controller alone is mutated, relative to the other weights."""
    both_weight: int = 1
    """How often body and controller are mutated together, relative to the other weights."""
    exchange_weight: int = 0
    """How often the body is tried with the controller of another elite, relative to the other weights."""
    donors: int = 8
    """Elites drawn for such an exchange: the fittest gives its controller."""
    switch_weight: int = 1
    """How often two controllers of a body, one good at either side, become one, relative to the others.

    Where the task does not tell left from right the controller is mutated instead.
    """
    crossover: float = 0.0
    """Probability that a controller is crossed with that of another elite before it is mutated."""

    def __post_init__(self) -> None:
        names = [f"{kind}_weight" for kind in OPERATORS]
        for name in names:
            if not 0 <= getattr(self, name) <= MAX_WEIGHT:
                raise InvalidData(f"{name} must be from 0 to {MAX_WEIGHT}, not {getattr(self, name)}")
        if not any(getattr(self, name) for name in names):
            raise InvalidData(f"one of {', '.join(names)} must be above 0")
        if not 1 <= self.donors <= MAX_DONORS:
            raise InvalidData(f"donors must be from 1 to {MAX_DONORS}, not {self.donors}")
        if not 0.0 <= self.crossover <= 1.0:
            raise InvalidData(f"crossover must be from 0 to 1, not {self.crossover}")

    @property
    def operators(self) -> tuple[str, ...]:
        """What makes a child, each as often as its weight says."""
        return tuple(kind for kind in OPERATORS for _ in range(getattr(self, f"{kind}_weight")))


PUBLISHED: Final = VariationConfig(neat=PUBLISHED_RATES, switch_weight=0)
"""The variation of the authors' published configuration, by NEAT-Python 2."""


@dataclasses.dataclass(frozen=True, slots=True)
class GivenRobot:
    """A robot that a run starts from.

    Attributes:
        morphology, controller: its genotype.
        origin: where it is from, for people.
    """

    morphology: Morphology
    controller: Controller
    origin: str

    def to_json(self) -> dict[str, Any]:
        """Return JSON-ready values."""
        return {
            "morphology": self.morphology.to_json(),
            "controller": self.controller.to_json(),
            "origin": self.origin,
        }

    @classmethod
    def from_json(cls, data: Any) -> Self:
        """Read a robot back from ``to_json``'s form.

        Raises:
            InvalidData, TypeError, KeyError: it is not of that form.
        """
        return cls(
            Morphology.from_json(data["morphology"]),
            Controller.from_json(data["controller"]),
            str(data["origin"]),
        )


def rng_state(rng: random.Random) -> list[Any]:
    """Return a generator's state, JSON-ready."""
    version, internal, gauss = rng.getstate()
    return [version, list(internal), gauss]


def restore_rng(rng: random.Random, state: Any) -> None:
    """Set a generator to what ``rng_state`` returned.

    Raises:
        ValueError, TypeError: the data is not such a state.
    """
    version, internal, gauss = state
    rng.setstate((version, tuple(internal), gauss))


@dataclasses.dataclass(frozen=True, slots=True)
class Specialists:
    """Two solutions with the same body.

    Attributes:
        left: comes nearest to the targets at its left.
        right: comes nearest to those at its right.
        again: whether they have been joined before.
    """

    left: Solution
    right: Solution
    again: bool


class Mates(Protocol):
    """The other elites that a child may have something of."""

    def pair(self) -> tuple[Controller, Controller]:
        """Draw one; return the controllers of it and of the parent, the fitter's first."""
        ...

    def donor(self, n: int) -> Controller:
        """Draw n; return the controller of the fittest."""
        ...

    def specialists(self) -> Specialists | None:
        """Return two solutions with one body, of the parent's size and stiffness, or None."""
        ...


@dataclasses.dataclass(frozen=True, slots=True)
class _Given:
    """Given robots as mates: none is known to be fitter than another."""

    controller: Controller
    others: Sequence[GivenRobot]
    rng: random.Random

    def pair(self) -> tuple[Controller, Controller]:
        return self.controller, self.donor(1)

    def donor(self, n: int) -> Controller:  # noqa: ARG002
        return self.rng.choice(self.others).controller

    def specialists(self) -> None:
        return None


class Variation:
    """Draws solutions and numbers them.

    Args:
        n_inputs: how many numbers the controllers sense.
        bodies: those that there are.
        seed: of all draws.
        config: rates and weights.
        sides: how the task tells left from right; None if it does not.
    """

    def __init__(
        self,
        *,
        n_inputs: int,
        bodies: BodySpace = PUBLISHED_BODIES,
        seed: int,
        config: VariationConfig,
        sides: Sides | None = None,
    ) -> None:
        self.rng = random.Random(seed)
        """The one generator of an algorithm: whatever else it draws comes from here too."""
        self._bodies = bodies
        self._config = config
        self._operators = config.operators
        self._neat = Neat(n_inputs=n_inputs, rates=config.neat)
        self._sides = sides
        self._n_drawn = 0
        self._given: tuple[GivenRobot, ...] = ()
        self._mutants_first = False

    def begin_with(self, given: Sequence[GivenRobot], fill: Fill = "random") -> None:
        """Take robots that ``first`` returns in place of the first random ones.

        Raises:
            InvalidData: there is none, and the first others are to be mutants.
        """
        if fill == "mutants" and not given:
            raise InvalidData("fill = mutants needs robots to start from; name them with --from")
        self._given, self._mutants_first = tuple(given), fill == "mutants"

    @property
    def n_drawn(self) -> int:
        """Number of solutions so far; the next one's number."""
        return self._n_drawn

    def new_generation(self) -> None:
        """Begin a generation of NEAT's innovations: equal ones share a number only within a generation."""
        self._neat.new_generation()
        if self._n_drawn or self._mutants_first:
            # random networks count from the beginning, as those that given ones descend from
            self._neat.count_beyond([g.controller for g in self._given])

    def first(self) -> Solution:
        """Return the next of the given robots; where there are no more, a random one or a mutant of one."""
        if self._n_drawn < len(self._given):
            return self._as_solution(self._next_number())
        if not self._mutants_first:
            return self.random()
        parent = self._as_solution(self._n_drawn % len(self._given))
        return self.mutate(parent, None, _Given(parent.controller, self._given, self.rng))

    def _as_solution(self, k: int) -> Solution:
        """Return a given robot as the solution that it is: the first ones have the numbers from 0."""
        given = self._given[k]
        return Solution(
            number=k,
            morphology=given.morphology,
            controller=given.controller,
            operator=GIVEN,
            source=given.origin,
        )

    def random(self) -> Solution:
        """Draw a solution: a body and a controller, independently."""
        return Solution(
            number=self._next_number(),
            morphology=self._bodies.draw(self.rng),
            controller=self._neat.random(self.rng),
        )

    def mutate(self, parent: Solution, source: str | None, mates: Mates) -> Solution:
        """Return a child by an operator drawn by the weights, drawn again until something has changed.

        Args:
            parent: what to change.
            source: name of the archive that it was drawn from, None for a given robot that is in none yet.
            mates: the elites of that archive.
        """
        operator = self.rng.choice(self._operators)
        if operator == "switch":
            if child := self._switch(source, mates):
                return child
            operator = "controller"  # of two networks that are good at one side each there are none
        morphology, controller = parent.morphology, parent.controller
        if operator == "exchange":
            controller = mates.donor(self._config.donors)
            if controller == parent.controller:  # which may be all that there is
                operator = "controller"
        while (morphology, controller) == (parent.morphology, parent.controller):
            if operator != "controller":
                morphology = self._bodies.mutate(parent.morphology, self.rng, self._config.body)
            if operator != "morphology":
                origin = parent.controller
                if self._config.crossover and self.rng.random() < self._config.crossover:
                    origin = self._neat.cross(*mates.pair(), self.rng)
                controller = self._neat.mutate(origin, self.rng)
        return Solution(
            number=self._next_number(),
            morphology=morphology,
            controller=controller,
            parent=parent.number,
            operator=operator,
            source=source,
        )

    def _switch(self, source: str | None, mates: Mates) -> Solution | None:
        """Return a body with two of its controllers as one, or None if there are none to join.

        Its parent is the one that is better at its left. What has been joined before is mutated, too.
        """
        if self._sides is None or (pair := mates.specialists()) is None:
            return None
        controller = switched(
            pair.left.controller,
            pair.right.controller,
            bearing=self._sides.bearing,
            reach=self._sides.reach,
            new_node=self._neat.next_node,
            new_innovation=self._neat.next_innovation,
        )
        if controller is None:
            return None
        if pair.again:
            controller = self._neat.mutate(controller, self.rng)
        return Solution(
            number=self._next_number(),
            morphology=pair.left.morphology,
            controller=controller,
            parent=pair.left.number,
            operator="switch",
            source=source,
        )

    def again(self, elite: Solution) -> Solution:
        """Return an elite under a new number, which gives it other noise."""
        return dataclasses.replace(
            elite, number=self._next_number(), parent=elite.number, operator=AGAIN, source=None
        )

    def state(self) -> dict[str, Any]:
        """Return what ``restore`` needs, JSON-ready."""
        return {"n_asked": self._n_drawn, "rng": rng_state(self.rng), "neat": self._neat.state()}

    def restore(self, state: dict[str, Any]) -> None:
        """Go back to what ``state`` returned; other keys are ignored."""
        self._n_drawn = state["n_asked"]
        restore_rng(self.rng, state["rng"])
        self._neat.restore(state["neat"])

    def _next_number(self) -> int:
        self._n_drawn += 1
        return self._n_drawn - 1
