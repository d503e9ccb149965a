"""How a module is put together: steps with pictures of the model, what is new in each of them in colour."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Final

import numpy as np
from reportlab.lib.colors import Color
from reportlab.platypus import Flowable, Paragraph, Table, TableStyle
from scipy.spatial.transform import Rotation

from engine.body import module as t
from engine.fabrication.dimensions import tolerances
from engine.fabrication.dimensions.acceptance import RODS, SPAN, expected, pull
from engine.fabrication.dimensions.cables import CableDesign, design_cables
from engine.fabrication.dimensions.floating_module import contraction, floating_module
from engine.fabrication.dimensions.limiter import has_limiter
from engine.fabrication.kit.jig import robot_jig
from engine.fabrication.mass_balance import mass_balance
from engine.fabrication.materials import Materials
from engine.fabrication.parts.net import EYELET_HOLE
from engine.fabrication.parts.servo_parts import elastic_length
from engine.fabrication.parts.shapes import POST
from engine.simulation.model import GRAVITY
from viz.build_sheet import blocks, bodies, style
from viz.build_sheet.bodies import CABLE_RADIUS, NODE_RADIUS
from viz.build_sheet.details import draw_drum, draw_rod_end
from viz.build_sheet.facts import Facts
from viz.build_sheet.pen import Pen, Picture
from viz.build_sheet.scene import Ball, SceneView, Tube, clearest, paint
from viz.build_sheet.style import Paper
from viz.robot.skeleton import Skeleton

CAMERA: Final = clearest(t.NODES, range(-44, 46, 4), range(12, 40, 3))
CHECK: Final = "Check the module"
PAIRS: Final = ((0, 1), (2, 3), (4, 5))
"""Parallel rods; the pairs are perpendicular to each other."""
MODULE: Final = Skeleton.placed([(Rotation.identity(), np.zeros(3))])
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
        detail: draws an enlarged detail in place of the module.
    """

    title: str
    text: str
    new: tuple[int, ...]
    there: tuple[int, ...] = ()
    servo: bool = False
    detail: Callable[[Pen], None] | None = None


def pages(facts: Facts, materials: Materials, paper: Paper) -> list[Flowable]:
    """Return the section."""
    design = design_cables(facts.morphology, materials)[0]
    steps = [_step(paper, k, s) for k, s in enumerate(steps_of(facts, materials, design), start=1)]
    n = facts.morphology.n_modules
    unlike = len(set(facts.morphology.stiffness_levels)) > 1
    return [
        blocks.heading("Build one module" + (f" (do this {n} times)" if n > 1 else "")),
        blocks.body(
            (
                "All modules are built in the same way"
                + ("; the cut list says which net and which caps go into which" if unlike else "")
                + ". "
                if n > 1
                else ""
            )
            + "In the pictures, what a step adds is in colour, what is there already is grey; numbers"
            " are nodes (rod ends). Wear eye protection from step 4 on."
        ),
        *steps,
        blocks.together([blocks.subheading("Knots"), *blocks.bullets(_knots())]),
        blocks.together(
            [
                blocks.subheading("What a finished module measures"),
                blocks.body(_spans(facts)),
                _contraction(facts, paper.inner_width),
                blocks.gap(2),
                blocks.note(
                    "Simulated, for a module that has stood for a day, without weight: hold the module by"
                    " rod 0 and measure with calipers from cap"
                    " to cap, where the cables leave (the node). <b>Shrinks too little:</b> a line slips or"
                    " is too long at 0°, its elastic is too soft, or the cables are too stiff. <b>Too much,"
                    " or a0 is off already:</b> a line is too short, or the cables are too soft. If the lines"
                    " are right, repeat the pull test with a piece of this module's material and export"
                    " again. Standing on the table a module sags, a soft one by some millimetres: measure in"
                    " the hand."
                ),
            ]
        ),
    ]


def _knots() -> list[str]:
    """Return which knot goes where."""
    return [
        "<b>Line:</b> braided polyethylene slips. Stop an end with a figure-eight knot; make a loop with a"
        " double overhand knot; put a drop of cyanoacrylate on both.",
        "<b>Latex thread to line:</b> an overhand knot in the thread's end, and behind it the line, two turns"
        " round the thread and two half hitches. No glue on latex: it turns brittle.",
    ]


