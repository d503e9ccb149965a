"""The folder that a robot leaves in."""

import csv
import hashlib
import io
import json

import pytest

from app.downloads.robot_folder import place_of, robot_folder, what_is
from engine.fabrication.materials import load_materials, preset_text
from engine.storage.reader import RunReader
from viz.build_sheet.facts import ArchivePlace, run_date
from viz.build_sheet.sections.title import qr_text


@pytest.fixture(scope="module")
def reader(small_run):
    with RunReader(small_run) as r:
        yield r


@pytest.fixture(scope="module")
def elite(reader):
    """Place and number of the elite with the fewest modules."""
    cell, number = min(reader.placements("morphology", reader.last_generation()).items())
    return ArchivePlace(archive="morphology", cell=cell), number


@pytest.fixture(scope="module")
def files(reader, elite):
    place, number = elite
    return robot_folder(reader, number, materials=load_materials(), place=place)


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
    assert files["materials.toml"].decode() == preset_text("latex-sheet")
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
