"""The passive cables as they are made: length, section and strain.

A cable of the simulation is a spring of stiffness k and rest length L0, stretched by s in the assembled
module. A strip of rubber of the simulation's rest length would be strained by 130 to 200 %, and it is no such
spring: its pull grows less and less. But one point of its curve suffices. A strip of rubber is chosen that
pulls, in the assembled module, with the simulated tension k s, and whose tension grows there by the simulated
k (``rubber.stretch_of``). That fixes its unstretched length L and its section A, for any modulus:

    L (stretch - 1 / stretch^2) / (1 + 2 / stretch^3) = s        k s = A G (stretch - 1 / stretch^2)

The strip ends where the cap of a rod's end holds the ring that it hangs on (``parts.shapes``); the rings lie
on the caps and hardly stretch. The modulus counts as it is after a day, when the cable has relaxed.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from typing import Final

import numpy as np

from engine.body import module as t
from engine.body.morphology import Morphology
from engine.fabrication.dimensions.floating_module import CONTRACTED, floating_module
from engine.fabrication.dimensions.rubber import pull, shear_modulus, stretch_of
from engine.fabrication.materials import Materials, Source, least_certain

RING_RADIUS: Final = 0.0033
"""Outer radius of a net's ring and of the cap's rim that it lies on, in m: cables begin to stretch there."""
LEAST_STRIP: Final = 0.001
"""Width of the narrowest strip that is cut from a sheet, in m: 0.05 mm of error are 5 % of it; assumed."""
MOST_STRIP: Final = 2 * RING_RADIUS * math.tan(math.radians(30.0))
"""Width of the widest, in m: two strips of a triangle, 60 degrees apart, still part at their ring."""


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Section:
    """The cross-section of a cable as made, in m: width in the net's plane, and thickness."""

    width: float
    thickness: float

    @property
    def area(self) -> float:
        """In m2."""
        return self.width * self.thickness


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class CableDesign:
    """How the 24 passive cables of a module are made; all are alike.

    Attributes:
        module: index from 0.
        level: the module's stiffness gene, 1 to 10.
        stiffness: in N/m: level / 10 x k_ref.
        stiffness_source: simulated, or measured if the materials name a ``k_ref``.
        tension: in the assembled module, servo off, in N.
        free: unstretched length from ring to ring, in m.
        area: of the section that the stiffness asks for, in m2.
        section: the section that is made.
        stiffness_made: that it has in the assembled module, in N/m; ``stiffness`` if there is no problem.
        strain_assembled: in the assembled module, servo off.
        strain_contracted: largest strain of any of the 24 at full contraction of the servo.
        producible: whether the section can be printed with the nozzle, or cut from a sheet that is sold.
        springs_back: whether neither strain exceeds what the material springs back from.
    """

    module: int
    level: int
    stiffness: float
    stiffness_source: Source
    tension: float
    free: float
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
    def square_side(self) -> float:
        """Side of a square section of area A, in m."""
        return math.sqrt(self.area)


def design_cables(morphology: Morphology, materials: Materials) -> tuple[CableDesign, ...]:
    """Return how the cables of each module are made, in the order of the modules."""
    by_level = {level: cable_design(level, materials) for level in set(morphology.stiffness_levels)}
    return tuple(
        dataclasses.replace(by_level[level], module=i) for i, level in enumerate(morphology.stiffness_levels)
    )


def cable_design(level: int, materials: Materials) -> CableDesign:
    """Return how the cables of a module of a stiffness level, 1 to 10, are made, as if it were module 0."""
    cable = materials.cable
    k = (t.CABLE_STIFFNESS if cable.k_ref is None else cable.k_ref) * level / t.N_STIFFNESS_LEVELS
    reach = float(floating_module(level, None).cables.mean()) - t.CABLE_REST_LENGTH
    span = float(spans(level, None).mean())
    stretch = stretch_of(reach, span)
    free, area = span / stretch, k * reach / (shear_modulus(cable) * pull(stretch))
    section = (_printed if cable.form == "printed" else _cut)(area, materials)
    made = k * section.area / area
    contracted = float(spans(level, CONTRACTED).max()) / free - 1.0
    return CableDesign(
        module=0,
        level=level,
        stiffness=k,
        stiffness_source=Source.SIMULATED if cable.k_ref is None else Source.MEASURED,
        tension=k * reach,
        free=free,
        area=area,
        section=section,
        stiffness_made=made,
        strain_assembled=stretch - 1.0,
        strain_contracted=contracted,
        producible=abs(made / k - 1) < 0.01,
        springs_back=max(stretch - 1.0, contracted) <= cable.max_strain * (1 + 1e-9),
    )


@functools.lru_cache(maxsize=2 * t.N_STIFFNESS_LEVELS)
def spans(level: int, command: int | None) -> np.ndarray:
    """Return (24,) lengths of the cables' stretched strips, from rim to rim, in m, as ``module.CABLES``.

    Args:
        level: the stiffness gene of a floating module, 1 to 10.
        command: of its servo in degrees; None for off.
    """
    nodes = floating_module(level, command).nodes
    found = []
    for a, b in t.CABLES:
        ends = []
        for node, other in ((a, b), (b, a)):
            axis = nodes[node] - nodes[node ^ 1]
            axis = axis / np.linalg.norm(axis)
            way = nodes[other] - nodes[node]
            way = way - axis * (way @ axis)
            ends.append(nodes[node] + RING_RADIUS * way / np.linalg.norm(way))
        found.append(np.linalg.norm(ends[1] - ends[0]))
    return np.array(found)


def section_source(materials: Materials) -> Source:
    """Return the section's source: that of the modulus, which decides it."""
    return least_certain(Source.SIMULATED, materials.cable_source)


def _printed(area: float, materials: Materials) -> Section:
    """Return the squarest section of whole layers that is no narrower than a line."""
    printer = materials.printer
    layers = max(printer.min_layers, math.floor(math.sqrt(area) / printer.layer + 1e-9))
    while layers > printer.min_layers and area / (layers * printer.layer) < printer.nozzle:
        layers -= 1
    thickness = layers * printer.layer
    return Section(width=max(printer.nozzle, area / thickness), thickness=thickness)


def _cut(area: float, materials: Materials) -> Section:
    """Return the section from the thinnest sheet whose strip is not too wide; the widest of the thickest."""
    sheets = materials.cable.stock_thicknesses
    thickness = next((s for s in sheets if area / s <= MOST_STRIP), sheets[-1])
    return Section(width=min(max(area / thickness, LEAST_STRIP), MOST_STRIP), thickness=thickness)
