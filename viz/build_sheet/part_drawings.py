"""Drawings with measures of the parts that one makes or checks by hand, from the solids that are printed.

Outlines are cuts and shadows of the solids of the files in ``parts/``; measures are the numbers that those
solids are made of, in mm.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from reportlab.platypus import Flowable

from engine.body import module as t
from engine.fabrication.dimensions.cables import CableDesign, design_cables
from engine.fabrication.materials import CAP_TIP, Materials
from engine.fabrication.parts import drum as d
from engine.fabrication.parts import foot as f
from engine.fabrication.parts import head_tag as h
from engine.fabrication.parts import servo_parts as sp
from engine.fabrication.parts import shapes as p
from viz.build_sheet import blocks, style
from viz.build_sheet.facts import Facts
from viz.build_sheet.part_view import Point, View, cut, shadow
from viz.build_sheet.pen import Pen, Picture
from viz.build_sheet.style import Paper

CAM: Final = style.mixed(style.SERVO, style.BAND, 0.3)


def pages(facts: Facts, materials: Materials, paper: Paper) -> list[Flowable]:
    """Return the section."""
    designs = {x.level: x for x in design_cables(facts.morphology, materials)}
    footed = bool(facts.feet.feet)
    drawings: list[tuple[str, float, Callable[[Pen], None]]] = [
        ("Rods", 118, lambda pen: _rods(pen, materials)),
        *(
            (
                f"Cap, stiffness {level / t.N_STIFFNESS_LEVELS:.1f}",
                170,
                lambda pen, design=design: _cap(pen, design, materials, footed=footed),
            )
            for level, design in sorted(designs.items())
        ),
        ("Drum of the servo", 252, lambda pen: _drum(pen, materials)),
        ("Servo mount", 150, lambda pen: _mount(pen, materials)),
        ("Tag holder and link", 136, lambda pen: _tag_holder(pen, materials)),
    ]
    if footed:
        lean = facts.feet.feet[0].lean
        drawings.append((f"Foot of {lean}°", 150, lambda pen: _foot(pen, lean)))
    found: list[Flowable] = [
        blocks.heading("Drawings of the parts"),
        blocks.body(
            "All measures in mm, the same numbers that the files in the folder parts are made from. Check the"
            " first print of each part with calipers; holes come out smaller, outsides larger, by up to"
            f" {1e3 * materials.printer.clearance:g} mm."
        ),
    ]
    for name, height, draw in drawings:
        picture = Picture(paper.inner_width, height, draw, f"drawing of {name}")
        found.append(blocks.together([blocks.subheading(name), picture]))
    return found


def _rods(pen: Pen, materials: Materials) -> None:
    length, tip = 1e3 * t.ROD_LENGTH, 1e3 * CAP_TIP
    half = sp.ROD_DIAMETER / 2
    bore = 500 * (materials.rod.bore or 0.0)
    scale = (pen.width - 120) / length
    left, right = (1e3 * v for v in sp.half_rods(materials))
    end = length - tip

    def tube(view: View, low: float, high: float) -> None:
        (x, y), (x1, y1) = view.at(low, -half), view.at(high, half)
        pen.box(x, y, x1 - x, y1 - y, fill=style.ROD, line=0.5)
        for side in (-1, 1) if bore else ():
            pen.line(view.at(low, side * bore), view.at(high, side * bore), width=0.35, dash=(3, 2))

    plain, servo = (View(pen, (34, y), scale) for y in (82, 30))
    tube(plain, tip, end)
    plain.level(0.0, length, 22, f"{length:.1f} from node to node, caps on", (0.0, 0.0))
    plain.level(tip, end, -16, f"{end - tip:.1f}", (-half, -half))
    across = f"Ø {2 * half:.1f}" + (f", bore {2 * bore:.1f}" if bore else "")
    pen.text(plain.at(length, 0)[0] + 8, plain.at(0, 0)[1] - 3, across)
    tube(servo, tip, tip + left)
    tube(servo, end - right, end)
    servo.level(tip, tip + left, -16, f"{left:.1f}", (-half, -half))
    servo.level(end - right, end, -16, f"{right:.1f}", (-half, -half))
    servo.level(tip + left, end - right, -16, "mount", (-half, -half))
    a, b = t.RODS[t.SERVO_ROD]
    for view, ends, name in ((servo, (a, b), "servo rod"), (plain, ("", ""), "plain rod")):
        pen.text(view.at(length / 2, 0)[0], view.at(0, half)[1] + 4, name, align="centre", color=style.SOFT)
        for x, node in zip((0.0, length), ends, strict=True):
            if node != "":
                place = view.at(x, 0)
                pen.text(
                    place[0] + (-4 if x == 0 else 8),
                    place[1] - 3,
                    f"node {node}",
                    align="right" if x == 0 else "left",
                )


def _cap(pen: Pen, design: CableDesign, materials: Materials, *, footed: bool) -> None:
    solid = p.cap(design, materials.printer, footed=footed)
    shape = p.cap_shape(design, materials.printer, footed=footed)
    sleeve, rim, low, seat = shape.sleeve, shape.rim, shape.low, shape.seat
    post, neck, top = shape.post, shape.neck, shape.top
    bore, flat = p.bore(materials.printer), p.SEAT[1]
    scale = min(13.0, (pen.height - 50) / (top - low))
    view = View(pen, (150, 30 - scale * low), scale)
    view.shape(cut(solid))
    foot = scale * low
    view.level(-bore, bore, foot - 8, f"Ø {2 * bore:.1f}", (low, low))
    view.level(-sleeve, sleeve, foot - 19, f"Ø {2 * sleeve:.1f}", (low, low))
    x = scale * rim
    view.upright(low, top, -x - 62, f"{top - low:.1f}", (-sleeve, -p.HEAD[0]))
    view.upright(low, 0.0, -x - 42, f"{-low:.1f}", (-sleeve, -rim))
    view.upright(shape.edge - p.RIM, shape.edge, -x - 16, f"{p.RIM:.1f}", (-rim, -rim))
    notes: list[tuple[float, str, Point]] = [
        (scale * (top - 0.4), f"knob Ø {2 * p.HEAD[0]:.1f} × {p.HEAD[1]:.1f}", (p.HEAD[0], top - 0.4)),
        (scale * (neck - 0.6), f"neck Ø {2 * p.NECK:.1f} × {neck - post:.1f}", (p.NECK, neck - 0.6)),
        (0.0, f"post Ø {2 * p.POST:.1f} × {post - seat:.1f} for the rings", (p.POST, (seat + post) / 2)),
        (-scale * 1.0, f"flat to Ø {2 * flat:.1f}, {-seat:.2f} below the node", (flat - 0.2, seat)),
        (-scale * 1.8, f"rim Ø {2 * rim:.1f}, slopes by {p.SLOPE:.0f}°", (rim, shape.edge)),
        (-scale * 4.0, f"rod's end, {1e3 * CAP_TIP:.1f} below the node", (bore * 0.4, -1e3 * CAP_TIP)),
    ]
    view.notes(x + 14, notes)
    above = View(pen, (pen.width - 82, pen.height / 2 - 4), 9.5)
    above.shape(solid.project())
    above.shape(solid.slice((seat + post) / 2))
    reach = 9.5 * rim
    above.title(reach + 26, "from outside; the cut through its post")
    (start, end) = p.line_hole()
    pen.line(above.at(start[0], 0), above.at(end[0], 0), color=style.SERVO_CABLE, dash=(3, 2))
    above.title(-reach - 20, f"hole Ø {p.HOLE:.1f} for the limiter's line")
    pen.text(above.at(rim + 1.2, 0)[0] + 3, above.origin[1] - 3, "inwards", color=style.SOFT)


def _drum(pen: Pen, materials: Materials) -> None:
    motor = materials.servo
    discs = d.drum_discs(motor)
    scale = 3.7
    boxes = [disc.bounding_box() for disc in discs]
    x, gap = 2.0, 27.0
    lowest = min(box[1] for box in boxes)
    y0 = pen.height - 108.0
    for k, (disc, box) in enumerate(zip(discs, boxes, strict=True), start=1):
        view = View(pen, (x + gap - scale * box[0], y0 + 16 - scale * lowest), scale)
        view.shape(disc.slice(0.5 * d.FLANGE))
        if k < len(discs):
            view.shape(disc.slice(d.FLANGE + 0.5 * d.GROOVE), CAM)
        wide, high = box[3] - box[0], box[4] - box[1]
        view.level(box[0], box[3], scale * lowest - 9, f"{wide:.1f}", (box[1], box[1]))
        view.upright(box[1], box[4], scale * box[0] - 8, f"{high:.1f}", (box[0], box[0]))
        pen.text(
            (view.at(box[0], 0)[0] + view.at(box[3], 0)[0]) / 2,
            pen.height - 9,
            f"disc {k}",
            align="centre",
            bold=True,
        )
        x += gap + scale * wide
    whole = d.servo_drum(motor)
    low, high = whole.bounding_box()[0], whole.bounding_box()[3]
    scale = 9.0
    view = View(pen, (56 - scale * low, 26), scale)
    view.shape(cut(whole))
    tall, deep = d.DRUM_TALL, d.shaft_depth(motor)
    view.upright(0.0, tall, scale * low - 34, f"{tall:.1f}", (low, low))
    bore = 1e3 * motor.shaft_diameter + 0.1
    view.level(-bore / 2, bore / 2, -9, f"Ø {bore:.1f}", (0.0, 0.0))
    right = scale * high
    view.note(
        right + 16,
        scale * (tall - 0.6),
        f"hole Ø {2 * d.SCREW_HEAD:.1f} for the screw's head",
        (d.SCREW_HEAD, tall - 0.6),
    )
    view.note(
        right + 16,
        scale * (deep + 0.5 * d.WEB),
        f"hole Ø {2 * d.SCREW:.1f} for the screw, {d.WEB:.1f} high",
        (d.SCREW, deep + 0.5 * d.WEB),
    )
    view.note(
        right + 16,
        scale * 0.5 * deep,
        f"hole Ø {bore:.1f} for the shaft, {deep:.1f} deep",
        (bore / 2, 0.5 * deep),
    )
    view.note(
        right + 16,
        0.0,
        f"flanges {d.FLANGE:.1f} thick, grooves {d.GROOVE:.1f} high, pegs Ø {2 * d.PEG:.1f}, channels"
        f" {d.CHANNEL:.1f} wide",
        (high - 2.0, 0.2),
    )
    pen.text(
        view.at((low + high) / 2, 0)[0],
        view.at(0, tall)[1] + 8,
        "cut along the servo rod, discs on each other",
        align="centre",
        color=style.SOFT,
    )


def _mount(pen: Pen, materials: Materials) -> None:
    motor, printer = materials.servo, materials.printer
    solid = sp.laid(sp.servo_mount(materials))
    box = solid.bounding_box()
    scale = min(3.6, (pen.height - 44) / (box[5] - box[2]))
    view = View(pen, (54 - scale * box[0], 30 - scale * box[2]), scale)
    view.shape(shadow(solid))
    left, right = sp.rod_gap(motor, printer)
    low = scale * box[2]
    view.level(box[0], box[3], low - 24, f"{box[3] - box[0]:.1f}", (box[2], box[2]))
    view.level(left, right, low - 10, f"{right - left:.1f}", (0.0, 0.0))
    view.upright(box[2], box[5], scale * box[0] - 22, f"{box[5] - box[2]:.1f}", (box[0], 0.0))
    point, clearance = sp.guide_point(), 1e3 * printer.clearance
    x = scale * box[3] + 14
    cradle = f"{1e3 * motor.body_length + clearance:.1f} × {1e3 * motor.body_width + clearance:.1f}"
    bore = sp.ROD_DIAMETER + clearance
    view.note(
        x,
        scale * (box[5] - 2.0),
        f"ball Ø {2e3 * t.ACTUATOR_RADIUS:.1f}, {point[0]:.1f} from the rod's axis",
        (point[1] + 2.0, point[0]),
    )
    view.note(x, scale * 14.0, f"arm Ø {2 * sp.ARM:.1f}, all holes Ø {sp.LINE_HOLE:.1f}", (sp.ARM, 13.0))
    view.note(
        x,
        scale * sp.BALLAST_AT[0],
        f"cup Ø {2 * sp.BALLAST_RADIUS + clearance:.1f} for the counterweight",
        (box[3] - 2.0, sp.BALLAST_AT[0]),
    )
    view.note(
        x, 0.0, f"sockets Ø {bore:.1f}, {sp.SOCKET:.1f} deep beside the servo", (right + sp.SOCKET - 0.5, 0.0)
    )
    view.note(x, scale * (box[2] + 1.0), f"cradle {cradle}, walls {sp.RIM:.1f}", (right + 1.0, box[2] + 1.0))
    view.title(scale * box[5] + 8, "seen from the side, the rod's axis level")


def _tag_holder(pen: Pen, materials: Materials) -> None:
    clip, plate = h.tag_clip(materials.printer), h.tag_plate()
    scale = 5.0
    inner = 1e3 * (t.ROD_RADIUS + materials.printer.clearance / 2)
    box = clip.bounding_box()
    view = View(pen, (62, 92), scale)
    view.shape(clip.slice(h.CLIP / 2))
    view.level(box[0], box[3], scale * box[1] - 12, f"{box[3] - box[0]:.1f}", (0.0, box[1]))
    view.note(-10, 36, f"hole Ø {2 * inner:.1f}, mouth {h.OPENING:.1f}", (0.0, inner))
    view.note(34, 22, f"hole Ø {h.WIRE + 0.1:.1f}", (inner + 5.5, 0.0))
    view.title(scale * box[1] - 30, f"clip, {h.CLIP:.1f} long")
    scale = 4.6
    view = View(pen, (pen.width / 2 - 10, 62), scale)
    view.shape(cut(plate))
    half = h.PLATE / 2
    view.level(-half, half, -14, f"{h.PLATE:.1f}, square", (0.0, 0.0))
    view.upright(
        0.0, h.THICK + h.BOSS[1], -scale * half - 16, f"{h.THICK + h.BOSS[1]:.1f}", (-half, -h.BOSS[0])
    )
    view.upright(0.0, h.THICK, scale * half + 8, f"{h.THICK:.1f}", (half, half))
    view.level(
        -h.BOSS[0], h.BOSS[0], scale * 6.8 + 10, f"Ø {2 * h.BOSS[0]:.1f}, hole {h.WIRE + 0.1:.1f}", (6.8, 6.8)
    )
    view.title(-32, "plate, cut")
    link = p.link()
    box = link.bounding_box()
    scale = 10.0
    view = View(pen, (pen.width - 62, 74), scale)
    view.shape(link.project())
    view.level(box[0], box[3], scale * box[1] - 10, f"{box[3] - box[0]:.1f}", (0.0, 0.0))
    view.level(-p.LINK_PITCH / 2, p.LINK_PITCH / 2, scale * box[4] + 10, f"{p.LINK_PITCH:.1f}", (0.0, 0.0))
    view.upright(box[1], box[4], scale * box[0] - 8, f"{box[4] - box[1]:.1f}", (0.0, 0.0))
    view.title(scale * box[1] - 28, f"link, {p.LINK_THICKNESS:.1f} thick, holes Ø {p.LINK_HOLE:.1f}")


def _foot(pen: Pen, lean: int) -> None:
    solid = f.foot(lean)
    box = solid.bounding_box()
    scale = 12.0
    view = View(pen, (150, 26 - scale * box[2]), scale)
    view.shape(cut(solid))
    view.level(box[0], box[3], scale * box[2] - 10, f"{box[3] - box[0]:.1f}", (box[2], box[2]))
    view.upright(box[2], box[5], scale * box[0] - 22, f"{box[5] - box[2]:.1f}", (0.0, 0.0))
    neck = p.POST_TOP + p.neck_height(footed=True)
    view.note(
        scale * box[3] + 14,
        scale * box[5] - 6,
        f"ball Ø {2 * f.RADIUS:.1f} over {f.SCALES} scales, {f.SCALE_HEIGHT:.1f} high, {f.SCALE_PITCH:.2f}"
        " apart",
        (1.5, box[5] - 0.6),
    )
    view.note(
        scale * box[3] + 14,
        scale * (neck + 0.4),
        f"room for the knob, Ø {2 * p.HEAD[0]:.1f}",
        (p.HEAD[0], neck + 0.4),
    )
    view.note(
        scale * box[3] + 14,
        scale * (neck - 0.3),
        f"hole Ø {p.LINK_HOLE:.1f} on the neck",
        (p.LINK_HOLE / 2, neck - 0.3),
    )
    view.note(
        scale * box[3] + 14,
        scale * box[2] - 6,
        f"notch {f.NOTCH[0]:.1f} wide, towards where it slides",
        (f.NOTCH[1] + 0.4, box[2] + 0.6),
    )
    view.title(scale * box[5] + 8, "cut along its rod, towards the notch")
