"""``export`` as a user types it."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import pytest
from pypdf import PdfReader

from engine.errors import ExportError
from engine.fabrication.materials import load_materials, preset_text
from engine.storage.reader import RunReader
from tests.support.command_line import Command
from viz.build_sheet.facts import ArchivePlace


@pytest.fixture
def elite(small_reader):
    """Place and number of the elite with the fewest modules."""
    cell, number = min(small_reader.placements("morphology", small_reader.last_generation()).items())
    return ArchivePlace(archive="morphology", cell=cell), number


@pytest.mark.parametrize(
    ("cell", "reason"),
    [
        ("9,0", "lies outside"),
        ("0,10", "lies outside"),
        ("1", "has 2 indices (0..8, 0..9), not 1: 1"),
        ("a,b", "written like 3,7"),
    ],
)
def test_impossible_cells_get_one_line(
    tensatlas: Command, small_run: Path, tmp_path: Path, cell: str, reason: str
) -> None:
    status, _, err = tensatlas("export", small_run, "--cell", cell, "--out", "out")
    assert (status, err.count("\n")) == (2, 1)
    assert reason in err
    assert not list(tmp_path.iterdir())


def test_an_empty_cell_gets_one_line(tensatlas: Command, small_run: Path, small_reader: RunReader) -> None:
    placed = small_reader.placements("morphology", small_reader.last_generation() or 0)
    empty = next((i, j) for i in range(9) for j in range(10) if (i, j) not in placed)
    status, _, err = tensatlas("export", small_run, "--cell", "{},{}".format(*empty), "--out", "out")
    assert (status, err.count("\n")) == (2, 1)
    assert "is empty" in err


def test_a_cell_is_exported_with_materials_of_ones_own_on_letter(tensatlas, small_run, elite, tmp_path):
    place, number = elite
    own = preset_text("latex-sheet").replace('name = "latex sheet"', 'name = "my sheet"')
    Path("mine.toml").write_text(own)
    cell = ",".join(map(str, place.cell))
    options = ("--cell", cell, "--out", "robot", "--materials", "mine.toml", "--paper", "letter")
    status, _, said = tensatlas("export", small_run, *options)
    assert (status, f"Wrote robot {number} to robot" in said) == (0, True)
    assert Path("robot/materials.toml").read_text() == own
    reader = PdfReader("robot/build_sheet.pdf")
    assert [float(v) for v in reader.pages[0].mediabox[2:]] == [612, 792]
    first = reader.pages[0].extract_text()
    assert f"morphology {cell}" in first
    assert sorted(p.name for p in tmp_path.iterdir()) == ["mine.toml", "robot"]


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        (("--out", "x"), "--cell I,J, or --all-elites"),
        (("--cell", "0,0", "--all-elites", "--out", "x"), "not both"),
        (("--cell", "8,99", "--out", "x"), "lies outside the morphology map"),
        (("--cell", "8", "--out", "x"), "a cell of the morphology map has 2 indices (0..8, 0..9), not 1: 8"),
        (("--cell", "EMPTY", "--out", "x"), "is empty"),
        (("--cell", "3;7", "--out", "x"), "a cell is written like 3,7"),
        (("--archive", "grid", "--cell", "0,0,0,0", "--out", "x"), "has no grid archive"),
        (("--archive", "grid", "--all-elites", "--out", "x"), "has no grid archive"),
        (("--cell", "0,0", "--out", "full"), "full exists already"),
        (("--cell", "0,0", "--out", "full/file/x"), "is not a folder"),
        (("--cell", "0,0", "--out", "x", "--materials", "none.toml"), "none.toml cannot be read"),
        (("--cell", "0,0", "--out", "x", "--materials", "negative.toml"), "negative.toml: cable.modulus_mpa"),
        (
            ("--cell", "0,0", "--out", "x", "--materials", "missing.toml"),
            "rod.kerf_mm is missing",
        ),
    ],
)
def test_what_is_wrong_gets_one_line_and_leaves_nothing(tensatlas, small_run, options, reason, tmp_path):
    text = preset_text("tpu-85a")
    lines = text.splitlines()
    Path("missing.toml").write_text("\n".join(x for x in lines if not x.startswith("kerf_mm")))
    negative = ["modulus_mpa = -12" if x.startswith("modulus_mpa") else x for x in lines]
    Path("negative.toml").write_text("\n".join(negative))
    Path("full").mkdir()
    Path("full/file").write_text("mine")
    before = sorted(tmp_path.rglob("*"))
    with RunReader(small_run) as reader:
        held = reader.placements("morphology", reader.last_generation())
    empty = next((i, j) for i in range(9) for j in range(10) if (i, j) not in held)
    options = [f"{empty[0]},{empty[1]}" if o == "EMPTY" else o for o in options]
    status, _, said = tensatlas("export", small_run, *options)
    assert (status, said.count("\n")) == (2, 1)
    assert reason in said
    assert sorted(tmp_path.rglob("*")) == before


def test_every_elite_is_exported_once_and_one_that_cannot_be_does_not_stop_the_others(
    tensatlas, small_run, monkeypatch
):
    made = []

    def quick(reader, number, *, place, **_):
        # what a folder holds is looked at elsewhere; here it is which folders there are
        if number == broken:
            raise ExportError(f"evaluation {number} cannot be repeated")
        made.append((place.archive, number))
        return {"README.md": place.name.encode()}

    with RunReader(small_run) as reader:
        last = reader.last_generation()
        held = {a: reader.placements(a, last) for a in ("morphology", "controller")}
    numbers = {n for cells in held.values() for n in cells.values()}
    broken = max(numbers)
    monkeypatch.setattr("app.downloads.robot_folder.robot_folder", quick)
    status, _, said = tensatlas("export", small_run, "--all-elites", "--out", "all", "--materials", "tpu-85a")
    assert status == 2
    assert f"1 of {len(numbers)} robots were not exported; the first: evaluation {broken}" in said
    assert f"{len(numbers) - 1} robots are of another material than tpu-85a; their sheets say why" in said
    assert sorted(n for _, n in made) == sorted(numbers - {broken})
    rows = list(csv.DictReader(io.StringIO(Path("all/index.csv").read_text())))
    assert len(rows) == sum(map(len, held.values()))
    folders = {r["folder"] for r in rows if int(r["evaluation"]) != broken}
    assert folders == {p.name for p in Path("all").iterdir() if p.is_dir()}


def test_a_kit_is_for_the_first_module_of_one_robot(
    tensatlas: Command, small_run: Path, tmp_path: Path
) -> None:
    with RunReader(small_run) as reader:
        cell, number = min(reader.placements("morphology", reader.last_closed().number).items())
    where = ("--cell", "{},{}".format(*cell))
    status, _, err = tensatlas("export", small_run, *where, "--kit", "--out", "kit", "--materials", "tpu-85a")
    assert (status, f"a kit for module 1 of robot {number} to kit; start with its kit.pdf" in err) == (
        0,
        True,
    )
    # no printed net stretches that far
    assert "Made of latex sheet, not of printed TPU, Shore 85A, which was asked for: At stiffness" in err
    assert load_materials("kit/measured.toml").cable == load_materials("latex-sheet").cable
    made = {str(p.relative_to("kit")) for p in Path("kit").rglob("*") if p.is_file()}
    assert {"README.md", "kit.pdf", "net_tiles.pdf", "measured.toml", "module.glb", "parts/jig.stl"} <= made
    assert "firmware/tsmr_robot/tsmr_robot.ino" in made
    # the form is a materials file of the next export
    assert load_materials("kit/measured.toml").servo == load_materials().servo
    status, _, err = tensatlas("export", small_run, "--all-elites", "--kit", "--out", "more")
    assert (status, err.count("\n"), "a kit is for one robot" in err) == (2, 1, True)
