from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from app.runs import run_files, run_notes
from app.runs.launcher import log_path
from engine.analysis.robustness import robust_path
from engine.errors import InvalidData, RunFileError
from engine.storage.lock import RunLock
from engine.storage.reader import RunReader
from engine.storage.schema import failures_folder


@pytest.fixture
def run(small_run: Path, tmp_path: Path) -> Path:
    """A run with all that may lie beside it, and a neighbour whose name begins alike."""
    path = Path(shutil.copy(small_run, tmp_path / "mine.tsmr"))
    shutil.copy(small_run, tmp_path / "mine.other.tsmr")
    run_notes.keep_note(path, " the good one\nreally ")
    robust_path(path).write_text("{}")
    log_path(path).write_text("Stopped.")
    failures_folder(path).mkdir()
    (failures_folder(path) / "evaluation-1.dump").write_bytes(b"x")
    return path


def names(folder: Path) -> set[str]:
    return {p.name for p in folder.iterdir()}


def test_a_run_is_renamed_with_all_that_belongs_to_it(run: Path) -> None:
    with RunReader(run) as reader:
        content = reader.canonical_hash()
    new = run_files.rename(run, "yours")
    assert new == run.with_name("yours.tsmr")
    assert names(run.parent) == {
        "yours.tsmr",
        "yours.tsmr.note.txt",
        "yours.robust.json",
        "yours.log",
        "yours.failures",
        "mine.other.tsmr",
    }
    assert (failures_folder(new) / "evaluation-1.dump").read_bytes() == b"x"
    assert run_notes.note_of(new) == "the good one\nreally"
    with RunReader(new) as reader:
        assert reader.canonical_hash() == content
    assert run_files.rename(new, "yours.tsmr") == new


@pytest.mark.parametrize("name", ["", "../x", "a/b", "a b", ".hidden", "x" * 80])
def test_a_name_that_no_run_can_have_is_refused(run: Path, name: str) -> None:
    before = names(run.parent)
    with pytest.raises(InvalidData, match="letters"):
        run_files.rename(run, name)
    assert names(run.parent) == before


def test_nothing_that_is_there_is_overwritten(run: Path) -> None:
    with pytest.raises(RunFileError, match=r"mine\.other\.tsmr exists already"):
        run_files.rename(run, "mine.other")
    run.with_name("free.log").write_text("another run's")
    with pytest.raises(RunFileError, match=r"free\.log exists already"):
        run_files.rename(run, "free")
    assert run.exists()


def test_a_deleted_run_is_whole_in_the_bin_and_so_is_the_next_of_its_name(run: Path, small_run: Path) -> None:
    first = run_files.to_bin(run)
    assert names(run.parent) == {"bin", "mine.other.tsmr"}
    assert names(first.parent) == {
        "mine.tsmr",
        "mine.tsmr.note.txt",
        "mine.robust.json",
        "mine.log",
        "mine.failures",
    }
    shutil.copy(small_run, run)
    second = run_files.to_bin(run)
    assert second.parent != first.parent
    assert first.exists()
    assert second.exists()
    with pytest.raises(RunFileError, match="does not exist any more"):
        run_files.to_bin(run)


def test_a_run_that_is_being_written_stays_where_it_is(run: Path) -> None:
    lock = RunLock.acquire(run)
    try:
        for move in (lambda: run_files.to_bin(run), lambda: run_files.rename(run, "yours")):
            with pytest.raises(RunFileError, match="stop it first"):
                move()
    finally:
        lock.release()
    assert run.exists()


def test_an_empty_note_is_none_and_an_endless_one_is_refused(run: Path) -> None:
    with pytest.raises(RunFileError, match="at most 2000"):
        run_notes.keep_note(run, "x" * 2001)
    assert run_notes.note_of(run) == "the good one\nreally"
    run_notes.keep_note(run, "  ")
    assert run_notes.note_of(run) == ""
    assert not run_notes.note_path(run).exists()
    run_notes.note_path(run).write_bytes(b"\xff" + b"y" * 50_000)
    assert len(run_notes.note_of(run)) == run_notes.MAX_NOTE
