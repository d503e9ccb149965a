"""Which numbers are measured, which simulated, which assumed, and what the sheet cannot know."""

from __future__ import annotations

from reportlab.platypus import Flowable

from engine.fabrication.materials import Materials
from viz.build_sheet import blocks, style
from viz.build_sheet.facts import Facts
from viz.build_sheet.style import Paper


def pages(facts: Facts, materials: Materials, paper: Paper) -> list[Flowable]:
    """Return the section."""
    k_ref = "simulated" if materials.cable.k_ref is None else "measured"
    rows = [
        [
            "Node positions, rod lengths and diameters, joint distances, faces and turns",
            "simulated",
            "robot.xml",
        ],
        ["Rest length of the cables, settled shape, tensions, sizes", "simulated", "robot.xml"],
        ["Stiffness of the cables", k_ref, "robot.xml; materials.toml if k_ref is set there"],
        [
            "Modulus and allowed strain of the cable material",
            str(materials.cable_source),
            "materials.toml" + ("" if materials.pull_test else ": make the pull test"),
        ],
        ["Cross-sections and free lengths of the cables", str(materials.cable_source), "from the two above"],
        ["Masses of rods and of servo rods with servo and arm", "simulated", "robot.xml, before scaling"],
        ["Masses and dimensions of bought parts; densities", "assumed", "materials.toml: data sheets"],
        ["Lengths of the internal cables at a servo command", "simulated", "published model of the actuator"],
        [
            "f<sub>s</sub>, paths, distances",
            "simulated",
            f"{style.escaped(facts.run_name)}.tsmr, trajectory.csv",
        ],
        [
            "Friction with the floor",
            "simulated",
            f"coefficient {facts.config.physics.friction:g}; yours differs",
        ],
        *_feet(facts, materials),
        ["Tolerances not marked otherwise", "assumed", "a designer's judgement"],
    ]
    scale = facts.config.physics.inertia_scale
    return [
        blocks.heading("Where the numbers come from"),
        blocks.body(
            "<b>Simulated</b>: the simulation uses the number or computed it. <b>Measured</b>: somebody"
            " measured it and wrote it into the materials file. <b>Assumed</b>: a data sheet's or the"
            " designer's; the simulation does not know it. A number that follows from several is as good as"
            " the worst of them. <b>Nothing on this sheet has been checked on a robot that was built.</b>"
        ),
        blocks.grid(
            ("number", "source", "where it is written"), rows, blocks.columns(paper.inner_width, 46, 16, 38)
        ),
        blocks.subheading("What differs between the simulated and a real robot"),
        *blocks.bullets(
            [
                "Rods are rigid; cables have no mass, pull along straight lines, pass through each other and"
                " never break.",
                "The servo is a point from which five cables leave; its body cannot touch anything.",
                f"Inertia is multiplied by {scale:g}, weights and forces are real: the motion is slow and"
                " well damped, a real robot may bounce more.",
                "Controller, power and tether weigh nothing and drag nothing; “As it would be built” counts"
                " the weight of the tether.",
            ]
        ),
    ]


def _feet(facts: Facts, materials: Materials) -> list[list[str]]:
    """Return the row about the friction of a robot's feet, if it has some."""
    if facts.morphology.feet == "none":
        return []
    forward, backward = facts.config.physics.feet_friction
    simulated = f"simulated with {forward:g} forward, {backward:g} backward, assumed"
    if materials.feet_test is None:
        return [["Friction of the feet", "assumed", f"{simulated}: make the friction test"]]
    return [["Friction of the feet, as built", "measured", f"materials.toml; {simulated}"]]
