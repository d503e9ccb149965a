"""``doctor`` as a user types it."""

import shutil
import socket
from pathlib import Path

import pytest

import app
from app.cli import doctor
from engine.storage.lock import lock_path
from tests.support.run_formats import change


def test_an_installation_and_a_run(tensatlas, small_run, tmp_path):
    path = shutil.copy(small_run, tmp_path / "run.tsmr")
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        s.listen()
        status, text, _ = tensatlas("doctor", path, "--port", s.getsockname()[1])
    lines = text.splitlines()
    assert status == 0
    assert lines[-1] == "No problem found"
    assert all(line.split()[0] in ("ok", "note") for line in lines[:-1])
    for what in (
        "Python 3.",
        "packages that it needs are installed",
        "core",
        "the simulation is compiled for this processor, kept in",
        "known simulation",
        f"GB free in {tmp_path}",
        "can be written, read meanwhile and locked",
        "cannot listen on 127.0.0.1:",
        "is a run file: dm-me on goal-reaching, seed 7, format 3",
        "SQLite finds no damage",
        "3 generations, 18 of 18 evaluations",
        "nothing is orphaned or missing",
        "all 18 evaluations can be read and are as they were written",
        "made with the versions and the physics installed here",
        "no process is writing it",
    ):
        assert what in text, what
    assert [p.name for p in tmp_path.iterdir()] == ["run.tsmr"]


@pytest.mark.parametrize(
    ("installed", "said"),
    [
        ({"numpy": "1.9"}, "problem numpy 1.9 is not >=2.0; pip install -c {} numpy mends that"),
        ({"numpy": None}, "problem numpy is missing; pip install -c {} numpy mends that"),
        (
            {"numpy": "99.0"},
            "note    other versions than tested: numpy 99.0 instead of",
        ),
    ],
)
def test_versions_are_compared_also_without_a_checkout(monkeypatch, installed, said):
    before = doctor._version
    monkeypatch.setattr(doctor, "_version", lambda name: installed.get(name, before(name)))
    found = [f"{f.verdict:<8}{f.text}; {f.remedy}" for f in doctor._packages()]
    assert any(
        line.startswith(said.format(Path(app.__file__).with_name("constraints.txt"))) for line in found
    ), found


@pytest.mark.parametrize(
    ("sql", "said"),
    [
        ("DELETE FROM generations WHERE generation = 1", "1 generations are missing: 1"),
        ("DELETE FROM evaluations WHERE number = 17", "18 evaluations were counted, 17 are there"),
        ("UPDATE placements SET evaluation = 99", "evaluations that do not exist: 99"),
        ("DELETE FROM state", "the state to resume from is missing"),
        ("UPDATE state SET generation = 9", "states to resume from are not of the last generation"),
        ("UPDATE details SET controller = x'ff00' WHERE number = 9", "evaluation 9"),
        ("DROP TABLE placements", "table placements is not as expected"),
        ("CREATE VIEW v AS SELECT 1", "it has a view"),
    ],
)
def test_what_is_wrong_with_a_run_is_said(small_run, tmp_path, sql, said):
    from engine.storage.check import check_run

    path = shutil.copy(small_run, tmp_path / "run.tsmr")
    change(path, sql)
    found = [f for f in check_run(path) if f.verdict == "problem"]
    assert any(said in f.text for f in found), found
    # what to do about it is said beside it, or in the error where it cannot be opened, if it is a run at all
    foreign = "is not a TensAtlas run file"
    assert all(f.remedy or "tensatlas recover" in f.text or foreign in f.text for f in found), found
    assert any(foreign in f.text for f in found) == ("VIEW" in sql)


@pytest.mark.parametrize(
    ("sql", "said"),
    [
        ("UPDATE evaluations SET operator = 'both' WHERE number = 9", "1 evaluations differ from what was w"),
        ("UPDATE details SET controller = x'ff00' WHERE number = 9", "rows of details differ from what was"),
        (
            "DELETE FROM details WHERE number = 9",
            "differ from what was written: 1 are missing",
        ),
        ("UPDATE computers SET n_evaluations = 3", "rows of computers differ from what was written: 1"),
        ("UPDATE placements SET evaluation = 9 WHERE generation = 1", "the maps of generation 1 differ from"),
        ("UPDATE generations SET n_failed = 9 WHERE generation = 1", "generation 1 differs from what was w"),
        ("DELETE FROM generations WHERE generation = 2", "generation 2 is missing"),
        ("UPDATE state SET generation = 1", "rows of state differ from what was written: the whole"),
    ],
)
def test_what_is_not_as_it_was_written_is_said(small_run, tmp_path, sql, said):
    from engine.storage.check import check_run

    path = shutil.copy(small_run, tmp_path / "run.tsmr")
    change(path, sql, sealed=False)
    found = [f for f in check_run(path) if f.verdict == "problem"]
    assert any(said in f.text and "tensatlas recover" in f.remedy for f in found), found


def test_a_run_that_is_damaged_locked_and_of_other_versions(tensatlas, small_run, tmp_path):
    path = shutil.copy(small_run, tmp_path / "run.tsmr")
    physics = 'replace(value, \'"physics": "\', \'"physics": "0\')'
    change(path, f"UPDATE meta SET value = {physics} WHERE key = 'versions'")
    lock_path(path).write_text("12345")
    status, text, _ = tensatlas("doctor", path)
    lines = text.splitlines()
    assert status == 0
    assert any(line.startswith("note") and "bodies are modelled differently" in line for line in lines)
    assert any(line.startswith("note") and "left from a process" in line for line in lines)
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    status, text, _ = tensatlas("doctor", path)
    lines = text.splitlines()
    assert status == 1
    assert lines[-1] == "1 problem found"
    assert any("is cut short" in line and "tensatlas recover" in line for line in lines)
