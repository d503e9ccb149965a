"""``compare`` as a user types it."""

from __future__ import annotations

import time
from pathlib import Path

import plotly.graph_objects as go
import pytest
from PIL import Image

from engine.config import replaced
from engine.errors import ExportError
from tests.support.command_line import Command
from tests.support.made_up import MADE_UP
from tests.support.made_up_grid import random_grid_run
from viz.report.images import write_images
from viz.report.report import ReportFigure


def test_compare_writes_a_report_tables_and_figures(tensatlas: Command, copy: Path, tmp_path: Path) -> None:
    out = tmp_path / "report"
    status, shown, err = tensatlas("compare", copy, "--out", out, "--images", "png")
    assert (status, "Wrote the report to" in err) == (0, True)
    assert "note" not in err
    assert "DM-ME" in shown
    assert "25.76 ± 4.93" in shown
    assert {p.name for p in out.iterdir()} == {
        *("report.html", "figures", "tables.md"),
        *("runs.csv", "groups.csv", "statistics.csv", "tests.csv", "trends.csv"),
    }
    figures = sorted((out / "figures").iterdir())
    assert [f.stem for f in figures] == [
        "goal-reaching-best-fitness",
        "goal-reaching-cells-above",
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
    tensatlas: Command, copy: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("BROWSER_PATH", "/nowhere/chromium")
    status, _, err = tensatlas("compare", copy, "--out", tmp_path / "report")
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
    figures = tmp_path / "figures"
    figures.mkdir()
    (figures / "a.svg").write_text("from before")
    with pytest.raises(ExportError, match="did not answer within 10 s"):
        write_images([figure], figures, "svg", patience=4.0)
    assert [(p.name, p.read_text()) for p in figures.iterdir()] == [("a.svg", "from before")]
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


def test_a_baseline_and_a_threshold_of_ones_own(tensatlas: Command, copy: Path, tmp_path: Path) -> None:
    out = tmp_path / "report"
    command = ("compare", copy, "--out", out, "--images", "none")
    status, shown, _ = tensatlas(*command, "--baseline", "small", "--above", 1.5)
    assert status == 0
    assert "Cells above 1.50 cm" in shown
    assert "A12 against DM-ME" in (out / "tables.md").read_text()
    status, _, err = tensatlas(*command, "--baseline", "nothing")
    assert (status, err) == (
        2,
        "tensatlas: no group is called 'nothing', and no run; the groups are: DM-ME\n",
    )


def test_each_of_many_groups_is_a_line(tensatlas: Command, tmp_path: Path) -> None:
    for seed, batch_size in enumerate((4, 6, 6, 8, 10)):
        config = replaced(MADE_UP, seed=seed, batch_size=batch_size, evaluations=32)
        random_grid_run(tmp_path / "runs" / f"{seed}.tsmr", seed, config=config)
    status, shown, _ = tensatlas("compare", "runs", "--out", "report", "--images", "none", "--baseline", 1)
    assert status == 0
    lines = [line.split("│")[1:3] for line in shown.splitlines() if line.startswith("│") and "DM-ME" in line]
    assert [int(n) for _, n in lines] == [1, 1, 2, 1]
    assert "too few runs to say which group is better" in shown


def test_compare_refuses_a_place_that_is_no_folder(tensatlas: Command, copy: Path, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    status, _, err = tensatlas("compare", copy, "--out", tmp_path / "file", "--images", "none")
    assert (status, err.count("\n")) == (2, 1)
    assert "cannot be used as the report's folder" in err
