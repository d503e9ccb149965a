"""Wiring, pins, and from servo command to cable length."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from reportlab.lib.colors import HexColor, white
from reportlab.platypus import Flowable

from engine.body import module as t
from engine.body import servo
from engine.fabrication.as_built.surroundings import CARRIED
from engine.fabrication.dimensions import tolerances
from engine.fabrication.dimensions.limiter import STRETCHED, THREAD, has_limiter
from engine.fabrication.firmware import CONTRACTED_PULSE, RELEASED_PULSE, SKETCH, pin_map
from engine.fabrication.firmware.protocol import BAUD, VERSION
from engine.fabrication.kit.power import SIGNAL as SIGNAL_WIRE
from engine.fabrication.kit.power import TETHER, power
from engine.fabrication.materials import Materials
from engine.fabrication.parts.drum import drum_errors, drum_order
from engine.simulation.model import GRAVITY
from viz.build_sheet import blocks, style
from viz.build_sheet.details import draw_limiter
from viz.build_sheet.facts import Facts
from viz.build_sheet.pen import Pen, Picture
from viz.build_sheet.style import Paper

PLUS, MINUS, SIGNAL = HexColor("#b3261e"), HexColor("#17212b"), HexColor("#c98a00")
ROW = 21.0
COMMANDS = (0, 30, 60, 90, 120, 150, 180)
PULL = 50.0
"""Weight that is hung on a piece of elastic to try it, in g."""


def pages(facts: Facts, materials: Materials, paper: Paper) -> list[Flowable]:
    """Return the section."""
    n = facts.morphology.n_modules
    pins = pin_map(n)
    board = materials.board
    height = 40 + ROW * max(n, 4)
    current = n * materials.servo.stall_current
    return [
        blocks.heading("Wiring"),
        blocks.body(
            f"One servo per module ({style.escaped(materials.servo.model)}), all on one"
            f" {materials.servo.voltage:g} V supply; the signal of each comes from a pin of its own. All"
            f" servos blocked draw {n} × {materials.servo.stall_current:g} A = <b>{current:.1f} A</b>: the"
            " supply and the common wires must bear that. <b>Join the grounds</b> of supply and board. Do not"
            " feed servos from the board's own 5 V pin; the board itself lives on its USB cable. A capacitor"
            " of 470 to 1000 µF across + and − at the robot keeps the board from resetting. A servo's plug:"
            " brown or"
            f" black is −, red +, orange or yellow the signal. {_tether(n, materials)}"
        ),
        Picture(paper.inner_width, height, lambda pen: _draw(pen, facts, materials, pins), "wiring diagram"),
        blocks.note(
            f"Board: {style.escaped(board.model)}; {style.escaped(board.note)}. Supply:"
            f" {style.escaped(materials.battery.model)}; {style.escaped(materials.battery.note)}."
        ),
        blocks.together(
            [
                blocks.subheading("Program"),
                *blocks.bullets(_program(facts, materials), numbered=True),
            ]
        ),
        blocks.together([blocks.subheading("Pin map"), _pins(facts, pins, paper.inner_width)]),
        blocks.together(
            [
                blocks.subheading("Internal cables: length between guide and node, by servo command"),
                _lengths(paper.inner_width),
                blocks.note(
                    "0° is released, 180° contracted. Length from the guide's ball to the loop at the node,"
                    f" at which the cable pulls {t.SERVO_OFFSET:.2f} N ({1000 * t.SERVO_OFFSET / GRAVITY:.0f}"
                    " g). These are the lengths that the drum's cams give: the simulated arm's are the same"
                    " at both ends, and differ in between by up to the last column; nothing to correct."
                    " Disc 1 lies on the servo."
                ),
                blocks.body(
                    f"<b>Elastic</b> ({style.escaped(materials.line.elastic)}): an internal cable gives way"
                    f" by 1 mm for every {t.SERVO_GAIN / 1000:.3f} N, at every tension. Hang {PULL:.0f} g on"
                    f" the piece: it must become {PULL * GRAVITY / t.SERVO_GAIN:.1f} mm longer, ±"
                    f" {100 * tolerances.STIFFNESS:.0f} %."
                    " Too much: knot it shorter; too little: longer."
                ),
                *(
                    [
                        blocks.body(_limiter()),
                        Picture(0.9 * paper.inner_width, 92, draw_limiter, "limiter"),
                    ]
                    if has_limiter(materials)
                    else []
                ),
            ]
        ),
        blocks.together(
            [blocks.subheading("What the controller does"), *blocks.bullets(_controller(facts))],
        ),
    ]


def _tether(n: int, materials: Materials) -> str:
    """Return how thick the wires to the robot are, and how they are guarded."""
    found = power(n, materials.servo, TETHER)
    if found is None:
        return f"No usual wire of {TETHER:g} m is thick enough: put the supply nearer to the robot."
    return (
        f"<b>Tether</b> of {TETHER:g} m: AWG {found.awg} ({found.section:.2f} mm²) for + and −, with a"
        " connector"
        f" ({found.connector}), a fuse of {found.fuse:g} A in + at the supply, a supply of {found.supply:g}"
        " A;"
        f" AWG {SIGNAL_WIRE} for each signal. It leaves the robot at its middle and hangs from above, in a"
        " loop of"
        f" about {200 * CARRIED:.0f} cm that neither lifts the robot nor lies on the floor."
    )


def _limiter() -> str:
    """Return how the limiter of an internal cable is made and adjusted."""
    limit = 1000 * t.SERVO_MAX_TENSION / GRAVITY
    return (
        f"<b>Limiter.</b> The simulated servo never pulls more than {t.SERVO_MAX_TENSION:g} N. So each of the"
        f" five rods that a line goes to (nodes {', '.join(map(str, sorted(t.SERVO_NODES)))}) holds a latex"
        f" thread of 0.8 mm, {1000 * THREAD / STRETCHED:.0f} mm from knot to knot, stretched to three times"
        " that. Tie it between two pieces of line, and draw it into the rod before the rod goes into the net."
        " When the node's cap is on, its line comes out of the cap's slanting hole: knot a bead of 2 mm on"
        f" it. Hang {limit:.0f} g (± {100 * tolerances.STIFFNESS:.0f} %) from the bead, the rod held so that"
        " the line leaves the cap as it does in the module, and pull at the other end of the rod until the"
        " bead just lifts off. Wedge that line into the tube with the tip of a toothpick, and cut both flush:"
        " the other cap goes over them. Check it again a day later."
    )


def _controller(facts: Facts) -> list[str]:
    rate = 1 / facts.config.physics.control_period
    frequencies = " or ".join(f"{f:g}" for f in servo.FREQUENCIES)
    phases = ", ".join(f"{np.degrees(p):.0f}°" for p in servo.PHASES)
    inputs = ", ".join(
        style.escaped(name) + ("" if unit == 1.0 else f" times {unit:.4g}")
        for name, unit in zip(facts.task.inputs, facts.task.units, strict=True)
    )
    return [
        f"Every {1000 / rate:.0f} ms it senses {facts.task.n_inputs} values ({inputs}; distances in m,"
        f" angles in rad, positive to the left) and gives every module a frequency ({frequencies} Hz) and a"
        f" phase ({phases}). The servo command is then 90° × (sin(2π × frequency × time + phase) + 1).",
        "The robot carries no sensor for these values: a computer with a camera above the floor tells them to"
        " the board (page “To steer it” of the robot's sheet). Without it the robot plays a gait that was"
        " recorded in"
        " simulation: of all targets the one that it came closest to; g1, g2 and so on choose another.",
        f"The time starts when the robot has been set down; after {facts.config.trials.settle_time:g} s it"
        " begins to move.",
        f"The network's first pair of outputs drives the head, module {t.module_number(facts.head.module)};"
        " the sketch knows that.",
    ]


def _pins(facts: Facts, pins: Mapping[int, int], width: float) -> Flowable:
    rows = []
    for module in range(facts.morphology.n_modules):
        role = "head" if module == facts.head.module else ""
        number = t.module_number(module)
        rows.append([str(number), role, f"D{pins[module]}", f"S{number}"])
    return blocks.grid(
        ("module", "", "pin of the board", "label both ends of the cable"),
        rows,
        blocks.columns(width * 0.7, 15, 15, 30, 40),
    )


def _lengths(width: float) -> Flowable:
    errors, order = drum_errors(), drum_order()
    rows = []
    for k, node in enumerate(t.SERVO_NODES):
        figures = [f"{1000 * servo.DRUM_LENGTHS[c, k]:.1f}" for c in COMMANDS]
        place = order.index(node)
        rows.append([f"to node {node}", *figures, str(place + 1), f"{errors[k]:.1f}"])
    header = ("cable (mm)", *(f"{c}°" for c in COMMANDS), "disc", "off by at most")
    return blocks.grid(
        header, rows, blocks.columns(width, 18, *[8.5] * len(COMMANDS), 10, 14), right=range(1, 10)
    )


def _program(facts: Facts, materials: Materials) -> list[str]:
    motor = materials.servo
    degrees = motor.travel * (CONTRACTED_PULSE - RELEASED_PULSE) / (motor.pulse_max - motor.pulse_min)
    return [
        f"Open firmware/{SKETCH}/{SKETCH}.ino in the Arduino IDE, connect the board by USB, choose board and"
        " port, upload. If the upload to a copy of a Nano fails, choose the processor “old bootloader”.",
        f"Open the serial monitor at {BAUD} baud, line ending “New Line”. It says “hello tensatlas"
        f" {VERSION} robot {facts.evaluation.solution.number} …”. If not: wrong port or baud.",
        "Supply off: plug the servos in as the pin map says. Supply on: they go to 0° and hold. One servo at"
        " a time is easiest.",
        "Type <b>a0</b>, then <b>a180</b> (any angle between works) and watch a mark on the shaft. The sketch"
        f" starts with pulses of {RELEASED_PULSE} and {CONTRACTED_PULSE} µs, which harm no servo but turn it"
        f" by about {degrees:.0f}° only. In settings.h widen the two numbers of this module, 50 µs at a time,"
        f" towards {motor.pulse_min:.0f} and {motor.pulse_max:.0f} µs (data sheet), until it turns by 180° ±"
        f" {tolerances.TRAVEL:.0f}°; if it hums at an end, go back 50 µs. Upload again.",
        "From a0 to a180 it must turn counter-clockwise, seen from the shaft's end. If not, exchange the two"
        " numbers.",
        "Type <b>x</b>: each servo in turn goes to 180° and back, and the sketch names its module.",
        "<b>g</b> starts the robot, <b>s</b> stops it and releases all cables. After a… it prints how long"
        " every internal cable should be. It stops by itself after the time in settings.h.",
    ]


def _draw(pen: Pen, facts: Facts, materials: Materials, pins: Mapping[int, int]) -> None:
    n = facts.morphology.n_modules
    top = pen.height - 24
    bottom = top - ROW * max(n, 4)
    board = (8.0, bottom, 108.0, top - bottom)
    supply = (pen.width - 92.0, bottom + (top - bottom) / 2 - 30, 84.0, 60.0)
    servos = pen.width * 0.50
    pen.box(*board, fill=style.BAND, radius=5)
    pen.text(board[0] + 8, top - 14, "Controller", bold=True, size=9)
    pen.text(board[0] + 8, top - 25, "board", bold=True, size=9)
    pen.box(*supply, fill=style.BAND, radius=5)
    pen.text(supply[0] + 20, supply[1] + 40, "Supply", bold=True, size=9)
    pen.text(supply[0] + 20, supply[1] + 28, f"{materials.servo.voltage:g} V", size=8.5)
    current = n * materials.servo.stall_current
    pen.text(supply[0] + 20, supply[1] + 16, f"≥ {current:.1f} A", size=8.5)
    found = power(n, materials.servo, TETHER)
    plus, minus = servos + 92, servos + 108
    y0, y1 = top + 8, bottom + 4
    pen.text(plus, y0 + 4, "+", align="centre", bold=True, size=9, color=PLUS)
    pen.text(minus, y0 + 4, "−", align="centre", bold=True, size=9, color=MINUS)
    pen.line((plus, y0), (plus, y1), color=PLUS, width=2)
    pen.line((minus, y0), (minus, y1 - 10), color=MINUS, width=2)
    for module in range(n):
        y = top - ROW * (module + 0.5)
        pen.box(servos - 8, y - 8, 72, 16, fill=style.BAND, radius=3)
        pen.text(servos - 3, y - 2.8, f"Servo {facts.module_name(module)}", size=8)
        pen.line((board[0] + board[2], y), (servos - 8, y), color=SIGNAL, width=1.2)
        pen.text(board[0] + board[2] - 5, y - 2.8, f"D{pins[module]}", align="right", bold=True)
        label = f"S{t.module_number(module)}"
        pen.text((board[0] + board[2] + servos - 8) / 2, y - 2.8, label, align="centre", halo=True)
        pen.line((servos + 64, y + 3), (plus, y + 3), color=PLUS, width=1)
        pen.line((servos + 64, y - 3), (minus, y - 3), color=MINUS, width=1)
        pen.disc((plus, y + 3), 1.8, fill=PLUS)
        pen.disc((minus, y - 3), 1.8, fill=MINUS)
    for x, y, sign, color in ((plus, supply[1] + 44, "+", PLUS), (minus, supply[1] + 16, "−", MINUS)):
        pen.line((x, y), (supply[0], y), color=color, width=2)
        pen.disc((x, y), 2.4, fill=color)
        pen.text(supply[0] + 5, y - 3, sign, bold=True, size=9, color=color)
    # the fuse in +, the capacitor between both
    middle = (minus + supply[0]) / 2 + 4
    pen.box(middle - 11, supply[1] + 40, 22, 8, fill=white, stroke=PLUS, line=1.2)
    pen.text(middle, supply[1] + 52, "fuse" + (f" {found.fuse:g} A" if found else ""), align="centre")
    for x, y, color in ((plus, y0 - 3, PLUS), (minus, y0 - 7, MINUS)):
        pen.line((x, y), (minus + 24, y), color=color, width=1)
    pen.text(minus + 27, y0 - 7.5, "capacitor", align="left")
    # the common ground, the wire that is forgotten most often
    pen.path([(minus, y1 - 10), (board[0] + 40, y1 - 10), (board[0] + 40, bottom)], stroke=MINUS, width=1.6)
    pen.text(board[0] + 46, bottom + 5, "GND", bold=True)
    pen.text((board[0] + 40 + servos) / 2, y1 - 12.8, "common ground", align="centre", halo=True)
