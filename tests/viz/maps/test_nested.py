from __future__ import annotations

import json
import re
from xml.etree import ElementTree

import pytest

from engine.search.archive import Cell
from engine.search.axes import Axis
from viz.maps.map_parts import Ring, Tile
from viz.maps.nested import MARK, Geometry, NestedMap, render, ring_style
from viz.maps.scale import Scale

GRID = (
    Axis("modules", 1.5, 10.5, 9),
    Axis("stiffness", 0.05, 1.05, 10),
    Axis("PCA 1", -4.0, 4.0, 9),
    Axis("PCA 2", -4.0, 4.0, 10),
)
PER_MODULE = (GRID[0], Axis("softest", 0.05, 1.05, 10), Axis("stiffest", 0.05, 1.05, 10))


def nested(axes: tuple[Axis, ...], cells: dict[Cell, float], **changes: object) -> NestedMap:
    tiles = {c: Tile(f"f_s {v:.2f} cm\nrobot {k}, <b>", k) for k, (c, v) in enumerate(cells.items())}
    fields: dict = {"name": "grid-nested", "scale": Scale("f_s cm", 0.0, 4.0)}
    return NestedMap(axes=axes, tiles=tiles, values=cells, **(fields | changes))


def table(svg: ElementTree.Element) -> dict[Cell, tuple[tuple[int, int], str]]:
    """Read the table of cells as the page does: corners and hover cards."""
    hints = json.loads(svg.attrib["data-hints"])
    found = {}
    for row in filter(None, svg.attrib["data-cells"].split(";")):
        x, y, cell, kind, numbers, _body, robot = row.split(",")
        rest = iter(numbers.split(" "))
        hint = re.sub(MARK, lambda _, rest=rest: next(rest), hints[int(kind)])
        assert f"robot {robot}," in hint
        found[tuple(map(int, cell.split(".")))] = ((int(x), int(y)), hint)
    return found


def test_a_hand_worked_grid_lies_in_a_grid() -> None:
    # 9 columns of maps of 9 cells, each 4 wide, 3 apart; 10 rows of maps of 10 cells, each 3 high
    g = Geometry.of((9, 10, 9, 10))
    assert (g.cell, g.step, g.columns, g.rows) == ((4, 3), (39, 33), 9, 10)
    assert g.corner((0, 9, 0, 9)) == (66, 14)  # the upper left one
    assert g.corner((0, 9, 1, 8)) == (70, 17)
    assert g.corner((1, 9, 0, 9)) == (105, 14)
    assert g.corner((0, 0, 0, 0)) == (66, 14 + 9 * 33 + 9 * 3)  # the lower left one
    assert g.bottom == 14 + 9 * 33 + 30


def test_a_hand_worked_archive_of_three_axes_lies_in_three_columns_of_maps() -> None:
    g = Geometry.of((9, 10, 10))
    assert (g.columns, g.rows, len(g.outer_cells())) == (3, 3, 9)
    width, height = g.cell
    assert g.outer_corner((4,)) == (66 + 10 * width + 14, 26 + 10 * height + 14 + 12)
    assert g.corner((4, 2, 9)) == (g.outer_corner((4,))[0] + 2 * width, g.outer_corner((4,))[1])


@pytest.mark.parametrize("shape", [(9, 10, 9, 10), (9, 10, 10), (2, 3, 4, 5), (1, 1, 1), (200, 3, 3)])
def test_cells_do_not_overlap(shape: tuple[int, ...]) -> None:
    g = Geometry.of(shape)
    inner = [(i, j) for i in range(shape[-2]) for j in range(shape[-1])]
    corners = [g.corner((*outer, *cell)) for outer in g.outer_cells() for cell in inner]
    assert len(set(corners)) == len(corners)
    rows = {y for _, y in corners}
    assert all(b - a >= g.cell[1] for a, b in zip(sorted(rows), sorted(rows)[1:], strict=False))


