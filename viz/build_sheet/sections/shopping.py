"""What to order and what to print, before anything is built."""

from __future__ import annotations

import math

from reportlab.platypus import Flowable

from engine.body import module as t
from engine.fabrication.bill_of_materials import parts
from engine.fabrication.buildability import problems
from engine.fabrication.dimensions.cut_lists import stock_plan
from engine.fabrication.dimensions.limiter import STRETCHED, THREAD, has_limiter
from engine.fabrication.kit.jig import jig_mass, robot_jig
from engine.fabrication.kit.power import SIGNAL, TETHER, power
from engine.fabrication.materials import Materials, ServoMotor
from engine.fabrication.parts import solids
from engine.fabrication.parts.head_tag import WIRE, WIRE_LENGTH
from engine.fabrication.parts.net import sheet_cuts
from engine.fabrication.parts.printed_parts import printed_parts
from engine.fabrication.parts.servo_parts import (
    BALLAST_RADIUS,
    ballast_length,
    ballast_mass,
    elastic_length,
)
from viz.build_sheet import blocks, style
from viz.build_sheet.facts import Facts
from viz.build_sheet.style import Paper

SPARE = 1.25
"""Filament and line that are ordered, per unit that the robot holds: misprints, brims, knots."""


def pages(facts: Facts, materials: Materials, paper: Paper) -> list[Flowable]:
    """Return both lists, below what to know before anybody buys anything."""
    width, printer = paper.inner_width, materials.printer
    soft = materials.cable.form == "printed"
    first = (
        "Print the pull coupon first and pull it (“Pull test of the cable material”)."
        if soft
        else "Cut the pull coupon first and pull it (“Pull test of the cable material”)."
    )
    return [
        blocks.heading("What to order and to print"),
        *_problems(facts, materials),
        blocks.grid(
            ("to order", "how much", "remarks"),
            _orders(facts, materials),
            blocks.columns(width, 32, 22, 46),
        ),
        blocks.gap(6),
        blocks.together(
            [
                blocks.subheading("To print"),
                blocks.grid(
                    ("file in the folder parts", "pieces", "material", "size (mm)", "each (g)", "how"),
                    _prints(facts, materials),
                    blocks.columns(width, 22, 8, 14, 17, 8, 31),
                    right=(1, 4),
                ),
                blocks.gap(2),
                blocks.note(
                    "Every part as .3mf, which knows its unit, and as .stl, to be read in mm. Masses are of"
                    f" solid parts: print with {1e3 * printer.nozzle:g} mm nozzle, layers of"
                    f" {1e3 * printer.layer:g} mm, 100 % filled, as “Filament settings to begin with” says."
                    f" {first} Then one cap: it must slide on a rod without force and not"
                    f" wobble ({1e3 * printer.clearance:g} mm of play); if not, change clearance_mm in the"
                    " materials file and export again."
                ),
            ]
        ),
    ]


def _problems(facts: Facts, materials: Materials) -> list[Flowable]:
    """Return what cannot be made or would not work as asked, before anybody buys anything."""
    found: list[Flowable] = []
    for problem in problems(facts.morphology, materials):
        where = style.module_names(problem.modules)
        cures = "; or ".join(style.escaped(p) for p in problem.proposals)
        text = style.escaped(problem.text)
        found.append(
            blocks.warning(
                f"<b>Cannot be made as asked (module{'s' if len(problem.modules) > 1 else ''} {where}).</b>"
                f" {text} What would work: {cures}."
            )
        )
    return found


