"""What to buy for a module or a robot, with typical parts, prices and hours.

Prices are what such parts usually cost, in euro, with tax and without shipping: our own guess of a date, no
shop's offer. They are there to tell 60 from 600 euro.
"""

from __future__ import annotations

import dataclasses
import math
from typing import Final

from engine.body import module as t
from engine.body.morphology import Morphology
from engine.fabrication.bill_of_materials import parts
from engine.fabrication.dimensions.cut_lists import stock_plan
from engine.fabrication.kit.jig import robot_jig
from engine.fabrication.materials import Materials
from engine.fabrication.parts.net import sheet_cuts
from engine.fabrication.parts.printed_parts import PrintedPart, printed_parts
from engine.fabrication.parts.servo_parts import BALLAST_RADIUS, ballast_length

AS_OF: Final = "2026-11"
"""Year and month of the prices."""
PRINT_SPEED: Final = 4.0e-9
"""Volume that a printer makes in a second, in m3: small parts, 0.2 mm layers; assumed."""
PER_PIECE: Final = 90.0
"""Seconds for each printed piece besides: moves, brim, heating; assumed."""
HOURS: Final = {
    "cutting and marking rods": 0.5,
    "net": 0.75,
    "servo, mount and drum": 0.75,
    "rods into jig and net": 0.75,
    "caps": 1.0,
    "internal cables": 1.5,
    "wiring and calibrating": 1.0,
    "measuring": 0.75,
}
"""Of work, for somebody's first module; assumed."""
AGAIN: Final = 0.5
"""Part of these hours that a further module takes; assumed."""
JOINING: Final = 0.25
"""Hours for each joint of two modules; assumed."""


@dataclasses.dataclass(frozen=True, slots=True)
class Purchase:
    """Something to buy.

    Attributes:
        what: it is.
        needed: spares included, as text.
        typical: a part that fits.
        packs: how many of the usual packs.
        low, high: price of one pack, in euro.
        once: whether further modules need no other one.
    """

    what: str
    needed: str
    typical: str
    packs: int
    low: float
    high: float
    once: bool = False


def purchases(morphology: Morphology, materials: Materials) -> list[Purchase]:
    """Return what to buy for a body, with spares."""
    n, plan = morphology.n_modules, stock_plan(morphology, materials)
    found = [
        Purchase(
            materials.rod.material,
            f"{plan.stock_rods} of {1000 * plan.stock_length:g} mm; one more for spares",
            "pultruded carbon tube or rod, outer diameter 3.0 mm",
            plan.stock_rods + 1,
            2.0,
            5.0,
        ),
        Purchase(
            materials.servo.model, f"{n}, one spare", "of that size and torque; measure it", n + 1, 3.0, 25.0
        ),
        Purchase(
            f"round steel, Ø {2 * BALLAST_RADIUS:.0f} mm",
            f"{n} of {ballast_length(materials):.1f} mm",
            "bar of 1 m, or a dowel pin",
            1,
            3.0,
            8.0,
            once=True,
        ),
    ]
    printed = printed_parts(morphology, materials)
    rigid = sum(p.quantity * p.mass for p in printed if not p.flexible)
    soft = sum(p.quantity * p.mass for p in printed if p.flexible)
    found.append(
        Purchase(
            f"{materials.plastic.material} filament",
            f"{1000 * rigid:.0f} g" + (", and 60 g for the jig" if robot_jig(morphology, materials) else ""),
            "1.75 mm, spool of 1 kg",
            1,
            15.0,
            30.0,
            once=True,
        )
    )
    form = materials.cable.form
    if soft:
        name = materials.cable.material if form == "printed" else "flexible filament (TPU), for the links"
        grams = f"{math.ceil(1.5 * 1000 * soft)} g, half of it for misprints"
        found.append(Purchase(name, grams, "1.75 mm, spool of 0.5 kg", 1, 20.0, 40.0, once=True))
    for cut in sheet_cuts(morphology, materials):
        x, y = (1000 * v for v in cut.piece)
        found.append(
            Purchase(
                f"{materials.cable.material}, {1000 * cut.thickness:g} mm",
                f"{cut.pieces} pieces of {x:.0f} × {y:.0f} mm, one of them for spares and the coupon",
                "by the metre, about 1 m wide",
                math.ceil(cut.pieces / max(1, int(1000 // x) * int(1000 // y))),
                12.0,
                30.0,
            )
        )
    line = sum(p.quantity * (p.length or 0.0) for p in parts(morphology, materials) if "internal" in p.group)
    found += [
        Purchase(
            materials.line.material,
            f"{max(2.0, 2.0 * line):.0f} m",
            "braided fishing line, about 15 kg breaking load, 100 m",
            1,
            8.0,
            15.0,
            once=True,
        ),
        Purchase(
            materials.line.elastic,
            f"{2 * len(t.SERVO_NODES) * n} pieces",
            "reel of latex thread of 0.8 mm, 10 m; the limiters' too",
            1,
            2.0,
            6.0,
            once=True,
        ),
        Purchase(
            "beads of 2 mm, steel wire of 1 mm, toothpicks",
            f"{2 * len(t.SERVO_NODES) * n} beads, half of them spares",
            "craft shop",
            1,
            3.0,
            8.0,
            once=True,
        ),
    ]
    found += [
        Purchase(f.model, f"{2 * f.per_module * n}, half of them spares", f.use, 1, 2.0, 6.0, once=True)
        for f in materials.fasteners
    ]
    return [
        *found,
        Purchase(materials.board.model, "1", "with USB cable", 1, 5.0, 25.0, once=True),
        Purchase(
            "supply, switch, fuse with holder, capacitor, wire, connectors",
            "1 each",
            "table “Power”",
            1,
            15.0,
            35.0,
            once=True,
        ),
        Purchase(
            "USB camera and a stand, to steer only",
            "1",
            "webcam of 1280 × 720 pixels, 60° wide, sharp from 1 m",
            1,
            15.0,
            50.0,
            once=True,
        ),
    ]


def print_hours(printed: tuple[PrintedPart, ...], jig: float = 0.0) -> float:
    """Return about how many hours a printer takes for parts, and for a jig of a volume in m3."""
    seconds = sum(p.quantity * (p.volume / PRINT_SPEED + PER_PIECE) for p in printed)
    return (seconds + jig / PRINT_SPEED) / 3600.0


def work_hours(modules: int) -> dict[str, float]:
    """Return hours of work by what is done, for a robot of so many modules."""
    found = {what: hours * (1.0 + AGAIN * (modules - 1)) for what, hours in HOURS.items()}
    return found if modules == 1 else {**found, "joining the modules, checking the robot": JOINING * modules}


def total(listed: list[Purchase], *, again: bool = False) -> tuple[float, float]:
    """Return the lowest and the highest price of purchases in euro.

    Args:
        listed: to add up.
        again: whether for a further module, which does without what is bought once.
    """
    counted = [p for p in listed if not (again and p.once)]
    return sum(p.packs * p.low for p in counted), sum(p.packs * p.high for p in counted)
