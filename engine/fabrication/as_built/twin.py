"""The description of a built robot as a physics to simulate it with."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping
from typing import Any, Final

from engine.body import module as t
from engine.body.morphology import Morphology
from engine.config import RunConfig
from engine.fabrication.as_built.deviation import Deviation
from engine.fabrication.as_built.deviations import deviations
from engine.fabrication.dimensions.feet import Foot, robot_feet
from engine.fabrication.materials import Materials
from engine.simulation.built import Built, Spread
from engine.simulation.evaluation import Evaluation
from engine.simulation.physics import Physics, as_built, one_of

FEET_PAIRS: Final = ((0.3, 0.8), (0.35, 0.7), (0.4, 0.6), (0.45, 0.55), (0.5, 0.5))
"""Friction of feet, forward and backward, with which a robot that has some is tried: from good to none."""
SOFT: Final = 2
"""The stiffness level whose masses and centre of mass stand for those of all bodies that a search tries.

The kernel simulates robots side by side that weigh the same. Soft bodies are those that crawl; with a net of
latex they weigh what was simulated within 0.1 g a rod up to level 4, and stiffer ones more.
"""


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Twin:
    """A robot as it would be built.

    Attributes:
        physics: of the run, whose robots may be as built themselves.
        deviations: how the built robot differs from the published one.
        footed: whether it has feet that grip one way.
    """

    physics: Physics
    deviations: tuple[Deviation, ...]
    footed: bool = False

    @property
    def built(self) -> Built:
        """What the robot is like."""
        figures: dict[str, Any] = {}
        for d in self.deviations:
            figures |= d.figures
        return Built(**figures)

    @property
    def spread(self) -> Spread:
        """How robots of the design differ."""
        scatter: dict[str, float] = {}
        for d in self.deviations:
            scatter |= d.scatter
        return Spread(**scatter)

    @property
    def nominal(self) -> Physics:
        """The physics of the design, without spread."""
        return as_built(self.physics, self.built)

    @property
    def varied(self) -> Physics:
        """The physics of the design with its spread, for a search: each repeat has another robot."""
        return as_built(self.physics, self.built, self.spread)

    def samples(self, n: int) -> list[Physics]:
        """Return the physics of the first n robots of the design; more of them begin with the same ones."""
        varied = dataclasses.replace(self.varied, timestep=self.physics.timestep)
        return [one_of(varied, (k,)) for k in range(n)]

    def alone(self) -> Mapping[str, Physics]:
        """Return by key the physics with one difference alone, of those that the design has."""
        return {
            d.key: as_built(self.physics, dataclasses.replace(self.physics.built, **d.figures))
            for d in self.deviations
            if dataclasses.replace(self.physics.built, **d.figures) != self.physics.built
        }

    def feet_pairs(self) -> Mapping[tuple[float, float], Physics]:
        """Return the design's physics with each of ``FEET_PAIRS``; none for a robot without feet."""
        return {
            pair: as_built(
                self.physics, dataclasses.replace(self.built, feet_forward=pair[0], feet_backward=pair[1])
            )
            for pair in (FEET_PAIRS if self.footed else ())
        }


def twin_of(
    physics: Physics,
    morphology: Morphology,
    materials: Materials,
    levels: Iterable[int] | None = None,
    feet: tuple[Foot, ...] = (),
) -> Twin:
    """Return the twin of a robot.

    Args:
        physics: of its run.
        morphology: its body.
        materials: what it is built from.
        levels: stiffness levels for which it holds, see ``deviations``.
        feet: that it wears.

    Raises:
        InvalidData: the materials give a robot that cannot be, such as one with a negative mass.
    """
    forward, backward = physics.feet_friction
    simulated = {
        "friction": f"coefficient {physics.friction:g}",
        "feet": f"{forward:g} forward, {backward:g} backward",
    }
    described = tuple(
        dataclasses.replace(d, simulated=simulated.get(d.key, d.simulated))
        for d in deviations(morphology, materials, levels, feet)
    )
    plain = dataclasses.replace(physics, spread=Spread())
    return Twin(physics=plain, deviations=described, footed=morphology.feet != "none")


def twin_of_robot(config: RunConfig, evaluation: Evaluation, materials: Materials) -> Twin:
    """Return the twin of a robot of a run, with the feet that it would wear.

    Raises:
        InvalidData: as for ``twin_of``, or today's robots do not survive the run's physics.
        TaskError: a user's task returns invalid values.
    """
    feet = robot_feet(config, evaluation).feet
    return twin_of(config.physics, evaluation.solution.morphology, materials, feet=feet)


def search_physics(
    physics: Physics, materials: Materials, *, spread: bool, level: int = SOFT, footed: bool = False
) -> Physics:
    """Return the physics to search with for robots that are to be built.

    Args:
        physics: of the run.
        materials: what its robots will be built from.
        spread: whether every repeat of an evaluation has another robot of the design.
        level: stiffness level of the bodies whose masses and centre of mass it has, 1 to 10.
        footed: whether robots may have feet; theirs have the friction that was measured, and no mass.
    """
    body = Morphology(level, (1,) * 5, feet="end" if footed else "none")
    twin = twin_of(physics, body, materials, levels=range(1, t.N_STIFFNESS_LEVELS + 1))
    return twin.varied if spread else twin.nominal
