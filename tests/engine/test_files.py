from __future__ import annotations

import csv
import io
import os
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from engine.files import csv_text, open_file

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
