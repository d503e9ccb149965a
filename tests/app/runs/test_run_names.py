from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.runs.library import Library
from app.runs.run_names import without_folders
from engine.errors import RunFileError

part = st.text("abcXYZ019_.-", min_size=1, max_size=8).filter(lambda t: t not in (".", ".."))


@given(st.lists(part, min_size=1, max_size=4), part)
def test_of_an_absolute_path_the_name_is_left(folders: list[str], name: str) -> None:
    path = "/" + "/".join([*folders, name])
    for text in ("{} is damaged", "no: {}", "'{}'", "recover {} --out NEW.tsmr"):
        assert without_folders(text.format(path), ()) == text.format(name)


@pytest.mark.parametrize(
    "text",
    ["20 of 36 m/s", "runs/uploads holds 20 files", "see https://a.example/b/c", "and/or", "a / b", "1/2/3"],
)
def test_what_is_no_path_stays(text: str) -> None:
    assert without_folders(text, ()) == text


def test_known_folders_may_have_spaces() -> None:
    folder = Path("/srv/my runs")
    text = f"{folder}/a.tsmr is damaged; {folder} is full"
    assert without_folders(text, [folder]) == "a.tsmr is damaged; its folder is full"


def test_a_visitor_learns_what_is_wrong_with_a_run_but_not_where_it_lies(
    tmp_path: Path, small_run: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "secret place").mkdir()
    path = Path(shutil.copy(small_run, tmp_path / "secret place" / "broken.tsmr"))
    os.truncate(path, 9000)
    library = Library([tmp_path / "secret place"])
    try:
        with pytest.raises(RunFileError) as refused:
            library.reader(path.resolve())
        told = library.for_visitors(str(refused.value))
        assert told.startswith("broken.tsmr is cut short")
        assert "/" not in told
        assert "secret" not in told
    finally:
        library.close()
