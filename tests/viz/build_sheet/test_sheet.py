"""What is on a build sheet, compared with the model, and whether anything lies over something else."""

import dataclasses
import io
import itertools
import re
from types import SimpleNamespace

import numpy as np
import pytest
from pypdf import PdfReader

from engine.analysis.as_built import AsBuilt, Scores
from engine.analysis.robustness import Robustness
from engine.body import module as t
from engine.body import servo
from engine.config import RunConfig
from engine.fabrication.bill_of_materials import parts
from engine.fabrication.buildability import problems
from engine.fabrication.dimensions.acceptance import SPAN, expected, pull
from engine.fabrication.dimensions.cables import design_cables
from engine.fabrication.dimensions.cut_lists import rods
from engine.fabrication.dimensions.floating_module import contraction
from engine.fabrication.dimensions.joints import joints, orientations
from engine.fabrication.firmware import pin_map
from engine.fabrication.markers import HEAD, N_CELLS, TARGET
from engine.fabrication.mass_balance import mass_balance
from engine.fabrication.materials import load_materials
from engine.fabrication.materials.properties import FeetTest
from engine.fabrication.parts.printed_parts import printed_parts
from engine.simulation.built import PUBLISHED
from engine.tasks import get_task, worlds
from tests.support.sheets import check_nothing_overflows_or_overlaps
from viz.build_sheet import style
from viz.build_sheet.document import typeset
from viz.build_sheet.pen import Pen
from viz.build_sheet.sections import feet, performance, steering, title
from viz.build_sheet.sheet import build_sheet

PAPERS = {2: "a4", 10: "letter"}


@pytest.fixture(scope="module")
def sheets(robots, materials):
    """PDF and layout by number of modules, the large robot's on Letter."""
    return {n: build_sheet(facts, materials, PAPERS[n]) for n, facts in robots.items()}


@pytest.fixture(scope="module")
def letters():
    """Sizes of the letters of each text on the sheets, filled by ``texts``: reading a PDF takes a while."""
    return {}


@pytest.fixture(scope="module")
def texts(robots, materials, letters):
    """What is written on the sheets, without their lines and areas, which take long to read."""
    with pytest.MonkeyPatch.context() as patch:
        for shape in ("line", "path", "disc", "box"):
            patch.setattr(Pen, shape, lambda *_, **__: None)
        pdfs = {n: build_sheet(facts, materials, PAPERS[n])[0] for n, facts in robots.items()}
    return {n: read(pdf, letters.setdefault(n, set())) for n, pdf in pdfs.items()}


def read(pdf, letters=None):
    def visit(text, _cm, _tm, _font, size):
        if letters is not None:
            letters.add((text.strip(), size))

    pages = [page.extract_text(visitor_text=visit) for page in PdfReader(io.BytesIO(pdf)).pages]
    return " ".join(" ".join(pages).split())


def what_to_expect(facts):
    """Return the text of that section alone."""
    paper = style.PAPERS["a4"]
    pdf, _ = typeset(performance.pages(facts, paper), paper=paper, title="", running="", date="")
    return read(pdf)


@pytest.mark.parametrize("n", [2, 10])
def test_nothing_overflows_or_lies_over_something_else(sheets, n):
    pdf, layout = sheets[n]
    check_nothing_overflows_or_overlaps(pdf, layout)
    assert len(layout.pictures) >= 12 + 2 * n
    assert len(layout.grids) >= 10
    for picture in layout.pictures:
        area = picture.area
        for label in picture.labels:
            assert area.x0 - 1 <= label.x0 <= label.x1 <= area.x1 + 1, (picture.name, label)
            assert area.y0 - 1 <= label.y0 <= label.y1 <= area.y1 + 1, (picture.name, label)
        for a, b in itertools.combinations(picture.labels, 2):
            assert not a.overlaps(b, slack=1.0), (picture.name, a.what, b.what)


@pytest.mark.parametrize("n", [2, 10])
def test_letters_are_large_enough_and_paper_is_as_asked(sheets, texts, letters, n):
    pdf, _ = sheets[n]
    reader = PdfReader(io.BytesIO(pdf))
    paper = style.PAPERS[PAPERS[n]]
    assert [float(v) for v in reader.pages[0].mediabox[2:]] == pytest.approx([paper.width, paper.height])
    assert len(letters[n]) > 100
    tiny = {text for text, size in letters[n] if text not in ("", "s") and size < 7}
    assert tiny == set()  # but for the subscript of f_s


