"""The body's genotype: number of modules, their stiffness, one joining face per module."""

from __future__ import annotations

import dataclasses
import random
from collections.abc import Sequence
from typing import Any, Final, Literal, Self

from engine.body.feet import FEET, FEET_TEXT, Feet
from engine.body.module import MAX_MODULES, MIN_MODULES, N_STIFFNESS_LEVELS, module_number
from engine.body.servo import N_RHYTHMS, PULSE
from engine.errors import InvalidData

StiffnessMode = Literal["shared", "per-module"]
"""Whether all modules of a body share one stiffness, as in the paper, or each has its own."""

HeadSearch = Literal["together", "rhythms"]
"""Whether all modules pulse alike while the head is searched, or each by a gene of its own, as published."""

N_FACES: Final = 8


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class BodyRates:
    """How bodies are mutated; the defaults are the published ones.

    The published face rate is 0.6 x 1/2, whose other half redraws a rhythm. With a stiffness per module it is
    0.6 x 1/3 for face, stiffness and rhythm each. Bodies without rhythms leave out that part.

    Raises:
        InvalidData: a number is out of its range.
    """

    body_rate: float = 0.3
    """Probability that the body changes as a whole: a module more, a module less or another stiffness."""
    face_rate: float = 0.3
    """Probability, for each module, that its joining face is drawn anew; and again its rhythm, if any."""
    module_rate: float = 0.2
    """The same with a stiffness per module, and again the probability that its stiffness is drawn anew."""
    feet_rate: float = 0.1
    """Probability that the feet are drawn anew, where they evolve; a third of the draws change nothing."""

    def __post_init__(self) -> None:
        # a mutation is repeated until something has changed
        for name, least, most in (
            ("body_rate", 0.01, 1.0),
            ("face_rate", 0.0, 1.0),
            ("module_rate", 0.0, 0.5),
            ("feet_rate", 0.0, 1.0),
        ):
            if not least <= getattr(self, name) <= most:
                raise InvalidData(f"{name} must be from {least:g} to {most:g}, not {getattr(self, name)}")


PUBLISHED_RATES: Final = BodyRates()


