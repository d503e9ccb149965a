"""Feet that grip one way: which goes on which rod end, where it points, and the test of their friction."""

from __future__ import annotations

import functools
import math
from typing import Final

import numpy as np
from reportlab.lib.colors import Color, HexColor, white
from reportlab.platypus import Flowable

from engine.body import module as t
from engine.body.feet import FEET_TEXT
from engine.fabrication.dimensions.cables import cable_design
from engine.fabrication.dimensions.feet import TEST_FEET, TEST_LEAN, Foot, foot_name
from engine.fabrication.mass_balance import mass_balance
from engine.fabrication.materials import Materials
from engine.fabrication.parts.foot import RADIUS, ball_outline
from engine.fabrication.parts.servo_parts import ROD_DIAMETER
from engine.fabrication.parts.shapes import FOOT_LIP, HEAD, NECK, POST_TOP, cap_shape, neck_height
from viz.build_sheet import blocks, bodies, style
from viz.build_sheet.facts import Facts
from viz.build_sheet.pen import Pen, Picture
from viz.build_sheet.scene import Ball, OrthographicCamera, SceneView, Tube, paint
from viz.build_sheet.style import Paper

FOOT: Final = HexColor("#b3286e")
FROM_ABOVE: Final = OrthographicCamera(np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]))
RISE: Final = POST_TOP + neck_height(footed=True) + HEAD[1] / 2 + RADIUS - (POST_TOP + NECK + HEAD[1])
"""How much farther than a plain cap's knob a foot reaches, in mm."""
PLAN_HEIGHT: Final = 190.0
ARROW: Final = 0.016
"""Length of a foot's arrow, in m."""


def pages(facts: Facts, materials: Materials, paper: Paper) -> list[Flowable]:
    """Return the section; nothing for a robot without feet."""
    feet, width = facts.feet.feet, paper.inner_width
    if not feet:
        return []
    forward, backward = facts.config.physics.feet_friction
    return [
        blocks.heading("Feet that grip one way"),
        blocks.body(
            f"This robot was evolved with feet that slide {FEET_TEXT[facts.morphology.feet]} of its chain"
            f" with friction {forward:g} and hold with {backward:g} else. Its {len(feet)} feet are flexible"
            " balls with scales (files parts/foot_*). Press each over the knob of its cap when the modules"
            " are joined, after the links, with a drop of glue. They go where rod ends touch the floor in the"
            f" simulated trials, and have {100 * facts.feet.covered:.0f} % of all contact with the floor. The"
            " rest is plain caps: of rod ends that touch less, or that are tied to one with a foot, where"
            " there is no room for two. Feet make these rod ends"
            f" {RISE:.1f} mm longer than plain caps: the robot stands a little higher than drawn."
        ),
        *blocks.bullets(
            [
                "The <b>part</b> says how the foot leans: foot_060 slides at 60° to the rod's outward"
                " direction. The kinds look alike; keep them apart.",
                "The <b>clock</b> says where the notch in its rim points. Look at the rod's end from outside,"
                " along the rod: 0° is towards the middle of the module, then clockwise.",
                "Number each foot with a pen as in the table. The arrows in the picture show which way each"
                " slides while the robot lies as at its start.",
            ]
        ),
        Picture(width, 118, functools.partial(_draw_foot, materials=materials), "a foot on its rod end"),
        blocks.together(
            [
                blocks.subheading("Seen from above, as it rests on the floor"),
                Picture(width, PLAN_HEIGHT, functools.partial(_draw_plan, facts=facts), "feet from above"),
            ]
        ),
        blocks.subheading("Which foot goes where"),
        blocks.grid(
            ("foot", "module", "rod end", "part", "clock", "on the floor", "slides, back (cm)", "off"),
            [_row(facts, foot) for foot in feet],
            blocks.columns(width, 8, 16, 11, 14, 10, 14, 19, 8),
            right=(0, 2, 4, 5, 6, 7),
        ),
        blocks.gap(2),
        blocks.note(
            "On the floor: part of the time. Slides, back: how far the rod end slides that way and against it"
            " in one simulated trial. Off: by how much the foot points elsewhere than the simulated one, on"
            " average over its contacts, because it keeps its direction on the rod while the module turns."
        ),
        blocks.together(_test(facts, materials, paper)),
        *_pairs(facts, width),
    ]


