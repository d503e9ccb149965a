"""What a browser's maps show, without a browser: the panel is replaced by a list of what it is told."""

from __future__ import annotations

import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.gui.click_channel import _CLICK
from app.maps.color_controls import ALL_RUNS, FIXED, ColorWish
from app.maps.map_board import MapBoard
from engine.analysis.robustness import Robustness, robust_path, save_robust
from engine.errors import InvalidData
from engine.search.axes import Axis
from engine.storage.reader import RunReader
from tests.support.evaluated_again import evaluated_again
from tests.support.grid_run import grid_cell
from viz.maps.contents import Content
from viz.maps.layouts import ONLY, layouts
from viz.maps.map_parts import Ring
from viz.maps.map_pictures import MapPicture

ALL = (-20.0, 20.0)
"""A scale for all runs, in cm."""


class Panel:
    """Keeps what it and the user are told."""

    def __init__(self) -> None:
        self.offered: tuple[Any, ...] = ()
        self.pictures: dict[str, MapPicture] = {}
        self.rings: dict[str, Ring | None] = {}
        self.notices: list[tuple[str, str]] = []
        self.least: float | None = None
        self.listed: tuple[set[int], int | None] = (set(), None)
        self.robust: Mapping[int, float] = {}

    def show(self, contents: Mapping[str, Content], chosen: int | None, robust: Mapping[int, float]) -> None:
        self.robust = robust
        self.listed = ({e.number for c in contents.values() for e in c.elites.values()}, chosen)

    def notify(self, title: str, text: str) -> None:
        self.notices.append((title, text))

    def offer_views(self, *offered: Any) -> None:
        self.offered = offered

    def show_maps(self, pictures: Sequence[MapPicture], rings: Sequence[Ring | None]) -> None:
        self.pictures = {p.view.name: p for p in pictures}
        self.rings = {p.view.name: r for p, r in zip(pictures, rings, strict=True)}


@pytest.fixture
def panel() -> Panel:
    return Panel()


def new_board(panel: Panel) -> MapBoard:
    return MapBoard(panel, panel.notify, lambda _reader: ALL, panel)  # type: ignore[arg-type]


@pytest.fixture
def board(panel: Panel, grid_reader: RunReader) -> MapBoard:
    board = new_board(panel)
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
    assert (empty.number, empty.meaning) == (None, "PCA 1 3.5 to 4.5, PCA 2 -5.0 to -4.0")
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
    board.set_colors(ColorWish("visits"))
    after = panel.pictures["grid-01"]
    assert after.elites == before.elites
    assert after.scale.title == "visits"
    board.set_colors(ColorWish("no such thing", "no such colours", "no such scale"))
    assert panel.pictures["grid-01"].scale == before.scale


def test_a_scale_is_fixed_or_shared_by_all_maps_runs_and_generations(
    board: MapBoard, panel: Panel, grid_reader: RunReader, small_reader: RunReader
) -> None:
    def ends() -> set[tuple[float, float]]:
        return {(p.scale.low, p.scale.high) for p in panel.pictures.values()}

    first, *_, last = grid_reader.generations()
    fitted = ends()
    assert len(fitted) == 1
    board.show(grid_reader, first, last)  # an earlier generation, the same colours
    assert ends() == fitted
    for wish, expected in (
        (ColorWish(scale=ALL_RUNS), ALL),
        (ColorWish(scale=FIXED, limits=(-3.0, 2.5)), (-3.0, 2.5)),
    ):
        board.set_colors(wish)
        assert ends() == {expected}
        board.clear()
        board.show(small_reader, small_reader.generations()[-1])
        assert ends() == {expected}
    for limits in ((2.0, 2.0), (3.0, 1.0), (float("nan"), 1.0), (0.0, 1e9), ("a", 1.0), (True, 2.0)):
        with pytest.raises(InvalidData, match="colour scale"):
            board.set_colors(ColorWish(scale=FIXED, limits=limits))  # type: ignore[arg-type]
    assert ends() == {(-3.0, 2.5)}
    board.set_colors(ColorWish("age", "cividis", FIXED, (-3.0, 2.5)))
    assert ends() != {(-3.0, 2.5)}  # no centimetres
    assert {p.scale.colormap for p in panel.pictures.values()} == {"cividis"}