@dataclasses.dataclass(frozen=True, slots=True)
class Morphology:
    """A linear chain of tensegrity modules.

    Attributes:
        stiffness_level: 1..10, of all modules; the relative stiffness is a tenth of it. A tuple gives
            every module its own.
        faces: per module the face, 1..8, that the next module attaches to. The last module has this gene too:
            its face is the front of the robot when the chain's end is its head.
        rhythms: per module how it contracts while the head is searched, 0..7, see ``servo.N_RHYTHMS``; empty
            where all modules pulse together.
        feet: whether it has feet that grip one way, and towards which end of the chain they slide.

    Raises:
        InvalidData: a gene is out of range.
    """

    stiffness_level: int | tuple[int, ...]
    faces: tuple[int, ...]
    rhythms: tuple[int, ...] = ()
    feet: Feet = "none"

    def __post_init__(self) -> None:
        if not isinstance(self.faces, tuple):
            raise InvalidData("the faces of a morphology must be a tuple of integers")
        _check_int("number of modules", len(self.faces), MIN_MODULES, MAX_MODULES)
        for face in self.faces:
            _check_int("face", face, 1, N_FACES)
        if isinstance(self.stiffness_level, tuple) and len(self.stiffness_level) != len(self.faces):
            raise InvalidData(
                f"a morphology of {len(self.faces)} modules has {len(self.stiffness_level)} stiffness levels"
            )
        for level in self.stiffness_levels:
            _check_int("stiffness level", level, 1, N_STIFFNESS_LEVELS)
        if not isinstance(self.rhythms, tuple) or len(self.rhythms) not in (0, len(self.faces)):
            raise InvalidData(
                "the rhythms of a morphology must be a tuple of integers, one per module or none"
            )
        for rhythm in self.rhythms:
            _check_int("rhythm", rhythm, 0, N_RHYTHMS - 1)
        if self.feet not in FEET:
            raise InvalidData(f"feet must be one of {', '.join(FEET)}, not {self.feet!r:.60}")

    @property
    def n_modules(self) -> int:
        """Number of modules, 2 to 10."""
        return len(self.faces)

    @property
    def stiffness_mode(self) -> StiffnessMode:
        """Whether the modules share one stiffness gene."""
        return "per-module" if isinstance(self.stiffness_level, tuple) else "shared"

    @property
    def stiffness_levels(self) -> tuple[int, ...]:
        """The level of each module, 1..10."""
        level = self.stiffness_level
        return level if isinstance(level, tuple) else (level,) * len(self.faces)

    @property
    def stiffnesses(self) -> tuple[float, ...]:
        """Relative stiffness of each module, 0.1 to 1.0."""
        return tuple(level / N_STIFFNESS_LEVELS for level in self.stiffness_levels)

    @property
    def open_loop(self) -> tuple[int, ...]:
        """How each module contracts while the head is searched, see ``servo.N_RHYTHMS``."""
        return self.rhythms or (PULSE,) * len(self.faces)

    @property
    def stiffness(self) -> float:
        """Relative stiffness, 0.1 to 1.0; the modules' mean where each has its own."""
        level = self.stiffness_level
        if isinstance(level, tuple):
            return sum(level) / (N_STIFFNESS_LEVELS * len(level))
        return level / N_STIFFNESS_LEVELS

    @property
    def stiffness_text(self) -> str:
        """The relative stiffness as text: ``0.3``, or ``0.1 0.5 0.3`` where each module has its own."""
        if self.stiffness_mode == "shared":
            return f"{self.stiffness:.1f}"
        return " ".join(f"{s:.1f}" for s in self.stiffnesses)

    def to_json(self) -> dict[str, Any]:
        """Return the genotype as JSON-ready values."""
        level = self.stiffness_level
        found: dict[str, Any] = {
            "stiffness_level": list(level) if isinstance(level, tuple) else level,
            "faces": list(self.faces),
        }
        if self.rhythms:
            found["rhythms"] = list(self.rhythms)
        if self.feet != "none":
            found["feet"] = self.feet
        return found

    @classmethod
    def from_json(cls, data: Any) -> Self:
        """Read a genotype back from ``to_json``'s form.

        Raises:
            InvalidData: a key is missing or a value has the wrong type or range.
        """
        if not isinstance(data, dict) or set(data) - {"rhythms", "feet"} != {"stiffness_level", "faces"}:
            raise InvalidData(
                "a morphology needs the keys 'stiffness_level' and 'faces', and may have 'rhythms' and 'feet'"
            )
        for key in ("faces", "rhythms"):
            if not isinstance(data.get(key, []), list):
                raise InvalidData(f"the {key} of a morphology must be a list of integers")
        level = data["stiffness_level"]
        return cls(
            stiffness_level=tuple(level) if isinstance(level, list) else level,
            faces=tuple(data["faces"]),
            rhythms=tuple(data.get("rhythms", ())),
            feet=data.get("feet", "none"),
        )


def random_morphology(
    rng: random.Random,
    stiffness: StiffnessMode = "shared",
    *,
    rhythms: bool = False,
    feet: Sequence[Feet] = ("none",),
) -> Morphology:
    """Draw a morphology uniformly; modules, stiffness, faces, rhythms and feet are independent.

    Args:
        rng: source of randomness.
        stiffness: whether the modules share one stiffness.
        rhythms: whether they have rhythms.
        feet: those that it may have; nothing is drawn where there is no choice.
    """
    n_modules = rng.randint(MIN_MODULES, MAX_MODULES)
    levels: int | tuple[int, ...]
    if stiffness == "per-module":
        levels = tuple(_random_level(rng) for _ in range(n_modules))
    else:
        levels = _random_level(rng)
    faces = tuple(_random_face(rng) for _ in range(n_modules))
    own = tuple(_random_rhythm(rng) for _ in range(n_modules)) if rhythms else ()
    return Morphology(levels, faces, own, _random_feet(rng, feet))


