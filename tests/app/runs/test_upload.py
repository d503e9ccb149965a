from __future__ import annotations

import contextlib
import itertools
import json
import shutil
import sqlite3
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.runs import upload
from app.runs.upload import keep, safe_name
from engine.errors import RunFileError
from engine.storage.reader import RunReader
from tests.support.opened import files_opened
from tests.support.run_formats import change, in_format

MANY_ARCHIVES = "".join(f", '$.a{k}', json_extract(archives, '$.morphology')" for k in range(20))


def chain(n: int) -> dict[str, object]:
    """Return the genotype of a network of n hidden neurons in a row."""
    path = [-1, *range(20, 20 + n), 0]
    return {
        "n_inputs": 2,
        "nodes": [[k, 0.0, 1.0] for k in range(20 + n)],
        "connections": [[a, b, 1.0, True, k] for k, (a, b) in enumerate(itertools.pairwise(path))],
    }


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return tmp_path / "runs" / "uploads"


def changed(run: Path, tmp_path: Path, *commands: str) -> bytes:
    """Return a run file that somebody has worked on."""
    path = Path(shutil.copy(run, tmp_path / "changed.tsmr"))
    change(path, *commands)
    with contextlib.closing(sqlite3.connect(path)) as db:
        db.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    return path.read_bytes()


def test_a_run_is_kept_in_its_own_folder_under_a_name_of_its_own(small_run: Path, folder: Path) -> None:
    content = small_run.read_bytes()
    first = keep("../../my run;.tsmr", content, folder)
    second = keep(r"C:\runs\my run;.tsmr", content, folder)
    assert [first, second] == [folder.resolve() / "my-run.tsmr", folder.resolve() / "my-run-2.tsmr"]
    assert {p.name for p in folder.iterdir()} == {"my-run.tsmr", "my-run-2.tsmr"}
    with RunReader(first) as there, RunReader(small_run) as here:
        assert there.canonical_hash() == here.canonical_hash()


def test_what_was_uploaded_is_opened_by_sqlite_alone(small_run: Path, tmp_path: Path) -> None:
    path = Path(shutil.copy(small_run, tmp_path / "run.tsmr"))
    with files_opened() as opened:
        upload.check(path)
    assert opened == []


@given(st.text(max_size=300))
def test_a_name_never_leaves_the_folder_nor_hides(name: str) -> None:
    safe = safe_name(name)
    assert safe
    assert len(safe) <= 60
    assert safe.replace("-", "").replace("_", "").isalnum()
    assert safe.isascii()


@pytest.mark.parametrize(
    ("commands", "what"),
    [
        (["DELETE FROM meta WHERE key = 'config'"], "damaged"),
        (["DROP TABLE state"], "table state"),
        (["PRAGMA application_id = 1"], "another program"),
        (["PRAGMA user_version = 99"], "newer"),
        (["UPDATE details SET controller = '[]'"], "damaged"),
        (["UPDATE placements SET cell = '190' || cell"], "outside"),
        (["DELETE FROM placements", "DELETE FROM generations"], "no finished generation"),
        (["CREATE VIEW evil AS SELECT 1"], "view"),
        (["CREATE TABLE more (a)"], "'more'"),
        (["CREATE TRIGGER t AFTER INSERT ON state BEGIN DELETE FROM meta; END"], "trigger"),
        (["ALTER TABLE state ADD COLUMN x AS (zeroblob(1000000000))"], "computed"),
        (
            [
                "ALTER TABLE state RENAME TO old",
                "DROP TABLE old",
                "CREATE VIEW state AS WITH RECURSIVE c(id) AS (SELECT 1 UNION ALL SELECT id + 1 FROM c)"
                " SELECT id, 1 AS generation, '' AS algorithm FROM c",
            ],
            "view",
        ),
    ],
)
def test_what_is_no_sound_run_is_refused_with_a_reason(
    commands: list[str], what: str, small_run: Path, folder: Path, tmp_path: Path
) -> None:
    with pytest.raises(RunFileError, match=what) as refused:
        keep("bad.tsmr", changed(small_run, tmp_path, *commands), folder)
    assert str(tmp_path) not in str(refused.value)
    assert "\n" not in str(refused.value)
    assert list(folder.iterdir()) == []


