"""Safety, tolerances, and the checks of a finished robot."""

from __future__ import annotations

import numpy as np
from reportlab.platypus import Flowable

from engine import tensegrity as t
from engine.fabrication.cables import cables
from engine.fabrication.materials import Materials
from viz.build_sheet import blocks
from viz.build_sheet.facts import MODULE_MASS, Facts
from viz.build_sheet.style import Paper


def pages(facts: Facts, materials: Materials, paper: Paper) -> list[Flowable]:
    """Return the section."""
    return [
        blocks.heading("Safety"),
        *blocks.bullets(_safety(facts, materials)),
        blocks.heading("Tolerances"),
        _tolerances(facts, paper.inner_width),
        blocks.heading("Checks"),
        blocks.body("Tick each; do not go on if one fails."),
        _checks(facts, materials, paper.inner_width),
    ]


def _safety(facts: Facts, materials: Materials) -> list[str]:
    every = cables(facts.morphology, materials)
    tension = max(c.pretension for c in every)
    one = [c for c in every if c.module == int(np.argmax(facts.morphology.stiffness_levels))]
    energy = sum(0.5 * c.stiffness * (c.assembled - c.rest) ** 2 for c in one)
    return [
        f"<b>Wear eye protection</b> while cables are hooked in. Each cable pulls with up to {tension:.2f} N;"
        " a finished"
        f" module holds {energy:.2f} J in its cables, and a rod that slips out flies.",
        "Never let go of a rod that has only one end in the net. Do not bring a module near your face.",
        f"Servos start without warning and pull up to {t.SERVO_MAX_TENSION:.2f} N per internal cable: keep"
        " fingers out of"
        " the module while power is on, and have a switch in the supply that you can reach.",
        "If you use a battery instead of a supply: only one with protection against short circuit, never left"
        " alone"
        " while it charges, and disconnected during assembly.",
        "Small parts and thin cords: not for children under 3. Check caps and cables before every use;"
        " replace a cable"
        " that shows cracks.",
        "Glue (cyanoacrylate) in a ventilated room, with gloves. Sawing or sanding carbon rods needs a mask"
        " and water.",
    ]


def _tolerances(facts: Facts, width: float) -> Flowable:
    noise = 1000 * facts.config.physics.servo_noise
    step = t.stiffness_n_per_m(1 / t.N_STIFFNESS_LEVELS)
    rows = [
        ["Rod, node to node", f"{1000 * t.ROD_LENGTH:.1f} mm", "± 0.3 mm", "assumed"],
        [
            "Rest length of a cable, between rod ends",
            f"{1000 * t.CABLE_REST_LENGTH:.2f} mm",
            "± 0.5 mm",
            "assumed",
        ],
        [
            "Stiffness of a cable",
            _stiffness(facts),
            "± 10 %, and all cables of a module alike within 5 %. The search tells stiffnesses apart by"
            f" {step:.1f} N/m.",
            "assumed",
        ],
        [
            "Length of an internal cable at a command",
            "table under “Wiring”",
            f"± {noise:.2f} mm: the robot was evolved with errors of this size (standard deviation)",
            "simulated",
        ],
        [
            "Line between joined nodes",
            f"{1000 * t.LINK_PLAY:.1f} mm",
            f"{800 * t.LINK_PLAY:.1f} to {1200 * t.LINK_PLAY:.1f} mm",
            "simulated",
        ],
        [
            "Mass of a module",
            f"{1000 * MODULE_MASS:.1f} g",
            "± 10 %; the heavy end of the servo towards the arm",
            "assumed",
        ],
        [
            "Friction between rod ends and floor",
            f"coefficient {facts.config.physics.friction:g}",
            "not known how much it matters: crawl on the floor that you measured",
            "simulated",
        ],
    ]
    header = ("what", "should be", "may differ", "source")
    return blocks.grid(header, rows, blocks.columns(width, 27, 22, 38, 13))


def _stiffness(facts: Facts) -> str:
    values = sorted({t.stiffness_n_per_m(s) for s in facts.morphology.stiffnesses})
    return ", ".join(f"{v:.2f}" for v in values) + " N/m"


def _checks(facts: Facts, materials: Materials, width: float) -> Flowable:
    length, breadth, height = (100 * v for v in facts.size)
    friction = facts.config.physics.friction
    angle = np.degrees(np.arctan(friction))
    pulses = f"{materials.servo.pulse_min:.0f} to {materials.servo.pulse_max:.0f} µs"
    checks = [
        (
            "Pull test",
            "The coupon, pulled as “Pull test of the cable material” says, has the stated force within 10 %."
            " If not: enter the"
            " measurement into the materials file and export again.",
        ),
        ("Every module", "Step 6 of its assembly: four cables per node, nothing touches, right angles."),
        (
            "Every module, on the scale",
            f"{1000 * MODULE_MASS:.1f} g ± 10 %, without tether.",
        ),
        (
            "Every servo, before its cables are tied",
            "Type a0, then a180: the arm turns by 180° without humming at the ends. settings.h starts with"
            " harmless"
            f" pulses; widen them until it does (data sheet: {pulses}).",
        ),
        ("Every internal cable", "Lengths at 0° and at 180° as in the table, ± 0.5 mm."),
        (
            "Joints",
            "Node pairs as in the orientation table; every servo rod lies at the stated turn. All joints"
            " wiggle.",
        ),
        (
            "Whole robot, servos off, on the floor",
            f"{length:.1f} cm long, {breadth:.1f} cm wide, {height:.1f} cm high, each ± 0.5 cm; it rests on"
            " the nodes named"
            " under “Settled modules”. If it lies on others, set it down again as drawn.",
        ),
        (
            "Floor",
            "A loose rod with caps, laid on end on a tilted piece of the floor, begins to slide at"
            f" {angle:.0f}°"
            f" (friction {friction:g}).",
        ),
        (
            "Rhythm",
            "Type g, without anything that tells it where the target is: after the rest every module"
            " contracts and"
            " releases in a steady rhythm; nothing rubs, no line leaves its groove. Type s to stop.",
        ),
        (
            "Closed loop",
            f"{facts.config.trials.trial_time:g} s towards a target {100 * facts.task.target_distance:.0f} cm"
            " away."
            " Compare with “What to expect of it”.",
        ),
    ]
    rows = [["[  ]", f"<b>{a}</b>", b] for a, b in checks]
    return blocks.grid((), rows, blocks.columns(width, 6, 26, 68))
