"""Safety, tolerances, and the checks of a finished robot."""

from __future__ import annotations

import numpy as np
from reportlab.platypus import Flowable

from engine.body import module as t
from engine.body.feet import FEET_TEXT
from engine.fabrication.dimensions import tolerances as tol
from engine.fabrication.dimensions.cut_lists import cables
from engine.fabrication.dimensions.limiter import line_limit
from engine.fabrication.mass_balance import mass_balance
from engine.fabrication.materials import Materials
from engine.fabrication.parts.drum import drum_errors, line_tensions
from viz.build_sheet import blocks
from viz.build_sheet.facts import MODULE_MASS, Facts
from viz.build_sheet.style import Paper


def pages(facts: Facts, materials: Materials, paper: Paper) -> list[Flowable]:
    """Return the section."""
    return [
        *safety(facts, materials),
        blocks.heading("Tolerances"),
        _tolerances(facts, materials, paper.inner_width),
        blocks.heading("Checks"),
        blocks.body("Tick each; do not go on if one fails."),
        _checks(facts, paper.inner_width),
    ]


def safety(facts: Facts, materials: Materials) -> list[Flowable]:
    """Return what a builder must know before anything else."""
    return [blocks.heading("Safety"), *blocks.bullets(_safety(facts, materials))]


def _safety(facts: Facts, materials: Materials) -> list[str]:
    every = cables(facts.morphology, materials)
    tension = max(c.pretension for c in every)
    one = [c for c in every if c.module == int(np.argmax(facts.morphology.stiffness_levels))]
    energy = sum(0.5 * c.stiffness * (c.assembled - c.rest) ** 2 for c in one)
    limit = line_limit(materials)
    pull = max(float(line_tensions(level, limit).max()) for level in set(facts.morphology.stiffness_levels))
    return [
        f"<b>Wear eye protection</b> while cables are hooked in. Each cable pulls with up to {tension:.2f} N;"
        f" a finished module holds {energy:.2f} J in its cables, and a rod that slips out flies.",
        "Never let go of a rod that has only one end in the net. Do not bring a module near your face.",
        f"Servos start without warning and pull up to {pull:.2f} N per internal cable: keep"
        " fingers out of the module while power is on, and have a switch in the supply that you can reach.",
        "If you use a battery instead of a supply: only one with protection against short circuit, never left"
        " alone while it charges, and disconnected during assembly.",
        "Small parts and thin strips: not for children under 3. Check caps and cables before every use;"
        " replace a cable that shows cracks.",
        "Glue (cyanoacrylate) in a ventilated room, with gloves. Sawing or sanding carbon rods needs a mask"
        " and water.",
    ]


def _tolerances(facts: Facts, materials: Materials, width: float) -> Flowable:
    step = t.stiffness_n_per_m(1 / t.N_STIFFNESS_LEVELS)
    near, far = facts.link_gaps
    built = mass_balance(facts.morphology, materials, facts.feet.feet).built / facts.morphology.n_modules
    drum = drum_errors().max()
    rows = [
        ["Rod, node to node", f"{1000 * t.ROD_LENGTH:.1f} mm", f"± {1000 * tol.ROD:.1f} mm", "assumed"],
        [
            "Rest length of a cable, between rod ends",
            f"{1000 * t.CABLE_REST_LENGTH:.2f} mm",
            f"± {1000 * tol.REST:.1f} mm",
            "assumed",
        ],
        [
            "Stiffness of a cable",
            _stiffness(facts),
            f"± {100 * tol.STIFFNESS:.0f} %, and all cables of a module alike within"
            f" {100 * tol.STIFFNESS_WITHIN:.0f} %. The search tells stiffnesses apart by {step:.1f} N/m.",
            "assumed",
        ],
        [
            "Length of an internal cable at 0° and at 180°",
            "table under “Wiring”",
            f"± {1000 * tol.INTERNAL_CABLE:.1f} mm: what that does to a module is in “What a finished module"
            f" measures”. Between 0° and 180° the drum itself deviates, by up to {drum:.1f} mm, as that table"
            " says: do not correct it.",
            "assumed",
        ],
        [
            "Distance of joined nodes, at rest",
            f"{1000 * near:.1f} to {1000 * far:.1f} mm",
            f"± {1000 * tol.LINK:.0f} mm",
            "simulated",
        ],
        [
            "Mass of a module",
            f"{1000 * built:.1f} g"
            + ("" if built < 1.01 * MODULE_MASS else f" (simulated {1000 * MODULE_MASS:.1f} g)"),
            f"± {100 * tol.MASS:.0f} %",
            "assumed",
        ],
        [
            "Friction between rod ends and floor",
            _friction(facts),
            "not known how much it matters: crawl on the floor that you measured",
            "simulated",
        ],
    ]
    header = ("what", "should be", "may differ", "source")
    return blocks.grid(header, rows, blocks.columns(width, 27, 22, 38, 13))


