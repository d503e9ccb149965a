"""The passive cables as they are made: section, length along the rods, strain, and what cannot be made.

A cable of the simulation is a spring of stiffness k that is L0 long when it pulls nothing. A piece of
elastic material with the free length L, the section A and the modulus E is that spring if
k = E A / L. In the simulation L0 is so short, and the rods hold it so far apart, that a cable of that
length would be strained by 130 to 200 %. So a real one is longer than L0: at both ends it goes on
along its rod, under a cap (``parts``), to an eyelet or a knot. This *tail* is part of the spring:
L = L0 + 2 tail (less the eyelets' rings, which hardly stretch). The rest length between the rod ends
stays L0, the stiffness stays k, the strain falls and the section grows.
"""

from __future__ import annotations

import dataclasses
import math
from typing import Final

import numpy as np

from engine.body import module as t
from engine.body.morphology import Morphology
from engine.fabrication.floating_module import CONTRACTED, floating_module
from engine.fabrication.materials import (
    MAX_TAIL,
    MIN_TAIL,
    PRESETS,
    CableMaterial,
    Materials,
    Source,
    least_certain,
    load_materials,
)

EYELET_WALL: Final = 0.0018
"""Width of the ring round an eyelet's hole, in m; it counts as rigid."""
KNOT_ALLOWANCE: Final = 0.03
"""Cord to add at each end for the knot, in m."""
_TAIL_STEP: Final = 0.0005


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Section:
    """The cross-section of a cable as made, in m: printed width x thickness, or a cord's diameter."""

    width: float
    thickness: float
    round: bool

    @property
    def area(self) -> float:
        """In m2."""
        return self.width * self.thickness * (math.pi / 4 if self.round else 1.0)


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class CableDesign:
    """How the 24 passive cables of a module are made; all have the same rest length and stiffness.

    Attributes:
        module: index from 0.
        level: the module's stiffness gene, 1 to 10.
        stiffness: in N/m: level / 10 x k_ref.
        stiffness_source: simulated, or measured if the materials name a ``k_ref``.
        rest: length L0 between the anchors at which a cable pulls nothing, in m.
        tail: how far it lies along the rod at each end, in m.
        free: elastic length L of the material, in m.
        area: A = k L / E, in m2.
        section: what is made of it.
        stiffness_made: E A / L of that section, in N/m; equals ``stiffness`` if there is no problem.
        strain_assembled: strain of the material in the assembled module, servo off.
        strain_contracted: largest strain of any of the 24 at full contraction of the servo.
        producible: whether the section can be printed with the nozzle, or bought.
        problems: what would not work, each with what would; empty if all is well.
    """

    module: int
    level: int
    stiffness: float
    stiffness_source: Source
    rest: float
    tail: float
    free: float
    area: float
    section: Section
    stiffness_made: float
    strain_assembled: float
    strain_contracted: float
    producible: bool
    problems: tuple[Problem, ...]

    @property
    def path(self) -> float:
        """Unstretched length from eyelet hole to eyelet hole, or knot to knot, in m: rest + 2 tail."""
        return self.rest + 2 * self.tail

    @property
    def square_side(self) -> float:
        """Side of a square section of area A, in m."""
        return math.sqrt(self.area)

    @property
    def round_diameter(self) -> float:
        """Diameter of a round section of area A, in m."""
        return math.sqrt(4 * self.area / math.pi)


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Problem:
    """Something that cannot be made as asked.

    Attributes:
        modules: which modules it concerns.
        text: what is wrong, one sentence.
        proposals: what would work; each was tried out with these formulas.
    """

    modules: tuple[int, ...]
    text: str
    proposals: tuple[str, ...]


def design_cables(morphology: Morphology, materials: Materials) -> tuple[CableDesign, ...]:
    """Return how the cables of each module are made, in the order of the modules."""
    by_level = {level: _design(level, materials) for level in set(morphology.stiffness_levels)}
    designs = []
    for i, level in enumerate(morphology.stiffness_levels):
        design = by_level[level]
        same = tuple(j for j, other in enumerate(morphology.stiffness_levels) if other == level)
        problems = tuple(dataclasses.replace(p, modules=same) for p in design.problems)
        designs.append(dataclasses.replace(design, module=i, problems=problems))
    return tuple(designs)


