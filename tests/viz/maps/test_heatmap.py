from __future__ import annotations

from xml.etree import ElementTree

import pytest

from engine.search.axes import Axis
from viz.maps.heatmap import Heatmap, render
from viz.maps.map_parts import LEFT, Ring, Tile
from viz.maps.scale import NO_VALUE, Scale

AXES = (Axis("modules", 1.5, 10.5, 9), Axis("stiffness", 0.05, 1.05, 10))


def draw(**changes: object) -> ElementTree.Element:
    defaults: dict = {
        "name": "morphology",
        "axes": AXES,
        "tiles": {(0, 0): Tile("worst", 7), (8, 9): Tile("best", 8)},
        "values": {(0, 0): -2.0, (8, 9): 6.0},
        "scale": Scale("f_s cm", -2.0, 6.0),
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
    assert empty.attrib["class"] == "e"
    assert low.attrib["fill"] == "#440154"  # viridis from end to end
    assert high.attrib["fill"] == "#fde725"


def test_a_filled_cell_without_a_value_is_grey_and_can_still_be_clicked() -> None:
    cell = cells(draw(values={(8, 9): 6.0}))["morphology:0,0"]
    rect = cell.find("rect")
    assert rect is not None
    assert rect.attrib["fill"] == NO_VALUE
    assert cell.attrib["data-filled"] == "1"


def test_the_chosen_robot_is_ringed_and_dashed_where_a_better_one_covers_it() -> None:
    def ring(**kind: bool) -> dict[str, str]:
        rings = [r for r in draw(ring=Ring((3, 2), **kind)).iter("rect") if r.get("class") == "ta-ring"]
        assert len(rings) == 1
        assert float(rings[0].attrib["x"]) == LEFT + 3 * 30 - 0.75
        return rings[0].attrib

    assert ring()["stroke"] != ring(linked=True)["stroke"]
    assert "stroke-dasharray" in ring(covered=True)
    assert "stroke-dasharray" not in ring()
    assert not [r for r in draw().iter("rect") if r.get("class") == "ta-ring"]


def test_hints_and_names_cannot_inject_markup() -> None:
    svg = draw(tiles={(0, 0): Tile('<script>alert("x")</script>', 7)}, name='m" onload="x')
    assert '<script>alert("x")</script>' in [g.get("data-h") for g in svg.iter("g")]
    assert not list(svg.iter("script"))
    assert "onload" not in svg.attrib
    evil = (Axis("<b>", 0.0, 1.0, 2), Axis('"><script>', 0.0, 1.0, 2))
    svg = draw(axes=evil, tiles={}, values={}, scale=Scale("<i>f_s", 0.0, 1.0))
    assert not list(svg.iter("script")) + list(svg.iter("b")) + list(svg.iter("i"))
    assert {"<b>", '"><script>'} <= {t.text for t in svg.iter("text")}


def test_axes_are_labelled_in_their_units() -> None:
    texts = {t.text for t in draw().iter("text")}
    assert {"0.1", "0.5", "1.0", "2", "10", "modules", "relative stiffness"} <= texts
    assert {"N/m", "12", "58", "115"} <= texts  # a tenth to all of 115.2 N/m
    pca = (Axis("PCA 1", -76.6, 67.9, 9), Axis("PCA 2", -4.5, 4.5, 10))
    texts = {t.text for t in draw(axes=pca).iter("text")}
    assert {"-77", "68", "-4.5", "4.5", "PCA 1", "PCA 2"} <= texts  # the bounds of the archive
    assert "N/m" not in texts


def test_the_keyboard_begins_at_the_chosen_robot_or_at_the_best() -> None:
    assert draw().get("data-start") == "8,9"
    assert draw(ring=Ring((0, 0))).get("data-start") == "0,0"
    assert draw(ring=Ring((3, 2))).get("data-start") == "8,9"  # nobody is there
    assert draw(tiles={}, values={}).get("data-start") is None
    assert draw().get("tabindex") == "0"


@pytest.mark.parametrize(("below", "label"), [(True, "≤-2"), (False, "-2")])
def test_the_bar_says_whether_values_lie_below_it(below: bool, label: str) -> None:
    svg = draw(scale=Scale("f_s cm", -2.0, 6.0, below=below))
    assert label in [t.text for t in svg.iter("text")]


def test_fresh_cells_flash() -> None:
    flashing = [r for r in draw(fresh=frozenset({(8, 9)})).iter("rect") if r.get("class") == "f"]
    assert [r.get("fill") for r in flashing] == ["#fde725"]
