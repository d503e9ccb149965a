"""What to order and what to print, before anything is built."""

from __future__ import annotations

import math

from reportlab.platypus import Flowable

from engine.body import module as t
from engine.fabrication.bill_of_materials import parts
from engine.fabrication.buildability import problems
from engine.fabrication.dimensions.cut_lists import stock_plan
from engine.fabrication.mass_balance import mass_balance
from engine.fabrication.materials import Materials
from engine.fabrication.parts.printed_parts import printed_parts
from engine.fabrication.parts.servo_parts import elastic_length
from viz.build_sheet import blocks, style
from viz.build_sheet.facts import Facts
from viz.build_sheet.style import Paper

SPARE = 1.25
"""Filament, cord and line that are ordered, per unit that the robot holds: misprints, brims, knots."""


def pages(facts: Facts, materials: Materials, paper: Paper) -> list[Flowable]:
    """Return both lists, below what to know before anybody buys anything."""
    width, printer = paper.inner_width, materials.printer
    soft = materials.cable.form == "printed"
    first = (
        "Print the pull coupon first and pull it (“Pull test of the cable material”)."
        if soft
        else "Pull a piece of the cord before you cut it (“Pull test of the cable material”)."
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
                    f" {1e3 * printer.layer:g} mm, 100 % filled, temperatures as on the spool, flexible parts"
                    f" slowly (20 mm/s). {first} Then one cap: it must slide on a rod without force and not"
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
                f"<b>Cannot be made as asked (modules {where}).</b> {text} What would work: {cures}."
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
        if grams:
            rows.append([style.escaped(name), f"{math.ceil(grams)} g", "with a quarter more for misprints"])
    if materials.cable.form == "cord":
        cords: dict[float, float] = {}
        for p in listed:
            if p.group == "passive cables" and p.diameter is not None and p.length is not None:
                cords[p.diameter] = cords.get(p.diameter, 0.0) + p.quantity * p.length
        for diameter, length in sorted(cords.items()):
            name = f"{style.escaped(materials.cable.material)}, Ø {1000 * diameter:g} mm"
            rows.append([name, f"{math.ceil(SPARE * length)} m", "passive cables, with a quarter more"])
    rows += [
        [
            style.escaped(motor.model),
            str(n),
            f"{motor.torque:g} N m at {motor.voltage:g} V; measure it: clones differ, the mount follows"
            " materials.toml",
        ],
    ]
    rows += [
        [style.escaped(f.model), str(n * f.per_module), style.escaped(f.use)] for f in materials.fasteners
    ]
    rows += [
        [style.escaped(materials.line.material), f"{math.ceil(SPARE * line)} m", "internal cables, joints"],
        [
            style.escaped(materials.line.elastic),
            f"{len(t.SERVO_NODES) * n} pieces of {1000 * elastic_length():.0f} mm at most",
            "one in every internal cable; chosen by hanging a weight on it (“Wiring”)",
        ],
    ]
    ballast = mass_balance(facts.morphology, materials, facts.feet.feet).ballast
    if ballast > 0:
        each = f"{n} × {1000 * ballast:.2f} g"
        rows.append(["ballast: lead or steel, in pieces", each, "one per module"])
    rows += [
        [style.escaped(materials.board.model), "1", f"with its USB cable; at least {n} free digital pins"],
        [
            f"supply of {motor.voltage:g} V, switch, capacitor of 470 to 1000 µF for 10 V or more",
            f"1 each, ≥ {n * motor.stall_current:.1f} A",
            style.escaped(materials.battery.model),
        ],
        [
            "stranded wire, pin headers for the servos' plugs",
            f"{3 * n} leads",
            "as long as the robot is to go",
        ],
        [
            "camera above the floor, or another sensor",
            "1",
            "only to steer to a target; rhythm alone needs none",
        ],
    ]
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
    return rows
