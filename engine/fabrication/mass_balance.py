"""Simulated against built mass of a robot, group by group, and why they differ."""

from __future__ import annotations

import dataclasses

import numpy as np

from engine.body import module as t
from engine.body.morphology import Morphology
from engine.fabrication.bill_of_materials import GROUPS, Part, parts
from engine.fabrication.dimensions.feet import Foot
from engine.fabrication.materials import Materials
from engine.fabrication.parts.servo_parts import servo_rod_centre_of_mass


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class MassLine:
    """A group of parts in the balance of masses.

    Attributes:
        group: one of ``GROUPS``.
        simulated: mass that the simulation gives it, in kg.
        built: sum of its parts, ballast included, in kg.
        explanation: why they differ.
    """

    group: str
    simulated: float
    built: float
    explanation: str


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class MassBalance:
    """Simulated against built mass of the whole robot; the lines add up to both totals.

    Attributes:
        lines: the groups that the robot carries.
        ballast: to glue to each module's servo rod, in kg: what a module lacks to its simulated mass.
        excess: what the robot weighs more than simulated, in kg; 0 if ballast makes up for it.
    """

    lines: tuple[MassLine, ...]
    ballast: float
    excess: float

    @property
    def simulated(self) -> float:
        """Mass of the robot in the simulation, in kg."""
        return sum(line.simulated for line in self.lines)

    @property
    def built(self) -> float:
        """Mass of the robot as built, ballast included, in kg."""
        return sum(line.built for line in self.lines)


def mass_balance(morphology: Morphology, materials: Materials, feet: tuple[Foot, ...] = ()) -> MassBalance:
    """Compare a robot's simulated mass with that of its parts and feet, group by group."""
    listed = parts(morphology, materials, feet)
    n = morphology.n_modules
    simulated = dict.fromkeys(GROUPS, 0.0)
    simulated["plain rods"] = n * (len(t.RODS) - 1) * t.ROD_MASS
    simulated["servo rod"] = n * t.SERVO_ROD_MASS
    ballast = next((p.mass for p in listed if p.name == "ballast"), 0.0)
    rod = (
        sum(
            p.quantity * p.mass
            for p in listed
            if p.name.startswith(("servo rod", "cap")) and p.group == "servo rod"
        )
        / n
    )
    off = servo_rod_centre_of_mass(materials, rod) - np.array(t.SERVO_ROD_CENTRE_OF_MASS)
    why = {
        "plain rods": f"{materials.rod.material} and two printed caps each{', and feet' if feet else ''}",
        "servo rod": f"rod, caps,{' feet,' if feet else ''} servo, mount, drum and screws"
        + (", and ballast for what the module lacks" if ballast else "")
        + f"; without ballast its centre of mass lies {1e3 * float(np.linalg.norm(off)):.0f} mm off the"
        " simulated one",
        "passive cables": "massless in the simulation",
        "internal cables": "massless in the simulation",
        "links": "massless in the simulation",
    }
    lines = tuple(
        MassLine(group=g, simulated=simulated[g], built=_mass(listed, g), explanation=why[g])
        for g in GROUPS[:-1]
    )
    excess = sum(line.built - line.simulated for line in lines)
    return MassBalance(lines=lines, ballast=ballast, excess=excess if excess > 1e-9 else 0.0)


def _mass(listed: tuple[Part, ...], group: str) -> float:
    return sum(p.quantity * p.mass for p in listed if p.group == group)