def mutate_morphology(
    parent: Morphology,
    rng: random.Random,
    rates: BodyRates = PUBLISHED_RATES,
    feet: Sequence[Feet] = ("none",),
) -> Morphology:
    """Return a mutated copy (it may equal its parent: the caller decides whether to try again).

    With probability ``body_rate`` one global mutation, drawn uniformly from inserting a random module at a
    random place, deleting a random module and redrawing the stiffness; one that would leave the range
    of 2 to 10 modules does nothing. Then every module redraws its face with probability ``face_rate``.

    Where every module has its own stiffness there is no global redraw, and its third of the global mutations
    does nothing. Instead every module redraws either its face or its stiffness, with probability
    ``module_rate`` each. The published code does the same; no published configuration uses it.

    A module that has a rhythm redraws that instead with the same probability. Where there is a choice of
    feet, they are redrawn last with probability ``feet_rate``.
    """
    body = _mutate_modules(parent, rng, rates)
    if len(feet) > 1 and rng.random() < rates.feet_rate:
        return dataclasses.replace(body, feet=_random_feet(rng, feet))
    return body


def _mutate_modules(parent: Morphology, rng: random.Random, rates: BodyRates) -> Morphology:
    faces, rhythms = list(parent.faces), list(parent.rhythms)
    stiffness_level = parent.stiffness_level
    if isinstance(stiffness_level, tuple):
        levels = _mutate_per_module(list(stiffness_level), faces, rhythms, rng, rates)
        return Morphology(levels, tuple(faces), tuple(rhythms), parent.feet)
    if rng.random() < rates.body_rate:
        kind = rng.choice(("insert", "delete", "stiffness"))
        if kind == "insert" and len(faces) < MAX_MODULES:
            where = rng.randint(0, len(faces))
            faces.insert(where, _random_face(rng))
            if rhythms:
                rhythms.insert(where, _random_rhythm(rng))
        elif kind == "delete" and len(faces) > MIN_MODULES:
            where = rng.randrange(len(faces))
            del faces[where], rhythms[where : where + 1]
        elif kind == "stiffness":
            stiffness_level = _random_level(rng)
    for i in range(len(faces)):
        draw = rng.random()
        if draw < rates.face_rate:
            faces[i] = _random_face(rng)
        elif rhythms and draw < 2 * rates.face_rate:
            rhythms[i] = _random_rhythm(rng)
    return Morphology(stiffness_level, tuple(faces), tuple(rhythms), parent.feet)


def _mutate_per_module(
    levels: list[int], faces: list[int], rhythms: list[int], rng: random.Random, rates: BodyRates
) -> tuple[int, ...]:
    """Change faces and rhythms in place; return the stiffness levels."""
    if rng.random() < rates.body_rate:
        kind = rng.choice(("insert", "delete", "nothing"))
        if kind == "insert" and len(faces) < MAX_MODULES:
            where = rng.randint(0, len(faces))
            faces.insert(where, _random_face(rng))
            levels.insert(where, _random_level(rng))
            if rhythms:
                rhythms.insert(where, _random_rhythm(rng))
        elif kind == "delete" and len(faces) > MIN_MODULES:
            where = rng.randrange(len(faces))
            del faces[where], levels[where], rhythms[where : where + 1]
    for i in range(len(faces)):
        draw = rng.random()
        if draw < rates.module_rate:
            faces[i] = _random_face(rng)
        elif draw < 2 * rates.module_rate:
            levels[i] = _random_level(rng)
        elif rhythms and draw < 3 * rates.module_rate:
            rhythms[i] = _random_rhythm(rng)
    return tuple(levels)


def _random_level(rng: random.Random) -> int:
    return rng.randint(1, N_STIFFNESS_LEVELS)


def _random_face(rng: random.Random) -> int:
    return rng.randint(1, N_FACES)


def _random_rhythm(rng: random.Random) -> int:
    return rng.randrange(N_RHYTHMS)


def _random_feet(rng: random.Random, feet: Sequence[Feet]) -> Feet:
    return rng.choice(feet) if len(feet) > 1 else feet[0]


def _check_int(what: str, value: Any, low: int, high: int) -> None:
    if type(value) is not int or not low <= value <= high:
        raise InvalidData(f"{what} must be a whole number from {low} to {high}, not {value!r}")


