"""The passive cables as they are made: section, length along the rods and strain.

A cable of the simulation is a spring of stiffness k and rest length L0. A piece of elastic material with the
free length L, the section A and the modulus E is that spring if k = E A / L. In the simulation L0 is so
short, and the rods hold it so far apart, that a cable of that length would be strained by 130 to 200 %. So a
real one is longer than L0: at both ends it continues along its rod, under a cap (``parts.shapes``), to an
eyelet or a knot. This *tail* is part of the spring: L = L0 + 2 tail (less the eyelets' rings, which hardly
stretch). The rest length between the rod ends stays L0, the stiffness stays k, the strain falls and the
section grows.

A tail takes part only as far as the cable slides over its cap. While it is pulled, friction leaves the tail
1 / c of the span's tension, c being the capstan's factor exp(friction x angle). Span and tails are springs in
series,

    k = E A / W,    W = L0 + (L - L0) / c,

the *working length*. The modulus counts as it is after a day, when the cable has relaxed.
"""

from __future__ import annotations

import dataclasses
import math
from typing import Final

import numpy as np

from engine.body import module as t
from engine.body.morphology import Morphology
from engine.fabrication.dimensions.floating_module import CONTRACTED, floating_module
from engine.fabrication.materials import (
    MIN_TAIL,
    CableMaterial,
    Materials,
    Source,
    least_certain,
)

EYELET_WALL: Final = 0.0018
"""Width of the ring round an eyelet's hole, in m; it counts as rigid."""
KNOT_ALLOWANCE: Final = 0.03
"""Cord to add at each end for the knot, in m."""
KNOT_LEFT: Final = 0.006
"""How much of that stays in the knot when it is trimmed, in m."""
_TAIL_STEP: Final = 0.0005
CAP_BEND: Final = math.radians(129.0)
"""How far a cable bends over its cap, in rad: the middle of the 113 to 145 degrees of the four notches."""
CAP_FRICTION: Final = 0.35
"""Coefficient of a cable on its cap, assumed: rubber and TPU on smooth plastic have 0.2 to 0.5."""


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
        rest: rest length L0 between the anchors, in m.
        tail: length that lies along the rod at each end, in m.
        free: elastic length L of the material, in m.
        working: working length W, in m.
        area: A = k W / E, in m2.
        section: the section that is made.
        stiffness_made: E A / W of that section, in N/m; equals ``stiffness`` if there is no problem.
        strain_assembled: strain of the span in the assembled module, servo off; tails have less.
        strain_contracted: largest strain of any of the 24 at full contraction of the servo.
        producible: whether the section can be printed with the nozzle, or bought.
        springs_back: whether neither strain exceeds what the material springs back from.
    """

    module: int
    level: int
    stiffness: float
    stiffness_source: Source
    rest: float
    tail: float
    free: float
    working: float
    area: float
    section: Section
    stiffness_made: float
    strain_assembled: float
    strain_contracted: float
    producible: bool
    springs_back: bool

    @property
    def works(self) -> bool:
        """Whether such cables can be made and last; ``cable_problems`` says why not, and what would."""
        return self.producible and self.springs_back

    @property
    def strain(self) -> float:
        """The larger of the two strains."""
        return max(self.strain_assembled, self.strain_contracted)

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


def design_cables(morphology: Morphology, materials: Materials) -> tuple[CableDesign, ...]:
    """Return how the cables of each module are made, in the order of the modules."""
    by_level = {level: cable_design(level, materials) for level in set(morphology.stiffness_levels)}
    return tuple(
        dataclasses.replace(by_level[level], module=i) for i, level in enumerate(morphology.stiffness_levels)
    )


def cable_design(level: int, materials: Materials) -> CableDesign:
    """Return how the cables of a module of a stiffness level, 1 to 10, are made, as if it were module 0."""
    cable = materials.cable
    k = _stiffness(level, cable)
    assembled, contracted = _stretch(level)
    stretch = max(assembled, contracted)
    pick = _printed if cable.form == "printed" else _cord
    tail, section = pick(k, stretch, materials)
    working, modulus = working_length(tail, cable), _modulus(cable)
    made = modulus * section.area / working
    return CableDesign(
        module=0,
        level=level,
        stiffness=k,
        stiffness_source=Source.SIMULATED if cable.k_ref is None else Source.MEASURED,
        rest=t.CABLE_REST_LENGTH,
        tail=tail,
        free=_free(tail, cable),
        working=working,
        area=k * working / modulus,
        section=section,
        stiffness_made=made,
        strain_assembled=assembled / working,
        strain_contracted=contracted / working,
        producible=abs(made / k - 1) < 0.01,
        springs_back=stretch / working <= cable.max_strain * (1 + 1e-9),
    )


def section_source(materials: Materials) -> Source:
    """Return the section's source: that of the modulus, which decides it."""
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


def working_length(tail: float, cable: CableMaterial, friction: float = CAP_FRICTION) -> float:
    """Return the working length W in m of a cable with tails of a length in m."""
    return t.CABLE_REST_LENGTH + (_free(tail, cable) - t.CABLE_REST_LENGTH) / _capstan(friction)


def _capstan(friction: float) -> float:
    return math.exp(friction * CAP_BEND)


def _modulus(cable: CableMaterial) -> float:
    """Return the modulus after a day, in Pa."""
    return cable.modulus * (1.0 - cable.relaxation_after_a_day)


def _tail(working: float, cable: CableMaterial) -> float:
    """Return the tail in m of a cable with a working length in m."""
    return MIN_TAIL + (working - working_length(MIN_TAIL, cable)) * _capstan(CAP_FRICTION) / 2


def _printed(k: float, stretch: float, materials: Materials) -> tuple[float, Section]:
    """Return the shortest tail that works, or the longest allowed, and the section."""
    cable, printer = materials.cable, materials.printer
    working = max(stretch / cable.max_strain, printer.least_area * _modulus(cable) / k)
    tail = max(MIN_TAIL, math.ceil(_tail(working, cable) / _TAIL_STEP - 1e-9) * _TAIL_STEP)
    tail = min(tail, cable.max_tail)
    area = k * working_length(tail, cable) / _modulus(cable)
    # the squarest section of whole layers that is no narrower than a line
    layers = max(printer.min_layers, math.floor(math.sqrt(area) / printer.layer + 1e-9))
    while layers > printer.min_layers and area / (layers * printer.layer) < printer.nozzle:
        layers -= 1
    thickness = layers * printer.layer
    return tail, Section(width=max(printer.nozzle, area / thickness), thickness=thickness, round=False)


def _cord(k: float, stretch: float, materials: Materials) -> tuple[float, Section]:
    """Return the thinnest cord whose tail makes the stiffness exact, or the one with the smallest error."""
    cable = materials.cable
    best: tuple[float, float, Section] | None = None
    for diameter in cable.stock_diameters:
        section = Section(width=diameter, thickness=diameter, round=True)
        working = _modulus(cable) * section.area / k
        tail = min(max(_tail(working, cable), MIN_TAIL), cable.max_tail)
        made = working_length(tail, cable)
        error = abs(made / working - 1) + max(0.0, stretch / made / cable.max_strain - 1)
        if best is None or error < best[0] - 1e-9:
            best = error, tail, section
    assert best is not None
    return best[1], best[2]
