"""The body's genotype: number of modules, one stiffness for all, one joining face per module."""

from __future__ import annotations

import dataclasses
import random
from typing import Any, Final, Self

from engine.errors import InvalidData
from engine.tensegrity import MAX_MODULES, MIN_MODULES, N_STIFFNESS_LEVELS

N_FACES: Final = 8
GLOBAL_MUTATION_PROBABILITY: Final = 0.3
FACE_MUTATION_PROBABILITY: Final = 0.3
"""0.6 x 1/2 of the published configuration: the other half redrew an open-loop gene we do not have."""


@dataclasses.dataclass(frozen=True, slots=True)
class Morphology:
    """A linear chain of tensegrity modules.

    Attributes:
        stiffness_level: 1..10; the relative stiffness is a tenth of it.
        faces: per module the face, 1..8, that the next module attaches to. The last module keeps its
            gene as well: that face is the front of the robot when the chain's end is its head.

    Raises:
        InvalidData: a gene is out of range.
    """

    stiffness_level: int
    faces: tuple[int, ...]

    def __post_init__(self) -> None:
        _check_int("stiffness level", self.stiffness_level, 1, N_STIFFNESS_LEVELS)
        if not isinstance(self.faces, tuple):
            raise InvalidData("the faces of a morphology must be a tuple of integers")
        _check_int("number of modules", len(self.faces), MIN_MODULES, MAX_MODULES)
        for face in self.faces:
            _check_int("face", face, 1, N_FACES)

    @property
    def n_modules(self) -> int:
        """Number of modules, 2 to 10."""
        return len(self.faces)

    @property
    def stiffness(self) -> float:
        """Relative stiffness, 0.1 to 1.0."""
        return self.stiffness_level / N_STIFFNESS_LEVELS

    def to_json(self) -> dict[str, Any]:
        """Return the genotype as JSON-ready values."""
        return {"stiffness_level": self.stiffness_level, "faces": list(self.faces)}

    @classmethod
    def from_json(cls, data: Any) -> Self:
        """Read a genotype back from ``to_json``'s form.

        Raises:
            InvalidData: a key is missing or a value has the wrong type or range.
        """
        if not isinstance(data, dict) or set(data) != {"stiffness_level", "faces"}:
            raise InvalidData("a morphology needs exactly the keys 'stiffness_level' and 'faces'")
        if not isinstance(data["faces"], list):
            raise InvalidData("the faces of a morphology must be a list of integers")
        return cls(stiffness_level=data["stiffness_level"], faces=tuple(data["faces"]))


def random_morphology(rng: random.Random) -> Morphology:
    """Draw a morphology uniformly: modules, stiffness and faces are independent."""
    n_modules = rng.randint(MIN_MODULES, MAX_MODULES)
    return Morphology(
        stiffness_level=rng.randint(1, N_STIFFNESS_LEVELS),
        faces=tuple(rng.randint(1, N_FACES) for _ in range(n_modules)),
    )


def mutate_morphology(parent: Morphology, rng: random.Random) -> Morphology:
    """Return a mutated copy (it may equal its parent: the caller decides whether to try again).

    With probability 0.3 one global mutation, drawn uniformly from inserting a random module at a
    random place, deleting a random module and redrawing the stiffness; one that would leave the range
    of 2 to 10 modules does nothing. Then every module redraws its face with probability 0.3.
    """
    faces = list(parent.faces)
    stiffness_level = parent.stiffness_level
    if rng.random() < GLOBAL_MUTATION_PROBABILITY:
        kind = rng.choice(("insert", "delete", "stiffness"))
        if kind == "insert" and len(faces) < MAX_MODULES:
            faces.insert(rng.randint(0, len(faces)), rng.randint(1, N_FACES))
        elif kind == "delete" and len(faces) > MIN_MODULES:
            del faces[rng.randrange(len(faces))]
        elif kind == "stiffness":
            stiffness_level = rng.randint(1, N_STIFFNESS_LEVELS)
    for i in range(len(faces)):
        if rng.random() < FACE_MUTATION_PROBABILITY:
            faces[i] = rng.randint(1, N_FACES)
    return Morphology(stiffness_level=stiffness_level, faces=tuple(faces))


def _check_int(what: str, value: Any, low: int, high: int) -> None:
    if type(value) is not int or not low <= value <= high:
        raise InvalidData(f"{what} must be a whole number from {low} to {high}, not {value!r}")
