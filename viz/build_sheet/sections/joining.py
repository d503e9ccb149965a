"""How the modules are joined: the orientation table and a picture of every joint, pulled apart."""

from __future__ import annotations

import functools
from typing import Final

import numpy as np
from reportlab.lib.colors import white
from reportlab.platypus import Flowable

from engine.body import module as t
from engine.fabrication.dimensions.joints import Joint, joints, orientations
from engine.fabrication.parts.shapes import LINK_PITCH
from engine.simulation.model import module_placements
from viz.build_sheet import blocks, bodies, style
from viz.build_sheet.bodies import CABLE_RADIUS, NODE_RADIUS
from viz.build_sheet.facts import Facts
from viz.build_sheet.pen import Pen, Picture
from viz.build_sheet.scene import Ball, SceneView, Tube, clearest, paint
from viz.build_sheet.style import Paper
from viz.robot.skeleton import Skeleton

APART: Final = 0.055
"""How far modules are pulled apart in the pictures, in m."""
PICTURE_HEIGHT: Final = 168.0


def pages(facts: Facts, paper: Paper) -> list[Flowable]:
    """Return the section."""
    n = facts.morphology.n_modules
    near, far = facts.link_gaps
    head, front = t.module_number(facts.head.module), "last" if facts.head.is_end else "first"
    pictures = [
        Picture(
            paper.inner_width / 2 - 6,
            PICTURE_HEIGHT,
            functools.partial(_draw_joint, facts=facts, joint=joint),
            f"joint {t.module_number(joint.module)}",
        )
        for joint in joints(facts.morphology)
    ]
    return [
        blocks.heading(f"Join the {n} modules"),
        blocks.body(
            "Join modules only when each has passed step 8 of its assembly. Lay both down as in the picture"
            " of their joint. For each of the three pairs of nodes in the table, stretch one printed link"
            " (parts/link.stl) over the knobs at the ends of the two caps until it sits on their necks, over"
            f" the loop of an internal cable if there is one; a loop of line, {LINK_PITCH:.1f} mm long, does"
            f" as well. The link holds the two necks {LINK_PITCH:.1f} mm apart and yields: in the settled"
            f" simulation joined nodes are {1000 * near:.1f} to {1000 * far:.1f} mm apart. The joint must"
            " wiggle. The three pairs alone fix which face meets which and in which turn. <b>Face</b> numbers"
            " are on the net drawing. The column “turn” is a check: seen along the chain from module 1, the"
            " servo rod of the next module must lie that much further clockwise."
        ),
        _orientation_table(facts, paper.inner_width),
        blocks.gap(3),
        blocks.note(
            f"Module 1 has no module before it and module {n} none after it. The head is module {head},"
            f" the {front} one; its front, which goes first, is face {_front_face(facts)} (nodes"
            f" {_names(t.FACES[_front_face(facts)])}). Mark it."
        ),
        blocks.in_pairs(pictures, paper.inner_width, 6),
    ]


def _orientation_table(facts: Facts, width: float) -> Flowable:
    """Return the orientation table: faces, nodes that meet and the turn of every joint."""
    stand = orientations(facts.morphology)
    rows = []
    for joint in joints(facts.morphology):
        i = joint.module
        turn = stand[i + 1].turn
        assert turn is not None
        rows.append(
            [
                f"<b>{t.module_number(i)} and {t.module_number(i + 1)}</b>",
                f"{joint.face} (nodes {_names(t.FACES[joint.face])})",
                f"{joint.next_face} (nodes {_names(t.FACES[joint.next_face])})",
                "<b>" + ", ".join(f"{a}–{b}" for a, b in joint.node_pairs) + "</b>",
                f"{turn:.0f}°",
            ]
        )
    header = ("modules", "face of the first", "face of the second", "nodes that meet, first–second", "turn")
    return blocks.grid(header, rows, blocks.columns(width, 13, 26, 26, 25, 10), right=(4,))


def _front_face(facts: Facts) -> int:
    face = facts.morphology.faces[facts.head.module]
    return face if facts.head.is_end else t.OPPOSITE_FACE[face]


def _names(nodes: tuple[int, ...]) -> str:
    return ", ".join(map(str, nodes))


def _draw_joint(pen: Pen, facts: Facts, joint: Joint) -> None:
    i = joint.module
    places = module_placements(facts.morphology)[i : i + 2]
    shifts = (np.zeros(3), np.array([APART, 0.0, 0.0]))
    body = Skeleton.placed([(turn, centre + s) for (turn, centre), s in zip(places, shifts, strict=True)])
    met = ([a for a, _ in joint.node_pairs], [b for _, b in joint.node_pairs])
    ends = np.concatenate([body.nodes[0, met[0]], body.nodes[1, met[1]]])
    camera = clearest(ends, range(-36, 40, 4), range(6, 36, 3))
    pen.box(0.5, 0.5, pen.width - 1, pen.height - 1, stroke=style.RULE, radius=4)
    view = SceneView.fitting(camera, body.nodes.reshape(-1, 3), (16, 16, pen.width - 32, pen.height - 54))
    things: list[Tube | Ball] = []
    for k in (0, 1):
        for r in range(len(t.RODS)):
            things.append(bodies.rod(body, k, r, style.SERVO if r == t.SERVO_ROD else style.GHOST))
        face = set(met[k])
        for (a, b), (p, q) in zip(t.CABLES, body.cables[k], strict=True):
            here = a in face and b in face
            color = style.CABLE if here else style.GHOST
            things.append(Tube(p, q, (2.2 if here else 1) * CABLE_RADIUS, color))
        things += [
            Ball(body.nodes[k, n], NODE_RADIUS, style.LINK if n in face else style.GHOST) for n in range(12)
        ]
    paint(pen, view, things)
    for a, b in joint.node_pairs:
        start, end = view.at(body.nodes[0, a]), view.at(body.nodes[1, b])
        pen.line(start, end, color=white, width=3)
        pen.line(start, end, color=style.LINK, width=1.3, dash=(3, 2))
    _label(pen, view, body, joint)
    number = t.module_number(i)
    pen.text(8, pen.height - 13, f"Modules {number} and {number + 1}", bold=True, size=9)
    nodes = ", ".join(f"{a}–{b}" for a, b in joint.node_pairs)
    pen.text(
        pen.width - 8, pen.height - 13, f"tie {nodes}", bold=True, size=9, align="right", color=style.LINK
    )
    for k in (0, 1):
        x = view.at(body.nodes[k].mean(axis=0))[0]
        top = max(view.at(p)[1] for p in body.nodes[k])
        name = f"module {facts.module_name(i + k)}"
        pen.text(x, min(top + 7, pen.height - 28), name, align="centre", size=8, color=style.SOFT)


def _label(pen: Pen, view: SceneView, body: Skeleton, joint: Joint) -> None:
    """Write the joined nodes' numbers beside their links, each on its own module's side."""
    for a, b in joint.node_pairs:
        start, end = np.array(view.at(body.nodes[0, a])), np.array(view.at(body.nodes[1, b]))
        along = (end - start) / max(float(np.linalg.norm(end - start)), 1e-9)
        for place, way, n in ((start, -1.0, a), (end, 1.0, b)):
            x, y = place + way * 9 * along
            pen.text(x, y - 2.4, str(n), align="centre", bold=True, size=9, halo=True, color=style.LINK)