def steps_of(facts: Facts, materials: Materials, design: CableDesign) -> list[Step]:
    """Return the steps for a printed net or for one that is cut from a sheet."""
    if materials.cable.form == "printed":
        ready = (
            "Lay the net down as on its drawing, the side up that was up in the printer (it becomes the"
            " outside), and write the node numbers beside its rings."
        )
    else:
        ready = (
            f"Cut the net from its sheet ({1000 * design.section.thickness:g} mm"
            + ("; the cut list says which" if len(set(facts.morphology.stiffness_levels)) > 1 else "")
            + ") along the layer CUT of net/net_stiffness…dxf, or by hand along net_tiles…pdf, printed at"
            f" 100 %: strips {1000 * design.section.width:.2f} mm wide, and no notch in their edges, where"
            " they would tear. It lies as on its drawing, the outside up: write the node numbers beside its"
            " rings."
        )
    balance, n = mass_balance(facts.morphology, materials, facts.feet.feet), facts.morphology.n_modules
    opposite = t.RODS[next(b for a, b in PAIRS if a == t.SERVO_ROD)]
    every = (0, 1, 2, 3, 4, 5)
    limited = has_limiter(materials)
    lines = ", ".join(map(str, sorted(t.SERVO_NODES)[:-1])) + f" and {max(t.SERVO_NODES)}"
    holder = robot_jig(facts.morphology, materials)
    held = (
        "Snap all six rods, capped, into the jig (parts/jig.stl): it holds them until the net is on."
        if holder is not None
        else "A second person holds the rods until the net is on: no jig fits beside this servo."
    )
    return [
        Step(
            "Prepare rods and net",
            "Cut six rods (cut list), sand the ends, write the node numbers on both ends: rod 0 has nodes 0"
            f" and 1, rod 1 nodes 2 and 3, and so on up to rod 5 with 10 and 11. {ready}"
            + (
                " Draw a limiter (“Wiring”) into each of the rods 1 to 5, and tape its two lines to the ends."
                if limited
                else ""
            ),
            every,
        ),
        Step(
            "Servo, mount and drum",
            "On the bench: cut the servo's two ears off and put it into the cradle of its mount, shaft to "
            "the ball's side and towards node 0; fix it with hot glue. Glue the six discs of the drum on "
            "each other, peg into hole, the disc with the notch on its edge lowest. Lead a line through "
            "the channel of every cam and knot its end behind it. Plug the servo in, type a0 (“Program”), "
            "and screw the drum on with the servo's own screw, its notch to the arm that carries the "
            "ball; what the splines leave over is made good with the pulse at 0°. Glue the counterweight "
            "into its cup and the two pieces of rod 0 into their sockets, the short one at node 0.",
            (),
            detail=lambda pen: draw_drum(pen, materials.servo),
        ),
        Step(
            "Caps",
            "Push a cap on every rod end until the rod meets its bottom. No glue: the cables will hold it."
            + (
                f" Begin with nodes {lines}: their limiter's line comes out of the cap's slanting hole, and"
                " gets its bead; then adjust these limiters (“Wiring”), before the other seven caps."
                if limited
                else ""
            )
            + " A ring of the net will lie on the post, pressed on the rim by its cables, which begin to"
            " stretch at the rim's edge.",
            (),
            detail=lambda pen: draw_rod_end(pen, design, materials),
        ),
        Step(
            "Net on rods 0 and 1",
            f"{held} Pull the net's rings over the knobs of nodes 0 to 3, down to the rim; a crochet hook"
            f" helps. The hole of {1000 * EYELET_HOLE:.1f} mm grips the post of {2 * POST:.1f} mm. A node"
            " drawn twice (a and b) gets both rings. In the finished"
            " module these"
            f" two rods are parallel, {_centi(_distance(0, 1))} cm apart.",
            PAIRS[0],
        ),
        Step(
            "Net on rods 2 and 3",
            "Rings of nodes 4 to 7: 4 and 5 on rod 2, 6 and 7 on rod 3, which stand"
            " across the first pair, inside the net. Every cable runs straight from rod to rod, none is"
            " twisted round another.",
            PAIRS[1],
            PAIRS[0],
        ),
        Step(
            "Net on rods 4 and 5",
            "Rings of nodes 8 to 11: 8 and 9 on rod 4, 10 and 11 on rod 5, across"
            " both other pairs. The last ones need most force; nothing is to be tightened, the lengths make"
            " the tension. Compare every node with the table of neighbours: a ring comes off as it went"
            " on. Then pull the module out of the jig.",
            PAIRS[2],
            (*PAIRS[0], *PAIRS[1]),
        ),
        Step(
            "Internal cables",
            f"Turn rod 0 in its caps until the ball points to the middle between nodes {opposite[0]} and"
            f" {opposite[1]}. Lead each line with a needle from its groove straight into the hole of the arm"
            " at the same height, on to the ball, and out of the hole that looks to its node. Tie on the"
            " elastic (“Wiring”) and a small loop of line (“Knots”);"
            f" from first knot to loop's end at most {1000 * elastic_length():.0f} mm. At a0, hang"
            f" {1000 * t.SERVO_OFFSET / GRAVITY:.0f} g on the loop: from ball to loop it must measure what"
            f" the table under “Wiring” says for 0°, ± {1000 * tolerances.INTERNAL_CABLE:.1f} mm. Then put"
            + (
                " the loop over the bead of the node's limiter (“Wiring”)."
                if has_limiter(materials)
                else " the loop over the neck of the node's cap."
            )
            + " Tie the servo's wire to rod 0, clear of the lines.",
            (),
            every,
            servo=True,
        ),
        Step(
            CHECK,
            "Every node has <b>four</b> cables; no two rods touch; the rods of a pair are parallel, the pairs"
            f" at right angles. Node to node along a cable it measures {_centi(_span(design))} cm. If two"
            " cables cross, take their rings off and put them on again. Weigh it"
            f" ({1000 * balance.built / n:.1f} g ± {100 * tolerances.MASS:.0f} %). Type a0 and a180 and"
            " compare with the table below, and again a day later: the material gives way by"
            f" {100 * materials.cable.relaxation_after_a_day:.0f} %, which the design allows for. If all is"
            " right then, a"
            " drop of cyanoacrylate at the lower edge of every cap keeps it on its rod. Write its number on"
            " the servo mount.",
            (),
            every,
        ),
    ]