def _row(facts: Facts, foot: Foot) -> list[str]:
    return [
        f"<b>{foot.number}</b>",
        facts.module_name(foot.module),
        str(foot.node),
        foot.part,
        f"<b>{foot.clock}°</b>",
        f"{100 * foot.share:.0f} %",
        f"{100 * foot.forward:.1f}, {100 * foot.backward:.1f}",
        f"{foot.off:.0f}°",
    ]


def _test(facts: Facts, materials: Materials, paper: Paper) -> list[Flowable]:
    down, up = (math.degrees(math.atan(f)) for f in facts.config.physics.feet_friction)
    standing = sum(foot.share for foot in facts.feet.feet)
    load = 1e3 * TEST_FEET * mass_balance(facts.morphology, materials, facts.feet.feet).built / standing
    steps = [
        f"Print parts/friction_sled and the {TEST_FEET} feet {foot_name(TEST_LEAN)} that the robot does not"
        f" need. Press them on the sled's knobs, all notches towards its point, and tape {load:.0f} g on its"
        f" back: {TEST_FEET} feet of the robot carry as much, on average.",
        "Cover a board with the floor that the robot is to crawl on. Stand the sled on it, its point"
        " <b>downhill</b>. Raise one end of the board slowly, tapping it, until the sled keeps sliding. Note"
        f" the angle, five times. The simulated feet begin at {down:.0f}°.",
        f"Turn the sled round, its point <b>uphill</b>, and do it again. The simulated feet begin at"
        f" {up:.0f}°.",
        "Write the angles into the materials file and export again. Then the robot is simulated as built with"
        " the friction that you measured, and with its spread:<br/>[feet_test]<br/>forward_degrees ="
        f" [{down:.0f}, …]<br/>backward_degrees = [{up:.0f}, …]",
    ]
    return [
        blocks.subheading("Friction test with a tilting board"),
        blocks.body(_measured(materials)),
        *blocks.bullets(steps, numbered=True),
        Picture(paper.inner_width, 96, functools.partial(_draw_board, down=down, up=up), "tilting board"),
    ]


def _measured(materials: Materials) -> str:
    test = materials.feet_test
    if test is None:
        return "<b>Nobody has measured these feet yet</b>: the simulated friction is assumed. Test first."
    (forward, backward), (less, more) = test.friction, test.spread
    return (
        f"<b>Measured</b> (materials.toml): {forward:.2f} ± {forward * less:.2f} forward,"
        f" {backward:.2f} ± {backward * more:.2f} backward. Test again when floor or filament change."
    )


def _pairs(facts: Facts, width: float) -> list[Flowable]:
    """Return how the robot fares with feet that grip better or worse."""
    if facts.as_built is None or not facts.as_built.pairs:
        return []
    rows = [
        [f"{forward:g}", f"{backward:g}", *(_cm(f) for f in (scores.mean, scores.deviation))]
        for (forward, backward), scores in facts.as_built.pairs.items()
    ]
    n = len(next(iter(facts.as_built.pairs.values())).f_s)
    header = ("friction forward", "backward", "f<sub>s</sub>, mean (cm)", "standard deviation (cm)")
    return [
        blocks.together(
            [
                blocks.subheading("How it fares with other friction"),
                blocks.grid(header, rows, blocks.columns(width, 25, 25, 25, 25), right=(0, 1, 2, 3)),
                blocks.gap(2),
                blocks.note(f"The robot as designed, {n} evaluations each under fresh noise."),
            ]
        )
    ]


def _cm(length: float | None) -> str:
    return "–" if length is None else style.signed(100 * length, 1)