def cable_problems(morphology: Morphology, materials: Materials) -> tuple[Problem, ...]:
    """Return every problem of the cables once, with the modules that it concerns."""
    return tuple(dict.fromkeys(p for d in design_cables(morphology, materials) for p in d.problems))


def section_source(materials: Materials) -> Source:
    """Return where the section comes from: no better known than the modulus."""
    return least_certain(Source.SIMULATED, materials.cable_source)


def _stiffness(level: int, cable: CableMaterial) -> float:
    return (t.CABLE_STIFFNESS if cable.k_ref is None else cable.k_ref) * level / t.N_STIFFNESS_LEVELS


def _stretch(level: int) -> tuple[float, float]:
    """Return the largest stretch of a module's cables, assembled and contracted, in m."""
    states = [floating_module(level, command) for command in (None, CONTRACTED)]
    assembled, contracted = (float(np.max(s.cables)) - t.CABLE_REST_LENGTH for s in states)
    return assembled, contracted


def _free(tail: float, cable: CableMaterial) -> float:
    ring = EYELET_WALL if cable.form == "printed" else 0.0
    return t.CABLE_REST_LENGTH + 2 * tail - 2 * ring


def _tail(free: float, cable: CableMaterial) -> float:
    return MIN_TAIL + (free - _free(MIN_TAIL, cable)) / 2


def _least_area(materials: Materials) -> float:
    p = materials.printer
    return p.nozzle * p.layer * p.min_layers


def _design(level: int, materials: Materials, *, propose: bool = True) -> CableDesign:
    cable = materials.cable
    k = _stiffness(level, cable)
    assembled, contracted = _stretch(level)
    stretch = max(assembled, contracted)
    pick = _printed if cable.form == "printed" else _cord
    tail, section = pick(k, stretch, materials)
    free = _free(tail, cable)
    area = k * free / cable.modulus
    made = cable.modulus * section.area / free
    producible = abs(made / k - 1) < 0.01
    strain = stretch / free
    design = CableDesign(
        module=0,
        level=level,
        stiffness=k,
        stiffness_source=Source.SIMULATED if cable.k_ref is None else Source.MEASURED,
        rest=t.CABLE_REST_LENGTH,
        tail=tail,
        free=free,
        area=area,
        section=section,
        stiffness_made=made,
        strain_assembled=assembled / free,
        strain_contracted=contracted / free,
        producible=producible,
        problems=(),
    )
    if producible and strain <= cable.max_strain * (1 + 1e-9):
        return design
    return dataclasses.replace(design, problems=_problems(design, strain, materials) if propose else (_BAD,))


def _printed(k: float, stretch: float, materials: Materials) -> tuple[float, Section]:
    """Return the shortest tail that works, or the longest allowed, and the section."""
    cable, printer = materials.cable, materials.printer
    free = max(stretch / cable.max_strain, _least_area(materials) * cable.modulus / k)
    tail = max(MIN_TAIL, math.ceil(_tail(free, cable) / _TAIL_STEP - 1e-9) * _TAIL_STEP)
    tail = min(tail, cable.max_tail)
    area = k * _free(tail, cable) / cable.modulus
    # the squarest section of whole layers that is no narrower than a line
    layers = max(printer.min_layers, math.floor(math.sqrt(area) / printer.layer + 1e-9))
    while layers > printer.min_layers and area / (layers * printer.layer) < printer.nozzle:
        layers -= 1
    thickness = layers * printer.layer
    return tail, Section(width=max(printer.nozzle, area / thickness), thickness=thickness, round=False)


