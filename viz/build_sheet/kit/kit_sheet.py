"""The papers of a kit for one module as one PDF."""

from __future__ import annotations

import dataclasses

from reportlab.platypus import Flowable, Paragraph

from engine.fabrication.dimensions.limiter import has_limiter
from engine.fabrication.kit.lone_module import LoneModule
from engine.fabrication.materials import Materials
from viz.build_sheet import blocks, part_drawings, style
from viz.build_sheet.document import PageLayout, on_pages_of_their_own, typeset
from viz.build_sheet.facts import Facts
from viz.build_sheet.kit import costs, steps
from viz.build_sheet.kit.scene_pictures import ScenePictures
from viz.build_sheet.sections import assembly, bill_of_materials, checks, cut_list, net, shopping, wiring
from viz.build_sheet.style import PaperName


def lone_facts(facts: Facts) -> Facts:
    """Return the facts of a robot's first module alone, for the sections of its build sheet."""
    solution = dataclasses.replace(
        facts.evaluation.solution, morphology=LoneModule.of(facts.evaluation.solution.morphology)
    )
    return dataclasses.replace(facts, evaluation=dataclasses.replace(facts.evaluation, solution=solution))


def kit_sheet(
    facts: Facts, materials: Materials, text: str, scene: ScenePictures, paper: PaperName = "a4"
) -> tuple[bytes, PageLayout]:
    """Return the PDF, and where everything is on its pages.

    Equal arguments give equal bytes.

    Args:
        facts: of the robot whose first module the kit is for.
        materials: what it is built from.
        text: of the materials file.
        scene: of that module, with the jig if there is one.
        paper: to print on.
    """
    sheet = style.PAPERS[paper]
    alone = lone_facts(facts)
    n = facts.morphology.n_modules
    sections: tuple[list[Flowable], ...] = (
        [*_title(facts, bool(scene.matching(["jig*"]))), *checks.safety(alone, materials)],
        [
            *shopping.pages(alone, materials, sheet),
            *bill_of_materials.pages(alone, materials, sheet),
            *cut_list.pages(alone, materials, sheet),
        ],
        [
            *costs.pages(alone.morphology, sorted({1, 2, 4, 6, 8, 10, n}), materials, sheet),
            costs.measuring(text, sheet),
        ],
        part_drawings.pages(alone, materials, sheet),
        net.pages(alone, materials, sheet),
        steps.pages(scene, sheet, limited=has_limiter(materials)),
        assembly.pages(alone, materials, sheet),
        wiring.pages(alone, materials, sheet),
    )
    return typeset(
        on_pages_of_their_own(sections),
        paper=sheet,
        title=f"Kit for module 1 of {facts.name} of {facts.run_name}",
        running=f"Kit for module 1 of {facts.name} · run {facts.run_name} · id {facts.robot_id}",
        date=f"run of {facts.date}",
    )


def _title(facts: Facts, jig: bool) -> list[Flowable]:
    held = " The jig holds its six rods while the net goes on." if jig else ""
    return [
        Paragraph(style.escaped(f"A kit for module 1 of {facts.name}"), style.TITLE),
        blocks.gap(4),
        blocks.body(
            "One module, before the others: it takes a day, and shows whether material, servo and printer are"
            f" what the robot of {facts.morphology.n_modules} modules needs.{held}"
        ),
        *blocks.bullets(
            [
                "Order what “What it costs” lists. Measure what has come, in the order of the form"
                " measured.toml, the pull test first.",
                "Export again with --materials measured.toml, print the parts, and cut the net.",
                "Print net_tiles.pdf at 100 %, lay its crosses over each other, glue the sheets to a board:"
                " the net is laid on it to be numbered, and cut along it where there is no cutting plotter.",
                "Read “Safety”. Wire the servo and load the sketch of the folder firmware (“Wiring”,"
                " “Program”):"
                " it has the whole robot's pins, and this module is the one at the first of them. Calibrate"
                " the"
                " servo before it is built in: the drum goes on at 0°.",
                "Build the module picture by picture; the text is under “Build one module”.",
                "Compare what it measures with “What a finished module measures”, at once and a day later.",
                "If it does, order and build the others: the robot's own folder has the parts of all.",
            ],
            numbered=True,
        ),
        blocks.gap(4),
        blocks.body(
            "There is no STEP file. The parts are made as triangles; as exact surfaces they would need a CAD"
            " kernel (OpenCASCADE, 450 MB installed) that nothing else here uses. The measures that matter"
            " are in the drawings and in the materials file, and CAD programs open the .3mf."
        ),
    ]
