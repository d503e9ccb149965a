"""Enlarged drawings of what a finger has to find: a rod's end under its cap, the servo's drum, a limiter."""

from __future__ import annotations

import math

import numpy as np

from engine.body import module as t
from engine.fabrication.dimensions.cables import RING_RADIUS, CableDesign
from engine.fabrication.dimensions.limiter import STRETCHED, THREAD
from engine.fabrication.materials import CAP_TIP, Materials, ServoMotor
from engine.fabrication.parts import drum as d
from engine.fabrication.parts import servo_parts as sp
from engine.fabrication.parts import shapes as p
from viz.build_sheet import style
from viz.build_sheet.pen import Pen

CAP = style.mixed(style.SERVO, style.BAND, 0.65)


def draw_rod_end(pen: Pen, design: CableDesign, materials: Materials) -> None:
    """Draw a finished rod end, cut along the rod, the node to the right."""
    shape = p.cap_shape(design, materials.printer)
    sleeve, low, rim, knob = shape.sleeve, shape.low, shape.rim, shape.top
    bare, reach = 7.0, 4.5
    scale = min((pen.width - 60) / (bare + knob - low), (pen.height / 2 - 20) / (rim + 0.7 * reach))
    x0, y0 = pen.width - 44 - scale * knob, pen.height / 2 + 2

    def at(x: float, y: float) -> tuple[float, float]:
        return x0 + scale * x, y0 + scale * y

    pen.path([at(*point) for point in shape.outline], fill=CAP, close=True)
    a, b = at(low - bare, -sp.ROD_DIAMETER / 2), at(-1e3 * CAP_TIP, sp.ROD_DIAMETER / 2)
    pen.box(a[0], a[1], b[0] - a[0], b[1] - a[1], fill=style.ROD, line=0.5)
    # the ring, which follows the rim's slope, and the cables
    turn = math.radians(p.SLOPE)
    way = np.array([-math.sin(turn), math.cos(turn)])
    flat, ring = p.SEAT[1], 1e3 * RING_RADIUS
    thick = max(1.2, scale * 1e3 * design.section.thickness)
    for side in (-1, 1):
        seat = np.array([shape.seat + 0.5 * thick / scale, flat])
        rim_edge = seat + (ring - flat) / math.cos(turn) * way
        path = [(seat[0], p.POST), tuple(seat), tuple(rim_edge), tuple(rim_edge + reach * way)]
        pen.path([at(x, side * y) for x, y in path], stroke=style.CABLE, width=thick)
    x, y = at(0.0, 0.0)
    edge = scale * (rim + 1.0)
    pen.line((x, y - edge - 8), (x, y + edge + 4), color=style.LINK, width=0.8, dash=(3, 2))
    pen.text(x + 2, y - edge - 18, "node", align="centre", color=style.LINK, bold=True)
    top = pen.height - 10
    pen.text(at(low, 0)[0], top, "cable", color=style.CABLE, bold=True)
    pen.line((at(low, 0)[0] + 12, top - 2), at(*(rim_edge + 0.6 * reach * way)), width=0.4)
    pen.text(x + 16, top, "ring", color=style.CABLE, bold=True)
    pen.line((x + 22, top - 2), at(shape.seat + 0.1, flat - 0.2), width=0.4)
    pen.text(at(low, 0)[0] - 6, y - edge - 2, "cap", color=style.SERVO, bold=True)
    pen.line((at(low, 0)[0] + 2, y - edge + 6), at(0.7 * low, -sleeve + 0.3), width=0.4)
    pen.text(at(low - bare, 0)[0], y - 3, "rod", bold=True)
    pen.text(x + 22, y - edge - 2, "knob", color=style.SOFT)
    pen.line((x + 28, y - edge + 6), at(knob - 0.4, -1.0), width=0.4)