def test_what_reevaluating_finds_is_shown_at_once_and_damage_to_it_said_once(
    panel: Panel, small_run: Path, tmp_path: Path
) -> None:
    path = Path(shutil.copy(small_run, tmp_path / "run.tsmr"))
    with RunReader(path) as reader:
        last = reader.generations()[-1]
        elites = {n: s for cells in reader.elites(last).values() for n, s in cells.values()}
        recorded = {n: s.fitness for n, s in elites.items()}

        def save(fresh: float) -> None:
            samples = {n: {1: fresh} for n in recorded}
            save_robust(Robustness(reader.created_at, {}, recorded, samples), robust_path(path))

        def shown() -> set[float]:
            return {round(v, 6) for p in panel.pictures.values() for v in p.values.values()}

        board = new_board(panel)
        board.show(reader, last)
        board.set_colors(ColorWish("robust fitness"))
        assert panel.offered[3] == "fitness f_s"  # not known yet
        save(0.44)
        board.refresh()
        assert panel.offered[3] == "robust fitness"
        assert shown() == {1.0}
        save(0.40)
        board.refresh()
        assert shown() == {5.0}
        robust_path(path).write_text("{")
        for _ in range(3):
            board.refresh()
            board.choose("morphology", next(iter(elites)))
            board.set_colors(ColorWish("robust fitness"))
        assert [text for _, text in panel.notices] == [f"{robust_path(path)} is damaged: it is not JSON"]
        assert panel.offered[3] == "fitness f_s"
        assert shown() == {round(100 * (0.45 - f), 6) for f in recorded.values()}
        save(0.43)
        board.refresh()
        assert shown() == {2.0}
        robust_path(path).unlink()
        board.refresh()
        assert panel.offered[2:] == (("fitness f_s", "age", "visits"), "fitness f_s")


def test_newly_won_cells_flash_in_nested_maps_too(
    board: MapBoard, panel: Panel, grid_reader: RunReader
) -> None:
    first, *_, last = grid_reader.generations()
    board.set_layout("nested")
    board.show(grid_reader, first, last)
    assert 'class="f"' not in panel.pictures["grid-nested"].render(None, "")
    board.show(grid_reader, last)
    before, after = (set(grid_reader.placements("grid", g.number).items()) for g in (first, last))
    assert panel.pictures["grid-nested"].fresh == {cell for cell, _ in after - before}
    assert 'class="f"' in panel.pictures["grid-nested"].render(None, "")


@given(st.lists(st.text(max_size=30), min_size=1, max_size=4, unique=True))
def test_clicks_name_every_map_whatever_a_file_calls_its_archives(archives: list[str]) -> None:
    axes = (Axis("a", 0.0, 1.0, 2), Axis("b", 0.0, 1.0, 2))
    names = [v.name for v in layouts(dict.fromkeys(archives, axes))[ONLY]]
    assert len(set(names)) == len(archives)
    assert all(_CLICK.fullmatch(f"{name}:1,2|3") for name in names)


def test_what_the_list_of_elites_leaves_out_is_pale(
    board: MapBoard, panel: Panel, grid_reader: RunReader
) -> None:
    picture = panel.pictures["grid-01"]
    assert panel.listed[0] >= {e.number for e in picture.elites.values()}
    assert not any(tile.pale for tile in picture.tiles.values())
    values = sorted(e.f_s for e in picture.elites.values())
    panel.least = values[len(values) // 2]
    board.filter()
    tiles = panel.pictures["grid-01"].tiles
    assert {c for c, t in tiles.items() if t.pale} == {
        c for c, e in picture.elites.items() if e.f_s < panel.least
    }
    number = picture.elites[next(iter(picture.elites))].number
    board.choose("grid", number)
    assert panel.listed[1] == number


def test_the_best_robot_is_the_best_under_new_noise_if_that_is_known(
    panel: Panel, small_run: Path, tmp_path: Path
) -> None:
    path, luckless = evaluated_again(small_run, tmp_path)
    results = robust_path(path)
    again = results.rename(tmp_path / "later")
    with RunReader(path) as reader:
        last = reader.generations()[-1]
        cells = reader.elites(last)
        fitness = {n: s.fitness for elites in cells.values() for n, s in elites.values()}
        board = new_board(panel)
        assert board.best() is None
        board.show(reader, last)
        found = board.best()
        assert found is not None
        archive, cell, number = found
        assert cells[archive][cell][0] == number
        assert fitness[number] == min(fitness.values())
        again.rename(results)
        found = board.best()
        assert found is not None
        assert found[2] == luckless
        board.refresh()
        assert panel.robust[luckless] == pytest.approx(35.0)
