"""To steer the robot: the camera, and the two tags to cut out."""

from __future__ import annotations

import numpy as np
from reportlab.lib.colors import black, white
from reportlab.lib.units import mm
from reportlab.platypus import Flowable

from engine.body import module as t
from engine.fabrication.firmware.protocol import PATIENCE
from engine.fabrication.markers import HEAD, N_CELLS, TARGET, Marker
from engine.simulation.model import face_rods
from viz.build_sheet import blocks, style
from viz.build_sheet.facts import Facts
from viz.build_sheet.pen import Pen, Picture
from viz.build_sheet.style import Paper

GAP = 14 * mm


def pages(facts: Facts, paper: Paper) -> list[Flowable]:
    """Return the section."""
    height = 1000 * (TARGET.side + 2 * TARGET.cell) * mm + 16
    return [
        blocks.together(
            [
                blocks.heading("To steer it"),
                *blocks.bullets(_steps(facts), numbered=True),
                Picture(paper.inner_width, height, _draw, "tags"),
                blocks.note(
                    f"The black squares must measure {1000 * HEAD.side:.0f} and {1000 * TARGET.side:.0f} mm;"
                    " if not, the sheet was not printed at 100 %: give the smaller one's side as --tag-mm."
                ),
            ]
        )
    ]


def head_point() -> float:
    """Return how far the simulated head lies ahead of its module's middle, in m.

    It is the mean of the middles of the three rods that end at the leading face.
    """
    middles = t.NODES[np.array(t.RODS)].mean(axis=1)
    return float(np.linalg.norm(middles[list(face_rods(1))].mean(axis=0)))


def _steps(facts: Facts) -> list[str]:
    head = style.escaped(facts.module_name(facts.head.module))
    command = "tensatlas drive --port /dev/ttyUSB0 --camera 0"
    more = ""
    if facts.task.name != "goal-reaching":
        more = (
            f" The task {style.escaped(facts.task.name)} is known to the run alone: name it, too, as in"
            " <b>tensatlas drive RUN --cell 3,7 --port …</b>"
        )
    return [
        "Cut the tags out along the dashed lines: the white border is needed. Print on matt paper, glue them"
        " to card.",
        f"The smaller one lies flat above the head point of module {head}, {1000 * head_point():.0f} mm ahead"
        " of the module's middle towards the face that leads; its arrow points away from the other modules."
        " If it must lie elsewhere, measure by how much the head point is ahead of the tag's middle, and say"
        " so with --ahead-mm.",
        "The larger one lies on the floor, where the robot is to go; its middle is the target. It may be"
        " moved while the robot crawls.",
        "Hang a camera above the floor that looks straight down and sees both, at 1280 × 720 pixels from 1"
        " to 1.5 m. Light from above, no glare.",
        f"pip install 'tensatlas[drive]', then <b>{command}</b>: it opens a page with the picture, starts the"
        " robot, and ends when the head has arrived or with Ctrl-C. If a tag is hidden for"
        f" {PATIENCE:g} s the servos release until it is seen again.{more}",
    ]


def _draw(pen: Pen) -> None:
    x = 0.0
    for marker in (HEAD, TARGET):
        x = _tag(pen, marker, x, 14.0) + GAP


def _tag(pen: Pen, marker: Marker, x: float, y: float) -> float:
    """Draw a tag with its border to cut out; return where it ends."""
    cell = 1000 * marker.cell * mm
    whole = (N_CELLS + 2) * cell
    top = y + whole
    pen.path([(x, y), (x + whole, y), (x + whole, top), (x, top)], dash=(3, 3), close=True, width=0.4)
    side = N_CELLS * cell
    pen.box(x + cell, y + cell, side, side, fill=black, stroke=None)
    for row, cells in enumerate(~marker.black()):
        for column in np.flatnonzero(cells):
            place = (x + (1 + column) * cell, top - (row + 2) * cell)
            pen.box(*place, cell, cell, fill=white, stroke=None)
    if marker is HEAD:
        middle = x + whole / 2
        pen.path(
            [(middle, top - 2), (middle - 4, top - 9), (middle + 4, top - 9)], fill=style.SOFT, close=True
        )
    pen.text(x, y - 10, f"{marker.name}, {1000 * marker.side:.0f} mm", size=8, color=style.SOFT)
    return x + whole