@pytest.mark.parametrize("n", [2, 10])
def test_the_numbers_are_the_models(robots, materials, texts, n):
    facts, text = robots[n], texts[n]
    morphology = facts.morphology
    assert facts.robot_id in text
    assert facts.robot_hash[:32] in text
    assert f"{100 * facts.f_s:.2f} cm".replace("-", "−") in text
    for name, distances in zip(facts.task.target_names, facts.evaluation.distances, strict=True):
        assert f"{name} {100 * distances.mean():.2f}" in text
    rod = rods(morphology, materials)[0]
    assert f"rod 0 (servo) 0 – 1 {n} {1000 * rod.cut:.1f} {1000 * rod.length:.1f}" in text
    for d in design_cables(morphology, materials):
        width, thickness = 1000 * d.section.width, 1000 * d.section.thickness
        figures = f"{d.stiffness:.2f} {d.tension:.3f} {1000 * d.free:.2f} {1e6 * d.area:.3f}"
        assert f"{figures} {width:.2f} × {thickness:.2f}" in text
    stand = orientations(morphology)
    for j in joints(morphology):
        pairs = ", ".join(f"{a}–{b}" for a, b in j.node_pairs)
        assert re.search(
            rf"{j.module + 1} and {j.module + 2} {j.face} .*? {pairs} {stand[j.module + 1].turn:.0f}°", text
        )
    for module, pin in pin_map(n).items():
        assert f"D{pin} S{module + 1}" in text
    assert f"Head (goes first) module {facts.head.module + 1}" in text
    for k, node in enumerate(t.SERVO_NODES):
        assert f"to node {node} {1000 * servo.TARGET_LENGTHS[0, k]:.1f}" in text
    found = problems(morphology, materials)
    assert bool(found) == (n == 10)  # its softest modules' cables are too thin
    for problem in found:
        assert problem.text.replace("mm2", "mm²") in text
        assert all(p.replace("mm2", "mm²") in text for p in problem.proposals)
    for level in set(morphology.stiffness_levels):
        for d in contraction(level, facts.built):
            figures = f"{1000 * d.released:.1f} {1000 * d.contracted:.1f} ± {1000 * d.tolerance:.1f}"
            assert f"{d.nodes[0]} and {d.nodes[1]} {figures}" in text
    near, far = (f"{1000 * v:.1f}" for v in facts.link_gaps)
    assert text.count(f"{near} to {far} mm") == 2
    for part in printed_parts(morphology, materials, facts.feet.feet):
        size = " × ".join(f"{1000 * v:.1f}" for v in part.size)
        assert re.search(rf"{part.name} {part.quantity} .*? {size}.*?{1000 * part.mass:.2f}", text)
    assert all(word in text for word in ("simulated", "assumed", "Wear eye protection"))


@pytest.mark.parametrize("n", [2, 10])
def test_masses_on_the_sheet_add_up(robots, materials, texts, n):
    facts, text = robots[n], texts[n]
    balance = mass_balance(facts.morphology, materials, facts.feet.feet)
    carried = sum(
        p.mass * p.quantity
        for p in parts(facts.morphology, materials, facts.feet.feet)
        if p.group != "off the robot"
    )
    assert carried == pytest.approx(balance.built)
    assert facts.mass == pytest.approx(balance.simulated)
    total = f"robot {1000 * balance.simulated:.2f} {1000 * balance.built:.2f}"
    assert total in text
    # the column of the balance as it is printed
    section = text[text.index("Does it weigh") : text.index(total)]
    lines = re.findall(r"(?:rods|rod|cables|links) (\d+\.\d\d) (\d+\.\d\d) ", section)
    assert len(lines) == len(balance.lines)
    sums = np.array(lines, dtype=float).sum(axis=0)
    np.testing.assert_allclose(sums, [1000 * balance.simulated, 1000 * balance.built], atol=0.03)


def test_the_same_robot_gives_the_same_bytes(robots, materials, sheets):
    facts = robots[2]
    assert build_sheet(facts, materials, "a4")[0] == sheets[2][0]


def test_a_users_text_is_printed_and_not_followed(texts):
    # a character that the font lacks shows as a question mark
    assert "a run <&> with ünusual ? name" in texts[2]