def _spans(facts: Facts) -> str:
    """Return what to measure before the servo moves, which tells one wrong cable."""
    span = float(expected(facts.morphology.stiffness_levels[0]).spans.mean())
    first, second = RODS
    return (
        f"<b>Servo off:</b> every one of the 24 cables spans {1000 * span:.1f} mm, ± {1000 * SPAN:.1f} mm,"
        " from rod end to rod end. One that spans less is too stiff or too short, its neighbours are right."
        f" <b>Stretch:</b> hold rod {first} level with rod {second} below it, hang the weight on the middle"
        f" of rod {second}, and measure how far the two move apart. Less: all cables are too stiff, more: too"
        " soft. Then type a0 and a180:"
    )


def _contraction(facts: Facts, width: float) -> Flowable:
    rows = []
    levels = facts.morphology.stiffness_levels
    for level in dict.fromkeys(levels):
        modules = style.module_names([i for i, other in enumerate(levels) if other == level])
        stretch = 1000 * expected(level).stretch
        weight = f"{1000 * pull(level) / GRAVITY:.0f}"
        rows += [
            [
                modules,
                *((weight, f"{stretch:.1f} ± {tolerances.STIFFNESS * stretch:.1f}") if k == 0 else ("", "")),
                f"{d.nodes[0]} and {d.nodes[1]}",
                f"{1000 * d.released:.1f}",
                f"{1000 * d.contracted:.1f}",
                f"± {1000 * d.tolerance:.1f}",
            ]
            for k, d in enumerate(contraction(level, facts.built))
        ]
    header = (
        "modules",
        "weight (g)",
        "stretch (mm)",
        "between nodes",
        "at a0 (mm)",
        "at a180 (mm)",
        "may differ (mm)",
    )
    shares = (18, 12, 15, 16, 12, 13, 14)
    return blocks.grid(header, rows, blocks.columns(width, *shares), right=(1, 4, 5, 6))


def _step(paper: Paper, number: int, step: Step) -> Flowable:
    width = paper.inner_width
    left = 0.44 * width
    draw = step.detail or (lambda pen: draw_step(pen, step))
    # four steps fill a page, or three and the table of measures
    height = 0.4 * paper.inner_height - 151
    picture = Picture(left, height, draw, f"step {number}")
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
    view = SceneView.fitting(CAMERA, t.NODES, (16, 14, pen.width - 32, pen.height - 28))
    rods = {*step.new, *step.there}
    things: list[Tube | Ball] = []
    for r in sorted(rods):
        color: Color = style.GHOST
        if r in step.new or step.title == CHECK:
            color = style.SERVO if r == t.SERVO_ROD else style.ROD
        things.append(bodies.rod(body, 0, r, color))
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
    if not loose:
        arm = bodies.servo(body, 0)
        things += arm if step.servo else arm[:2]
    paint(pen, view, things, thinnest=0.7)
    label_nodes(pen, view, body.nodes[0], sorted(n for r in rods for n in t.RODS[r]))


def label_nodes(
    pen: Pen, view: SceneView, nodes: np.ndarray, which: list[int], *, size: float = 8.0, away: float = 8.5
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
    return float(np.linalg.norm(t.ROD_MIDDLES[a] - t.ROD_MIDDLES[b]))


def _span(design: CableDesign) -> float:
    """Return the distance between two joined nodes of a finished module, servo off, in m."""
    nodes = floating_module(design.level, None).nodes
    return float(np.mean([np.linalg.norm(nodes[a] - nodes[b]) for a, b in t.CABLES]))


def _centi(metres: float) -> str:
    return f"{100 * metres:.1f}"
