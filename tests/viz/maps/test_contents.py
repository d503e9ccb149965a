from __future__ import annotations

import dataclasses
from xml.etree import ElementTree

import pytest
from hypothesis import given
from hypothesis import strategies as st

from engine.body.morphology import Morphology
from engine.errors import InvalidData, RunFileError
from engine.search.archive import cell_name
from engine.search.axes import Axis, body_cell
from engine.storage.reader import RunReader
from viz import words
from viz.maps import axis_labels
from viz.maps.coloring import FITNESS, by_age, by_number, by_visits
from viz.maps.contents import Content, ShownElite, load_contents
from viz.maps.layouts import BY_BODY, NESTED, ONLY, PROJECTED, layouts
from viz.maps.map_pictures import outer_cell, pictures
from viz.maps.scale import Palette

BODY = (Axis("modules", 1.5, 10.5, 9), Axis("stiffness", 0.05, 1.05, 10))
PCA = (Axis("PCA 1", -4.5, 4.5, 9), Axis("PCA 2", -5.0, 5.0, 10))
PER_MODULE = (BODY[0], Axis("softest", 0.05, 1.05, 10), Axis("stiffest", 0.05, 1.05, 10))


def elite(number: int, f_s: float, generation: int = 0) -> ShownElite:
    return ShownElite(number, f_s, generation, Morphology(4, (1, 2, 3)))


GRID = Content(
    (*BODY, *PCA),
    {
        (1, 3, 0, 0): elite(1, 2.0),
        (1, 3, 4, 4): elite(2, 5.0, 6),  # the best of its body, and of all
        (1, 5, 4, 4): elite(3, 3.0, 2),  # of the same behaviour as 2
        (8, 9, 0, 0): elite(4, 2.5),
    },
)


def test_contents_are_what_the_file_holds(small_reader: RunReader) -> None:
    for generation in small_reader.generations():
        contents = load_contents(small_reader, generation)
        assert set(contents) == {"morphology", "controller"}
        for name, content in contents.items():
            held = small_reader.contents(name, generation.number)
            assert set(content.elites) == set(held)
            for cell, found in content.elites.items():
                fitness = held[cell].fitness
                assert fitness is not None
                assert found.f_s == pytest.approx(45.0 - 100 * fitness)
                assert f"robot {held[cell].solution.number}," in found.hint


def test_a_cell_outside_its_map_is_damage(small_reader: RunReader) -> None:
    last = small_reader.generations()[-1]
    figures = dict(last.archives)
    figures["morphology"] = dataclasses.replace(figures["morphology"], axes=(*BODY, *PCA))
    with pytest.raises(RunFileError, match="outside a map"):
        load_contents(small_reader, dataclasses.replace(last, archives=figures))


def test_each_kind_of_archive_has_its_ways_to_be_seen() -> None:
    def names(archives: dict[str, tuple[Axis, ...]]) -> dict[str, list[str]]:
        return {layout: [v.name for v in views] for layout, views in layouts(archives).items()}

    assert names({"morphology": BODY, "controller": PCA}) == {ONLY: ["morphology", "controller"]}
    assert names({"morphology": BODY}) == {ONLY: ["morphology"]}
    assert names({"grid": GRID.axes}) == {
        PROJECTED: ["grid-01", "grid-23"],
        BY_BODY: ["grid-01", "grid-section"],
        NESTED: ["grid-nested", "grid-section"],
    }
    assert names({"morphology": PER_MODULE, "controller": PCA}) == {
        PROJECTED: ["morphology-01", "morphology-02", "controller"],
        NESTED: ["morphology-nested", "controller"],
    }
    assert names({"line": BODY[:1]}) == {}


def test_hand_worked_pictures_of_a_grid() -> None:
    bodies, behaviours = pictures({"grid": GRID}, layouts({"grid": GRID.axes})[PROJECTED], FITNESS)
    assert {c: e.number for c, e in bodies.elites.items()} == {(1, 3): 2, (1, 5): 3, (8, 9): 4}
    assert bodies.sources[1, 3] == (1, 3, 4, 4)
    assert {c: e.number for c, e in behaviours.elites.items()} == {(0, 0): 4, (4, 4): 2}
    assert bodies.title == "Morphology map, projected"
    assert behaviours.title == "Controller map, projected"
    assert bodies.figures == "3 cells, 3% · QD score 10 cm"  # of 90; 5 + 3 + 2.5
    assert bodies.scale == behaviours.scale
    assert (bodies.scale.low, bodies.scale.high) == (2.0, 5.0)


def test_hover_cards_say_what_to_expect_below_what_was_recorded() -> None:
    ways = layouts({"grid": GRID.axes})[PROJECTED]
    bodies, _ = pictures({"grid": GRID}, ways, FITNESS, robust={2: -1.25})
    first, second, *_ = bodies.tiles[1, 3].hint.split("\n")
    assert first == "5.0 cm closer · f_s 5.00 cm"
    assert second == "1.2 cm farther under fresh noise"
    assert "noise" not in bodies.tiles[1, 5].hint


