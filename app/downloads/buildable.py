"""Whether a robot can be built from a material, told before its files are made."""

from __future__ import annotations

import functools
import threading
from typing import Final

from engine.body.module import N_STIFFNESS_LEVELS
from engine.body.morphology import Morphology
from engine.errors import InvalidData
from engine.fabrication.materials import PRESETS, load_materials

_one_at_a_time: Final = threading.Lock()


def problems_of(body: Morphology, material: object) -> tuple[str, ...]:
    """Return why a body cannot be made from a material: sentences, none if it can.

    Takes a third of a second for every stiffness that it has not seen before.

    Raises:
        InvalidData: the material is not on offer.
    """
    if not isinstance(material, str) or material not in PRESETS:
        raise InvalidData(f"Choose a material: {', '.join(PRESETS)}.")
    found: list[str] = []
    for level in sorted(set(body.stiffness_levels)):
        with _one_at_a_time:  # many browsers ask for the same few
            found += _of_level(level, material)
    return tuple(dict.fromkeys(found))


def instead_of(body: Morphology, material: str) -> str:
    """Return the preset that a body's files are made of where its cables cannot be of that one; else none."""
    from engine.fabrication.dimensions.cable_problems import makeable

    made = makeable(body, load_materials(material))
    return made.file if made.instead else ""


@functools.lru_cache(maxsize=len(PRESETS) * N_STIFFNESS_LEVELS)
def _of_level(level: int, material: str) -> tuple[str, ...]:
    """Return the problems of modules of one stiffness, however many there are."""
    from engine.fabrication.buildability import problems  # meshes take a second to import

    return tuple(p.text for p in problems(Morphology(level, (1, 1)), load_materials(material)))
