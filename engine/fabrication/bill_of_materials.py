"""The parts of a robot with quantity, size and mass, and the robot's total mass.

All masses are real. The simulation scales every inertia; its total here is unscaled.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Final

from engine.body import module as t
from engine.body import servo
from engine.body.morphology import Morphology
from engine.fabrication.dimensions.cables import design_cables
from engine.fabrication.dimensions.cut_lists import rods, stock_plan
from engine.fabrication.dimensions.feet import Foot
from engine.fabrication.dimensions.limiter import STRETCHED, THREAD, has_limiter
from engine.fabrication.materials import Materials, Source, load_materials
from engine.fabrication.parts.drum import drum_errors
from engine.fabrication.parts.net import module_net, net_name
from engine.fabrication.parts.printed_parts import printed_parts
from engine.fabrication.parts.servo_parts import BALLAST_RADIUS, ballast_length, ballast_mass
from engine.fabrication.parts.shapes import net_outline
from engine.files import csv_text

LIMITER_MASS: Final = 5e-5
"""Of a thread with its bead and knots, in kg."""
GRAVITY: Final = 9.81
COLUMNS: Final = (
    "part",
    "group",
    "quantity",
    "length_mm",
    "diameter_mm",
    "mass_each_g",
    "mass_total_g",
    "source",
    "note",
)
GROUPS: Final = ("plain rods", "servo rod", "passive cables", "internal cables", "links", "off the robot")


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Part:
    """A kind of part.

    Attributes:
        name: what it is.
        group: what the simulation counts it with, one of ``GROUPS``.
        quantity: how many the robot needs.
        length: of one part, in m; None where a length says nothing.
        diameter: of one part, in m, or None.
        mass: of one part as built, in kg.
        source: where the mass comes from.
        note: where it goes, and remarks.
    """

    name: str
    group: str
    quantity: int
    length: float | None = None
    diameter: float | None = None
    mass: float
    source: Source
    note: str


def simulated_mass(morphology: Morphology) -> float:
    """Return the mass of a robot in the simulation (its real inertia), in kg."""
    return morphology.n_modules * (t.SERVO_ROD_MASS + (len(t.RODS) - 1) * t.ROD_MASS)


def parts(
    morphology: Morphology, materials: Materials | None = None, feet: tuple[Foot, ...] = ()
) -> tuple[Part, ...]:
    """Return the parts of a robot with these feet, ballast included; by default of the default preset."""
    materials = materials or load_materials()
    listed = (
        *_rods(morphology, materials),
        *_cables(morphology, materials),
        *_printed(morphology, materials, feet),
        *_bought(morphology, materials),
        Part(
            name="counterweight",
            group="servo rod",
            quantity=morphology.n_modules,
            length=1e-3 * ballast_length(materials),
            diameter=2e-3 * BALLAST_RADIUS,
            mass=ballast_mass(materials),
            source=Source.ASSUMED,
            note="round steel, in the cup of the servo mount: balances the servo and makes its rod as heavy"
            " as the simulated one",
        ),
    )
    return tuple(sorted(listed, key=lambda p: GROUPS.index(p.group)))


def bill_of_materials(
    morphology: Morphology, materials: Materials | None = None, feet: tuple[Foot, ...] = ()
) -> str:
    """Return the parts of a robot with these feet as CSV: lengths and diameters in mm, masses in g."""
    listed = parts(morphology, materials, feet)
    rows: list[Sequence[object]] = [COLUMNS]
    for p in listed:
        figures = [_milli(v) for v in (p.length, p.diameter, p.mass, p.quantity * p.mass)]
        rows.append([p.name, p.group, p.quantity, *figures, p.source, p.note])
    built = sum(p.quantity * p.mass for p in listed if p.group != "off the robot")
    row = ["robot as built", "", "", "", "", "", _milli(built), "", "sum of what the robot carries"]
    rows.append(row)
    row = ["robot as simulated", "", "", "", "", "", _milli(simulated_mass(morphology)), Source.SIMULATED]
    each = f"{_milli(t.ROD_MASS)} g per plain rod, {_milli(t.SERVO_ROD_MASS)} g per servo rod"
    rows.append([*row, each])
    return csv_text(rows)


def _rods(morphology: Morphology, materials: Materials) -> list[Part]:
    rows = rods(morphology, materials)
    plan = stock_plan(morphology, materials)
    result = []
    for kind in ("plain", "servo"):
        of_kind = [r for r in rows if r.kind == kind]
        result.append(
            Part(
                name=f"{kind} rod",
                group="plain rods" if kind == "plain" else "servo rod",
                quantity=len(of_kind),
                length=of_kind[0].cut,
                diameter=of_kind[0].diameter,
                mass=of_kind[0].cut_mass,
                source=Source.ASSUMED,
                note=f"{materials.rod.material}; {len(of_kind) // morphology.n_modules} per module;"
                f" {1e3 * of_kind[0].length:g} mm from node to node with its caps; all"
                f" {plan.pieces} pieces come from {plan.stock_rods} of {1e3 * plan.stock_length:g} mm",
            )
        )
    return result


def _cables(morphology: Morphology, materials: Materials) -> list[Part]:
    result = []
    designs = design_cables(morphology, materials)
    if materials.cable.form == "sheet":
        for level in sorted({d.level for d in designs}):
            design = next(d for d in designs if d.level == level)
            modules = [d.module for d in designs if d.level == level]
            net = module_net(design, materials.printer)
            area, thickness = 1e-6 * net_outline(net, design).area, design.section.thickness
            name = net_name(level)
            result.append(
                Part(
                    name=name,
                    group="passive cables",
                    quantity=len(modules),
                    mass=materials.cable.density * area * thickness,
                    source=materials.cable_source,
                    note=f"cut from {materials.cable.material}, {1e3 * thickness:g} mm, along net/{name}.dxf,"
                    f" {1e3 * net.size[0]:.0f} x {1e3 * net.size[1]:.0f} mm; the 24 cables of a module in one"
                    " piece" + (f"; modules {_list(modules)}" if len(modules) < morphology.n_modules else ""),
                )
            )
    if has_limiter(materials):
        result.append(
            Part(
                name="limiter",
                group="internal cables",
                quantity=len(t.SERVO_NODES) * morphology.n_modules,
                length=THREAD / STRETCHED,
                mass=LIMITER_MASS,
                source=Source.ASSUMED,
                note="latex thread of 0.8 mm with a bead at one end, inside the rods of nodes"
                f" {', '.join(map(str, sorted(t.SERVO_NODES)))}; stretched until the bead lifts off at"
                f" {1000 * t.SERVO_MAX_TENSION / GRAVITY:.0f} g",
            )
        )
    reach = 0.1
    errors = drum_errors()
    for k, node in enumerate(t.SERVO_NODES):
        released, contracted = servo.TARGET_LENGTHS[0, k], servo.TARGET_LENGTHS[-1, k]
        length = float(released) + reach
        result.append(
            Part(
                name=f"internal cable to node {node}",
                group="internal cables",
                quantity=morphology.n_modules,
                length=length,
                diameter=materials.line.diameter,
                mass=materials.line.linear_density * length,
                source=Source.ASSUMED,
                note=f"{materials.line.material}, in series with {materials.line.elastic}; from the guide's"
                f" ball to node {node} {_milli(float(released))} mm at command 0 and"
                f" {_milli(float(contracted))} mm at command 180, in between off the simulated table by at"
                f" most {errors[k]:.1f} mm; {1e3 * reach:g} mm are for drum and knots",
            )
        )
    return result


def _printed(morphology: Morphology, materials: Materials, feet: tuple[Foot, ...]) -> list[Part]:
    result = []
    for p in printed_parts(morphology, materials, feet):
        if p.name in ("pull_coupon", "friction_sled"):
            groups = [("off the robot", p.quantity)]
        elif p.name.startswith("foot"):
            groups = _groups_of_feet(p.quantity, [f for f in feet if f.part == p.name])
        elif p.name.startswith("cap"):
            servo_caps = 2 * len(p.modules)
            groups = [("plain rods", p.quantity - servo_caps), ("servo rod", servo_caps)]
        elif p.name.startswith("net"):
            groups = [("passive cables", p.quantity)]
        elif p.name.startswith("tag"):
            groups = [("plain rods", p.quantity)]
        else:
            groups = [("links" if p.name == "link" else "servo rod", p.quantity)]
        where = f"; modules {_list(list(p.modules))}" if 0 < len(p.modules) < morphology.n_modules else ""
        material = materials.plastic.material
        if p.flexible:
            printed = materials.cable.form == "printed"
            material = materials.cable.material if printed else "TPU or another flexible filament"
        result += [
            Part(
                name=p.name,
                group=group,
                quantity=quantity,
                mass=p.mass,
                source=Source.ASSUMED,
                note=f"printed, {material}; {p.note}{where}",
            )
            for group, quantity in groups
        ]
    return result


def _groups_of_feet(quantity: int, on_robot: list[Foot]) -> list[tuple[str, int]]:
    """Return how many feet of a kind go with which group; those not on the robot are for the test."""
    heavy = sum(t.rod_of(f.node) == t.SERVO_ROD for f in on_robot)
    plain = len(on_robot) - heavy
    every = [("plain rods", plain), ("servo rod", heavy), ("off the robot", quantity - plain - heavy)]
    return [(group, n) for group, n in every if n]


def _bought(morphology: Morphology, materials: Materials) -> list[Part]:
    n = morphology.n_modules
    motor = materials.servo
    result = [
        Part(
            name="servomotor",
            group="servo rod",
            quantity=n,
            mass=motor.mass,
            source=Source.ASSUMED,
            note=f"{motor.model}; {motor.torque:g} N m at {motor.voltage:g} V, {motor.travel:g} degrees",
        )
    ]
    result += [
        Part(
            name=f.model,
            group="servo rod",
            quantity=n * f.per_module,
            mass=f.mass,
            source=Source.ASSUMED,
            note=f.use,
        )
        for f in materials.fasteners
    ]
    result += [
        Part(
            name=name,
            group="servo rod" if item.carried else "off the robot",
            quantity=1,
            mass=item.mass,
            source=Source.ASSUMED,
            note=f"{item.model}; {item.note}",
        )
        for name, item in (("controller board", materials.board), ("power supply", materials.battery))
    ]
    return result


def _list(modules: list[int]) -> str:
    return ", ".join(str(t.module_number(m)) for m in modules)


def _milli(value: float | None) -> str:
    return "" if value is None else f"{1000.0 * value:.3f}"