def draw_drum(pen: Pen, motor: ServoMotor) -> None:
    """Draw the drum from the side, on its servo, with the node that each groove's line goes to."""
    shapes, rims = d.outlines(motor.travel), d.flanges(motor.travel)
    low, high = (pick(rim.bounds[k] for rim in rims) for pick, k in ((min, 0), (max, 2)))
    scale = min((pen.height - 54) / d.DRUM_TALL, (pen.width - 96) / (high - low))
    x0, z0 = 10 - scale * low, 34.0

    def disc(z: float, thick: float, bounds: tuple[float, float, float, float]) -> None:
        wide = scale * (bounds[2] - bounds[0])
        pen.box(x0 + scale * bounds[0], z0 + scale * z, wide, scale * thick, fill=CAP, line=0.5)

    pen.box(x0 - 34, 2, 68, z0 - 2, fill=style.BAND)
    pen.text(x0, 14, "servo", align="centre", color=style.SOFT)
    right = x0 + scale * high + 8
    for k, rim in enumerate(rims):
        z = k * (d.FLANGE + d.GROOVE)
        if k < len(shapes):
            cam = shapes[k][0].bounds
            disc(z + d.FLANGE, d.GROOVE, cam)
            y = z0 + scale * (z + d.FLANGE + d.GROOVE / 2)
            pen.line((x0 + scale * cam[2], y), (right, y), color=style.SERVO_CABLE, width=1.2)
            text = f"node {d.drum_order()[k]}"
            pen.text(right + 3, y - 2.8, text, bold=True, color=style.SERVO_CABLE)
        disc(z, d.FLANGE, rim.bounds)
        pen.text(x0, z0 + scale * (z + d.FLANGE / 2) - 2.4, str(k + 1), align="centre", size=7)
    pen.text(x0, z0 + scale * d.DRUM_TALL + 5, "ball's side", align="centre", color=style.SOFT)


def draw_limiter(pen: Pen) -> None:
    """Draw a rod with its limiter, cut along the rod: the thread inside, the line out of a cap, its bead."""
    length, tip = 1e3 * t.ROD_LENGTH, 1e3 * CAP_TIP
    scale = (pen.width - 150) / length
    x0, y, half, wall = 62.0, 48.0, 9.0, 3.0
    left, right = x0 + scale * tip, x0 + scale * (length - tip)
    for side in (-1, 1):
        edge = y + (half - wall if side > 0 else -half)
        pen.box(left, edge, right - left, wall, fill=style.ROD, line=0.4)
    for end, way in ((left, -1), (right, 1)):
        cap = 26.0
        for side in (-1, 1):
            edge = y + (half + 0.8 if side > 0 else -half - 4.8)
            pen.box(end - (cap if way > 0 else 0), edge, cap, 4.0, fill=CAP, line=0.4)
        pen.box(end if way > 0 else end - 9, y - half - 4.8, 9, 2 * half + 9.6, fill=CAP, line=0.4)
    a, b = (x0 + scale * (length / 2 + sign * 500 * THREAD) for sign in (-1, 1))
    # the line is drawn over the cap, as its hole would not be seen
    out = (right + 9, y + half + 3)
    bead = (out[0] + 4, out[1] + 3)
    pen.path([(left + 6, y), (a, y)], stroke=style.INK, width=0.9)
    pen.path([(b, y), (right + 1, y), out, bead], stroke=style.INK, width=0.9)
    pen.line((a, y), (b, y), color=style.SERVO_CABLE, width=2.2)
    for x in (a, b):
        pen.disc((x, y), 2.2, fill=style.SERVO_CABLE)
    pen.path(
        [(left - 1, y + 2.8), (left + 17, y + 0.6), (left + 17, y - 0.6), (left - 1, y - 2.8)],
        fill=style.GHOST,
        width=0.4,
        close=True,
    )
    pen.disc(bead, 4.0, fill=style.LINK)
    pen.path([bead, (bead[0] + 20, bead[1] + 9)], stroke=style.SERVO_CABLE, width=0.9, dash=(3, 2))
    pen.dimension(
        (a, 18),
        (b, 18),
        f"{1e3 * THREAD:.0f} mm stretched, {1e3 * THREAD / STRETCHED:.0f} mm loose",
        ticks=(y - 3, y - 3),
    )
    pen.text((a + b) / 2, y + 14, "latex thread", align="centre", color=style.SERVO_CABLE, bold=True)
    pen.text(left + 40, y + 28, "toothpick", color=style.SOFT)
    pen.line((left + 48, y + 26), (left + 12, y + 2), width=0.4)
    pen.text(right - 34, y + 28, "line", align="right", bold=True)
    pen.line((right - 36, y + 26), ((b + right) / 2, y + 1), width=0.4)
    pen.text(bead[0] + 8, bead[1] - 6, "bead", color=style.LINK, bold=True)
    pen.text(bead[0] + 12, bead[1] + 16, "to the servo", color=style.SERVO_CABLE)
    pen.text(left - 12, y - 3, "far node", align="right", color=style.SOFT)
    pen.text(right + 14, y - 14, "line's node", color=style.SOFT)
