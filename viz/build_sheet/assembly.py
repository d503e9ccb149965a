"""How a module is put together: steps with pictures of the model, what is new in each of them in colour."""

from __future__ import annotations

import dataclasses
from typing import Final

import numpy as np
from reportlab.lib.colors import Color
from reportlab.platypus import Flowable, Paragraph, Table, TableStyle

from engine import tensegrity as t
from engine.fabrication.cables import CableDesign, design_cables
from engine.fabrication.materials import Materials
from engine.fabrication.module_state import floating_module
from viz.build_sheet import blocks, style
from viz.build_sheet.bodies import CABLE_RADIUS, NODE_RADIUS, Body
from viz.build_sheet.facts import Facts
from viz.build_sheet.picture import Pen, Picture
from viz.build_sheet.scene import Ball, Tube, View, clearest, paint
from viz.build_sheet.style import Paper

CAMERA: Final = clearest(t.NODES, range(-44, 46, 4), range(12, 40, 3))
PICTURE_HEIGHT: Final = 158.0
CHECK: Final = "Check the shape"
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
        servo: whether servo and internal cables are mounted in this step.
    """

    title: str
    text: str
    new: tuple[int, ...]
    there: tuple[int, ...] = ()
    servo: bool = False


def pages(facts: Facts, materials: Materials, paper: Paper) -> list[Flowable]:
    """Return the section."""
    design = design_cables(facts.morphology, materials)[0]
    steps = [_step(paper, k, s) for k, s in enumerate(steps_of(materials, design), start=1)]
    return [
        blocks.heading(f"Build one module (do this {facts.morphology.n_modules} times)"),
        blocks.body(
            "All modules are built in the same way; if their cables differ in stiffness, the cut list says"
            " which net or cord goes"
            " into which. In the pictures, what a step adds is in colour, what is there"
            " already is grey; small numbers are nodes (rod ends). Write the node number on every rod end"
            " <b>before</b>"
            " you begin: everything later refers to it."
        ),
        *steps,
    ]


def steps_of(materials: Materials, design: CableDesign) -> list[Step]:
    """Return the steps for a printed net or for cords."""
    tail = f"{1000 * design.tail:.1f} mm"
    if materials.cable.form == "printed":
        ready = "Lay the net on the table as on its drawing and write the node numbers beside its rings."
        hook = "Push the net's rings of nodes {} over the rod ends"
        where = f"Each ring sits on the bare rod, {tail} from the node."
    else:
        ready = "Cut 24 cords by the cut list. Tie them node by node as the neighbours table says."
        hook = "Tie the cords of nodes {} round the rod ends"
        where = f"Each knot sits on the bare rod, {tail} from the node."
    return [
        Step(
            "Prepare the rods",
            "Cut six rods and write the node numbers on both ends: rod 0 has nodes 0 and 1, rod 1 nodes 2 and"
            " 3, and so"
            " on up to rod 5 with 10 and 11. Glue the servo mount to the middle of rod 0 (orange), its guide"
            " to the"
            f" side of the module's centre. {ready}",
            (0, 1, 2, 3, 4, 5),
        ),
        Step(
            "First pair: rods 0 and 1",
            f"{hook.format('0 to 3')}. {where} Put a cap on each end; lay the node's four cables along it,"
            " one in each"
            " notch of its crown. A drop of glue keeps the cap from turning. In the finished module these two"
            " rods are"
            f" parallel, {_centi(_distance(0, 1))} cm apart.",
            PAIRS[0],
        ),
        Step(
            "Second pair: rods 2 and 3",
            f"{hook.format('4 to 7')}, with caps as before: 4 and 5 on rod 2, 6 and 7 on rod 3. They stand"
            " across the"
            " first pair. Every cable runs straight from cap to cap and none is twisted round another.",
            PAIRS[1],
            PAIRS[0],
        ),
        Step(
            "Third pair: rods 4 and 5",
            f"{hook.format('8 to 11')}: 8 and 9 on rod 4, 10 and 11 on rod 5, across both other pairs. The"
            " last ones need"
            " the most force: a second person holds the rods. Now the module stands by itself.",
            PAIRS[2],
            (*PAIRS[0], *PAIRS[1]),
        ),
        Step(
            "Servo, drum and internal cables",
            "Screw the servo into the mount on rod 0 and type a0 (see “Wiring”). Press the drum on its shaft."
            " Lead a line"
            " from each groove through the guide (the orange ball) to one of nodes "
            + ", ".join(map(str, t.SERVO_NODES))
            + f"; between line and node goes {style.escaped(materials.line.elastic)}. Set the lengths by the"
            " table under “Wiring”. Glue the ballast of the bill of materials to rod 0, away from the servo.",
            (),
            (0, 1, 2, 3, 4, 5),
            servo=True,
        ),
        Step(
            CHECK,
            "Every node has <b>four</b> cables; no two rods touch; the rods of a pair are parallel, the pairs"
            " at right"
            " angles. Compare with the neighbours table. If two cables cross, the module is twisted: take off"
            " the last"
            f" rod and put it in again. Node to node along a cable it measures {_centi(_span(design))} cm."
            " Write its number on"
            " the servo mount.",
            (),
            (0, 1, 2, 3, 4, 5),
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
        if r in step.new or step.title == CHECK:
            color = style.SERVO if r == t.SERVO_ROD else style.ROD
        things.append(body.rod(0, r, color))
        things += [
            Ball(body.nodes[0, n], NODE_RADIUS, style.NODE if r in step.new else style.GHOST)
            for n in t.RODS[r]
        ]
    loose = len(step.new) == len(t.RODS)
    for (a, b), (p, q) in zip(t.CABLES, body.cables[0], strict=True):
        between = {t.rod_of(a), t.rod_of(b)}
        if loose or not between <= rods:
            continue
        fresh = between & set(step.new) or step.title == CHECK
        things.append(Tube(p, q, CABLE_RADIUS, style.CABLE if fresh else style.GHOST))
    if step.servo or loose:
        servo = body.servo(0)
        things += servo if step.servo else servo[:2]
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


def _span(design: CableDesign) -> float:
    """Return the distance between two joined nodes of a finished module, servo off, in m."""
    nodes = floating_module(design.level, None).nodes
    return float(np.mean([np.linalg.norm(nodes[a] - nodes[b]) for a, b in t.CABLES]))


def _centi(metres: float) -> str:
    return f"{100 * metres:.1f}"