def test_spread_under_fresh_noise_is_told_where_it_is_known(robots):
    facts = robots[2]
    fitness = facts.evaluation.fitness
    robust = Robustness("", {}, {0: fitness}, {0: {1: fitness + 0.01, 2: fitness + 0.02, 3: None}})
    text = what_to_expect(dataclasses.replace(facts, robust=robust))
    fresh = 100 * (facts.task.target_distance - fitness) - np.array([1.0, 2.0])
    assert "Evaluated again 2 times" in text
    assert f"{fresh.mean():.2f} cm ± {fresh.std(ddof=1):.2f}".replace("-", "−") in text


def test_a_run_without_trajectories_still_has_a_sheet(robots):
    facts = robots[2]
    empty = np.zeros((facts.task.n_targets, 0, 2), dtype=np.float32)
    facts = dataclasses.replace(facts, evaluation=dataclasses.replace(facts.evaluation, trajectory=empty))
    assert "does not hold the paths" in what_to_expect(facts)


def test_what_the_rest_of_the_sheet_calls_by_its_number_is_there(texts):
    """Steps, sections and drawings that other places send the reader to."""
    text = texts[2]
    for step in ("3. Caps", "4. Net on rods 0 and 1", "7. Internal cables", "8. Check the module"):
        assert step in text
    named = set(re.findall("“([A-Z][^”]+)”", text))
    assert {"Program", "Wiring", "Safety", "Checks", "Settled modules", "What to expect of it"} <= named
    for section in named - {"New Line"}:
        assert len(re.findall(rf"(?<!“){re.escape(section)}(?!”)", text)) >= 1, section


def test_the_robots_links_are_measured_where_it_rests(robots):
    facts = robots[10]
    nodes, gaps = facts.body.nodes, []
    for j in joints(facts.morphology):
        for a, b in j.node_pairs:
            gaps.append(np.linalg.norm(nodes[j.module, a] - nodes[j.module + 1, b]))
    assert facts.link_gaps == pytest.approx((min(gaps), max(gaps)))
    assert facts.size[2] == pytest.approx(nodes[..., 2].max() + t.ROD_RADIUS)


def test_walls_to_set_up_are_listed_for_each_target():
    config = RunConfig(task="squeezing")
    task = get_task(config.task)
    facts = SimpleNamespace(task=task, morphology=SimpleNamespace(n_modules=3))
    paper = style.PAPERS["a4"]
    pdf, layout = typeset(
        performance.walls(facts, paper.inner_width), paper=paper, title="", running="", date=""
    )
    text = read(pdf)
    assert layout.too_narrow == []
    for world, name in zip(worlds(task, 3), task.target_names, strict=True):
        for wall in world:
            if not wall.is_buried:
                x, half = 100 * wall.centre[0], 100 * wall.half_size[0]
                assert name in text
                assert f"{x - half:.1f} to {x + half:.1f}".replace("-", "−") in text


def test_sheets_fit_their_columns_and_a_module_weighs_what_is_built(robots):
    rubber = load_materials("silicone-sheet")
    pdf, layout = build_sheet(robots[2], rubber, "letter")
    assert layout.too_narrow == []
    weight = mass_balance(robots[2].morphology, rubber).built / 2
    assert f"Weigh it ({1000 * weight:.1f} g" in read(pdf)


def said_by(parts) -> str:
    """Return the text of parts of a sheet, without its markup."""
    return " ".join(p.getPlainText() for p in parts)


@pytest.mark.parametrize(
    ("robots_cm", "printable", "said", "unsaid"),
    [
        (
            9.0,
            True,
            ["Evolved 10.0 cm, as built 9.0 ± 0.0", "all that is needed"],
            ["Not worth", "Cannot"],
        ),
        (4.0, True, ["Not worth building: it loses 60 % of that.", "by how the drum winds"], ["all that is"]),
        (-4.0, True, ["as built −4.0", "it loses more than all of that", "--as-built"], ["all that is"]),
        (9.0, False, ["Cannot be built so", "as built 9.0"], ["all that is needed"]),
    ],
)
def test_the_first_page_says_whether_it_is_worth_building(robots, robots_cm, printable, said, unsaid):
    def scores(cm):
        return Scores((cm / 100, cm / 100), None, None)

    found = AsBuilt(scores(10.0), scores(9.5), scores(robots_cm), {"winding": scores(3.0)})
    facts = dataclasses.replace(robots[2], as_built=found)
    rubber = load_materials()
    if not printable:
        rubber = dataclasses.replace(rubber, cable=dataclasses.replace(rubber.cable, max_strain=0.2))
    text = said_by(title.verdict(facts, rubber))
    assert all(words in text for words in said), text
    assert not any(words in text for words in unsaid), text


