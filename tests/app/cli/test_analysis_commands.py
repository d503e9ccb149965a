"""``compare``, ``table``, ``project`` and ``reevaluate`` as a user types them."""

from __future__ import annotations

import csv
import json
import shutil
import time
from collections.abc import Callable
from pathlib import Path

import plotly.graph_objects as go
import pytest
from PIL import Image

from app.cli.main import main
from engine.errors import ExportError
from viz.report.images import write_images
from viz.report.report import ReportFigure

Command = Callable[..., tuple[int, str, str]]


@pytest.fixture
def tensatlas(capsys: pytest.CaptureFixture[str], small_run: Path, tmp_path: Path) -> Command:
    """Run a command on a copy of a real run; return exit status, standard output, standard error."""
    copy = tmp_path / "small.tsmr"
    shutil.copy(small_run, copy)

    def run(command: str, *arguments: object) -> tuple[int, str, str]:
        status = 0
        try:
            main([command, str(copy), *map(str, arguments)])
        except SystemExit as e:
            status = int(e.code or 0)
        out, err = capsys.readouterr()
        return status, out, err

    return run


def test_compare_writes_a_report_tables_and_figures(tensatlas: Command, tmp_path: Path) -> None:
    out = tmp_path / "report"
    status, shown, err = tensatlas("compare", "--out", out, "--images", "png")
    assert (status, "Wrote the report to" in err) == (0, True)
    assert "note" not in err
    assert "DM-ME" in shown
    assert "25.76 ± 4.93" in shown
    assert {p.name for p in out.iterdir()} == {
        *("report.html", "figures", "runs.csv", "statistics.csv", "tests.csv", "trends.csv"),
    }
    figures = sorted((out / "figures").iterdir())
    assert [f.stem for f in figures] == [
        "goal-reaching-best-fitness",
        "goal-reaching-ends",
        "goal-reaching-maps",
        "goal-reaching-nested-dm-me",
        "goal-reaching-qd-score-and-coverage",
    ]
    sizes = {}
    for figure in figures:
        with Image.open(figure) as image:
            assert len(image.convert("RGB").getcolors(10**6) or range(10**6)) > 20  # something is drawn
            sizes[figure.stem] = image.size
    # two pixels for each of the figure's
    assert sizes["goal-reaching-best-fitness"] == (2160, 800)
    assert sizes["goal-reaching-maps"][1] > 900


def test_compare_without_a_chromium_still_writes_the_page(
    tensatlas: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("BROWSER_PATH", "/nowhere/chromium")
    status, _, err = tensatlas("compare", "--out", tmp_path / "report")
    lines = [line for line in err.splitlines() if "note" in line]
    assert (status, len(lines)) == (0, 1)
    assert "no Chromium could draw the figures" in lines[0]
    assert (tmp_path / "report" / "report.html").stat().st_size > 10**6
    assert not any((tmp_path / "report" / "figures").iterdir())


def test_a_chromium_that_hangs_costs_patience_and_not_the_report(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    browser = tmp_path / "chromium"
    browser.write_text(f"#!/bin/sh\necho $$ >> {tmp_path}/pids\nexec sleep 600\n")
    browser.chmod(0o755)
    monkeypatch.setenv("BROWSER_PATH", str(browser))
    figure = ReportFigure("a", "", go.Figure(layout={"width": 100, "height": 100}))
    with pytest.raises(ExportError, match="did not answer within 10 s"):
        write_images([figure], tmp_path, "svg", patience=4.0)
    pids = (tmp_path / "pids").read_text().split()
    assert pids
    for _ in range(100):
        if not any(_lives(pid) for pid in pids):
            return
        time.sleep(0.1)
    pytest.fail("a browser is left behind")


def _lives(pid: str) -> bool:
    """Tell whether a process is there and no zombie that nobody has waited for."""
    try:
        return "\nState:\tZ" not in Path("/proc", pid, "status").read_text()
    except OSError:
        return False


def test_compare_refuses_a_place_that_is_no_folder(tensatlas: Command, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    status, _, err = tensatlas("compare", "--out", tmp_path / "file", "--images", "none")
    assert (status, err.count("\n")) == (2, 1)
    assert "cannot be used as the report's folder" in err


def test_table(tensatlas: Command, tmp_path: Path) -> None:
    status, _, err = tensatlas("table", "--out", tmp_path / "elites.csv", "--archive", "morphology")
    with open(tmp_path / "elites.csv", newline="") as f:
        rows = list(csv.DictReader(f))
    assert (status, f"Wrote {len(rows)} elites" in err) == (0, True)
    assert {r["archive"] for r in rows} == {"morphology"}


def test_project_info_and_what_the_projection_is_good_for(
    tensatlas: Command, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    up = tmp_path / "up.tsmr"
    status, _, err = tensatlas("project", "--out", up)
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
        main(["project", str(tmp_path / "small.tsmr"), "--out", str(up)])
    assert "exists; choose another name" in capsys.readouterr().err


def test_project_to_a_place_that_is_no_folder_gets_one_line(tensatlas: Command, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    status, out, err = tensatlas("project", "--out", tmp_path / "file" / "up.tsmr")
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert "file is not a folder" in err


def test_reevaluate(tensatlas: Command, tmp_path: Path) -> None:
    status, out, err = tensatlas("reevaluate", "--repeats", 1, "--archive", "morphology")
    assert (status, "Kept in" in err) == (0, True)
    assert "QD score, corrected" in out
    assert "morphology: evaluated again, an elite's f_s" in out
    assert (tmp_path / "small.robust.json").exists()
    # what is there is not simulated again
    status, out, err = tensatlas("reevaluate", "--repeats", 1, "--archive", "morphology", "--json")
    (facts,) = json.loads(out)
    assert (status, err, facts["archive"], facts["n_failed"]) == (0, "", "morphology", 0)
    assert facts["luck"] == pytest.approx(facts["mean"] - facts["mean_again"])
    status, _, err = tensatlas("reevaluate", "--repeats", 0)
    assert (status, err) == (2, "tensatlas: repeats must be from 1 to 100, not 0\n")
