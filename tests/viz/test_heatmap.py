from __future__ import annotations

import dataclasses
import math
import re
from xml.etree import ElementTree

import pytest
from hypothesis import given
from hypothesis import strategies as st

from engine.algorithms.base import Axis
from viz import heatmap
from viz.heatmap import Heatmap, Tile, color_limits, describe_cell, render, with_fresh

AXES = (Axis("modules", 1.5, 10.5, 9), Axis("stiffness", 0.05, 1.05, 10))


def draw(**changes: object) -> ElementTree.Element:
    defaults: dict = {
        "name": "morphology",
        "axes": AXES,
        "tiles": {(0, 0): Tile(-2.0, "worst", 7), (8, 9): Tile(6.0, "best", 7)},
        "limits": (-2.0, 6.0),
    }
    return ElementTree.fromstring(render(Heatmap(**(defaults | changes)), "go()"))


def cells(svg: ElementTree.Element) -> dict[str, ElementTree.Element]:
    return {g.attrib["data-c"]: g for g in svg.iter("g") if "data-c" in g.attrib}


def test_every_cell_can_be_clicked_and_says_whether_it_is_filled() -> None:
    drawn = cells(draw())
    assert len(drawn) == 90
    filled = {name for name, g in drawn.items() if g.attrib["data-filled"] == "1"}
    assert filled == {"morphology:0,0", "morphology:8,9"}


def test_modules_grow_to_the_right_and_stiffness_upwards() -> None:
    def corner(name: str) -> tuple[float, float]:
        rect = cells(draw())[name].find("rect")
        assert rect is not None
        return float(rect.attrib["x"]), float(rect.attrib["y"])

    assert corner("morphology:1,0")[0] > corner("morphology:0,0")[0]
    assert corner("morphology:0,1")[1] < corner("morphology:0,0")[1]


def test_empty_cells_are_dashed_and_filled_ones_take_the_ends_of_the_colour_scale() -> None:
    drawn = cells(draw())
    empty, low, high = (drawn[f"morphology:{c}"].find("rect") for c in ("4,4", "0,0", "8,9"))
    assert empty is not None
    assert low is not None
    assert high is not None
    assert "stroke-dasharray" in empty.attrib
    assert low.attrib["fill"] == "#440154"  # viridis from end to end
    assert high.attrib["fill"] == "#fde725"


def test_the_selection_is_ringed() -> None:
    rings = [r for r in draw(selected=(0, 0), linked=(8, 9)).iter("rect") if r.get("fill") == "none"]
    assert len(rings) == 2
    assert len({r.get("stroke") for r in rings}) == 2


def test_hints_and_names_cannot_inject_markup() -> None:
    svg = draw(tiles={(0, 0): Tile(0.0, '<script>alert("x")</script>', 7)}, name='m" onload="x')
    titles = [t.text for t in svg.iter("title")]
    assert '<script>alert("x")</script>' in titles
    assert not list(svg.iter("script"))
    assert "onload" not in svg.attrib


def test_stiffness_axis_is_labelled_in_tenths() -> None:
    texts = {t.text for t in draw().iter("text")}
    assert {"0.1", "0.5", "1.0", "2", "10", "modules", "relative stiffness"} <= texts


@given(st.lists(st.floats(-100, 100), min_size=1))
def test_color_limits_hold_the_best_and_all_but_a_few_of_the_worst(values: list[float]) -> None:
    low, high = color_limits(values)
    assert high >= max(values)
    assert low <= sorted(values)[math.ceil(0.05 * (len(values) - 1))]
    assert high - low >= 1


def test_one_runaway_does_not_take_the_colours_from_the_others() -> None:
    values = [*(k / 20 for k in range(100)), -300.0]
    assert color_limits(values) == (0.0, 5.0)
    labels = [t.text for t in draw(tiles={(0, 0): Tile(-9.0, "", 7)}, limits=(-2.0, 6.0)).iter("text")]
    assert "≤-2" in labels
    assert "≤-2" not in [t.text for t in draw().iter("text")]


def test_color_limits_of_nothing() -> None:
    assert color_limits([]) == (0.0, 1.0)


@pytest.mark.parametrize("value", [-1e9, 1e9])
def test_values_beyond_the_scale_take_its_end(value: float) -> None:
    color = heatmap._color(value, (0.0, 1.0), "viridis")
    assert re.fullmatch("#[0-9a-f]{6}", color)


def test_newly_won_cells_are_marked_but_not_after_new_axes() -> None:
    before = Heatmap(
        name="m", axes=AXES, tiles={(0, 0): Tile(1.0, "a", 7), (1, 1): Tile(2.0, "b", 7)}, limits=(0, 3)
    )
    after = dataclasses.replace(
        before, tiles={(0, 0): Tile(1.5, "c", 7), (1, 1): Tile(2.0, "b", 7), (2, 2): Tile(0, "", 7)}
    )
    assert with_fresh(after, before).fresh == {(0, 0), (2, 2)}
    moved = dataclasses.replace(after, axes=(Axis("PCA 1", 0.0, 1.0, 9), AXES[1]))
    assert with_fresh(moved, before).fresh == frozenset()
    assert with_fresh(after, None).fresh == frozenset()


def test_a_cell_is_named_by_what_it_stands_for() -> None:
    heatmap = Heatmap(name="m", axes=AXES, tiles={}, limits=(0, 1))
    assert describe_cell(heatmap, (0, 9)) == "modules 2 and stiffness 1.0"