@pytest.mark.parametrize(
    ("command", "what"),
    [
        ("UPDATE generations SET generation = 20000 WHERE generation = 0", "more than 20000 generations"),
        (f"UPDATE evaluations SET controller = '{json.dumps(chain(300))}'", "200 connections in a row, not"),
        (f"UPDATE evaluations SET controller = '{json.dumps(chain(9980))}'", "at most 2000 nodes"),
        ("UPDATE evaluations SET controller = zeroblob(4000001)", "its controller has a length of"),
        ("UPDATE evaluations SET distances = '[' || hex(zeroblob(500000)) || ']'", "its distances has a"),
        ("UPDATE evaluations SET operator = hex(zeroblob(2500000))", "its operator has 5000000 characters"),
        ("UPDATE meta SET value = json_quote(hex(zeroblob(100))) WHERE key = 'created_at'", "the date has"),
        (
            "UPDATE meta SET value = json_object('a', hex(zeroblob(2000))) WHERE key = 'versions'",
            "a has 4000",
        ),
        ("UPDATE generations SET archives = json_set(archives, '$.morphology.axes[0].n', 51)", "impossible"),
        ("UPDATE generations SET archives = json_set(archives" + MANY_ARCHIVES + ")", "at most 16 archives"),
        (
            "UPDATE generations SET archives = archives || hex(zeroblob(60000))",
            "figures of a generation",
        ),
    ],
)
def test_what_costs_too_much_is_refused_with_a_reason(
    command: str, what: str, small_run: Path, folder: Path, tmp_path: Path
) -> None:
    old = in_format(small_run, tmp_path / "old.tsmr", 1)  # which has no digests that would tell
    keep("good.tsmr", old.read_bytes(), folder)
    with pytest.raises(RunFileError, match=what) as refused:
        keep("bad.tsmr", changed(old, tmp_path, command), folder)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("content", [b"", b"SQLite format 3\x00", b"x" * 5000, b"PK\x03\x04" + b"\0" * 200])
def test_other_files_are_refused(content: bytes, folder: Path) -> None:
    with pytest.raises(RunFileError, match=r"bad\.tsmr"):
        keep("bad.tsmr", content, folder)
    assert list(folder.iterdir()) == []


def test_a_file_of_another_name_is_refused_whatever_it_holds(small_run: Path, folder: Path) -> None:
    with pytest.raises(RunFileError, match=r"pic\.csv is no run file"):
        keep("pic.csv", small_run.read_bytes(), folder)
    assert not folder.exists()
    assert keep("PIC.TSMR", small_run.read_bytes(), folder).suffix == ".tsmr"


def test_a_file_of_half_its_length_is_refused(small_run: Path, folder: Path) -> None:
    content = small_run.read_bytes()
    with pytest.raises(RunFileError, match=r"bad\.tsmr"):
        keep("bad.tsmr", content[: len(content) // 2], folder)


def test_a_task_file_that_an_upload_names_is_never_run(small_run: Path, folder: Path, tmp_path: Path) -> None:
    ran = tmp_path / "ran"
    task = tmp_path / "task.py"
    task.write_text(f"open({str(ran)!r}, 'w')")
    content = changed(
        small_run,
        tmp_path,
        f"UPDATE meta SET value = json_set(value, '$.task', '{task}') WHERE key = 'config'",
    )
    with pytest.raises(RunFileError, match="task"):
        keep("bad.tsmr", content, folder)
    assert not ran.exists()


def test_size_and_number_are_limited(small_run: Path, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    content = small_run.read_bytes()
    monkeypatch.setattr(upload, "MAX_FILES", 2)
    for _ in range(2):
        keep("a.tsmr", content, folder)
    with pytest.raises(RunFileError, match="2 files already"):
        keep("a.tsmr", content, folder)
    monkeypatch.setattr(upload, "MAX_BYTES", len(content) - 1)
    with pytest.raises(RunFileError, match="larger than"):
        keep("a.tsmr", content, folder)