def test_what_differs_is_listed_with_what_it_costs(robots, texts):
    facts, text = robots[2], texts[2]
    assert facts.twin is not None
    assert facts.as_built is not None
    for d in facts.twin.deviations:
        assert d.name in text
        assert f"{d.origin}: " in text
    assert "Paths of the head as built" in text
    assert np.array_equal(performance.path_of(facts), facts.as_built.robots.trajectory)
    plain = dataclasses.replace(facts, as_built=None)
    assert performance.path_of(plain) is facts.evaluation.trajectory


def test_a_module_is_accepted_by_what_the_built_one_measures(robots):
    built = robots[10].built
    made, published = ({d.nodes: d for d in contraction(9, b)} for b in (built, PUBLISHED))
    both = set(made) & set(published)
    assert both
    # the limiter makes what is built contract as what was simulated
    assert all(abs(published[n].contracted - made[n].contracted) < published[n].tolerance / 2 for n in both)
    # without one a stiff module's lines are stretched beyond the simulated limit
    bare = {d.nodes: d for d in contraction(9, dataclasses.replace(built, line_limit=0.0))}
    both = set(bare) & set(published)
    assert both
    assert all(published[n].contracted - bare[n].contracted > 0.002 for n in both)


def test_a_module_is_told_from_a_stiffer_one_by_what_the_sheet_asks_for(robots, texts):
    for n, facts in robots.items():
        for level in set(facts.morphology.stiffness_levels):
            wanted = expected(level)
            grams = f"{1000 * pull(level) / 9.81:.0f}"
            assert re.search(rf"{grams} {1000 * wanted.stretch:.1f} ± {100 * wanted.stretch:.1f}", texts[n])
        assert f"{1000 * wanted.spans.mean():.1f} mm, ± {1000 * SPAN:.1f} mm" in texts[n]


def test_feet_are_on_the_sheet_of_a_robot_that_wears_some(robots, materials, texts):
    facts = robots[10]
    assert len(facts.feet.feet) > 8
    for foot in facts.feet.feet:
        where = f"{foot.number} {facts.module_name(foot.module)} {foot.node} {foot.part} {foot.clock}°"
        assert where in texts[10]
    assert "Nobody has measured these feet yet" in texts[10]
    for (forward, backward), scores in facts.as_built.pairs.items():
        assert f"{forward:g} {backward:g} {100 * scores.mean:.1f}".replace("-", "−") in texts[10]
    assert f"Put its {len(facts.feet.feet)} feet on" in texts[10]
    assert "Friction of the feet assumed" in texts[10]
    for text in ("Feet that grip one way", "feet on", "Friction of the feet"):
        assert text not in texts[2]


def test_measured_feet_are_named(robots, materials):
    tested = dataclasses.replace(materials, feet_test=FeetTest(forward=(20.0, 22.0), backward=(35.0, 40.0)))
    paper = style.PAPERS["a4"]
    story = feet.pages(robots[10], tested, paper)
    text = read(typeset(story, paper=paper, title="", running="", date="")[0])
    assert "0.38 ± 0.03 forward, 0.77 ± 0.10 backward" in text
    assert "Nobody has measured" not in text


def test_the_tags_are_printed_at_their_size(robots, texts):
    facts = robots[2]
    paper = style.PAPERS["a4"]
    boxes = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Pen, "box", lambda _self, _x, _y, w, h, **_: boxes.append((w, h)))
        typeset(steering.pages(facts, paper), paper=paper, title="", running="", date="")
    squares = []
    for marker in (HEAD, TARGET):
        side = 1000 * marker.side * 72 / 25.4
        cell = side / N_CELLS
        squares += [(side, side), *[(cell, cell)] * int((~marker.black()).sum())]
    assert np.array(boxes) == pytest.approx(np.array(squares))
    assert "tensatlas drive --port" in texts[2]
    assert f"{1000 * steering.head_point():.0f} mm ahead of the module" in texts[2]
