from __future__ import annotations

import csv
import errno
import io
import os
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from engine.files import csv_text, open_file, write_files

STARTS = ("=", "+", "-", "@", "\t", "\r", "\n")


def cells(text: str, delimiter: str = ",") -> list[list[str]]:
    return list(csv.reader(io.StringIO(text, newline=""), delimiter=delimiter))


@pytest.mark.parametrize(
    "formula",
    ['=cmd|" /C calc"!A0', "+1+1", "-2+3", "@SUM(A1)", "\t=1", "\r=1", '=HYPERLINK("http://a")', "-", "--x"],
)
def test_no_text_is_a_formula(formula: str) -> None:
    ((cell,),) = cells(csv_text([[formula]]))
    assert cell.replace("'", "") == formula.replace("\r", "\n")
    assert cell.startswith("'")


@pytest.mark.parametrize("number", [-1.5, 1e-300, -7, "-1.25", "+3", "1e5", "-.5", "-2.5E-03"])
def test_numbers_stay_numbers(number: object) -> None:
    assert csv_text([[number, None]]) == f"{number},\n"


@given(st.lists(st.text() | st.integers() | st.floats(allow_nan=False) | st.none(), min_size=1))
def test_whatever_is_written_begins_no_formula_and_loses_nothing(row: list[object]) -> None:
    text = csv_text([row])
    (found,) = cells(text)
    for cell, value in zip(found, row, strict=True):
        if isinstance(value, str):
            plain = value.replace("\r\n", "\n").replace("\r", "\n")
            assert cell.replace("'", "") == plain.replace("'", "")
            assert not cell.startswith(STARTS) or is_number(cell)
        elif value is not None:
            assert cell == str(value)


@given(st.text(alphabet="=+-@; \ta1", max_size=12))
def test_nor_where_semicolons_end_fields(text: str) -> None:
    written = csv_text([[text, "b"]]).rstrip("\n")
    for row in cells(written, ";"):
        for cell in row:
            first = cell.split(",")[0]
            assert not first.startswith(("=", "+", "-", "@")) or is_number(first)


def is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return not text
    return True


def test_a_pipe_is_no_file(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with pytest.raises(OSError, match="regular file"):
        open_file(pipe)
    with pytest.raises(OSError, match="regular file"):
        open_file(tmp_path)
    pipe.unlink()
    pipe.write_bytes(b"abc")
    with open_file(pipe) as f:
        assert f.read() == b"abc"


@pytest.mark.parametrize("error", [OSError(errno.ENOSPC, "No space left on device"), KeyboardInterrupt()])
def test_files_are_written_whole_or_not_at_all(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: BaseException
) -> None:
    old, new = tmp_path / "old.csv", tmp_path / "folder" / "new.csv"
    old.write_text("before")
    synced = []

    def sync(_: int) -> None:
        synced.append(True)
        if len(synced) == 2:  # the first file is written then, under its other name
            raise error

    with monkeypatch.context() as patch:
        patch.setattr("os.fsync", sync)
        with pytest.raises(type(error)) as caught:
            write_files({old: "after", new: b"after"})
    if isinstance(caught.value, OSError):
        assert (caught.value.filename, caught.value.strerror) == (str(new), "No space left on device")
    assert old.read_text() == "before"
    assert [p for p in tmp_path.rglob("*") if p.is_file()] == [old]
    write_files({old: "ä", new: b"after"})
    assert (old.read_bytes(), new.read_bytes()) == ("ä".encode(), b"after")


def test_a_file_that_is_written_anew_stays_where_and_what_it_was(tmp_path: Path) -> None:
    (tmp_path / "there").mkdir()
    real, link = tmp_path / "there" / "real.csv", tmp_path / "link.csv"
    real.write_text("before")
    real.chmod(0o640)
    link.symlink_to(real)
    write_files({link: "after"})
    assert link.is_symlink()
    assert (real.read_text(), real.stat().st_mode & 0o777) == ("after", 0o640)
    for a, b in (("a", "b"), ("b", "a")):
        (tmp_path / a).symlink_to(tmp_path / b)
    with pytest.raises(OSError, match="symbolic links"):
        write_files({tmp_path / "a": "x"})


def test_what_is_no_file_is_not_replaced(tmp_path: Path) -> None:
    pipe, folder = tmp_path / "pipe", tmp_path / "folder"
    os.mkfifo(pipe)
    folder.mkdir()
    reading = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    try:
        write_files({pipe: "content"})
        assert os.read(reading, 20) == b"content"
    finally:
        os.close(reading)
    assert pipe.is_fifo()
    with pytest.raises(NotADirectoryError, match="Not a directory"):
        write_files({pipe / "new": "x"})
    with pytest.raises(IsADirectoryError) as caught:
        write_files({tmp_path / "new": "x", folder: "x"})
    assert caught.value.filename == str(folder)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["folder", "pipe"]