def test_only_filled_cells_are_drawn_in_paths_of_one_colour_each() -> None:
    cells: dict[Cell, float] = {(0, 9, 0, 9): 0.0, (0, 9, 1, 8): 4.0, (8, 0, 8, 0): 4.0}
    svg = ElementTree.fromstring(render(nested(GRID, cells), "go()"))
    paths = {p.attrib["fill"]: p.attrib["d"] for p in svg.iter("path") if "fill" in p.attrib}
    assert paths["#440154"] == "M66 14h4v3h-4z"
    assert paths["#fde725"].startswith("M70 17h4v3h-4zM")
    assert len(paths) == 2
    frames = {p.attrib["class"]: p.attrib["d"].count("M") for p in svg.iter("path") if "class" in p.attrib}
    assert frames == {"o": 2, "e": 88}


def test_the_table_has_every_cell_with_its_place_and_its_hover_card() -> None:
    cells: dict[Cell, float] = {(0, 9, 1, 8): -1.25, (3, 0, 2, 2): 3.5}
    found = table(ElementTree.fromstring(render(nested(GRID, cells), "go()")))
    assert found == {
        (0, 9, 1, 8): ((70, 17), "f_s -1.25 cm\nrobot 0, <b>"),
        (3, 0, 2, 2): ((66 + 3 * 39 + 8, 14 + 9 * 33 + 7 * 3), "f_s 3.50 cm\nrobot 1, <b>"),
    }


def test_an_empty_archive_can_be_drawn() -> None:
    for axes in (GRID, PER_MODULE):
        assert table(ElementTree.fromstring(render(nested(axes, {}), "go()"))) == {}


def test_three_axes_say_which_map_is_which() -> None:
    svg = ElementTree.fromstring(render(nested(PER_MODULE, {(0, 1, 2): 1.0}), "go()"))
    texts = {t.text for t in svg.iter("text")}
    assert {f"{n} modules" for n in range(2, 11)} | {"softest module", "stiffest module"} <= texts


def test_no_room_is_drawn_for_a_softest_module_that_is_stiffer_than_the_stiffest() -> None:
    axes = (PER_MODULE[0], *(Axis(name, 0.05, 0.25, 2) for name in ("softest", "stiffest")))
    svg = ElementTree.fromstring(render(nested(axes, {}), "go()"))
    (frames,) = [p.attrib["d"] for p in svg.iter("path")]
    width, height = Geometry.of((9, 2, 2)).cell
    step = f"v{height}h-{width}"
    assert frames.startswith(f"M66 26h{2 * width}{step}{step}zM")


def test_four_axes_say_what_lies_within_a_map() -> None:
    svg = ElementTree.fromstring(render(nested(GRID, {}), "go()"))
    texts = {t.text for t in svg.iter("text")}
    assert {"modules", "relative stiffness", "in each: PCA 1 → · PCA 2 ↑"} <= texts


def test_thousands_of_cells_make_a_small_picture() -> None:
    cells: dict[Cell, float] = {
        (i, j, k, m): (i + j + k + m) / 9
        for i in range(9)
        for j in range(10)
        for k in range(9)
        for m in range(3)
    }
    assert len(cells) == 2430
    assert len(render(nested(GRID, cells), "go()")) < 70 * len(cells)


def test_fresh_cells_flash_apart_from_the_others() -> None:
    cells: dict[Cell, float] = {(0, 9, 0, 9): 4.0, (0, 9, 1, 8): 4.0}
    svg = ElementTree.fromstring(render(nested(GRID, cells, fresh=frozenset({(0, 9, 1, 8)})), "go()"))
    assert [p.attrib["d"] for p in svg.iter("path") if p.get("class") == "f"] == ["M70 17h4v3h-4z"]


def test_the_ring_is_moved_by_a_style_of_its_own() -> None:
    grid = nested(GRID, {(0, 9, 1, 8): 1.0})
    style = ring_style(grid, Ring((0, 9, 1, 8)))
    assert "translate(70px,17px)" in style
    assert "translate(66px,14px)" in style  # the map that it lies in
    assert len(style) < 400
    assert ring_style(grid, None) == ""


def test_names_cannot_inject_markup() -> None:
    evil = '"]{}</style><script>alert(1)</script>'
    grid = nested((Axis("</text><script>", 0, 1, 2), *GRID[1:]), {(0, 9, 1, 8): 1.0}, name=evil)
    svg = ElementTree.fromstring(render(grid, "go()"))
    assert not list(svg.iter("script"))
    assert svg.attrib["data-map"] == evil
    style = ElementTree.fromstring(ring_style(grid, Ring((0, 9, 1, 8))))
    assert not list(style)  # a single style element
