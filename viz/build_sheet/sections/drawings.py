"""Orthographic drawings with dimensions: the settled robot from above and from the side, and one module."""

from __future__ import annotations

import itertools

import numpy as np
from reportlab.platypus import Flowable

from engine.body import module as t
from engine.fabrication.parts.head_tag import PLATE, WIRE, WIRE_LENGTH
from viz.build_sheet import blocks, style
from viz.build_sheet.bodies import robot
from viz.build_sheet.bodies import rod as bodies_rod
from viz.build_sheet.facts import Facts
from viz.build_sheet.pen import Pen, Picture
from viz.build_sheet.scene import Ball, OrthographicCamera, SceneView, Tube, paint
from viz.build_sheet.style import Paper

FROM_ABOVE = OrthographicCamera(np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]))
FROM_THE_SIDE = OrthographicCamera(np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]))
POINTS_PER_M = 72 / 0.0254
SCALES = (1, 2, 2.5, 3, 4, 5, 6, 8, 10)

_WORDS = (
    "<b>Module</b>: a ball of six rods that do not touch, held by 24 cables (a tensegrity). <b>Node</b>: the"
    " end of a rod, 0 to 11 in every module.",
    "<b>Passive cable</b>: one of the 24 elastic cables of a module. <b>Internal cable</b>: one of the five"
    " lines that the servo pulls. <b>Face</b>: a triangle of three passive cables, 1 to 8, that can join"
    " another module.",
    "<b>Head</b>: the module at the end that goes first. <b>Cell</b>: the robot's place on a map of many;"
    " only good to find it again.",
)


def pages(facts: Facts, paper: Paper) -> list[Flowable]:
    """Return the section."""
    length, width, height = facts.size
    scale = next(s for s in SCALES if length * POINTS_PER_M / s <= paper.inner_width - 74)
    size = POINTS_PER_M / scale
    plan = Picture(paper.inner_width, width * size + 64, lambda pen: _draw_plan(pen, facts, size), "plan")
    side = Picture(
        paper.inner_width, height * size + 54, lambda pen: _draw_side(pen, facts, size), "elevation"
    )
    return [
        blocks.heading("Drawings: the whole robot, settled"),
        blocks.body(
            f"Scale 1:{scale:g}, measures in cm. This is the simulated robot"
            f" {facts.config.trials.settle_time:g} s after being set down, servos released: gravity has"
            " sagged it. A finished robot is checked against these measures (see “Checks”). Colours are those"
            " of the first page."
        ),
        blocks.together([blocks.subheading("From above"), plan]),
        blocks.together([blocks.subheading("From the side (seen from the robot's right)"), side]),
        _head_point(facts, paper),
        blocks.together([blocks.subheading("Settled modules"), _heights(facts, paper.inner_width)]),
        blocks.together([blocks.subheading("Words used here"), *blocks.bullets(_WORDS)]),
    ]


def _draw_plan(pen: Pen, facts: Facts, size: float) -> None:
    body = facts.levelled
    low, high = facts.extent()
    view = SceneView(FROM_ABOVE, size, np.array([37 - size * low[0], 40 - size * low[1]]))
    paint(pen, view, robot(facts), thinnest=0.4)
    x0, y0 = view.at(low)
    x1, y1 = view.at(high)
    pen.dimension((x0, y0 - 32), (x1, y0 - 32), f"{100 * (high - low)[0]:.1f}", ticks=(y0, y0))
    pen.dimension((x1 + 16, y0), (x1 + 16, y1), f"{100 * (high - low)[1]:.1f}", ticks=(x1, x1))
    centres = body.centres
    for i, centre in enumerate(centres):
        x, _ = view.at(centre)
        name = facts.module_name(i)
        pen.text(
            x, y1 + 8, name, align="centre", bold=True, color=style.ACCENT if "head" in name else style.INK
        )
    order = np.argsort([view.at(c)[0] for c in centres])
    for a, b in itertools.pairwise(order):
        xa, xb = view.at(centres[a])[0], view.at(centres[b])[0]
        text = f"{100 * abs(centres[b, 0] - centres[a, 0]):.1f}"
        pen.dimension((xa, y0 - 16), (xb, y0 - 16), text, ticks=(y0, y0))


def _draw_side(pen: Pen, facts: Facts, size: float) -> None:
    body = facts.levelled
    low, high = facts.extent()
    view = SceneView(FROM_THE_SIDE, size, np.array([37 - size * low[0], 14.0]))
    ground = view.at(np.zeros(3))[1]
    pen.line((8, ground), (pen.width - 8, ground), color=style.SOFT, width=0.8)
    x = 10.0
    while x < pen.width - 12:
        pen.line((x, ground), (x - 4, ground - 4), color=style.RULE, width=0.4)
        x += 6
    paint(pen, view, robot(facts), thinnest=0.4)
    x1, top = view.at(high)
    pen.dimension((x1 + 16, ground), (x1 + 16, top), f"{100 * high[2]:.1f}", ticks=(x1, x1))
    head = facts.head.module
    x, _ = view.at(body.nodes[head].mean(axis=0))
    way = "crawls this way"
    pen.line((x - 6, top + 14), (x + 22, top + 14), color=style.ACCENT, width=1.4)
    pen.path([(x + 29, top + 14), (x + 21, top + 17.5), (x + 21, top + 10.5)], fill=style.ACCENT, stroke=None)
    pen.text(x - 10, top + 11.3, way, align="right", color=style.ACCENT)