def test_coverage_is_over_the_cells_that_can_be_filled() -> None:
    half = Content(PER_MODULE, {(0, 1, 2): elite(1, 1.0)}, coverage=0.5)
    ways = layouts({"morphology": PER_MODULE})
    assert pictures({"morphology": half}, ways[NESTED], FITNESS)[0].figures.startswith("1 cell, 50%")
    assert pictures({"morphology": half}, ways[PROJECTED], FITNESS)[0].figures.startswith("1 cell, 1%")


def test_a_section_lies_within_the_body_of_the_chosen_robot_or_of_the_best() -> None:
    views = layouts({"grid": GRID.axes})[BY_BODY]
    _, inner = pictures({"grid": GRID}, views, FITNESS)
    assert inner.outer == (1, 3)
    assert {c: e.number for c, e in inner.elites.items()} == {(0, 0): 1, (4, 4): 2}
    assert inner.title == "Within 3 modules, relative stiffness 0.4 (46 N/m)"
    _, inner = pictures({"grid": GRID}, views, FITNESS, chosen=4)
    assert (inner.outer, list(inner.elites)) == ((8, 9), [(0, 0)])
    assert outer_cell(Content(GRID.axes, {}), 4) is None
    empty = pictures({"grid": Content(GRID.axes, {})}, views, FITNESS)
    assert [len(p.elites) for p in empty] == [0, 0]


def test_the_chosen_robot_is_marked_wherever_it_lies() -> None:
    ways = layouts({"grid": GRID.axes})
    drawn = {
        p.view.name: p for way in ways.values() for p in pictures({"grid": GRID}, way, FITNESS, chosen=1)
    }
    marks = {name: p.ring(GRID.cell_of(1), linked=False) for name, p in drawn.items()}
    found = {name: (r.cell, r.covered) for name, r in marks.items() if r is not None}
    assert found == {
        "grid-01": ((1, 3), True),  # shows robot 2
        "grid-23": ((0, 0), True),  # shows robot 4
        "grid-section": ((0, 0), False),
        "grid-nested": ((1, 3, 0, 0), False),
    }
    assert drawn["grid-section"].ring(GRID.cell_of(4), linked=False) is None  # another body's
    assert drawn["grid-01"].ring(None, linked=False) is None


def test_newly_won_cells_are_fresh_and_after_new_axes_newly_come_robots_but_not_within_another_body() -> None:
    views = layouts({"grid": GRID.axes})[BY_BODY]
    before = pictures({"grid": GRID}, views, FITNESS)
    won = Content(GRID.axes, {**GRID.elites, (1, 3, 4, 4): elite(9, 6.0, 7), (2, 2, 2, 2): elite(8, 1.0)})
    fresh = [p.fresh for p in pictures({"grid": won}, views, FITNESS, before=before)]
    assert fresh == [{(1, 3), (2, 2)}, {(4, 4)}]
    elsewhere = pictures({"grid": won}, views, FITNESS, chosen=4, before=before)
    assert [p.fresh for p in elsewhere] == [{(1, 3), (2, 2)}, frozenset()]
    moved = Content((*BODY, Axis("PCA 1", 0.0, 9.0, 9), PCA[1]), won.elites)
    assert [p.fresh for p in pictures({"grid": moved}, views, FITNESS, before=before)][1] == {(4, 4)}
    assert all(not p.fresh for p in before)


def test_colours_by_age_and_by_a_table_of_numbers() -> None:
    views = layouts({"grid": GRID.axes})[PROJECTED]
    bodies, _ = pictures({"grid": GRID}, views, by_age(7))  # those found last are the youngest
    assert bodies.values == {(1, 3): 1.0, (1, 5): 5.0, (8, 9): 7.0}
    assert (bodies.scale.low, bodies.scale.high, bodies.scale.title) == (0.0, 7.0, "age, gen.")
    assert bodies.tiles[1, 3].hint.endswith("found 1 generation ago")
    robust = by_number({2: 1.5, 1: 9.0}, "robust f_s cm")
    bodies, _ = pictures({"grid": GRID}, views, robust)
    assert bodies.values == {(1, 3): 1.5}  # the others are grey
    assert bodies.tiles[1, 3].hint.endswith("robust f_s 1.50 cm")
    assert "robust" not in bodies.tiles[1, 5].hint
    # a map of which nothing is known is grey, and says why
    bodies, _ = pictures({"grid": GRID}, views, by_number({}, "robust f_s cm"))
    assert (bodies.scale.title, bodies.values) == ("robust f_s cm", {})
    assert bodies.figures == "none of these was evaluated again"


