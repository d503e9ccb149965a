"""How a module is put together: steps with pictures of the model, what is new in each of them in colour."""

from __future__ import annotations

import dataclasses
from typing import Final

import numpy as np
from reportlab.lib.colors import Color
from reportlab.platypus import Flowable, Paragraph, Table, TableStyle

from engine import tensegrity as t
from engine.fabrication.materials import Materials
from viz.build_sheet import blocks, style
from viz.build_sheet.bodies import CABLE_RADIUS, NODE_RADIUS, Body
from viz.build_sheet.facts import Facts
from viz.build_sheet.picture import Pen, Picture
from viz.build_sheet.scene import Ball, Tube, View, clearest, paint
from viz.build_sheet.style import Paper

CAMERA: Final = clearest(t.NODES, range(-44, 46, 4), range(12, 40, 3))
PICTURE_HEIGHT: Final = 158.0
PAIRS: Final = ((0, 1), (2, 3), (4, 5))
"""Parallel rods; the pairs are perpendicular to each other."""
MODULE: Final = Body.placed([lambda p: p], (1,))
"""One module as built, in its own frame."""


@dataclasses.dataclass(frozen=True, slots=True)
class Step:
    """One step.

    Attributes:
        title: what is done.
        text: how, as reportlab's markup.
        new: rods that are put in.
        there: rods that are in already.
        arm, cables: whether servo arm and internal cables are mounted in this step.
        all_cables: whether passive cables are drawn that lead to rods not yet there.
    """

    title: str
    text: str
    new: tuple[int, ...]
    there: tuple[int, ...] = ()
    arm: bool = False
    cables: bool = False


def pages(facts: Facts, materials: Materials, paper: Paper) -> list[Flowable]:
    """Return the section."""
    steps = [_step(paper, k, s) for k, s in enumerate(steps_of(materials), start=1)]
    return [
        blocks.heading(f"Build one module (do this {facts.morphology.n_modules} times)"),
        blocks.body(
            "All modules are built in the same way. In the pictures, what a step adds is in colour, what is there"
            " already is grey; small numbers are nodes (rod ends). Write the node number on every cap <b>before</b>"
            " you begin: everything later refers to it."
        ),
        *steps,
    ]


def steps_of(materials: Materials) -> list[Step]:
    """Return the steps for a printed net or for cords."""
    printed = materials.cable.form == "printed"
    spread = (
        "Lay the printed net on the table as on the net drawing, node numbers up, and write the numbers beside the"
        " eyelets."
        if printed
        else "Cut 24 cords by the cut list and tie a loop into both ends of each at the marked length."
    )
    hook = "Push the eyelets" if printed else "Hook the cords' loops"
    return [
        Step(
            "Prepare the rods",
            "Cut six rods. Glue a cap on both ends of each and number the caps: rod 0 has nodes 0 and 1, rod 1 nodes"
            " 2 and 3, and so on up to rod 5 with 10 and 11. Glue the servo mount to the middle of rod 0 (orange)."
            f" {spread}",
            (0, 1, 2, 3, 4, 5),
        ),
        Step(
            "First pair: rods 0 and 1",
            f"{hook} of nodes 0 and 1 on the caps of rod 0, those of 2 and 3 on rod 1. Both rods are parallel,"
            f" {_centi(_distance(0, 1))} cm apart.",
            PAIRS[0],
        ),
        Step(
            "Second pair: rods 2 and 3",
            f"{hook} of nodes 4 to 7 on rods 2 and 3: node 4 and node 5 on rod 2, 6 and 7 on rod 3. They stand across"
            " the first pair, outside of it. Let nobody help by twisting: every cable runs straight.",
            PAIRS[1],
            PAIRS[0],
        ),
        Step(
            "Third pair: rods 4 and 5",
            f"{hook} of nodes 8 to 11 on rods 4 and 5, across both other pairs. The last eyelets need the most force:"
            " hold the rod, not the cable. Now the module stands by itself.",
            PAIRS[2],
            (*PAIRS[0], *PAIRS[1]),
        ),
        Step(
            "Check the shape",
            "Every node has <b>four</b> cables; no two rods touch; each pair of rods is parallel and the pairs are at right"
            " angles. Compare with the neighbours table. If two cables are crossed, the module is twisted: take off"
            " the last rod and put it in again.",
            (),
            (0, 1, 2, 3, 4, 5),
        ),
        Step(
            "Servo, arm and internal cables",
            "Fix the servo to the mount on rod 0 so that its arm points to the module's centre; set it to 0° first"
            " (sketch, step “centre”). Lead a line from the arm to each of nodes "
            + ", ".join(map(str, t.SERVO_NODES))
            + " and set the lengths by the table under “Wiring”.",
            (),
            (0, 1, 2, 3, 4, 5),
            arm=True,
            cables=True,
        ),
    ]


