"""``evolve`` and ``resume`` as a user types them."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from app.cli.main import main
from engine.storage.reader import RunReader
from engine.tasks import TASKS_VARIABLE, loading
from tests.support.command_line import TINY, Command

ROOT = Path(__file__).resolve().parents[3]
EXAMPLE = ROOT / "docs" / "tasks" / "climb_step.py"


def test_a_task_from_a_file(tensatlas: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Evolve with --task FILE.py, then look at the run with and without the file."""
    monkeypatch.setattr(loading, "_loaded", {})
    monkeypatch.delenv(TASKS_VARIABLE, raising=False)
    status, _, err = tensatlas("evolve", "step.tsmr", *TINY, "--workers", 1, f"--task={EXAMPLE}")
    assert status == 0
    assert f"with: TENSATLAS_TASKS={EXAMPLE} tensatlas explore step.tsmr" in err
    facts = json.loads(tensatlas("info", "step.tsmr", "--json")[1])
    assert facts["task"] == facts["config"]["task"] == "climb-step"
    assert set(facts["versions"]) >= {"task climb-step"}
    with RunReader(tmp_path / "step.tsmr") as reader:
        cell = "{},{}".format(*next(iter(reader.placements("morphology", 1))))
    assert tensatlas("export", "step.tsmr", "--cell", cell, "--out", "robot")[0] == 0
    assert "| step of 2 cm |" in (tmp_path / "robot" / "README.md").read_text()
    status, out, _ = tensatlas("verify", "step.tsmr", "--cell", cell, "--seeds", 1, "--workers", 1)
    assert (status, "identical to what was recorded" in out, "step of" in out) == (0, True, True)

    monkeypatch.setattr(loading, "_loaded", {})
    for command in ("info", "resume", "explore"):
        status, _, err = tensatlas(command, "step.tsmr")
        assert (status, err.count("\n")) == (2, 1)
        assert "unknown task 'climb-step'" in err
        assert TASKS_VARIABLE in err
    monkeypatch.setenv(TASKS_VARIABLE, str(EXAMPLE))
    status, out, _ = tensatlas("info", "step.tsmr")
    assert (status, "climb-step" in out) == (0, True)
    assert tensatlas("resume", "step.tsmr")[0] == 0


def test_a_task_file_with_an_error_leaves_no_run(tensatlas: Command, tmp_path: Path) -> None:
    (tmp_path / "broken.py").write_text("TASK = Task(\n")
    for flags in (("--task", "broken.py"), ("--task", "missing.py"), ("--task", "flying")):
        status, _, err = tensatlas("evolve", "a.tsmr", *TINY, *flags)
        assert (status, err.count("\n")) == (2, 1)
        assert flags[1] in err
    assert not (tmp_path / "a.tsmr").exists()


def test_an_existing_run_is_not_overwritten(tensatlas: Command, tmp_path: Path, small_run: Path) -> None:
    path = tmp_path / "a.tsmr"
    path.write_bytes(small_run.read_bytes())
    status, _, err = tensatlas("evolve", "a.tsmr", *TINY)
    assert (status, "tensatlas resume a.tsmr" in err) == (2, True)
    assert path.read_bytes() == small_run.read_bytes()
    assert os.listdir(tmp_path) == ["a.tsmr"]


@pytest.mark.parametrize("sign", [signal.SIGINT, signal.SIGTERM])
def test_ctrl_c_saves_and_says_how_to_go_on(tmp_path: Path, sign: signal.Signals) -> None:
    path = tmp_path / "long.tsmr"
    flags = [
        "--preset",
        "smoke",
        "--evaluations",
        "500",
        "--initial",
        "4",
        "--batch-size",
        "2",
        "--workers",
        "1",
    ]
    process = subprocess.Popen(
        [sys.executable, "-m", "app", "evolve", str(path), *flags],
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline:
        if path.exists():
            with RunReader(path) as reader:
                if reader.last_generation() is not None:
                    break
        time.sleep(0.1)
    process.send_signal(sign)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "Traceback" not in err
    assert f"tensatlas resume {path}" in err
    assert os.listdir(tmp_path) == ["long.tsmr"]
    with RunReader(path) as reader:
        assert reader.n_evaluations() >= 4
        assert not reader.is_live


def test_a_run_starts_from_the_robots_of_another(tensatlas: Command, small_run: Path, tmp_path: Path) -> None:
    with RunReader(small_run) as reader:
        (cell, number), *_ = reader.placements("morphology", 2).items()
    source = f"{small_run}:{cell[0]},{cell[1]}"
    status, _, err = tensatlas("evolve", "next.tsmr", *TINY, "--workers", 1, "--from", source)
    assert (status, "Finished" in err) == (0, True)
    with RunReader(tmp_path / "next.tsmr") as reader, RunReader(small_run) as other:
        first = reader.evaluation(0).solution
        assert (first.operator, first.source) == ("given", f"small.tsmr robot {number}")
        assert first.controller == other.evaluation(number).solution.controller
    assert f"1 given robot: small.tsmr robot {number}" in tensatlas("info", "next.tsmr")[1]
    status, _, err = tensatlas("evolve", "x.tsmr", *TINY, "--from", "gone.csv")
    assert (status, err.count("\n")) == (2, 1)
    assert "gone.csv cannot be read" in err


def test_evolve_with_processes_says_what_computed(tmp_path, capsys):
    path = tmp_path / "run.tsmr"
    flags = "--preset smoke --evaluations 8 --initial 6 --batch-size 2 --workers 2".split()
    main(["evolve", str(path), *flags, "--trials.trial-time", "1.0"])
    capsys.readouterr()
    main(["info", str(path), "--json"])
    (computer,) = json.loads(capsys.readouterr().out)["computed_on"]
    assert computer["evaluations"] == 8
    main(["info", str(path)])
    assert "computed on" in capsys.readouterr().out


def test_robots_are_evolved_as_they_would_be_built(tensatlas: Command, tmp_path: Path) -> None:
    run = tmp_path / "built.tsmr"
    small = "--preset smoke --evaluations 4 --initial 4 --refit-generations 0".split()
    code, _, _ = tensatlas("evolve", run, *small, "--as-built", "latex-sheet", "--spread")
    assert code == 0
    with RunReader(run) as reader:
        physics = reader.config.physics
    assert physics.built.winding == "cams"
    assert physics.built.sensing_delay > 0.0
    assert physics.spread.stiffness > 0.0


def test_robots_cannot_differ_without_a_material(tensatlas: Command, tmp_path: Path) -> None:
    code, _, err = tensatlas("evolve", tmp_path / "x.tsmr", "--spread")
    assert code == 2
    assert "--spread needs --as-built" in err
