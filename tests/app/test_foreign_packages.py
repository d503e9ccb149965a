"""Somebody else's ``app``, ``engine`` and ``viz`` lie in the current folder and in ``PYTHONPATH``."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

import tensatlas
from app.runs import launcher
from app.runs.launcher import NewRun
from engine.children import command_line
from engine.config import preset, replaced
from engine.storage.reader import RunReader
from engine.storage.writer import is_being_written
from viz.report import images

CAMPAIGN = """
preset = "smoke"
tasks = ["goal-reaching"]
algorithms = ["dm-me"]
seeds = [5]
[config]
evaluations = 6
initial = 4
batch_size = 2
trials.repeats = 1
"""


@pytest.fixture
def foreign(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A file that appears if what somebody has put into the current folder and the search path is run."""
    ran = tmp_path / "ran"
    for folder in ("here", "elsewhere"):
        for name in (*tensatlas.PACKAGES, "random"):
            if (folder, name) != (
                "elsewhere",
                "random",
            ):  # whoever sets PYTHONPATH may mean Python's own modules
                path = tmp_path / folder / f"{name}.py"
                path.parent.mkdir(exist_ok=True)
                path.write_text(f"open({str(ran)!r}, 'a').write(__file__ + '\\n')\n")
    monkeypatch.chdir(tmp_path / "here")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path / "elsewhere"))
    return ran


def test_a_campaign_and_its_workers_run_none_of_it(foreign: Path) -> None:
    Path("campaign.toml").write_text(CAMPAIGN)
    line = command_line("campaign", "campaign.toml", "--out", "out", "--images", "none", "--workers", "2")
    done = subprocess.run(line, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert not foreign.exists()
    with RunReader(Path("out/goal-reaching_dm-me_5.tsmr")) as reader:
        assert reader.n_evaluations() == 6


def test_a_run_of_the_app_runs_none_of_it(foreign: Path) -> None:
    config = replaced(preset("smoke"), evaluations=6, initial=4, batch_size=2)
    path = launcher.start(NewRun(name="new", preset="smoke", config=config, workers=1))
    deadline = time.monotonic() + 120
    while is_being_written(path) and time.monotonic() < deadline:
        time.sleep(0.1)
    assert not foreign.exists()
    with RunReader(path) as reader:
        assert reader.n_evaluations() == 6


def test_the_drawing_of_figures_runs_none_of_it(foreign: Path) -> None:
    status, said = images._run("no JSON", 60.0)
    assert status == 1
    assert "Expecting value" in said
    assert not foreign.exists()


def test_what_was_imported_before_ours_is_said(foreign: Path) -> None:
    code = (
        "import sys, engine; sys.path.insert(0, sys.argv[1]); sys.argv[1:] = ['info', 'x']\n"
        "import tensatlas; tensatlas.main()"
    )
    done = subprocess.run(
        [sys.executable, "-P", "-c", code, tensatlas.ROOT], capture_output=True, text=True, check=False
    )
    assert done.returncode == 2
    there = os.path.dirname(os.environ["PYTHONPATH"]) + "/elsewhere"  # noqa: PTH120
    assert done.stderr == (
        f"tensatlas: a package called 'engine' in {there} was imported before TensAtlas's own in"
        f" {tensatlas.ROOT}; rename it, or start TensAtlas without it\n"
    )
    assert foreign.exists()
