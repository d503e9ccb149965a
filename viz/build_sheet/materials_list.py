"""The bill of materials, with masses that add up to the simulated robot's."""

from __future__ import annotations

from reportlab.platypus import Flowable

from engine.fabrication.bill_of_materials import Part, parts
from engine.fabrication.materials import Materials
from viz.build_sheet import blocks, style
from viz.build_sheet.facts import Facts
from viz.build_sheet.style import Paper


def pages(facts: Facts, materials: Materials, paper: Paper) -> list[Flowable]:
    """Return the section."""
    rows = [_row(p) for p in parts(facts.morphology)]
    rows.append(["all parts", "", "", "", f"{1000 * facts.mass:.1f}", ""])
    header = ("part", "pieces", "length × diameter (mm)", "mass each (g)", "mass (g)", "basis")
    return [
        blocks.heading("Bill of materials"),
        blocks.grid(
            header,
            rows,
            blocks.columns(paper.inner_width, 22, 9, 17, 11, 11, 30),
            right=(1, 3, 4),
            total=True,
        ),
    ]


def _row(part: Part) -> list[str]:
    size = " × Ø ".join(f"{1000 * v:.1f}" for v in (part.length, part.diameter) if v is not None)
    mass = ("", "") if part.mass is None else (f"{1000 * part.mass:.3f}", f"{1000 * part.mass * part.quantity:.1f}")
    return [style.escaped(part.name), str(part.quantity), size, *mass, style.escaped(part.basis)]
