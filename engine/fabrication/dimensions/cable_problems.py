"""Which passive cables cannot be made or would not last, and what would work instead."""

from __future__ import annotations

import dataclasses

from engine.body.morphology import Morphology
from engine.fabrication.dimensions.cables import CableDesign, cable_design
from engine.fabrication.materials import (
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


def makeable(morphology: Morphology, materials: Materials) -> Materials:
    """Return the materials asked for, or the first preset that all of a body's cables can be made of.

    A file of one's own is never replaced, as what was measured is in it.
    """
    found = cable_problems(morphology, materials)
    if not found or materials.file not in PRESETS:
        return materials
    for name in PRESETS:
        other = load_materials(name)
        if not cable_problems(morphology, other):
            instead = f"Made of {other.name}, not of {materials.name}, which was asked for: {found[0].text}"
            return dataclasses.replace(other, instead=instead)
    return materials


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
            thick = d.stiffness_made < d.stiffness
            texts.append(
                f"At stiffness {d.level / 10:.1f} no {cable.material} that can be bought is"
                f" {'thick' if thick else 'thin'} enough: a strip of {1e3 * d.section.width:.1f} x"
                f" {1e3 * d.section.thickness:g} mm, the {'widest' if thick else 'narrowest'}, is"
                f" {d.stiffness_made / d.stiffness:.2f} times as stiff."
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

    for percent in (*range(95, 4, -5), *range(110, 310, 10)):
        modulus = cable.modulus * percent / 100
        if works(cable=dataclasses.replace(cable, modulus=modulus)):
            kind = "softer" if percent < 100 else "stiffer"
            found.append(f"a {kind} material: a modulus of {modulus / 1e6:.3g} MPa")
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
        found.append(f"another material, which springs back from at least {100 * d.strain:.0f} % strain")
    return tuple(found)
