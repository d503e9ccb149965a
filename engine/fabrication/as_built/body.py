"""How a built robot's rods and passive cables differ from the simulated ones."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from engine.body import module as t
from engine.body.morphology import Morphology
from engine.fabrication.as_built.deviation import TOLERANCE, Deviation, Origin, grams
from engine.fabrication.bill_of_materials import parts
from engine.fabrication.dimensions import tolerances
from engine.fabrication.dimensions.cables import CableDesign, cable_design
from engine.fabrication.dimensions.feet import Foot
from engine.fabrication.materials import Materials
from engine.fabrication.parts.servo_parts import servo_rod_centre_of_mass

MODULUS_CHECKED: Final = tolerances.STIFFNESS / TOLERANCE
"""Standard deviation of a modulus from a data sheet, in parts of it. Batches differ by 20 %, but the sheet
begins with a pull test: outside its tolerance nothing is built before the measurement is entered."""
MODULUS_MEASURED: Final = 0.03
"""The same once it is entered: of a scale, and of a ruler at 60 mm."""


def masses(morphology: Morphology, materials: Materials, feet: tuple[Foot, ...]) -> Deviation:
    """Return the deviation of the masses of the rods, with all that hangs on them, but no tether."""
    plain, heavy = _rod_masses(morphology, materials, feet)
    return Deviation(
        key="mass",
        name="masses",
        simulated=f"{grams(t.ROD_MASS)} per plain rod, {grams(t.SERVO_ROD_MASS)} with servo",
        built=f"{grams(plain)} and {grams(heavy)}, with caps,{' feet,' if feet else ''} cables and links",
        spread=f"± {50 * tolerances.MASS:.0f} %",
        origin=Origin.COMPUTED,
        source="bill of materials",
        remedy="lighter caps or cables, or ballast where the module is too light",
        figures={"plain_rod_mass": plain, "servo_rod_mass": heavy},
        scatter={"mass": tolerances.MASS / TOLERANCE},
    )


def _rod_masses(morphology: Morphology, materials: Materials, feet: tuple[Foot, ...]) -> tuple[float, float]:
    """Return the masses in kg of a plain and of a servo rod, with what hangs on them.

    Passive cables and links hang on all rods alike, the internal cables on the servo rod.
    """
    groups: dict[str, float] = {}
    for part in parts(morphology, materials, feet):
        groups[part.group] = groups.get(part.group, 0.0) + part.quantity * part.mass
    n, rods = morphology.n_modules, len(t.RODS)
    shared = (groups["passive cables"] + groups.get("links", 0.0)) / (n * rods)
    plain = groups["plain rods"] / (n * (rods - 1)) + shared
    return plain, (groups["servo rod"] + groups["internal cables"]) / n + shared


def centre_of_mass(morphology: Morphology, materials: Materials, feet: tuple[Foot, ...]) -> Deviation:
    """Return the deviation of where the servo rod's centre of mass lies."""
    middle = built_centre_of_mass(morphology, materials, feet)
    off = float(np.linalg.norm(middle - np.array(t.SERVO_ROD_CENTRE_OF_MASS)))
    x, y, z = (1e3 * v for v in middle)
    return Deviation(
        key="centre_of_mass",
        name="servo rod's centre of mass",
        simulated=f"{1e3 * t.SERVO_ROD_CENTRE_OF_MASS[0]:.1f} mm inwards of the rod's middle",
        built=f"{x:.1f} mm inwards, {y:.1f} mm along, {z:.1f} mm aside: {1e3 * off:.1f} mm off",
        spread="± 1 mm each way",
        origin=Origin.COMPUTED,
        source="solids of servo, mount, drum and counterweight",
        remedy="evolve with --as-built, whose bodies have the centre of mass that the design has",
        figures={"centre_of_mass": tuple(map(float, middle))},
        scatter={"centre_of_mass": 0.001},
    )


def built_centre_of_mass(
    morphology: Morphology, materials: Materials, feet: tuple[Foot, ...] = ()
) -> np.ndarray:
    """Return (3,) the mean centre of mass of servo rods with their feet, in m, in the rod's frame."""
    listed = parts(morphology, materials, feet)
    n = morphology.n_modules
    caps = sum(p.quantity * p.mass for p in listed if p.name.startswith("cap") and p.group == "servo rod")
    bare = servo_rod_centre_of_mass(materials, caps / n)
    total = sum(p.quantity * p.mass for p in listed if p.group == "servo rod") / n
    weighs = {p.name: p.mass for p in listed}
    # a foot sits on a node, which is half a rod away from the middle
    ends = {a: np.sign(t.NODES[a, 1]) * t.ROD_LENGTH / 2 for a in t.RODS[t.SERVO_ROD]}
    worn = [(weighs[f.part] / n, ends[f.node]) for f in feet if f.node in ends]
    moment = np.array([0.0, sum(mass * place for mass, place in worn), 0.0])
    others = total - sum(mass for mass, _ in worn)
    return np.asarray((others * bare + moment) / total)


def cables(levels: Sequence[int], materials: Materials) -> Deviation:
    """Return the deviation of the stiffness of the passive cables of some levels."""
    designs = {level: cable_design(level, materials) for level in levels}
    factors = [1.0] * t.N_STIFFNESS_LEVELS
    for level, d in designs.items():
        factors[level - 1] = d.stiffness_made / _wanted(d)
    own = sorted({f"{factors[level - 1]:.2f}" for level in levels})
    built = f"{' to '.join((own[0], own[-1]) if len(own) > 1 else own)} times that"
    if not all(d.producible for d in designs.values()):
        built += ": the section asked for cannot be made"
    if not all(d.springs_back for d in designs.values()):
        built += ": it is strained beyond what it springs back from"
    material = MODULUS_MEASURED if materials.pull_test else MODULUS_CHECKED
    module = tolerances.STIFFNESS / TOLERANCE
    guess = f"modulus of {materials.name}, checked by a pull test: {materials.cable.source or 'no source'}"
    return Deviation(
        key="cables",
        name="stiffness of the passive cables",
        simulated=", ".join(f"{t.stiffness_n_per_m(level / 10):.1f}" for level in levels) + " N/m",
        built=built,
        spread=f"± {100 * material:.0f} % all alike, ± {100 * module:.0f} % by module",
        origin=Origin.MEASURED if materials.pull_test else Origin.ASSUMED,
        source="pull test" if materials.pull_test else guess,
        remedy="a pull test, entered in the materials file, and exporting again; or another material",
        figures={"stiffness": tuple(factors)},
        scatter={"stiffness": material, "module_stiffness": module},
    )


def _wanted(design: CableDesign) -> float:
    """Return the simulated stiffness of a cable in N/m: a measured ``k_ref`` is no reason for another."""
    return t.stiffness_n_per_m(design.level / t.N_STIFFNESS_LEVELS)


def rest_length() -> Deviation:
    """Return the deviation of the rest length of the passive cables."""
    return Deviation(
        key="rest_length",
        name="rest length of the passive cables",
        simulated=f"{1e3 * t.CABLE_REST_LENGTH:.2f} mm",
        built=f"as if it were {1e3 * t.CABLE_REST_LENGTH:.2f} mm, in the assembled module",
        spread=f"± {1e3 * tolerances.REST / TOLERANCE:.2f} mm",
        origin=Origin.ASSUMED,
        source="half the sheet's tolerance",
        remedy="nets cut within the tolerance",
        scatter={"rest_length": tolerances.REST / TOLERANCE},
    )
