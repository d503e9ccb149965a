from __future__ import annotations

import math
import re
from xml.etree import ElementTree

import pytest
from hypothesis import given
from hypothesis import strategies as st

from viz import theme
from viz.maps.scale import STEPS, Palette, Scale, bar, color_limits, count_scale, fitness_scale


@given(st.lists(st.floats(-100, 100), min_size=1))
def test_limits_hold_the_best_and_all_but_a_few_of_the_worst(values: list[float]) -> None:
    low, high = color_limits(values)
    assert high >= max(values)
    assert low <= sorted(values)[math.ceil(0.05 * (len(values) - 1))]
    assert high - low >= 1


def test_one_runaway_does_not_take_the_colours_from_the_others() -> None:
    scale = fitness_scale([*(k / 20 for k in range(100)), -300.0])
    assert (scale.low, scale.high, scale.below) == (0.0, 5.0, True)
    assert scale.ticks()[0.0] == "≤0"
    assert not fitness_scale([0.0, 5.0]).below


def test_scales_of_nothing() -> None:
    assert (fitness_scale([]).low, fitness_scale([]).high) == (0.0, 1.0)
    assert (count_scale([], "n").low, count_scale([], "n").high) == (0.0, 1.0)


@pytest.mark.parametrize(("value", "step"), [(-1e9, 0), (1e9, STEPS - 1), (0.5, (STEPS - 1) // 2)])
def test_values_beyond_the_scale_take_its_end(value: float, step: int) -> None:
    scale = Scale("x", 0.0, 1.0)
    assert scale.step(value) == step
    assert re.fullmatch("#[0-9a-f]{6}", scale.color(value))


def test_counts_are_labelled_with_whole_numbers_at_their_places() -> None:
    ticks = count_scale([1.0] * 60 + [15.0] * 40 + [900.0], "visits").ticks()
    assert ticks == {0.0: "0", 4 / 15: "4", 8 / 15: "8", 11 / 15: "11", 1.0: "≥15"}
    assert Scale("gen.", 0.0, 1.0, whole=True).ticks() == {0.0: "0", 1.0: "1"}


def test_a_bar_runs_upwards_or_to_the_right() -> None:
    for width, height, end in ((12, 200, "up"), (200, 8, "right")):
        drawn = ElementTree.fromstring(f"<svg>{bar(Scale('x', 0.0, 1.0), 0, 0, width, height)}</svg>")
        stops = [s.attrib["stop-color"] for s in drawn.iter("stop")]
        assert (stops[0], stops[-1]) == ("#440154", "#fde725")
        gradient = drawn.find("linearGradient")
        assert gradient is not None
        assert gradient.attrib["id"].endswith(end)
        assert (gradient.attrib["y1"], gradient.attrib["x2"]) == (("1", "0") if end == "up" else ("0", "1"))


def test_a_title_is_escaped_and_has_its_subscript() -> None:
    text = ElementTree.fromstring(f"<text>{Scale('robust f_s < cm', 0.0, 1.0).title_markup()}</text>")
    assert "".join(text.itertext()) == "robust fs < cm"
    assert [t.text for t in text.iter("tspan")] == ["s", " < cm"]


def test_a_palette_changes_colours_and_the_ends_of_lengths_alone() -> None:
    palette = Palette("cividis", (-5.0, 3.0))
    scale = palette.apply(fitness_scale([0.0, 6.0]), [-6.0, 6.0], lengths=True)
    assert (scale.low, scale.high, scale.colormap) == (-5.0, 3.0, "cividis")
    assert (scale.below, scale.above) == (True, True)
    assert scale.color(9.0) == scale.color(3.0) != Scale("f_s cm", -5.0, 3.0).color(3.0)
    counts = palette.apply(count_scale([4.0], "visits"), [4.0], lengths=False)
    assert (counts.low, counts.high, counts.whole) == (0.0, 4.0, True)
    assert (counts.below, counts.above) == (False, False)


@given(st.floats(-50.0, -0.5), st.floats(0.5, 50.0))
def test_0_is_the_grey_middle_where_values_lie_on_both_sides_of_it(low: float, high: float) -> None:
    scale = Scale("f_s cm", low, high, signed=True)
    assert scale.color(0.0) == theme.STILL
    assert scale.color(high) == Scale("f_s cm", 0.0, high).color(high)
    assert len({scale.color(v) for v in (low, low / 2, 0.0, high / 2, high)}) == 5
    for part in (0.0, 0.2, 0.5, 0.9, 1.0):
        assert scale.part(scale.value(part)) == pytest.approx(part)
    assert scale.ticks()[0.5] == "0"


def test_values_on_one_side_of_0_have_all_colours() -> None:
    for low, high in ((0.0, 3.0), (-3.0, 0.0), (1.0, 2.0)):
        signed, plain = Scale("f_s cm", low, high, signed=True), Scale("f_s cm", low, high)
        assert [signed.color(low), signed.color(high)] == [plain.color(low), plain.color(high)]


def test_the_bar_has_the_colours_of_the_cells() -> None:
    scale = Scale("f_s cm", -4.0, 2.0, signed=True, colormap="cividis")
    drawn = ElementTree.fromstring(f"<svg>{bar(scale, 0, 0, 12, 200)}</svg>")
    stops = [s.attrib["stop-color"] for s in drawn.iter("stop")]
    assert [stops[0], stops[len(stops) // 2], stops[-1]] == [scale.color(v) for v in (-4.0, 0.0, 2.0)]
