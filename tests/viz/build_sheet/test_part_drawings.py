"""Drawings of parts: their measures are those of the solids that are printed, and none lies over another."""

import itertools

import pytest
from reportlab.pdfgen.canvas import Canvas

from engine.body import module as t
from engine.fabrication.dimensions.cables import design_cables
from engine.fabrication.materials import CAP_SLEEVE, load_materials
from engine.fabrication.parts import shapes
from engine.fabrication.parts.drum import drum_discs, servo_drum
from engine.fabrication.parts.foot import foot
from engine.fabrication.parts.head_tag import tag_clip, tag_plate
from engine.fabrication.parts.servo_parts import half_rods, laid, servo_mount
from engine.fabrication.parts.solids import extent
from tests.support.sheets import check_nothing_overflows_or_overlaps
from viz.build_sheet import part_drawings, style
from viz.build_sheet.document import typeset
from viz.build_sheet.pen import Pen


@pytest.mark.parametrize(("n", "preset"), [(2, ""), (10, ""), (2, "silicone-sheet")])
def test_the_measures_are_those_of_the_solids(robots, materials, n, preset):
    facts, paper = robots[n], style.PAPERS["a4"]
    materials = load_materials(preset) if preset else materials
    footed = bool(facts.feet.feet)
    story = part_drawings.pages(facts, materials, paper)
    pdf, layout = typeset(story, paper=paper, title="", running="", date="")
    check_nothing_overflows_or_overlaps(pdf, layout)
    said = {p.name.removeprefix("drawing of "): [label.what for label in p.labels] for p in layout.pictures}
    wanted = {
        "Rods": [1e3 * v for v in (t.ROD_LENGTH, *half_rods(materials))],
        "Drum of the servo": [v for disc in drum_discs(materials.servo) for v in extent(disc)[:2]],
        "Servo mount": [extent(laid(servo_mount(materials)))[k] for k in (0, 2)],
        "Tag holder and link": [
            extent(tag_clip(materials.printer))[0],
            *(extent(tag_plate())[k] for k in (0, 2)),
            *extent(shapes.link())[:2],
        ],
    }
    wanted["Drum of the servo"].append(extent(servo_drum(materials.servo))[2])
    for design in design_cables(facts.morphology, materials):
        solid = shapes.cap(design, materials.printer, footed=footed)
        wanted[f"Cap, stiffness {design.level / 10:.1f}"] = [extent(solid)[2], 1e3 * CAP_SLEEVE]
    if footed:
        lean = facts.feet.feet[0].lean
        wanted[f"Foot of {lean}°"] = [extent(foot(lean))[k] for k in (0, 2)]
    assert set(said) == set(wanted)
    for name, measures in wanted.items():
        for measure in measures:
            assert any(text.startswith(f"{measure:.1f}") for text in said[name]), (name, measure)
    for picture in layout.pictures:
        for label in picture.labels:
            assert picture.area.x0 - 1 <= label.x0 <= label.x1 <= picture.area.x1 + 1, label.what
            assert picture.area.y0 - 1 <= label.y0 <= label.y1 <= picture.area.y1 + 1, label.what
        for a, b in itertools.combinations(picture.labels, 2):
            assert not a.overlaps(b, slack=1.0), (picture.name, a.what, b.what)


@pytest.mark.parametrize(
    ("start", "end"),
    [((20, 50), (26, 50)), ((88, 50), (94, 50)), ((50, 20), (50, 26)), ((20, 50), (90, 50))],
)
def test_a_measure_stands_beside_a_line_that_is_too_short_for_it(tmp_path, start, end):
    pen = Pen(Canvas(str(tmp_path / "a.pdf")), 100, 100)
    pen.dimension(start, end, "12.5 mm")
    (label,) = pen.labels
    assert 0 <= label.x0 <= label.x1 <= 100
    (x0, y0), (x1, y1) = start, end
    middle = (label.x0 + label.x1) / 2, (label.y0 + label.y1) / 2
    within = x0 <= middle[0] <= x1 and y0 - 1 <= middle[1] <= y1 + 1
    assert within == (x1 - x0 > 50)
