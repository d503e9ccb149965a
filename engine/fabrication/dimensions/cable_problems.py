"""Which passive cables cannot be made or would not last, and what would work instead."""

from __future__ import annotations

import dataclasses
import math

from engine.body.morphology import Morphology
from engine.fabrication.dimensions.cables import CableDesign, cable_design
from engine.fabrication.materials import (
    MAX_TAIL,
    PRESETS,
    CableMaterial,
    Materials,
    Printer,
    load_materials,
)


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Problem:
    """Something that cannot be made as asked.

    Attributes:
        modules: which modules it concerns.
        text: what is wrong, one sentence.
        proposals: what would help; each was checked with these formulas.
    """

    modules: tuple[int, ...]
    text: str
    proposals: tuple[str, ...]


def cable_problems(morphology: Morphology, materials: Materials) -> tuple[Problem, ...]:
    """Return every problem of the cables once, with the modules that it concerns."""
    levels = morphology.stiffness_levels
    found: list[Problem] = []
    for level in dict.fromkeys(levels):
        modules = tuple(i for i, other in enumerate(levels) if other == level)
        found += _problems(cable_design(level, materials), materials, modules)
    return tuple(found)


def _problems(d: CableDesign, materials: Materials, modules: tuple[int, ...]) -> list[Problem]:
    cable, printer = materials.cable, materials.printer
    texts = []
    if not d.producible:
        if cable.form == "printed":
            texts.append(
                f"At stiffness {d.level / 10:.1f} a cable of {cable.material} would have to be"
                f" {1e6 * d.area:.3f} mm2 thin; the printer's least is {1e6 * printer.least_area:.3f} mm2"
                f" ({1e3 * printer.nozzle:g} mm nozzle, {printer.min_layers} layers of"
                f" {1e3 * printer.layer:g} mm), which is {d.stiffness_made / d.stiffness:.2f} times as stiff."
            )
        else:
            texts.append(
                f"At stiffness {d.level / 10:.1f} no {cable.material} that can be bought fits: the one of"
                f" {1e3 * d.section.width:g} mm is {d.stiffness_made / d.stiffness:.2f} times as stiff."
            )
    if not d.springs_back:
        texts.append(
            f"At stiffness {d.level / 10:.1f} a cable is strained by {100 * d.strain:.0f} %;"
            f" {cable.material} springs back up to {100 * cable.max_strain:.0f} %."
        )
    if not texts:
        return []
    proposals = _proposals(d, materials)
    return [Problem(modules=modules, text=text, proposals=proposals) for text in texts]


def _proposals(d: CableDesign, materials: Materials) -> tuple[str, ...]:
    """Return changes that each solve all of a module's problems, checked with these formulas."""
    cable, printer = materials.cable, materials.printer
    found = []

    def works(**change: CableMaterial | Printer) -> bool:
        changed = dataclasses.replace(materials, **change)  # type: ignore[arg-type]
        return cable_design(d.level, changed).works

    if cable.max_tail < MAX_TAIL:
        for half_mm in range(math.floor(2000 * cable.max_tail) + 1, round(2000 * MAX_TAIL) + 1):
            if works(cable=dataclasses.replace(cable, max_tail=half_mm / 2000)):
                found.append(f"a longer path: max_tail_mm = {half_mm / 2:g} in [cable]")
                break
    for percent in range(95, 4, -5):
        modulus = cable.modulus * percent / 100
        if works(cable=dataclasses.replace(cable, modulus=modulus)):
            found.append(f"a softer material: a modulus of {modulus / 1e6:.3g} MPa")
            break
    if cable.form == "printed":
        for nozzle in (0.0003, 0.00025, 0.0002, 0.00015, 0.0001):
            if nozzle < printer.nozzle and works(printer=dataclasses.replace(printer, nozzle=nozzle)):
                found.append(f"a finer nozzle: {1e3 * nozzle:g} mm")
                break
    for name in PRESETS:
        other = load_materials(name)
        if other.cable.material != cable.material and works(cable=other.cable):
            found.append(f"{other.cable.material} (preset {name})")
    if not found:
        found.append(
            f"another material: softer than {cable.modulus / 1e6:.3g} MPa and springing back from at least"
            f" {100 * d.strain:.0f} % strain"
        )
    return tuple(found)