def body_changes(parent: Morphology, child: Morphology) -> list[str]:
    """Return what differs between two bodies, in words; modules count from 1.

    An added or removed module is named such that the fewest differences remain in the others.
    """
    old, new = list(parent.faces), list(child.faces)
    changes = []
    moved = len(new) - len(old)
    kept = list(range(len(new)))  # modules of the child that have a counterpart in the parent
    if abs(moved) == 1:
        longer, shorter = (new, old) if moved > 0 else (old, new)
        at = min(range(len(longer)), key=lambda i: _differences(longer[:i] + longer[i + 1 :], shorter))
        changes.append(f"module {module_number(at)} {'added' if moved > 0 else 'removed'}")
        if moved > 0:
            kept.remove(at)
            new = new[:at] + new[at + 1 :]
        else:
            old = old[:at] + old[at + 1 :]
    elif moved:
        return [f"{len(old)} → {len(new)} modules", *_feet_change(parent, child)]
    turned = [kept[i] for i, (a, b) in enumerate(zip(old, new, strict=True)) if a != b]
    if not moved and parent.rhythms != child.rhythms:
        changes.append("rhythms")
    if turned:
        modules = ", ".join(str(module_number(i)) for i in turned)
        changes.append(f"face{'s' if len(turned) > 1 else ''} of {modules}")
    if parent.stiffness_level != child.stiffness_level:
        if child.stiffness_mode == parent.stiffness_mode == "shared":
            changes.append(f"stiffness {parent.stiffness_text} → {child.stiffness_text}")
        elif not moved:
            changes.append("stiffnesses")
    return changes + _feet_change(parent, child)


def _feet_change(parent: Morphology, child: Morphology) -> list[str]:
    if parent.feet == child.feet:
        return []
    return [f"feet {FEET_TEXT[parent.feet]} → {FEET_TEXT[child.feet]}"]


def _differences(a: list[int], b: list[int]) -> int:
    return sum(x != y for x, y in zip(a, b, strict=True))


def with_feet(body: Morphology, feet: Feet) -> Morphology:
    """Return a body with other feet.

    Raises:
        InvalidData: there are no such feet.
    """
    return dataclasses.replace(body, feet=feet)


def with_modules(body: Morphology, n: int) -> Morphology:
    """Return a body with modules removed from its end, or added there as copies of its last one.

    Raises:
        InvalidData: the number of modules is out of range.
    """
    if not MIN_MODULES <= n <= MAX_MODULES:
        raise InvalidData(f"modules must be from {MIN_MODULES} to {MAX_MODULES}, not {n}")
    faces = (body.faces + body.faces[-1:] * n)[:n]
    level = body.stiffness_level
    if isinstance(level, tuple):
        level = (level + level[-1:] * n)[:n]
    rhythms = (body.rhythms + body.rhythms[-1:] * n)[:n]
    return dataclasses.replace(body, stiffness_level=level, faces=faces, rhythms=rhythms)


def with_face(body: Morphology, module: int, face: int) -> Morphology:
    """Return a body in which one module, counted from 0, joins the next one at another face.

    Raises:
        InvalidData: there is no such module or face.
    """
    if not 0 <= module < body.n_modules:
        raise InvalidData(f"module must be from 1 to {body.n_modules}, not {module + 1}")
    return dataclasses.replace(body, faces=(*body.faces[:module], face, *body.faces[module + 1 :]))


def with_stiffness(body: Morphology, level: int, module: int | None = None) -> Morphology:
    """Return a body with another stiffness level, in all modules or in one, counted from 0.

    Raises:
        InvalidData: there is no such level or module, or its modules share one stiffness.
    """
    if not 1 <= level <= N_STIFFNESS_LEVELS:
        raise InvalidData(f"stiffness level must be from 1 to {N_STIFFNESS_LEVELS}, not {level}")
    levels = body.stiffness_level
    if module is None:
        every = (level,) * len(levels) if isinstance(levels, tuple) else level
        return dataclasses.replace(body, stiffness_level=every)
    if not isinstance(levels, tuple):
        raise InvalidData("the modules of this robot share one stiffness")
    if not 0 <= module < body.n_modules:
        raise InvalidData(f"module must be from 1 to {body.n_modules}, not {module + 1}")
    return dataclasses.replace(body, stiffness_level=(*levels[:module], level, *levels[module + 1 :]))