def _cord(k: float, stretch: float, materials: Materials) -> tuple[float, Section]:
    """Return the thinnest cord whose tail makes the stiffness exact, or the one that errs least."""
    cable = materials.cable
    best: tuple[float, float, Section] | None = None
    for diameter in cable.stock_diameters:
        section = Section(width=diameter, thickness=diameter, round=True)
        free = cable.modulus * section.area / k
        tail = min(max(_tail(free, cable), MIN_TAIL), cable.max_tail)
        error = abs(_free(tail, cable) / free - 1) + max(
            0.0, stretch / _free(tail, cable) / cable.max_strain - 1
        )
        if best is None or error < best[0] - 1e-9:
            best = error, tail, section
    assert best is not None
    return best[1], best[2]


_BAD: Final = Problem(modules=(), text="", proposals=())


def _works(level: int, materials: Materials) -> bool:
    return not _design(level, materials, propose=False).problems


def _problems(d: CableDesign, strain: float, materials: Materials) -> tuple[Problem, ...]:
    cable, printer = materials.cable, materials.printer
    texts = []
    if not d.producible:
        if cable.form == "printed":
            texts.append(
                f"At stiffness {d.level / 10:.1f} a cable of {cable.material} would have to be"
                f" {1e6 * d.area:.3f} mm2 thin; the printer's least is {1e6 * _least_area(materials):.3f} mm2"
                f" ({1e3 * printer.nozzle:g} mm nozzle, {printer.min_layers} layers of"
                f" {1e3 * printer.layer:g} mm), which is {d.stiffness_made / d.stiffness:.2f} times as stiff."
            )
        else:
            texts.append(
                f"At stiffness {d.level / 10:.1f} no {cable.material} that can be bought fits: the one of"
                f" {1e3 * d.section.width:g} mm is {d.stiffness_made / d.stiffness:.2f} times as stiff."
            )
    if strain > cable.max_strain * (1 + 1e-9):
        texts.append(
            f"At stiffness {d.level / 10:.1f} a cable is strained by {100 * strain:.0f} %;"
            f" {cable.material} springs back up to {100 * cable.max_strain:.0f} %."
        )
    proposals = _proposals(d, materials)
    return tuple(Problem(modules=(), text=text, proposals=proposals) for text in texts)


def _proposals(d: CableDesign, materials: Materials) -> tuple[str, ...]:
    """Return changes that solve all of a module's problems, each tried out."""
    cable, printer = materials.cable, materials.printer
    found = []

    def try_cable(text: str, **change: float) -> bool:
        works = _works(
            d.level,
            dataclasses.replace(materials, cable=dataclasses.replace(cable, **change)),  # type: ignore[arg-type]
        )
        if works:
            found.append(text)
        return works

    if cable.max_tail < MAX_TAIL:
        for half_mm in range(math.floor(2000 * cable.max_tail) + 1, round(2000 * MAX_TAIL) + 1):
            text = f"a longer path: max_tail_mm = {half_mm / 2:g} in [cable]"
            if try_cable(text, max_tail=half_mm / 2000):
                break
    for percent in range(95, 4, -5):
        modulus = cable.modulus * percent / 100
        text = f"a softer material: a modulus of {modulus / 1e6:.3g} MPa"
        if try_cable(text, modulus=modulus):
            break
    if cable.form == "printed":
        for nozzle in (0.0003, 0.00025, 0.0002, 0.00015, 0.0001):
            finer = dataclasses.replace(printer, nozzle=nozzle)
            if nozzle < printer.nozzle and _works(d.level, dataclasses.replace(materials, printer=finer)):
                found.append(f"a finer nozzle: {1e3 * nozzle:g} mm")
                break
    for name in PRESETS:
        other = load_materials(name)
        if other.cable.material != cable.material and _works(
            d.level, dataclasses.replace(materials, cable=other.cable)
        ):
            found.append(f"{other.cable.material} (preset {name})")
    if not found:
        found.append(
            f"another material: softer than {cable.modulus / 1e6:.3g} MPa and springing back from at least"
            f" {100 * max(d.strain_assembled, d.strain_contracted):.0f} % strain"
        )
    return tuple(found)
