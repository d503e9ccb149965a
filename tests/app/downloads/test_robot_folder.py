"""The folder that a robot leaves in, the command that writes it, and what goes wrong on the way."""

import csv
import hashlib
import io
import json
from pathlib import Path

import pytest
from pypdf import PdfReader

from app.cli.main import main
from app.downloads.robot_folder import place_of, robot_folder, what_is
from engine.errors import ExportError
from engine.fabrication.materials import load_materials, preset_text
from engine.storage.reader import RunReader
from viz.build_sheet.facts import Place, run_date
from viz.build_sheet.sections.title import qr_text


@pytest.fixture(scope="module")
def reader(small_run):
    with RunReader(small_run) as r:
        yield r


@pytest.fixture(scope="module")
def elite(reader):
    """Place and number of the elite with the fewest modules."""
    cell, number = min(reader.placements("morphology", reader.last_generation()).items())
    return Place(archive="morphology", cell=cell), number


@pytest.fixture(scope="module")
def files(reader, elite):
    place, number = elite
    return robot_folder(reader, number, materials=load_materials(), place=place)


@pytest.fixture
def tensatlas(tmp_path, monkeypatch, capsys):
    """Run a command in an empty folder; return its exit status and what it says."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments):
        status = 0
        try:
            main([str(a) for a in arguments])
        except SystemExit as e:
            status = e.code or 0
        return status, capsys.readouterr().err

    return run


def test_the_manifest_knows_every_file_and_where_the_robot_comes_from(reader, elite, files):
    place, number = elite
    manifest = json.loads(files["manifest.json"])
    assert set(manifest["files"]) == set(files) - {"manifest.json"}
    for name, about in manifest["files"].items():
        assert about["sha256"] == hashlib.sha256(files[name]).hexdigest()
        assert about["bytes"] == len(files[name])
        assert about["what"] == what_is(name)
    robot = manifest["robot"]
    assert (robot["run"], robot["evaluation"]) == ("small", number)
    assert robot["hash"].startswith(robot["id"])
    assert robot["link"] == f"?run=small&archive=morphology&cell={place.cell[0]},{place.cell[1]}"
    assert manifest["versions"]["run"] == reader.versions
    assert manifest["versions"]["export"]["reportlab"]
    readme = files["README.md"].decode()
    assert all(f"`{name}`" in readme for name in files if "/" not in name)
    assert place_of(reader, number) == place


def test_the_folder_holds_all_that_a_workshop_needs(elite, files):
    assert {
        "README.md",
        "bill_of_materials.csv",
        "build_sheet.pdf",
        "firmware/tsmr_robot/tsmr_robot.ino",
        "genotype.json",
        "materials.toml",
        "replay.html",
        "robot.glb",
        "robot.xml",
        "tables/cables.csv",
        "tables/internal_cables.csv",
        "tables/joints.csv",
        "tables/paths.csv",
        "tables/rods.csv",
        "tables/targets.csv",
    } <= set(files)
    kinds = {name.rsplit(".", 1)[1] for name in files}
    assert {"stl", "3mf", "dxf", "svg", "glb"} <= kinds
    assert files["materials.toml"].decode() == preset_text("tpu-85a")
    rows = list(csv.DictReader(io.StringIO(files["tables/targets.csv"].decode())))
    assert len(rows) == 4
    assert all(float(r["score_cm"]) + float(r["closer_by_cm"]) == pytest.approx(45.0, abs=1e-3) for r in rows)
    paths = list(csv.reader(io.StringIO(files["tables/paths.csv"].decode())))
    assert (len(paths), len(paths[0])) == (1 + 2, 1 + 2 * 4)
    assert len(files["tables/internal_cables.csv"].splitlines()) == 1 + 181


def test_the_same_robot_gives_the_same_files(reader, elite, files):
    place, number = elite
    again = robot_folder(reader, number, materials=load_materials(), place=place)
    assert set(again) == set(files)
    assert [n for n in files if files[n] != again[n]] == []


def test_a_cell_is_exported_with_materials_of_ones_own_on_letter(tensatlas, small_run, elite, tmp_path):
    place, number = elite
    own = preset_text("latex-cord").replace('name = "latex cord"', 'name = "my cord"')
    Path("mine.toml").write_text(own)
    cell = ",".join(map(str, place.cell))
    options = ("--cell", cell, "--out", "robot", "--materials", "mine.toml", "--paper", "letter")
    status, said = tensatlas("export", small_run, *options)
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
    status, said = tensatlas("export", small_run, *options)
    assert (status, said.count("\n")) == (2, 1)
    assert reason in said
    assert sorted(tmp_path.rglob("*")) == before


def test_every_elite_is_exported_once_and_one_that_cannot_be_does_not_stop_the_others(
    tensatlas, small_run, monkeypatch
):
    made = []

    def quick(reader, number, *, place, **_):
        # what a folder holds is looked at above; here it is which folders there are
        if number == broken:
            raise ExportError(f"evaluation {number} cannot be repeated")
        made.append((place.archive, number))
        return {"README.md": place.name.encode()}

    with RunReader(small_run) as reader:
        last = reader.last_generation()
        held = {a: reader.placements(a, last) for a in ("morphology", "controller")}
    numbers = {n for cells in held.values() for n in cells.values()}
    broken = max(numbers)
    monkeypatch.setattr("app.cli.export.robot_folder", quick)
    status, said = tensatlas("export", small_run, "--all-elites", "--out", "all")
    assert status == 2
    assert f"1 of {len(numbers)} robots were not exported; the first: evaluation {broken}" in said
    assert sorted(n for _, n in made) == sorted(numbers - {broken})
    rows = list(csv.DictReader(io.StringIO(Path("all/index.csv").read_text())))
    assert len(rows) == sum(map(len, held.values()))
    folders = {r["folder"] for r in rows if int(r["evaluation"]) != broken}
    assert folders == {p.name for p in Path("all").iterdir() if p.is_dir()}


def test_dates_and_qr_codes_of_odd_files(robots_facts):
    assert run_date("2026-11-24T14:32:54+00:00") == "2026-11-24"
    assert run_date("") == run_date("yesterday") == run_date("2026-13-40") == "unknown"
    text = qr_text(robots_facts)
    assert robots_facts.robot_id in text
    assert text.endswith(robots_facts.link)


@pytest.fixture
def robots_facts(reader, elite):
    from engine.export import simulate_trial
    from viz.build_sheet.facts import gather

    place, number = elite
    evaluation = reader.evaluation(number)
    return gather(reader, evaluation, simulate_trial(reader.config, evaluation), place)