def head_point(facts: Facts) -> np.ndarray:
    """Return (3,) the point that the simulation takes for the robot's place, settled and levelled, in m."""
    body = facts.levelled
    return np.asarray(body.rods[facts.head.module, list(facts.head.front)].mean(axis=(0, 1)))


def tag_rod(facts: Facts) -> int:
    """Return the rod of the head that its tag is fixed to: of those without a servo the highest."""
    heights = facts.levelled.rods[facts.head.module].mean(axis=1)[:, 2]
    return max((r for r in range(len(t.RODS)) if r != t.SERVO_ROD), key=lambda r: float(heights[r]))


def _head_point(facts: Facts, paper: Paper) -> Flowable:
    a, b, c = facts.head.front
    rod = tag_rod(facts)
    _, high = facts.extent()
    point = head_point(facts)
    picture = Picture(paper.inner_width, 178.0, lambda pen: _draw_head(pen, facts), "head point")
    return blocks.together(
        [
            blocks.subheading("The head point, and the tag that a camera sees"),
            blocks.body(
                f"The simulation's head is a point between rods: the mean of the middles of rods {a}, {b} and"
                f" {c} of module {t.module_number(facts.head.module)} (in colour), at rest"
                f" {100 * (high - point)[0]:.1f} cm behind the robot's front end, {100 * point[2]:.1f} cm"
                f" above the ground. Snap the clip on the middle of rod {rod}, glue {WIRE_LENGTH:.0f} mm of"
                f" steel wire of {WIRE:g} mm into it and into the plate, and bend it until the plate is"
                " level, its middle above the point (± 3 mm) and above everything that moves. Glue the tag on"
                " the plate, its upper edge towards the front."
            ),
            picture,
        ]
    )


def _draw_head(pen: Pen, facts: Facts) -> None:
    """Draw the head module from above and from the side: the head point, and the tag's plate above it."""
    i, body = facts.head.module, facts.levelled
    point, rods = head_point(facts), body.rods[i]
    spread = rods.reshape(-1, 3)
    low, high = spread.min(axis=0) - 0.004, spread.max(axis=0) + 0.004
    high[2] += 0.02
    size = min((pen.width / 2 - 40) / (high - low)[0], (pen.height - 36) / max((high - low)[1:]))
    for side, (camera, axis, name) in enumerate(
        ((FROM_ABOVE, 1, "from above"), (FROM_THE_SIDE, 2, "from the side"))
    ):
        left = 18 + side * pen.width / 2
        view = SceneView(camera, size, np.array([left - size * low[0], 26 - size * low[axis]]))
        things: list[Tube | Ball] = [
            bodies_rod(body, i, r, style.HEAD if r in facts.head.front else style.GHOST)
            for r in range(len(t.RODS))
        ]
        paint(pen, view, things, thinnest=0.5)
        x, y = view.at(point)
        plate = np.array([0.0005 * PLATE, 0.0005 * PLATE if axis == 1 else 0.0])
        top = point if axis == 1 else np.array([point[0], point[1], high[2] - 0.006])
        px, py = view.at(top)
        wide, tall = 2 * size * plate[0], max(2 * size * plate[1], 1.6)
        pen.box(px - wide / 2, py - tall / 2, wide, tall, stroke=style.ACCENT, line=1.0)
        if axis == 2:
            pen.line((x, y), (px, py), color=style.ACCENT, width=0.7, dash=(3, 2))
            mx, my = view.at(rods[tag_rod(facts)].mean(axis=0))
            pen.path([(mx, my), (mx + 5, py - 9), (px, py)], stroke=style.INK, width=1.2)
        for dx, dy in ((5, 0), (0, 5)):
            pen.line((x - dx, y - dy), (x + dx, y + dy), color=style.ACCENT, width=1.4)
        pen.text(left + size * (high - low)[0] / 2, 8, name, align="centre", color=style.SOFT)


def _heights(facts: Facts, width: float) -> Flowable:
    body = facts.levelled
    low, _ = facts.extent()
    rows = []
    for i in range(body.n_modules):
        nodes = body.nodes[i]
        top = 1000 * (nodes[:, 2].max() + t.ROD_RADIUS)
        ground = [str(n) for n in range(len(t.NODES)) if nodes[n, 2] < 0.005]
        centre = nodes.mean(axis=0)
        rows.append(
            [
                facts.module_name(i),
                f"{100 * (centre[0] - low[0]):.1f}",
                f"{top / 10:.1f}",
                f"{100 * centre[2]:.1f}",
                ", ".join(ground) or "none",
            ]
        )
    header = (
        "module",
        "centre, from the rear end (cm)",
        "highest point (cm)",
        "centre, above the ground (cm)",
        "nodes on the ground",
    )
    return blocks.grid(header, rows, blocks.columns(width, 14, 22, 18, 22, 24), right=(1, 2, 3))
