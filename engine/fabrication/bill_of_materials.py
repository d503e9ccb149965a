"""What a robot is made of: the parts of its modules and joints, as a table.

Only numbers of ``engine.tensegrity`` and the actuator table appear. Masses are those of the real
robot, not the scaled ones of the simulation.
"""

from __future__ import annotations

import csv
import dataclasses
import io
from typing import Final

import numpy as np

from engine import servo
from engine import tensegrity as t
from engine.morphology import Morphology

COLUMNS: Final = (
    "part",
    "quantity",
    "length_mm",
    "diameter_mm",
    "mass_each_g",
    "mass_total_g",
    "basis",
    "note",
)


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Part:
    """A kind of part.

    Attributes:
        name: what it is.
        quantity: how many the robot needs.
        length: of one part, in m; None where the robot's model has none.
        diameter: of one part, in m, or None.
        mass: of one part, in kg, or None.
        basis: which of the numbers the simulation uses and which are assumed or missing.
        note: where it goes and what else there is to know.
    """

    name: str
    quantity: int
    length: float | None = None
    diameter: float | None = None
    mass: float | None = None
    basis: str
    note: str


def parts(morphology: Morphology) -> list[Part]:
    """Return the parts of a robot."""
    n = morphology.n_modules
    return [*_rods(n), *_passive_cables(morphology), *_servo_cables(n), _servomotors(n), _links(n)]


def total_mass(morphology: Morphology) -> float:
    """Return the mass of all parts that have one, in kg."""
    return sum(p.quantity * p.mass for p in parts(morphology) if p.mass is not None)


def bill_of_materials(morphology: Morphology) -> str:
    """Return the parts of a robot as CSV: lengths and diameters in mm, masses in g."""
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(COLUMNS)
    for p in parts(morphology):
        mass = None if p.mass is None else p.quantity * p.mass
        figures = [_milli(v) for v in (p.length, p.diameter, p.mass, mass)]
        writer.writerow([p.name, p.quantity, *figures, p.basis, p.note])
    total = _milli(total_mass(morphology))
    writer.writerow(["all parts", "", "", "", "", total, "sum of the column", ""])
    return file.getvalue()


def _rods(n_modules: int) -> list[Part]:
    shape = {"length": t.ROD_LENGTH, "diameter": 2 * t.ROD_RADIUS}
    n_plain = len(t.RODS) - 1
    return [
        Part(
            name="plain rod",
            quantity=n_plain * n_modules,
            mass=t.ROD_MASS,
            basis="length, diameter and mass simulated; material not modelled",
            note=f"{n_plain} per module; from node to node, round ends add"
            f" {_milli(t.ROD_RADIUS)} mm on each side",
            **shape,
        ),
        Part(
            name="servo rod",
            quantity=n_modules,
            mass=t.SERVO_ROD_MASS,
            basis="length, diameter and mass simulated; the motor's body is not modelled",
            note=f"rod {t.SERVO_ROD} of each module; mass with servomotor and arm",
            **shape,
        ),
    ]


def _passive_cables(morphology: Morphology) -> list[Part]:
    """Return a part for each stiffness that occurs, naming the modules that need it if not all do."""
    built = [t.passive_anchor(a, b) - t.passive_anchor(b, a) for a, b in t.CABLES]
    length = float(np.linalg.norm(built, axis=1).mean())  # all are equally long
    cables = []
    for relative in sorted(set(morphology.stiffnesses)):
        modules = [i for i, s in enumerate(morphology.stiffnesses) if s == relative]
        where = "per module"
        if len(modules) < morphology.n_modules:
            where = f"in each of the modules {', '.join(map(str, modules))}"
        cables.append(
            Part(
                name="passive cable",
                quantity=len(t.CABLES) * len(modules),
                length=t.CABLE_REST_LENGTH,
                basis="length, stiffness and damping simulated, as a spring that only pulls;"
                " massless in the simulation; diameter and material not modelled",
                note=f"{len(t.CABLES)} {where}; length at rest between its anchors on the rods'"
                f" surface; stretched to {_milli(length)} mm in a module as built;"
                f" stiffness {t.stiffness_n_per_m(relative):.2f} N/m; damping {t.CABLE_DAMPING:.2f} N s/m",
            )
        )
    return cables


def _servo_cables(n_modules: int) -> list[Part]:
    cables = []
    for k, node in enumerate(t.SERVO_NODES):
        released, contracted = (float(servo.TARGET_LENGTHS[c, k]) for c in (0, 180))
        a, b = t.servo_anchors(node)
        cables.append(
            Part(
                name=f"internal cable to node {node}",
                quantity=n_modules,
                length=released,
                basis="target lengths simulated; massless in the simulation; diameter, material and"
                " what winds on the servo's arm not modelled",
                note=f"from the servo's arm to node {node}; target length {_milli(released)} mm at"
                f" command 0 and {_milli(contracted)} mm at command 180 (degrees);"
                f" {_milli(float(np.linalg.norm(a - b)))} mm between its anchors as built;"
                f" tension at most {t.SERVO_MAX_TENSION} N",
            )
        )
    return cables


def _servomotors(n_modules: int) -> Part:
    rest = 1000.0 * (t.SERVO_ROD_MASS - t.ROD_MASS)
    return Part(
        name="servomotor with arm",
        quantity=n_modules,
        basis="assumed: a part of its own; the simulation knows only the servo rod's mass and the"
        " point where the cables leave the arm",
        note=f"mass counted with the servo rod; {rest:.3f} g are left for motor and arm if its rod"
        " weighs as much as a plain one",
    )


def _links(n_modules: int) -> Part:
    play = _milli(0.8 * t.LINK_PLAY), _milli(1.2 * t.LINK_PLAY)
    return Part(
        name="link between modules",
        quantity=len(t.JOINT_ORDER) * (n_modules - 1),
        length=t.LINK_PLAY,
        basis="length simulated; massless in the simulation; diameter and material not modelled",
        note=f"{len(t.JOINT_ORDER)} per joint, node to node; the simulation keeps each between"
        f" {play[0]} and {play[1]} mm",
    )


def _milli(value: float | None) -> str:
    return "" if value is None else f"{1000.0 * value:.3f}"
