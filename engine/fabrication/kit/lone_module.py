"""A robot's module without the others, for everything that is made of a body."""

from __future__ import annotations

from engine.body.module import N_STIFFNESS_LEVELS
from engine.body.morphology import Morphology
from engine.errors import InvalidData


class LoneModule(Morphology):
    """One module; no robot of a run is one."""

    __slots__ = ()

    def __post_init__(self) -> None:
        level = self.stiffness_level
        if not isinstance(level, int) or not 1 <= level <= N_STIFFNESS_LEVELS or len(self.faces) != 1:
            raise InvalidData("a lone module has one stiffness and one face")

    @classmethod
    def of(cls, morphology: Morphology, module: int = 0) -> LoneModule:
        """Return a module of a robot, the first one if nothing is said."""
        return cls(morphology.stiffness_levels[module], (morphology.faces[module],))
