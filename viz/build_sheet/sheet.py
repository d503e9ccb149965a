"""The whole build sheet of a robot."""

from __future__ import annotations

from engine.fabrication.materials import Materials
from viz.build_sheet import part_drawings, style
from viz.build_sheet.document import PageLayout, on_pages_of_their_own, typeset
from viz.build_sheet.facts import Facts
from viz.build_sheet.kit import costs
from viz.build_sheet.sections import (
    assembly,
    bill_of_materials,
    checks,
    cut_list,
    drawings,
    feet,
    joining,
    net,
    performance,
    shopping,
    sources,
    steering,
    title,
    wiring,
)
from viz.build_sheet.style import PaperName


def build_sheet(facts: Facts, materials: Materials, paper: PaperName = "a4") -> tuple[bytes, PageLayout]:
    """Return a robot's build sheet as a PDF, and where everything is on its pages.

    Equal arguments give equal bytes.

    Args:
        facts: the robot and where it comes from.
        materials: what it is built from.
        paper: to print on.
    """
    sheet = style.PAPERS[paper]
    sections = (
        title.pages(facts, materials, sheet),
        performance.pages(facts, sheet),
        drawings.pages(facts, sheet),
        [
            *shopping.pages(facts, materials, sheet),
            *bill_of_materials.pages(facts, materials, sheet),
            *cut_list.pages(facts, materials, sheet),
        ],
        costs.pages(facts.morphology, [facts.morphology.n_modules], materials, sheet),
        part_drawings.pages(facts, materials, sheet),
        net.pages(facts, materials, sheet),
        assembly.pages(facts, materials, sheet),
        joining.pages(facts, sheet),
        feet.pages(facts, materials, sheet),
        [*wiring.pages(facts, materials, sheet), *steering.pages(facts, sheet)],
        [*checks.pages(facts, materials, sheet), *sources.pages(facts, materials, sheet)],
    )
    return typeset(
        on_pages_of_their_own(sections),
        paper=sheet,
        title=f"Build sheet of {facts.name} of {facts.run_name}",
        running=f"{facts.name} · run {facts.run_name} · id {facts.robot_id} · {facts.where}",
        date=f"run of {facts.date}",
    )
