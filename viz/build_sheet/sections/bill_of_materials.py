"""The bill of materials, and why its masses add up to the simulated robot's."""

from __future__ import annotations

from reportlab.platypus import CondPageBreak, Flowable

from engine.fabrication.bill_of_materials import Part, parts
from engine.fabrication.mass_balance import MassBalance, mass_balance
from engine.fabrication.materials import Materials
from engine.fabrication.parts.servo_parts import LINE_HOLE
from viz.build_sheet import blocks, style
from viz.build_sheet.facts import Facts
from viz.build_sheet.style import Paper

_TOOLS = (
    "3D printer for rigid and for flexible filament; for nets of sheet a cutting plotter or laser, or a sharp"
    " knife, a steel ruler and a punch of 2.5 mm; scissors; drills of 1 mm"
    f" and {LINE_HOLE:g} mm, turned by hand; hot glue gun",
    "fine saw for the rods, metal saw and file for the counterweights, sandpaper, calipers, a ruler of 30"
    " cm, a scale that reads 0.1 g",
    "crochet hook or blunt tweezers to pull rings over the caps, needle, water-proof pen, numbered stickers,"
    " tape, toothpicks; a paper cup on a thread, filled with water or coins on the scale, for every weight"
    " that this sheet names",
    "soldering iron or crimp connectors, small screwdriver, a computer with the Arduino IDE and a USB cable",
    "protective glasses, gloves and mask (see “Safety”); a level floor of 1 × 1 m to crawl on",
)


def pages(facts: Facts, materials: Materials, paper: Paper) -> list[Flowable]:
    """Return the section."""
    width = paper.inner_width
    listed = parts(facts.morphology, materials, facts.feet.feet)
    balance = mass_balance(facts.morphology, materials, facts.feet.feet)
    header = ["part", "pieces", "length × Ø (mm)", "each (g)", "all (g)", "source of mass", "note"]
    shares = [18, 8, 14, 8, 9, 11, 32]
    inner = [p for p in listed if p.name.startswith("internal cable")]
    rows = [_row(p) for p in listed if p not in inner[1:]]
    rows[listed.index(inner[0])] = _internal(inner, materials)
    rows.append(
        ["robot as built", "", "", "", f"{1000 * balance.built:.1f}", "", "without what is off the robot"]
    )
    sources = {p.source for p in listed}
    if len(sources) == 1:
        # one source for all is said once, and the notes get its room
        shares[-1] += shares.pop(5)
        for row in (header, *rows):
            del row[5]
    return [
        CondPageBreak(260),
        blocks.heading("Bill of materials"),
        blocks.body(
            f"The parts of the finished robot with their masses, materials “{style.escaped(materials.name)}”"
            " (file materials.toml in the folder; it can be edited, and the robot exported again with it)."
            + (f" All masses in this table are <b>{sources.pop()}</b>." if len(sources) == 1 else "")
        ),
        blocks.grid(header, rows, blocks.columns(width, *shares), right=(1, 3, 4), total=True),
        blocks.together([blocks.subheading("Tools"), *blocks.bullets(_TOOLS)]),
        blocks.together(
            [
                blocks.subheading("Does it weigh what was simulated?"),
                _balance(balance, width),
                blocks.gap(2),
                blocks.note(_verdict(balance)),
            ]
        ),
    ]


def _internal(listed: list[Part], materials: Materials) -> list[str]:
    """Return one row for the internal cables, which differ only in length."""
    lengths = [1000 * p.length for p in listed if p.length is not None]
    every = sum(p.mass * p.quantity for p in listed)
    pieces = sum(p.quantity for p in listed)
    return [
        "internal cables",
        str(pieces),
        f"{min(lengths):.0f} to {max(lengths):.0f} × Ø {1000 * materials.line.diameter:.2f}",
        f"{1000 * every / pieces:.2f}",
        f"{1000 * every:.2f}",
        str(listed[0].source),
        f"{style.escaped(materials.line.material)}, in series with {style.escaped(materials.line.elastic)};"
        " five per module, cut long; how long when tied is under “Wiring”",
    ]


def _row(part: Part) -> list[str]:
    size = " × ".join(
        f"{mark}{1000 * v:.2f}" for mark, v in (("", part.length), ("Ø ", part.diameter)) if v is not None
    )
    each, every = (f"{1000 * m:.2f}" for m in (part.mass, part.mass * part.quantity))
    return [
        style.escaped(part.name.replace("_", " ")),
        str(part.quantity),
        size,
        each,
        every,
        str(part.source),
        style.escaped(part.note),
    ]


def _balance(balance: MassBalance, width: float) -> Flowable:
    rows = [
        [
            line.group,
            f"{1000 * line.simulated:.2f}",
            f"{1000 * line.built:.2f}",
            style.signed(1000 * (line.built - line.simulated), 2),
            style.escaped(line.explanation),
        ]
        for line in balance.lines
    ]
    rows.append(
        [
            "robot",
            f"{1000 * balance.simulated:.2f}",
            f"{1000 * balance.built:.2f}",
            style.signed(1000 * (balance.built - balance.simulated), 2),
            "",
        ]
    )
    header = ("what", "simulated (g)", "built (g)", "difference (g)", "why")
    return blocks.grid(header, rows, blocks.columns(width, 18, 14, 12, 15, 41), right=(1, 2, 3), total=True)


def _verdict(balance: MassBalance) -> str:
    if balance.excess > 5e-5:
        part = 100 * balance.excess / balance.simulated
        return (
            f"The robot as built is {1000 * balance.excess:.1f} g ({part:.0f} %) heavier than simulated. It"
            " sags more than drawn and may crawl less; lighter caps and cables help most."
        )
    return (
        f"A module weighs what was simulated, with {1000 * balance.ballast:.1f} g of counterweight at its"
        " servo."
    )
