"""The bodies that a search draws, and the map of the body that they lie on."""

from __future__ import annotations

import dataclasses
import random
from typing import Final

from engine.body.feet import FEET, Feet
from engine.body.module import MAX_MODULES, MIN_MODULES, N_STIFFNESS_LEVELS
from engine.body.morphology import (
    PUBLISHED_RATES,
    BodyRates,
    Morphology,
    StiffnessMode,
    mutate_morphology,
    random_morphology,
)
from engine.search.archive import Cell, GridArchive
from engine.search.axes import Axis, body_cell

N_SIZES: Final = MAX_MODULES - MIN_MODULES + 1


@dataclasses.dataclass(frozen=True, slots=True)
class BodySpace:
    """Which bodies there are, and what tells them apart.

    The first axis of the map is the number of modules, the second the stiffness level. Where each module has
    its own stiffness, the second is the softest one's and a third the stiffest's.

    Attributes:
        stiffness: whether a body's modules share one stiffness.
        rhythms: whether its modules have rhythms.
        feet: those that a body may have.
        feet_axis: whether they, in the order of ``FEET``, are one more axis of the map, the last.
    """

    stiffness: StiffnessMode = "shared"
    rhythms: bool = False
    feet: tuple[Feet, ...] = ("none",)
    feet_axis: bool = False

    def draw(self, rng: random.Random) -> Morphology:
        """Draw a body."""
        return random_morphology(rng, self.stiffness, rhythms=self.rhythms, feet=self.feet)

    def mutate(
        self, parent: Morphology, rng: random.Random, rates: BodyRates = PUBLISHED_RATES
    ) -> Morphology:
        """Return a mutated copy, which may equal its parent."""
        return mutate_morphology(parent, rng, rates, self.feet)

    @property
    def shape(self) -> tuple[int, ...]:
        """The number of cells along each axis."""
        return tuple(axis.n for axis in self.axes)

    @property
    def n_possible(self) -> int:
        """How many of the cells a body can lie in.

        Where each module has its own stiffness, half of the cells ask for a softest module that is stiffer
        than the stiffest: 9 x 55 of 9 x 10 x 10 are possible.
        """
        pairs = N_STIFFNESS_LEVELS * (N_STIFFNESS_LEVELS + 1) // 2
        n = N_SIZES * (pairs if self.stiffness == "per-module" else N_STIFFNESS_LEVELS)
        return n * (len(FEET) if self.feet_axis else 1)

    @property
    def axes(self) -> tuple[Axis, ...]:
        """What the axes are."""
        names = ("softest", "stiffest") if self.stiffness == "per-module" else ("stiffness",)
        n = N_STIFFNESS_LEVELS
        return (
            Axis("modules", MIN_MODULES - 0.5, MAX_MODULES + 0.5, N_SIZES),
            *(Axis(name, 0.05, 0.05 + n / 10, n) for name in names),
            *((Axis("feet", -0.5, len(FEET) - 0.5, len(FEET)),) if self.feet_axis else ()),
        )

    def cell(self, body: Morphology) -> Cell:
        """Return the cell that a body lies in."""
        return body_cell(self.axes, body)

    def archive(self) -> GridArchive:
        """Return an empty archive with these cells."""
        return GridArchive(shape=self.shape, n_possible=self.n_possible)


PUBLISHED_BODIES: Final = BodySpace()
"""One stiffness for all modules of a robot, no rhythms, no feet."""