def _draw_foot(pen: Pen, materials: Materials) -> None:
    """Draw a foot of 60 degrees on a rod end from its side, and a notch at 120 degrees from outside."""
    scale, lean, clock = 5.2, math.radians(60), math.radians(120)
    x0, y0 = 150.0, 50.0

    def at(z: float, x: float) -> tuple[float, float]:
        return x0 + scale * z, y0 + scale * x

    def bar(low: float, high: float, half: float, fill: Color) -> None:
        a, b = at(low, -half), at(high, half)
        pen.box(*a, b[0] - a[0], b[1] - a[1], fill=fill, line=0.5)

    cap = cap_shape(cable_design(1, materials), materials.printer, footed=True)
    neck = POST_TOP + neck_height(footed=True)
    bar(-20.0, cap.low, ROD_DIAMETER / 2, style.ROD)
    pen.path([at(*point) for point in cap.outline], fill=style.BAND, close=True)
    middle = neck + HEAD[1] / 2
    turn = np.array([[np.cos(lean), -np.sin(lean)], [np.sin(lean), np.cos(lean)]])
    outline = ball_outline()
    whole = np.concatenate([outline, outline[::-1] * (-1.0, 1.0)])
    # in the picture z runs to the right and x upwards; the ball's axis is where it slides
    around = np.array([[z, x] for x, z in whole]) @ turn.T + (middle, 0.0)
    around = np.maximum(around, (neck - FOOT_LIP, -99.0))
    pen.path([at(z, x) for z, x in around], fill=style.mixed(FOOT, white, 0.55), stroke=FOOT, close=True)
    pen.disc(at(neck - FOOT_LIP + 0.3, RADIUS - 1.0), 2.2, fill=style.INK)
    ahead = turn @ (1.0, 0.0)
    start, tip = (np.array(at(*(np.array([middle, 0.0]) + k * ahead))) for k in (4.4, 9.0))
    _arrow(pen, start, tip, FOOT)
    pen.text(tip[0] + 9, tip[1] - 6, "slides", color=FOOT, bold=True)
    pen.line(at(middle, 0.0), at(middle + 12.0, 0.0), color=style.SOFT, dash=(3, 2))
    pen.text(at(middle + 5.2, 0.0)[0], y0 + 6, "60°")
    pen.text(at(-6.0, 0.0)[0], y0 + 31, "notch", align="right")
    pen.line((at(-6.0, 0.0)[0] + 2, y0 + 33), at(neck - FOOT_LIP, RADIUS - 1.0), width=0.4)
    pen.text(at(-20.0, 0.0)[0], 3, "rod with its cap, from the side")
    # from outside
    cx, cy, r = pen.width - 150.0, 52.0, 30.0
    pen.disc((cx, cy), r, fill=style.mixed(FOOT, white, 0.55), stroke=FOOT)
    for k in range(12):
        a = math.radians(90 - 30 * k)
        pen.line(*((cx + q * math.cos(a), cy + q * math.sin(a)) for q in (r + 2, r + 6)), color=style.SOFT)
    way = np.array([math.sin(clock), math.cos(clock)])
    pen.disc((cx + (r - 5) * way[0], cy + (r - 5) * way[1]), 3.5, fill=style.INK)
    pen.text(cx, cy + r + 9, "0°: the module's middle", align="centre")
    pen.text(cx + r + 9, cy - 3, "90°")
    pen.text(cx - r - 9, cy - 3, "270°", align="right")
    pen.text(cx + (r + 9) * way[0], cy + (r + 9) * way[1] - 6, "notch at 120°")
    pen.text(cx, 3, "from outside, along the rod", align="centre")


def _draw_plan(pen: Pen, facts: Facts) -> None:
    body, feet = facts.levelled, facts.feet.feet
    low, high = facts.extent()
    corners = np.array([low, high])
    view = SceneView.fitting(FROM_ABOVE, corners, (34, 16, pen.width - 68, pen.height - 46))
    things: list[Tube | Ball] = []
    for i in range(body.n_modules):
        things += [bodies.rod(body, i, r, style.GHOST) for r in range(len(t.RODS))]
    things += [Ball(body.nodes[f.module, f.node], 1e-3 * RADIUS, FOOT) for f in feet]
    paint(pen, view, things, thinnest=0.4)
    for i, centre in enumerate(body.centres):
        name = facts.module_name(i)
        color = style.ACCENT if "head" in name else style.SOFT
        pen.text(view.at(centre)[0], pen.height - 14, name, align="centre", bold=True, color=color)
    taken: list[np.ndarray] = []
    for foot in feet:
        start = np.array(view.at(body.nodes[foot.module, foot.node]))
        tip = np.array(view.at(body.nodes[foot.module, foot.node] + ARROW * _level(body.nodes, foot)))
        _arrow(pen, start, tip, FOOT)
        place = _free(start, start - tip, taken)
        taken.append(place)
        pen.text(
            float(place[0]),
            float(place[1]),
            str(foot.number),
            align="centre",
            bold=True,
            color=FOOT,
            halo=True,
            size=7.5,
        )


