"""Every reason why a robot cannot be built or would not work, and what would help."""

from __future__ import annotations

from typing import Final

from engine.body import module as t
from engine.body.morphology import Morphology
from engine.fabrication.dimensions.cable_problems import Problem, cable_problems
from engine.fabrication.dimensions.cables import design_cables
from engine.fabrication.dimensions.limiter import line_limit
from engine.fabrication.materials import CAP_SLEEVE, Materials
from engine.fabrication.parts.assembly import servo_clearance
from engine.fabrication.parts.drum import required_torque
from engine.fabrication.parts.net import LAYOUTS, lay_out
from engine.fabrication.parts.printed_parts import printed_parts
from engine.fabrication.parts.servo_parts import SOCKET, rod_gap

APART: Final = 0.5
"""Least gap between a cap and the servo's mount, along the rod, in mm."""
LEAST_GAP: Final = 0.5
"""Least gap between a servo and the module's other rods, in mm."""


def problems(morphology: Morphology, materials: Materials) -> tuple[Problem, ...]:
    """Return all problems of a robot: cables first, then parts, then the servo; empty if all is well."""
    return (
        *cable_problems(morphology, materials),
        *_parts(morphology, materials),
        *_servo(morphology, materials),
        *_cap_room(morphology, materials),
    )


def _parts(morphology: Morphology, materials: Materials) -> list[Problem]:
    printer = materials.printer
    found = []
    for part in printed_parts(morphology, materials):
        x, y, z = (1e3 * s for s in part.size)
        if not part.fits:
            proposals = [f"a printer with a bed of at least {x:.0f} x {y:.0f} x {max(z, 1):.0f} mm"]
            if part.name.startswith("net"):
                design = design_cables(morphology, materials)[part.modules[0]]
                sizes = {name: lay_out(name, design.free, printer).size for name in LAYOUTS}
                proposals = [
                    f"a printer with a bed of at least {1e3 * a:.0f} x {1e3 * b:.0f} mm"
                    for a, b in sizes.values()
                ]
            found.append(
                Problem(
                    modules=part.modules,
                    text=f"{part.name} is {x:.0f} x {y:.0f} x {z:.0f} mm and does not fit the bed of"
                    f" {1e3 * printer.bed_x:.0f} x {1e3 * printer.bed_y:.0f} x {1e3 * printer.bed_z:.0f} mm.",
                    proposals=tuple(proposals),
                )
            )
        if not part.walls_hold:
            found.append(
                Problem(
                    modules=part.modules,
                    text=f"{part.name} has walls thinner than {part.min_wall:g} mm.",
                    proposals=("a finer nozzle and a smaller min_wall_mm in [printer]",),
                )
            )
    return found


def _servo(morphology: Morphology, materials: Materials) -> list[Problem]:
    motor = materials.servo
    everywhere = tuple(range(morphology.n_modules))
    found = []
    torque = required_torque(motor, line_limit(materials))
    if torque > motor.torque:
        found.append(
            Problem(
                modules=everywhere,
                text=f"{motor.model} gives {motor.torque:g} N m; the internal cables ask for"
                f" {torque:.3f} N m.",
                proposals=(f"a servo of at least {torque:.3f} N m",),
            )
        )
    for level in sorted(set(morphology.stiffness_levels)):
        gap = servo_clearance(level, materials)
        if gap < LEAST_GAP:
            modules = tuple(i for i, other in enumerate(morphology.stiffness_levels) if other == level)
            found.append(
                Problem(
                    modules=modules,
                    text=f"At stiffness {level / t.N_STIFFNESS_LEVELS:.1f} {motor.model} on its mount comes"
                    f" closer than {LEAST_GAP:g} mm to another rod when the module contracts.",
                    proposals=("a smaller servo",),
                )
            )
    return found


def _cap_room(morphology: Morphology, materials: Materials) -> list[Problem]:
    """Return whether the cap of node 0 would meet the servo's mount."""
    left, _ = rod_gap(materials.servo, materials.printer)
    room = 500 * t.ROD_LENGTH + left - SOCKET - APART
    if room > 1e3 * CAP_SLEEVE:
        return []
    return [
        Problem(
            modules=tuple(range(morphology.n_modules)),
            text=f"The cap of node 0 meets the mount of {materials.servo.model}: between them are"
            f" {room - 1e3 * CAP_SLEEVE:.1f} mm.",
            proposals=("a shorter servo",),
        )
    ]
