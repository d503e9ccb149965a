"""``reevaluate`` as a user types it."""

from __future__ import annotations

import csv
import json
import shutil
from pathlib import Path

import pytest

from engine.storage.reader import RunReader
from tests.support.command_line import Command
from viz.maps.coloring import colorings


def test_reevaluate(tensatlas: Command, copy: Path, tmp_path: Path) -> None:
    status, out, err = tensatlas("reevaluate", copy, "--repeats", 1, "--archive", "morphology")
    assert (status, "Kept in" in err) == (0, True)
    assert "QD score, corrected" in out
    assert "morphology: evaluated again, an elite's f_s" in out
    assert (tmp_path / "small.robust.json").exists()
    # what is there is not simulated again
    status, out, err = tensatlas("reevaluate", copy, "--repeats", 1, "--archive", "morphology", "--json")
    (facts,) = json.loads(out)
    assert (status, err, facts["archive"], facts["n_failed"]) == (0, "", "morphology", 0)
    assert facts["luck"] == pytest.approx(facts["mean"] - facts["mean_again"])
    status, _, err = tensatlas("reevaluate", copy, "--repeats", 0)
    assert (status, err) == (2, "tensatlas: repeats must be from 1 to 100, not 0\n")


def test_several_runs_and_folders_one_after_another(
    tensatlas: Command, copy: Path, tmp_path: Path, grid_run: Path
) -> None:
    (tmp_path / "more").mkdir()
    shutil.copy(grid_run, tmp_path / "more" / "grid.tsmr")
    command = ("reevaluate", copy, tmp_path / "more", "--repeats", 1, "--archive", "morphology")
    status, out, err = tensatlas(*command)
    assert (status, err.count("Kept in")) == (0, 2)
    assert out.index("small.tsmr") < out.index("grid.tsmr")
    facts = json.loads(tensatlas(*command, "--json")[1])
    assert [Path(f["run"]).stem for f in facts] == ["small", "grid"]
    # the bodies' best of a 4-D archive, as compare takes them
    status, out, _ = tensatlas("compare", *command[1:3], "--images", "none")
    assert "over fresh noise" in out
    with (tmp_path / "comparison" / "runs.csv").open(newline="") as f:
        best = {Path(r["run"]).stem: float(r["robust_best_f_s_cm"]) for r in csv.DictReader(f)}
    assert best == {Path(f["run"]).stem: pytest.approx(100 * f["best_again"]) for f in facts}


def test_elites_as_they_would_be_built(tensatlas: Command, copy: Path, tmp_path: Path) -> None:
    command = ("reevaluate", copy, "--repeats", 1, "--archive", "morphology", "--as-built", "latex-sheet")
    status, _, err = tensatlas(*command)
    assert (status, "small.as_built.json" in err) == (0, True)
    assert not (tmp_path / "small.robust.json").exists()
    kept = json.loads((tmp_path / "small.as_built.json").read_text())
    assert kept["versions"]["robots of"].startswith("latex-sheet (")
    with RunReader(copy) as reader:
        assert "as-built fitness" in colorings(reader)
        assert "robust fitness" not in colorings(reader)
        coloring = colorings(reader)["as-built fitness"](reader, 1)
    assert coloring is not None
    # robots of another material are other robots
    status, _, err = tensatlas(*command[:-1], "tpu-85a")
    assert (status, err.count("\n")) == (2, 1)
    assert "was made with robots of latex-sheet" in err
    # nothing new is simulated, and built robots do differ from evolved ones
    (built,) = json.loads(tensatlas(*command, "--json")[1])
    (evolved,) = json.loads(tensatlas(*command[:-2], "--json")[1])
    assert built["mean"] == evolved["mean"]
    assert built["mean_again"] != evolved["mean_again"]
