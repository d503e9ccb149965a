"""The papers of a kit: nothing overflows, every part has its picture, the net is at 1:1."""

import io
import re

import numpy as np
import pytest
from pypdf import PdfReader
from reportlab.lib.units import mm

from engine.export import simulate_trial
from engine.fabrication.dimensions.cables import cable_design, design_cables
from engine.fabrication.kit.jig import jig
from engine.fabrication.kit.lone_module import LoneModule
from engine.fabrication.materials import load_materials, preset_text
from engine.fabrication.parts.assembly import robot_glb
from engine.fabrication.parts.net import lay_out, module_net
from engine.storage.reader import RunReader
from tests.support.sheets import check_nothing_overflows_or_overlaps
from viz.build_sheet import style
from viz.build_sheet.facts import gather
from viz.build_sheet.kit import steps, tiles
from viz.build_sheet.kit.kit_sheet import kit_sheet
from viz.build_sheet.kit.module_scene import module_scene
from viz.build_sheet.scene import OrthographicCamera

MATERIALS = load_materials()


@pytest.fixture(scope="module")
def facts(small_run):
    with RunReader(small_run) as reader:
        number = min(reader.placements("morphology", reader.last_closed().number).values())
        evaluation = reader.evaluation(number)
        return gather(reader, evaluation, simulate_trial(reader.config, evaluation))


@pytest.fixture(scope="module")
def scene(facts):
    module = LoneModule.of(facts.morphology)
    glb = robot_glb(module, MATERIALS)
    return module_scene(glb, jig(module.stiffness_levels[0], glb))


@pytest.fixture(scope="module")
def sheet(facts, scene):
    return kit_sheet(facts, MATERIALS, preset_text("latex-sheet"), scene)


def test_nothing_overflows_or_lies_over_something_else(sheet):
    pdf, layout = sheet
    check_nothing_overflows_or_overlaps(pdf, layout)
    for picture in layout.pictures:
        for label in picture.labels:
            assert picture.area.x0 - 1 <= label.x0 <= label.x1 <= picture.area.x1 + 1, label.what


def test_it_says_what_a_workshop_asks(sheet):
    pages = PdfReader(io.BytesIO(sheet[0])).pages
    text = " ".join(" ".join(page.extract_text() for page in pages).split())
    for said in (
        "A kit for module 1 of Robot",
        "euro (2026-11)",
        "Hours of work",
        "AWG",
        "fuse",
        "Filament settings to begin with",
        "What to measure, in this order",
        "USB camera",
        "hours, 2.8 of them for the jig",
        "There is no STEP file",
    ):
        assert said in text, said
    # a page that the text sends its reader to is there
    for section in set(re.findall("“([A-Z][^”]+)”", text)) - {"New Line", "To steer it", "The head point"}:
        assert len(re.findall(rf"(?<!“){re.escape(section)}(?!”)", text)) >= 1, section
    # what has to be there before it is used comes before it
    order = ("Draw a limiter", "No glue:", "adjust these limiters", "rings over the knobs", "a day later")
    order += ("cyanoacrylate at the",)
    places = [text.index(words, text.index("1. Prepare rods and net")) for words in order]
    assert places == sorted(places)


def test_the_actions_add_every_part_one_after_the_other(scene):
    made = steps.actions(scene, limited=True)
    assert len(made) > 25
    there = set()
    for action in made:
        new = set(scene.matching(action.new))
        there -= set(scene.matching(action.gone))
        assert new or action.gone
        there |= new
    assert there == set(scene.names) - {"jig"}
    assert any("jig" in a.text for a in made)
    # without a jig there is no word of it
    bare = module_scene(robot_glb(LoneModule(2, (1,)), MATERIALS), None)
    assert not any("jig" in a.text for a in steps.actions(bare, limited=False))
    assert not any("limiter" in a.text for a in steps.actions(bare, limited=False))


