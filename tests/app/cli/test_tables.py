"""``table`` and ``project`` as a user types them."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest

from app.cli.main import main
from tests.support.command_line import Command


def test_table(tensatlas: Command, copy: Path, tmp_path: Path) -> None:
    status, _, err = tensatlas("table", copy, "--out", tmp_path / "elites.csv", "--archive", "morphology")
    with open(tmp_path / "elites.csv", newline="") as f:
        rows = list(csv.DictReader(f))
    assert (status, f"Wrote {len(rows)} elites" in err) == (0, True)
    assert {r["archive"] for r in rows} == {"morphology"}


def test_all_evaluations_as_a_table(tensatlas: Command, copy: Path, tmp_path: Path) -> None:
    status, _, err = tensatlas("table", copy, "--all", "--out", tmp_path / "all.csv")
    with open(tmp_path / "all.csv", newline="") as f:
        rows = list(csv.DictReader(f))
    assert (status, "Wrote 18 evaluations to" in err) == (0, True)
    assert [int(r["evaluation"]) for r in rows] == list(range(18))
    status, _, err = tensatlas("table", copy, "--all", "--archive", "morphology", "--out", tmp_path / "x.csv")
    assert (status, "leave out --archive" in err) == (2, True)


def test_project_info_and_what_the_projection_is_good_for(
    tensatlas: Command, copy: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    up = tmp_path / "up.tsmr"
    status, _, err = tensatlas("project", copy, "--out", up)
    assert (status, "onto" in err) == (0, True)
    main(["info", str(up)])
    assert "of small.tsmr: the two 2-D archives as one 4-D map" in capsys.readouterr().out
    main(["info", str(up), "--json"])
    assert json.loads(capsys.readouterr().out)["projection"]["source"] == "small.tsmr"
    main(["table", str(up), "--out", str(tmp_path / "grid.parquet")])
    main(["project", str(up), "--out", str(tmp_path / "down.tsmr")])
    capsys.readouterr()
    main(["compare", str(up), "--out", str(tmp_path / "report"), "--images", "none"])
    assert "is a projection of small.tsmr" in capsys.readouterr().err
    with pytest.raises(SystemExit, match="2"):
        main(["project", str(copy), "--out", str(up)])
    assert "exists; choose another name" in capsys.readouterr().err


def test_project_to_a_place_that_is_no_folder_gets_one_line(
    tensatlas: Command, copy: Path, tmp_path: Path
) -> None:
    (tmp_path / "file").touch()
    status, out, err = tensatlas("project", copy, "--out", tmp_path / "file" / "up.tsmr")
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert "file is not a folder" in err
