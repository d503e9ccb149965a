"""What a browser's maps show, without a browser: the panel is replaced by a list of what it is told."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import pytest
from grid_run import grid_cell
from hypothesis import given
from hypothesis import strategies as st

from app.clicks import _CLICK
from app.map_board import MapBoard
from engine.algorithms.base import Axis
from engine.reader import RunReader
from viz.heatmap import Ring
from viz.pictures import Picture
from viz.views import ONLY, layouts


class Panel:
    """Keeps what it is told to show."""

    def __init__(self) -> None:
        self.offered: tuple[Any, ...] = ()
        self.pictures: dict[str, Picture] = {}
        self.rings: dict[str, Ring | None] = {}

    def offer_views(self, *offered: Any) -> None:
        self.offered = offered

    def show_maps(self, pictures: Sequence[Picture], rings: Sequence[Ring | None]) -> None:
        self.pictures = {p.view.name: p for p in pictures}
        self.rings = {p.view.name: r for p, r in zip(pictures, rings, strict=True)}


@pytest.fixture
def panel() -> Panel:
    return Panel()


@pytest.fixture
def board(panel: Panel, grid_reader: RunReader) -> MapBoard:
    board = MapBoard(panel)  # type: ignore[arg-type]
    board.show(grid_reader, grid_reader.generations()[-1])
    return board


def test_a_click_on_a_projected_cell_hits_the_best_robot_of_it(
    board: MapBoard, panel: Panel, grid_reader: RunReader
) -> None:
    assert panel.offered == (
        ("projected", "body by body", "nested"),
        "projected",
        ("fitness f_s", "age", "visits"),
        "fitness f_s",
    )
    whole = [e for e in grid_reader.all_evaluations() if e.fitness is not None]
    for cell in panel.pictures["grid-23"].elites:
        rivals = [e for e in whole if grid_cell(e)[2:] == cell]
        best = min(rivals, key=lambda e: e.fitness or 0.0)
        picked = board.pick("grid-23", cell)
        assert picked is not None
        assert (picked.archive, picked.number) == ("grid", best.solution.number)
        assert picked.cell == grid_cell(best)
    assert any(len([e for e in whole if grid_cell(e)[2:] == c]) > 1 for c in panel.pictures["grid-23"].elites)


def test_empty_cells_and_cells_that_do_not_exist(board: MapBoard) -> None:
    empty = board.pick("grid-23", (8, 0))
    assert empty is not None
    assert (empty.number, empty.meaning) == (None, "PCA 1 4.0, PCA 2 -4.5")
    for name, cell in (("grid-23", (9, 0)), ("grid-23", (1, 1, 1)), ("grid", (1, 1)), ("grid-nested", (0,))):
        assert board.pick(name, cell) is None


def test_the_chosen_robot_stays_marked_in_every_way_to_see_the_archive(
    board: MapBoard, panel: Panel, grid_reader: RunReader
) -> None:
    last = grid_reader.generations()[-1].number
    cell, number = min(grid_reader.placements("grid", last).items())
    board.choose("grid", number)
    for layout in ("projected", "body by body", "nested"):
        board.set_layout(layout)
        assert all(ring is not None and not ring.linked for ring in panel.rings.values())
    assert panel.rings["grid-nested"] == Ring(cell)
    assert panel.pictures["grid-section"].outer == cell[:2]
    board.set_layout("anything")
    assert list(panel.pictures) == ["grid-01", "grid-23"]


def test_going_on_flashes_what_was_won_and_going_back_does_not(
    board: MapBoard, panel: Panel, grid_reader: RunReader
) -> None:
    first, *_, last = grid_reader.generations()
    board.show(grid_reader, first)
    assert not any(p.fresh for p in panel.pictures.values())
    board.show(grid_reader, last)
    assert any(p.fresh for p in panel.pictures.values())
    assert board.generation == last.number


def test_colours_change_without_changing_what_is_shown(board: MapBoard, panel: Panel) -> None:
    before = panel.pictures["grid-01"]
    board.set_coloring("visits")
    after = panel.pictures["grid-01"]
    assert after.elites == before.elites
    assert after.scale.title == "visits"
    board.set_coloring("no such thing")
    assert panel.pictures["grid-01"].scale == before.scale


@given(st.lists(st.text(max_size=30), min_size=1, max_size=4, unique=True))
def test_clicks_name_every_map_whatever_a_file_calls_its_archives(archives: list[str]) -> None:
    axes = (Axis("a", 0.0, 1.0, 2), Axis("b", 0.0, 1.0, 2))
    names = [v.name for v in layouts(dict.fromkeys(archives, axes))[ONLY]]
    assert len(set(names)) == len(archives)
    assert all(_CLICK.fullmatch(f"{name}:1,2|3") for name in names)
