"""Breeding: the configuration of a run whose designer chooses the parents, made from a few choices.

Such a run is like any other. It starts from the chosen robots and their mutants, has small generations, so
that children are seen soon, and mutates as far as the designer wants to go from the parents.
"""

from __future__ import annotations

import dataclasses
import typing
from collections.abc import Sequence
from typing import Any, Final, Literal

from engine.body.morphology import BodyRates
from engine.config import RunConfig, replaced
from engine.control.rates import NeatRates
from engine.errors import InvalidData
from engine.search.map_search import MapSearchConfig
from engine.search.variation import VariationConfig

Held = Literal["nothing", "bodies", "controllers"]
"""What all children have from their parents unchanged."""
MAX_PARENTS: Final = 8
"""Most robots that are bred at once."""
CHILDREN: Final = 8
"""Robots in a generation: lanes that are simulated in little more time than one."""
MAX_GENERATIONS: Final = 100
SPAN: Final = 3.0
"""How many times larger than the usual one a rate is for the strongest mutations, and smaller for the
weakest."""
_REFITS: Final = (0, 1, 2, 4, 8, 16, 32, 64)
"""With few robots, the first axes of the controller map say little."""


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Breeding:
    """What a designer chooses.

    Attributes:
        strength: of the mutations: 0 near the parents, 0.5 as usual, 1 far from them.
        hold: what does not change.
        generations: that are bred, the first among them.
        seed: of everything random.

    Raises:
        InvalidData: a choice is none on offer, or a number is out of its range.
    """

    strength: float = 0.5
    hold: Held = "nothing"
    generations: int = 5
    seed: int = 0

    def __post_init__(self) -> None:
        if not 0.0 <= self.strength <= 1.0:
            raise InvalidData(f"the strength of mutations must be from 0 to 1, not {self.strength}")
        if self.hold not in typing.get_args(Held):
            raise InvalidData(f"hold must be one of {', '.join(typing.get_args(Held))}, not {self.hold!r}")
        if not 1 <= self.generations <= MAX_GENERATIONS:
            raise InvalidData(f"generations must be from 1 to {MAX_GENERATIONS}, not {self.generations}")


def breeding_config(choices: Breeding, parents: Sequence[RunConfig]) -> RunConfig:
    """Return the configuration of a run that breeds robots.

    What the robots are asked to do and how they are simulated is taken from the run of the first parent, but
    for what takes time: one noise seed, by the kernel.

    Args:
        choices: of the designer.
        parents: the configuration of each parent's run.

    Raises:
        InvalidData: there are no parents or too many, or they cannot be bred together.
    """
    if not 1 <= len(parents) <= MAX_PARENTS:
        raise InvalidData(f"choose 1 to {MAX_PARENTS} robots to breed from, not {len(parents)}")
    base = parents[0]
    for other in parents[1:]:
        for what, of in _SHARED.items():
            if of(base) != of(other):
                raise InvalidData(
                    f"these robots cannot be bred together: their {what} differ ({of(base)} and {of(other)})"
                )
    first = len(parents) + CHILDREN
    weights: dict[Held, dict[str, int]] = {
        "nothing": {},
        "bodies": {"morphology_weight": 0, "both_weight": 0},
        "controllers": {"controller_weight": 0, "both_weight": 0},
    }
    return replaced(
        base,
        algorithm="dm-me",
        evaluations=first + CHILDREN * (choices.generations - 1),
        overlap=0,
        seed=choices.seed,
        map_search=MapSearchConfig(
            initial=first,
            fill="mutants",
            batch_size=CHILDREN,
            refit_generations=_REFITS,
            sensory=base.map_search.sensory,
        ),
        variation=VariationConfig(
            body=body_rates(choices.strength),
            neat=dataclasses.replace(
                neat_rates(choices.strength),
                hidden=base.variation.neat.hidden,
                version=base.variation.neat.version,
            ),
            switch_weight=0,  # it might take another body of the same size
            **weights[choices.hold],
        ),
        trials=dataclasses.replace(base.trials, repeats=1, trajectory_bits=base.trials.trajectory_bits or 14),
        physics=dataclasses.replace(base.physics, simulator="kernel"),
    )


def body_rates(strength: float) -> BodyRates:
    """Return the rates of bodies for a strength from 0 to 1; none falls as it rises."""
    usual, most = BodyRates(), {"module_rate": 0.5}
    return BodyRates(
        **{
            f.name: min(getattr(usual, f.name) * _factor(strength), most.get(f.name, 1.0))
            for f in dataclasses.fields(usual)
        }
    )


def neat_rates(strength: float) -> NeatRates:
    """Return the rates and powers of controllers for a strength from 0 to 1; none falls as it rises."""
    usual = NeatRates()
    return dataclasses.replace(
        usual,
        **{
            f.name: getattr(usual, f.name) * _factor(strength)
            for f in dataclasses.fields(usual)
            if f.type == "float"
        },
    )


def _factor(strength: float) -> float:
    return SPAN ** (2.0 * strength - 1.0)


_SHARED: Final[dict[str, Any]] = {
    "tasks": lambda c: c.task,
    "units of the sensors": lambda c: c.sensors,
    "kinds of stiffness": lambda c: c.stiffness,
    "ways to find the head": lambda c: c.head_search,
    "outputs without inputs": lambda c: c.trials.unfed_outputs,
}
"""Without these in common a robot is not itself in the other's run."""