def test_what_is_new_is_in_colour_and_what_is_there_is_grey(scene):
    camera = OrthographicCamera.looking(-30.0, 25.0)
    around = scene.points(scene.names)
    caps = scene.matching(["*_cap_*"])

    def colourful(new, there):
        picture = np.asarray(scene.picture(camera, new, there, size=(120, 100), around=around)).astype(int)
        return (np.ptp(picture, axis=2) > 40).sum(), (picture.min(axis=2) < 230).sum()

    colour, drawn = colourful(caps, [])
    assert drawn > 50
    assert colour > 0.5 * drawn
    grey, drawn = colourful([], caps)
    assert drawn > 50
    assert grey == 0
    assert colourful([], []) == (0, 0)


def test_small_parts_are_seen_on_their_pictures(scene):
    there, small = [], 0
    for action in steps.actions(scene, limited=True):
        new, gone = scene.matching(action.new), scene.matching(action.gone)
        there = [name for name in there if name not in {*new, *gone}]
        patterns = action.new if action.close else ()
        around = scene.points(scene.matching(action.close or ["*"]))
        if action.caps or any("_way_" in p or "ballast" in p for p in patterns):
            camera = steps.camera_for(scene, action, there, around)
            assert scene.seen(camera, new, there, around) > 15, action.text
            small += 1
        there += new
    # caps, the limiters at them, rings over them, lines, the counterweight
    assert small == 5 + 6 + 1 + 6 + 5 + 1


def test_the_scene_stands_in_its_jig(scene):
    """The rods of the scene lie where the jig has its clips."""
    _, low, high = scene.middle("jig"), *(f(scene.points(["jig"]), axis=0) for f in (np.min, np.max))
    assert low[2] == pytest.approx(0.0, abs=1e-6)
    for r in range(6):
        x, y, z = scene.middle(f"*_rod{r}")
        assert 0.02 < z < 0.13
        assert low[0] < x < high[0]
        assert low[1] < y < high[1]


@pytest.mark.parametrize(("paper", "path"), [("a4", 0.06), ("letter", 0.12), ("a4", 0.03)])
def test_the_tiles_show_the_whole_net_at_its_size(monkeypatch, paper, path):
    net, design = lay_out("strip", path, MATERIALS.printer), cable_design(2, MATERIALS)
    sheets, drawn = [], []
    plain_text, plain_page = tiles.Canvas.drawString, tiles.Canvas.showPage
    labels = {e.label for e in net.eyelets}
    paper_size = style.PAPERS[paper]

    def text(canvas, x, y, said, **more):
        if said in labels:
            drawn.append((x - tiles.BESIDE[0], y - tiles.BESIDE[1]))
        plain_text(canvas, x, y, said, **more)

    def show_page(canvas):
        sheets.append((canvas._pagesize, np.array(drawn)))
        drawn.clear()
        plain_page(canvas)

    monkeypatch.setattr(tiles.Canvas, "drawString", text)
    monkeypatch.setattr(tiles.Canvas, "showPage", show_page)
    pdf, (rows, columns) = tiles.net_tiles(net, design, paper_size, "Net")
    assert len(sheets) == rows * columns == len(PdfReader(io.BytesIO(pdf)).pages)
    assert (rows * columns > 1) == (path > 0.03)
    positions = np.array([e.position for e in net.eyelets]) * 1000 * mm
    seen = np.zeros(len(positions), dtype=int)
    for (width, height), places in sheets:
        # at 1:1, whichever part of it is on the sheet
        np.testing.assert_allclose(places - places[0], positions - positions[0], atol=1e-6)
        edge = tiles.MARGIN
        inside = (places > edge).all(axis=1) & (places < np.array([width, height]) - edge).all(axis=1)
        seen += inside
    assert (seen >= 1).all()
    again, _ = tiles.net_tiles(net, design, paper_size, "Net")
    assert again == pdf


def test_a_modules_own_net_is_tiled(facts):
    (design,) = design_cables(LoneModule.of(facts.morphology), MATERIALS)
    net = module_net(design, MATERIALS.printer)
    pdf, _ = tiles.net_tiles(net, design, style.PAPERS["a4"], "Net of module 1")
    text = "".join(page.extract_text() for page in PdfReader(io.BytesIO(pdf)).pages)
    assert "print at 100 %" in text
    assert all(label in text for label in ("2a", "3b", "11"))