def test_visits_count_the_evaluations_of_a_body(small_reader: RunReader) -> None:
    generations = small_reader.generations()
    for g in (generations[0], generations[-1]):
        contents = load_contents(small_reader, g)
        ways = layouts({name: c.axes for name, c in contents.items()})
        bodies, behaviours = pictures(contents, ways[ONLY], by_visits(small_reader, g.number))
        # every evaluation that did not fail fell into a cell that has been filled since
        assert sum(bodies.values.values()) == g.n_evaluations - g.n_failed
        assert min(bodies.values.values()) >= 1
        assert (behaviours.scale.title, behaviours.values) == ("visits", {})  # not known for trajectories
        assert "by body only" in behaviours.figures


@given(st.integers(2, 10), st.integers(1, 10))
def test_a_body_lies_in_the_cell_that_is_labelled_with_it(n_modules: int, level: int) -> None:
    cell = body_cell(BODY, Morphology(level, (1,) * n_modules))
    assert (cell[0] + 0.5, str(n_modules)) in axis_labels.ticks(BODY[0])
    assert (cell[1] + 0.5, f"{level / 10:.1f}") in axis_labels.ticks(BODY[1])
    stiffness = axis_labels.newtons_per_metre(BODY[1])
    assert stiffness is not None
    assert stiffness[cell[1]] == (cell[1] + 0.5, f"{11.52 * level:.0f}")


@given(st.floats(-500, 500), st.floats(0.1, 1000), st.integers(1, 200))
def test_an_axis_of_the_trajectory_says_its_bounds_in_a_few_labels(low: float, span: float, n: int) -> None:
    ticks = axis_labels.ticks(Axis("PCA 1", low, low + span, n))
    assert (ticks[0][0], ticks[-1][0]) == (0, n)
    assert 2 <= len(ticks) <= axis_labels.MAX_BOUNDS
    for text, bound in ((ticks[0][1], low), (ticks[-1][1], low + span)):
        assert float(text) == pytest.approx(bound, abs=0.5 if span >= 30 else 0.0501)
        assert text not in ("-0", "-0.0")


def test_cells_are_named_by_what_they_stand_for() -> None:
    assert axis_labels.describe(BODY, (0, 9)) == "2 modules, relative stiffness 1.0 (115 N/m)"
    assert axis_labels.describe(PCA, (4, 0)) == "PCA 1 -0.5 to 0.5, PCA 2 -5.0 to -4.0"
    assert axis_labels.is_body(PER_MODULE)
    assert not axis_labels.is_body(GRID.axes)
    with pytest.raises(InvalidData, match="outside"):
        body_cell((Axis("modules", 1.5, 3.5, 2),), Morphology(1, (1,) * 9))


def test_every_archive_has_a_scale_of_its_own() -> None:
    far = Content(GRID.axes, {cell: elite(e.number, 10 * e.f_s) for cell, e in GRID.elites.items()})
    contents = {"near": GRID, "far": far}
    views = [v for name in contents for v in layouts({name: GRID.axes})[PROJECTED]]
    shown = pictures(contents, views, FITNESS)
    scales = {
        name: {(p.scale.low, p.scale.high) for p in shown if p.view.archive == name} for name in contents
    }
    assert {len(s) for s in scales.values()} == {1}
    alone = pictures({"near": GRID}, [v for v in views if v.archive == "near"], FITNESS)
    assert scales["near"] == {(p.scale.low, p.scale.high) for p in alone}
    assert max(scales["far"]) > max(scales["near"])
    fixed = pictures(contents, views, FITNESS, palette=Palette(limits=(-1.0, 4.0)))
    assert {(p.scale.low, p.scale.high) for p in fixed} == {(-1.0, 4.0)}


def test_who_lies_still_is_pale_and_cards_say_so_in_words(small_reader: RunReader) -> None:
    content = load_contents(small_reader, small_reader.generations()[-1])["morphology"]
    view = layouts({"morphology": content.axes})[ONLY]
    (picture,) = pictures({"morphology": content}, view, FITNESS)
    svg = ElementTree.fromstring(picture.render(None, "go()"))
    seen = set()
    for cell, found in content.elites.items():
        (drawn,) = (g for g in svg.iter("g") if g.get("data-c") == f"morphology:{cell_name(cell)}")
        kinds = (drawn[0].get("class") or "").split()
        assert ("z" in kinds) == found.lies_still == (abs(found.f_s) < 0.79) == ("lies still" in found.hint)
        assert drawn.get("data-b") == "".join(map(str, found.morphology.faces))
        seen.add(words.gained(found.f_s, found.still_below).split()[-1])
    assert seen <= {"still", "closer", "farther"}


def test_what_is_gained_in_words() -> None:
    said = [words.gained(f_s, 0.79) for f_s in (6.41, 0.8, 0.78, 0.0, -0.78, -5.12)]
    assert said == ["6.4 cm closer", "0.8 cm closer", *["lies still"] * 3, "5.1 cm farther"]