def _orders(facts: Facts, materials: Materials) -> list[list[str]]:
    n, motor = facts.morphology.n_modules, materials.servo
    plan = stock_plan(facts.morphology, materials)
    listed = parts(facts.morphology, materials, facts.feet.feet)
    printed = printed_parts(facts.morphology, materials, facts.feet.feet)
    line = sum(p.quantity * (p.length or 0.0) for p in listed if p.group == "internal cables")
    rows = [
        [
            style.escaped(materials.rod.material),
            f"{plan.stock_rods} × {1e3 * plan.stock_length:g} mm",
            f"{plan.pieces} pieces, see “Cut list”; the diameter matters, caps and rings fit it",
        ]
    ]
    for flexible, name in (
        (True, materials.cable.material if materials.cable.form == "printed" else "flexible filament (TPU)"),
        (False, f"{materials.plastic.material} filament"),
    ):
        grams = SPARE * 1000 * sum(p.quantity * p.mass for p in printed if p.flexible == flexible)
        holder = robot_jig(facts.morphology, materials)
        if holder is not None and not flexible:
            grams += SPARE * 1000 * jig_mass(holder, materials)
        if grams:
            rows.append([style.escaped(name), f"{math.ceil(grams)} g", "with a quarter more for misprints"])
    for cut in sheet_cuts(facts.morphology, materials):
        name = f"{style.escaped(materials.cable.material)}, {1000 * cut.thickness:g} mm"
        x, y = (1000 * v for v in cut.piece)
        rows.append(
            [
                name,
                f"{cut.pieces} × {x:.0f} × {y:.0f} mm",
                "nets, and one more for misses and the coupon",
            ]
        )
    rows += [
        [
            style.escaped(motor.model),
            str(n),
            f"{motor.torque:g} N m at {motor.voltage:g} V; measure it: the mount follows materials.toml."
            " Its two ears are cut off",
        ],
    ]
    rows += [
        [style.escaped(f.model), str(n * f.per_module), style.escaped(f.use)] for f in materials.fasteners
    ]
    rows += [
        [style.escaped(materials.line.material), f"{math.ceil(SPARE * line)} m", "internal cables, joints"],
        [
            style.escaped(materials.line.elastic),
            f"{len(t.SERVO_NODES) * n} pieces of 50 mm",
            f"one in every internal cable, tied at most {1000 * elastic_length():.0f} mm long with its loop;"
            " checked by hanging a weight on it (“Wiring”)",
        ],
    ]
    if has_limiter(materials):
        each = f"{len(t.SERVO_NODES) * n} pieces of {1000 * THREAD / STRETCHED + 40:.0f} mm"
        rows.append(["latex thread, Ø 0.8 mm, and as many beads of 2 mm", each, "limiters (“Wiring”)"])
    rows.append(
        [
            f"steel wire, Ø {WIRE:g} mm",
            f"{WIRE_LENGTH:.0f} mm",
            "holds the head's tag (“The head point” on the robot's sheet)",
        ]
    )
    rows.append(
        [
            f"round steel, Ø {2 * BALLAST_RADIUS:.0f} mm",
            f"{n} × {ballast_length(materials):.1f} mm",
            f"counterweight of {1000 * ballast_mass(materials):.1f} g each, in the cup of the servo mount",
        ]
    )
    rows += [
        [
            style.escaped(materials.board.model),
            "1",
            f"with its USB cable; at least {n} free digital pin{'s' if n > 1 else ''}",
        ],
        [
            f"supply of {motor.voltage:g} V, switch, capacitor of 470 to 1000 µF for 10 V or more",
            f"1 each, ≥ {n * motor.stall_current:.1f} A",
            style.escaped(materials.battery.model),
        ],
        *_wires(n, motor),
        [
            "USB camera, 1280 × 720 pixels, about 60° wide, with a stand",
            "1",
            "hangs 1 to 1.5 m above the floor; only to steer to a target, rhythm alone needs none",
        ],
    ]
    return rows


def _wires(n: int, motor: ServoMotor) -> list[list[str]]:
    """Return what feeds the robot: wires, their connector and their fuse."""
    found = power(n, motor, TETHER)
    each = f"{TETHER:g} m of each"
    rows = [
        [f"stranded wire, AWG {SIGNAL}; pin headers for the servos' plugs", f"{n} × {TETHER:g} m", "signals"]
    ]
    if found is not None:
        remark = f"loses {found.drop:.2f} V when all servos are blocked; connector {found.connector}"
        rows.append(
            [f"stranded wire, AWG {found.awg} ({found.section:.2f} mm²), red and black", each, remark]
        )
        rows.append([f"fuse of {found.fuse:g} A with its holder", "1", "in + at the supply"])
    return rows


def _prints(facts: Facts, materials: Materials) -> list[list[str]]:
    rows = []
    for p in printed_parts(facts.morphology, materials, facts.feet.feet):
        size = " × ".join(f"{1000 * v:.1f}" for v in p.size)
        soft = materials.cable.material if materials.cable.form == "printed" else "flexible (TPU)"
        rows.append(
            [
                style.escaped(p.name),
                str(p.quantity),
                style.escaped(soft if p.flexible else materials.plastic.material),
                size if p.fits else f"<b>{size}: larger than the bed</b>",
                f"{1000 * p.mass:.2f}",
                style.escaped(p.print_it),
            ]
        )
    holder = robot_jig(facts.morphology, materials)
    if holder is not None:
        size = " × ".join(f"{v:.1f}" for v in solids.extent(holder.solid))
        mass = jig_mass(holder, materials)
        how = "as it stands, with support; holds the rods of one module after the other"
        material = style.escaped(materials.plastic.material)
        rows.append(["jig", "1", material, size, f"{1000 * mass:.0f}", how])
    return rows
