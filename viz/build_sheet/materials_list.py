"""The bill of materials, and why its masses add up to the simulated robot's."""

from __future__ import annotations

from reportlab.platypus import Flowable

from engine.fabrication.bill_of_materials import MassBalance, Part, mass_balance, parts
from engine.fabrication.materials import Materials
from viz.build_sheet import blocks, style
from viz.build_sheet.facts import Facts
from viz.build_sheet.style import Paper


def pages(facts: Facts, materials: Materials, paper: Paper) -> list[Flowable]:
    """Return the section."""
    width = paper.inner_width
    listed = parts(facts.morphology, materials)
    balance = mass_balance(facts.morphology, materials)
    header = ("part", "pieces", "length × Ø (mm)", "each (g)", "all (g)", "source of mass", "note")
    shares = (19, 8, 13, 9, 9, 11, 31)
    rows = [_row(p) for p in listed]
    rows.append(["robot as built", "", "", "", f"{1000 * balance.built:.1f}", "", "without what is off the robot"])
    return [
        blocks.heading("Bill of materials"),
        blocks.body(
            f"For the whole robot, materials “{style.escaped(materials.name)}” (file materials.toml in the folder; it can"
            " be edited, and the robot exported again with it)."
        ),
        blocks.grid(header, rows, blocks.columns(width, *shares), right=(1, 3, 4), total=True),
        blocks.together(
            [
                blocks.subheading("Does it weigh what was simulated?"),
                _balance(balance, width),
                blocks.gap(2),
                blocks.note(_verdict(balance)),
            ]
        ),
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
    if balance.excess:
        part = 100 * balance.excess / balance.simulated
        return (
            f"The robot as built is {1000 * balance.excess:.1f} g ({part:.0f} %) heavier than simulated. It sags more"
            " than drawn and may crawl less; a lighter servo helps most."
        )
    return (
        f"Each module gets {1000 * balance.ballast:.2f} g of ballast on its servo rod, so that it weighs what was"
        " simulated."
    )
