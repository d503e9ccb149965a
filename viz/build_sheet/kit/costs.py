"""What a module or a robot costs in money and hours, how it is fed, how its filaments are printed.

The sheet of a robot has these pages, too; what to measure in which order is a kit's alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from reportlab.platypus import Flowable

from engine.body.morphology import Morphology
from engine.fabrication.kit.jig import robot_jig
from engine.fabrication.kit.measured import measures
from engine.fabrication.kit.power import LARGEST_DROP, SIGNAL, TETHER, power
from engine.fabrication.kit.purchases import AS_OF, PRINT_SPEED, print_hours, purchases, total, work_hours
from engine.fabrication.materials import Materials
from engine.fabrication.parts.printed_parts import printed_parts
from viz.build_sheet import blocks, style
from viz.build_sheet.style import Paper

_FILAMENT: Final = (
    ("nozzle, bed", "240 °C, 80 °C", "225 °C, 45 °C"),
    ("layer; first layer", "0.2 mm; 0.2 mm", "0.2 mm; 0.2 mm, 20 mm/s"),
    ("walls, infill", "3, 100 %", "2, 100 % along the cables"),
    ("speed, fan", "50 mm/s, 40 %", "20 mm/s, 50 %"),
    ("retraction", "1 mm (direct drive), 4 mm (Bowden)", "0.5 mm or none, direct drive"),
    ("supports, brim", "under the servo mount only; brim of 3 mm under caps", "none, none"),
    ("drying", "65 °C, 6 h", "55 °C, 8 h: wet TPU strings"),
)


def pages(
    morphology: Morphology, n_servos: Sequence[int], materials: Materials, paper: Paper
) -> list[Flowable]:
    """Return the section.

    Args:
        morphology: a robot or a module.
        n_servos: numbers of servos to say the power for.
        materials: what it is built from.
        paper: to print on.
    """
    width, n = paper.inner_width, morphology.n_modules
    listed = purchases(morphology, materials)
    (low, high), (low_more, high_more) = total(listed), total(listed, again=True)
    holder = robot_jig(morphology, materials)
    jig = 0.0 if holder is None else 1e-9 * float(holder.solid.volume())
    hours = print_hours(printed_parts(morphology, materials), jig)
    work = work_hours(n)
    what = (
        f"for the first module, {low_more:.0f} to {high_more:.0f} for each further one"
        if n == 1
        else "for the robot"
    )
    rows = [
        [
            style.escaped(p.what),
            style.escaped(p.needed),
            style.escaped(p.typical),
            str(p.packs),
            f"{p.packs * p.low:.0f} to {p.packs * p.high:.0f}",
        ]
        for p in listed
    ]
    return [
        blocks.heading("What it costs"),
        blocks.grid(
            ("to buy", "needed, with spares", "typical part", "packs", f"euro ({AS_OF})"),
            rows,
            blocks.columns(width, 26, 24, 29, 8, 13),
            right=(3, 4),
        ),
        blocks.gap(2),
        blocks.note(
            f"<b>{low:.0f} to {high:.0f} euro</b> {what}: usual prices as of {AS_OF}, our own guess and no"
            f" shop's offer, with tax and without shipping. The printer needs about {hours:.1f} hours"
            + (f", {jig / PRINT_SPEED / 3600:.1f} of them for the jig. " if jig else ". ")
            + "Not counted: printer, calipers, scale,"
            " soldering iron."
        ),
        blocks.together(
            [
                blocks.subheading("Hours of work, for somebody's first " + ("module" if n == 1 else "robot")),
                blocks.grid(
                    ("what", "hours"),
                    [
                        *[[a, f"{h:.1f}"] for a, h in work.items()],
                        ["<b>all</b>", f"<b>{sum(work.values()):.0f}</b>"],
                    ],
                    blocks.columns(0.5 * width, 70, 30),
                    right=(1,),
                ),
            ]
        ),
        blocks.together([blocks.subheading("Power"), *_power(n_servos, materials, width)]),
        blocks.together(
            [
                blocks.subheading("Filament settings to begin with"),
                blocks.grid(
                    (
                        "",
                        f"{style.escaped(materials.plastic.material)}: rigid parts, jig",
                        "TPU 85A: links, nets",
                    ),
                    [[f"<b>{a}</b>", b, c] for a, b, c in _FILAMENT],
                    blocks.columns(width, 24, 38, 38),
                ),
                blocks.gap(2),
                blocks.note("Assumed, for a nozzle of 0.4 mm; the spool's own figures win."),
            ]
        ),
    ]


def measuring(text: str, paper: Paper) -> Flowable:
    """Return what to measure for the materials file with a text, in which order."""
    return blocks.together(
        [
            blocks.subheading("What to measure, in this order"),
            blocks.body(
                "The file <b>measured.toml</b> is the form for it. Fill it in, then make the parts from"
                " it: tensatlas export … --materials measured.toml."
            ),
            blocks.grid(
                ("", "what", "how", "measured"),
                [
                    ["1", "pull test", "“Pull test of the cable material”, before anything is cut", ""],
                    *[
                        [str(n), f"{table}: {key.replace('_', ' ')}", style.escaped(how), ""]
                        for n, table, key, how in measures(text)
                    ],
                ],
                blocks.columns(paper.inner_width, 5, 28, 50, 17),
            ),
        ]
    )


def _power(n_servos: Sequence[int], materials: Materials, width: float) -> list[Flowable]:
    rows = []
    for n in n_servos:
        found = power(n, materials.servo, TETHER)
        if found is None:
            rows.append([str(n), "–", "no wire is thick enough: put the supply nearer", "", "", "", ""])
            continue
        rows.append(
            [
                str(n),
                f"{found.current:.1f} A",
                f"AWG {found.awg} ({found.section:.2f} mm²)",
                f"{found.drop:.2f} V",
                found.connector,
                f"{found.fuse:g} A",
                f"{found.supply:g} A",
            ]
        )
    header = ("servos", "all blocked", "wire to the robot", "it loses", "connector", "fuse", "supply")
    return [
        blocks.grid(header, rows, blocks.columns(width, 10, 13, 24, 11, 20, 10, 12)),
        blocks.gap(2),
        blocks.note(
            f"For a tether of {TETHER:g} m, whose wires lose at most {LARGEST_DROP:g} V, and servos that draw"
            f" {materials.servo.stall_current:g} A when they are blocked. From the common wires to a servo"
            f" AWG 26 is enough, for its signal AWG {SIGNAL}. The fuse sits at the supply, in the + wire; a"
            " capacitor of 470 to 1000 µF at the robot."
        ),
    ]
