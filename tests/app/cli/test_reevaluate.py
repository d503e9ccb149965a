"""``reevaluate`` as a user types it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.support.command_line import Command


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
