"""Orthographic drawings with dimensions: the settled robot from above and from the side, and one module."""

from __future__ import annotations

import itertools

import numpy as np
from reportlab.platypus import Flowable

from engine.body import module as t
from viz.build_sheet import blocks, style
from viz.build_sheet.bodies import robot
from viz.build_sheet.facts import Facts
from viz.build_sheet.pen import Pen, Picture
from viz.build_sheet.scene import OrthographicCamera, SceneView, paint
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
