"""Enlarged drawings of what a finger has to find: a rod's end under its cap, the servo's drum, a limiter."""

from __future__ import annotations

from reportlab.lib.colors import Color

from engine.body import module as t
from engine.fabrication.dimensions.cables import CableDesign
from engine.fabrication.dimensions.limiter import STRETCHED, THREAD
from engine.fabrication.materials import CAP_TIP, Materials, ServoMotor
from engine.fabrication.parts import drum as d
from engine.fabrication.parts import servo_parts as sp
from engine.fabrication.parts import shapes as p
from engine.fabrication.parts.net import EYELET_HOLE, EYELET_RADIUS
from viz.build_sheet import style
from viz.build_sheet.pen import Pen

CAP = style.mixed(style.SERVO, style.BAND, 0.65)


def draw_rod_end(pen: Pen, design: CableDesign, materials: Materials) -> None:
    """Draw a finished rod end, cut along the rod, the node to the right."""
    tail, printed = 1e3 * design.tail, materials.cable.form == "printed"
    bore = (sp.ROD_DIAMETER + 1e3 * materials.printer.clearance) / 2
    sleeve = bore + 1e3 * materials.printer.min_wall
    crown, knob = sleeve + p.CROWN_TEETH, p.CROWN_ABOVE + p.NECK + p.HEAD[1]
    bare = 7.0
    scale = min((pen.width - 24) / (tail + bare + knob), (pen.height / 2 - 34) / crown)
    x0, y0 = pen.width - 10 - scale * knob, pen.height / 2

    def at(x: float, y: float) -> tuple[float, float]:
        return x0 + scale * x, y0 + scale * y

    def bar(x: float, x1: float, half: float, fill: Color) -> None:
        a, b = at(x, -half), at(x1, half)
        pen.box(*a, b[0] - a[0], b[1] - a[1], fill=fill, line=0.5)

    bar(-tail, p.CROWN_ABOVE, sleeve, CAP)
    bar(max(-tail, -p.CROWN_BELOW), p.CROWN_ABOVE, crown, CAP)
    bar(p.CROWN_ABOVE, p.CROWN_ABOVE + p.NECK, p.NECK, CAP)
    bar(p.CROWN_ABOVE + p.NECK, knob, p.HEAD[0], CAP)
    bar(-tail - bare, -1e3 * CAP_TIP, sp.ROD_DIAMETER / 2, style.ROD)
    ring = 1e3 * (EYELET_RADIUS - EYELET_HOLE / 2)
    for side in (-1, 1):
        a = at(-tail - p.EYELET_THICKNESS, side * sp.ROD_DIAMETER / 2)
        b = at(-tail, side * (sp.ROD_DIAMETER / 2 + ring))
        low, high = min(a[1], b[1]), max(a[1], b[1])
        pen.box(a[0], low, b[0] - a[0], high - low, fill=style.CABLE, stroke=None)
        path = [(-tail, sleeve + 0.35), (-0.1, sleeve + 0.35), (0.0, 1.7), (-1.0, sleeve + p.CROWN_TEETH + 2)]
        pen.path([at(x, side * y) for x, y in path], stroke=style.CABLE, width=2.0)
    x, y = at(0.0, 0.0)
    pen.line(
        (x, y - scale * crown - 22), (x, y + scale * crown + 4), color=style.LINK, width=0.8, dash=(3, 2)
    )
    below = y - scale * crown - 16
    pen.dimension((at(-tail, 0)[0], below), (x, below), f"{tail:.1f} mm", ticks=(y - scale * sleeve,) * 2)
    pen.text(x + 2, below - 14, "node", align="centre", color=style.LINK, bold=True)
    # a short cap is drawn near the right edge
    where = min(at(-tail - bare, 0)[0], pen.width - 146)
    pen.text(where, y + scale * crown + 22, "ring" if printed else "knot", color=style.CABLE, bold=True)
    pen.line((where + 12, y + scale * crown + 20), at(-tail - 0.6, sp.ROD_DIAMETER / 2 + 1), width=0.4)
    pen.text(where + 44, y + scale * crown + 22, "cable", color=style.CABLE, bold=True)
    pen.line((where + 58, y + scale * crown + 20), at(-0.6 * tail, sleeve + 0.4), width=0.4)
    pen.text(where + 92, y + scale * crown + 22, "cap", color=style.SERVO, bold=True)
    pen.line((where + 101, y + scale * crown + 20), at(-0.25 * tail, 0.5 * (sleeve + bore)), width=0.4)
    pen.text(where, y - 3, "rod", bold=True)
    pen.text(pen.width - 10, y + scale * crown + 22, "neck", align="right", color=style.SOFT)
    pen.line((pen.width - 20, y + scale * crown + 20), at(p.CROWN_ABOVE + p.NECK / 2, p.NECK), width=0.4)


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