def _level(nodes: np.ndarray, foot: Foot) -> np.ndarray:
    """Return (3,) which way a foot on a resting robot (M, 12, 3) slides, level, of length 1."""
    a, b = nodes[foot.module, foot.node], nodes[foot.module, foot.node ^ 1]
    z = (a - b) / np.linalg.norm(a - b)
    x = nodes[foot.module].mean(axis=0) - (a + b) / 2
    x = x - z * (x @ z)
    x = x / np.linalg.norm(x)
    way = np.stack([x, np.cross(z, x), z], axis=1) @ foot.direction
    return np.asarray(way * (1.0, 1.0, 0.0) / max(float(np.linalg.norm(way[:2])), 1e-9))


def _free(start: np.ndarray, away: np.ndarray, taken: list[np.ndarray]) -> np.ndarray:
    """Return where a number goes: behind its foot's arrow, or where there is room around it."""
    first = math.atan2(away[1], away[0])
    for reach in (11.0, 18.0, 25.0, 32.0):
        for turn in (0, 1, -1, 2, -2, 3, -3, 4):
            angle = first + turn * math.pi / 4
            place = start + reach * np.array([math.cos(angle), math.sin(angle)]) - (0.0, 2.6)
            if all(abs(place - other)[0] > 14 or abs(place - other)[1] > 9 for other in taken):
                return place
    return start


def _arrow(pen: Pen, start: np.ndarray, tip: np.ndarray, color: Color) -> None:
    way = (tip - start) / max(float(np.linalg.norm(tip - start)), 1e-9)
    side = np.array([-way[1], way[0]])
    pen.line(tuple(start), tuple(tip), color=white, width=3.2)
    pen.line(tuple(start), tuple(tip), color=color, width=1.5)
    pen.path([tip + 4 * way, tip - 2 * way + 3 * side, tip - 2 * way - 3 * side], stroke=None, fill=color)


def _draw_board(pen: Pen, down: float, up: float) -> None:
    """Draw both ways of the test, the board at the angles at which the simulated feet begin to slide."""
    for k, (angle, ahead, key) in enumerate(((down, -1.0, "forward_degrees"), (up, 1.0, "backward_degrees"))):
        left = 10 + k * pen.width / 2
        a = math.radians(angle)
        along, square = np.array([math.cos(a), math.sin(a)]), np.array([-math.sin(a), math.cos(a)])
        foot = np.array([left + 8, 14.0])
        reach = min(118.0, 72 / max(math.sin(a), 1e-6))
        pen.line((left, 14), (left + 150, 14), color=style.SOFT)
        pen.line(tuple(foot), tuple(foot + reach * along), width=2.5)
        middle = foot + 0.55 * reach * along + 8 * square
        for shift in (-13, 13):
            pen.disc(tuple(middle + shift * along - 4 * square), 3.2, fill=FOOT)
        body = [(-20.0, 0.0), (14.0, 0.0), (20.0, 2.5), (14.0, 5.0), (-20.0, 5.0)]
        pen.path(
            [middle + ahead * x * along + y * square for x, y in body], fill=style.BAND, close=True, width=0.8
        )
        pen.text(left + 62, 20, f"{angle:.0f}°", bold=True)
        pen.text(left + 130, 54, "point downhill" if ahead < 0 else "point uphill", bold=True)
        pen.text(left + 130, 42, key, color=style.SOFT)