def neighbours(width: float) -> Flowable:
    """Return the table of which nodes each node is joined to."""
    cells = []
    for n in range(len(t.NODES)):
        others = sorted(b if a == n else a for a, b in t.CABLES if n in (a, b))
        inner = "yes" if n in t.SERVO_NODES else ""
        cells.append([str(n), str(n ^ 1), ", ".join(map(str, others)), inner])
    half = len(cells) // 2
    rows = [[*a, *b] for a, b in zip(cells[:half], cells[half:], strict=True)]
    header = ("node", "rod to", "cables to", "internal cable") * 2
    return blocks.grid(header, rows, blocks.columns(width, 9, 9, 19, 13, 9, 9, 19, 13))


def _step(paper: Paper, number: int, step: Step) -> Flowable:
    width = paper.inner_width
    left = 0.44 * width
    picture = Picture(left, PICTURE_HEIGHT, lambda pen: draw_step(pen, step), f"step {number}")
    text = [
        Paragraph(f"{number}. {step.title}", style.SUBHEADING),
        Paragraph(step.text, style.BODY),
    ]
    table = Table([[picture, text]], colWidths=[left, width - left], hAlign="LEFT")
    table.setStyle(
        TableStyle(
            [
                ("VALIGN", (0, 0), (-1, -1), "MIDDLE"),
                ("LEFTPADDING", (0, 0), (-1, -1), 0),
                ("RIGHTPADDING", (0, 0), (-1, -1), 0),
                ("LINEBELOW", (0, 0), (-1, -1), 0.4, style.RULE),
            ]
        )
    )
    return table


def draw_step(pen: Pen, step: Step) -> None:
    """Draw the picture of a step."""
    body = MODULE
    view = View.fitting(CAMERA, t.NODES, (16, 14, pen.width - 32, pen.height - 28))
    rods = {*step.new, *step.there}
    things: list[Tube | Ball] = []
    for r in sorted(rods):
        color: Color = style.GHOST
        if r in step.new or step.title.startswith("Check"):
            color = style.SERVO if r == t.SERVO_ROD else style.ROD
        things.append(body.rod(0, r, color))
        things += [
            Ball(body.nodes[0, n], NODE_RADIUS, style.NODE if r in step.new else style.GHOST)
            for n in t.RODS[r]
        ]
    loose = len(step.new) == len(t.RODS)
    for (a, b), ends in zip(t.CABLES, body.cables[0], strict=True):
        between = {t.rod_of(a), t.rod_of(b)}
        if loose or not between <= rods:
            continue
        fresh = between & set(step.new) or step.title.startswith("Check")
        things.append(Tube(*ends, CABLE_RADIUS, style.CABLE if fresh else style.GHOST))
    if step.arm or loose:
        servo = body.servo(0)
        things += servo if step.cables else servo[:2]
    paint(pen, view, things, thinnest=0.7)
    label_nodes(pen, view, body.nodes[0], sorted(n for r in rods for n in t.RODS[r]))


def label_nodes(
    pen: Pen, view: View, nodes: np.ndarray, which: list[int], *, size: float = 8.0, away: float = 8.5
) -> None:
    """Write the numbers of nodes beside them, on the side away from the module's middle.

    Args:
        pen: to write with.
        view: how the module is seen.
        nodes: (12, 3) of a module, in m.
        which: nodes to label.
        size: of the figures.
        away: distance from node to figure, in points.
    """
    centre = np.array(view.at(nodes.mean(axis=0)))
    for n in which:
        place = np.array(view.at(nodes[n]))
        out = (place - centre) / max(float(np.linalg.norm(place - centre)), 1e-9)
        x, y = place + away * out
        pen.text(x, y - 0.27 * size, str(n), align="centre", bold=True, size=size, halo=True)


def _distance(a: int, b: int) -> float:
    middles = [t.NODES[list(t.RODS[r])].mean(axis=0) for r in (a, b)]
    return float(np.linalg.norm(middles[0] - middles[1]))


def _centi(metres: float) -> str:
    return f"{100 * metres:.1f}"