def _friction(facts: Facts) -> str:
    physics = facts.config.physics
    if facts.morphology.feet == "none":
        return f"coefficient {physics.friction:g}"
    forward, backward = physics.feet_friction
    return (
        f"coefficient {forward:g} {FEET_TEXT[facts.morphology.feet]} of the chain, {backward:g} else, of rod"
        " ends with feet"
    )


def _stiffness(facts: Facts) -> str:
    values = sorted({t.stiffness_n_per_m(s) for s in facts.morphology.stiffnesses})
    return ", ".join(f"{v:.2f}" for v in values) + " N/m"


def _checks(facts: Facts, width: float) -> Flowable:
    length, breadth, height = (100 * v for v in facts.size)
    along = tol.SIZE + (facts.morphology.n_modules - 1) * tol.LINK
    friction = facts.config.physics.friction
    angle = np.degrees(np.arctan(friction))
    checks = [
        (
            "Pull test",
            "The coupon, pulled as “Pull test of the cable material” says, has the stated force"
            f" within {100 * tol.STIFFNESS:.0f} %. If not: enter the measurement into the materials file and"
            " export again, before anything else is made.",
        ),
        (
            "Every servo",
            f"From a0 to a180 it turns by 180° ± {tol.TRAVEL:.0f}°, counter-clockwise seen from its shaft,"
            " and does not hum at the ends. If not: steps 4 and 5 of “Program”.",
        ),
        (
            "Every internal cable",
            f"Lengths at 0° and at 180° as in the table under “Wiring”, ± {1000 * tol.INTERNAL_CABLE:.1f} mm."
            " If only 180° is off: the servo's pulses, or a line that slipped off its groove.",
        ),
        (
            "Every module",
            "Step 8 of its assembly: shape, mass, and what it measures at a0 and a180, again a day later.",
        ),
        (
            "Joints",
            "Node pairs as in the orientation table; every servo rod lies at the stated turn. All joints"
            " wiggle. If not: the pairs are wrong; take the links off.",
        ),
        (
            "Whole robot, servos off, on the floor",
            f"{length:.1f} cm long (± {100 * along:.1f} cm), {breadth:.1f} cm wide, {height:.1f} cm high (±"
            f" {100 * tol.SIZE:.1f} cm); it rests on the nodes named under “Settled modules”. If it lies on"
            " others, set it down on these. If it is lower, cables are too soft or a module too heavy.",
        ),
        (
            "Floor",
            "A loose rod with caps, laid along the slope of a tilted piece of the floor, begins to slide at"
            f" {angle:.0f}° (friction {friction:g}). If not: put paper or cloth on the floor, or expect"
            " another way of crawling.",
        ),
        (
            "Rhythm",
            "Type g, without a computer that tells it where the target is. The monitor says “state settling”"
            f" and, after {facts.config.trials.settle_time:g} s, “state gait1”: every module contracts and"
            " releases as in a simulated trial; nothing rubs, no line leaves its groove. Type s to stop.",
        ),
        (
            "Closed loop",
            f"Needs the camera (“To steer it”). {facts.config.trials.trial_time:g} s towards a target"
            f" {100 * facts.task.target_distance:.0f} cm away. Compare with “What to expect of it”.",
        ),
    ]
    if facts.feet.feet:
        checks.insert(-2, _feet_check(facts))
    rows = [["[  ]", f"<b>{a}</b>", b] for a, b in checks]
    return blocks.grid((), rows, blocks.columns(width, 6, 26, 68))


def _feet_check(facts: Facts) -> tuple[str, str]:
    down, up = (np.degrees(np.arctan(f)) for f in facts.config.physics.feet_friction)
    return (
        "Feet",
        f"The sled of the friction test slides at {down:.0f}° with its point downhill and at {up:.0f}° with"
        " it uphill, on this floor. If not: enter the angles into the materials file and export again. Every"
        " notch points as “Which foot goes where” says.",
    )
