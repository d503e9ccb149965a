"""``recover``, ``migrate`` and ``slim`` as a user types them."""

import json
import shutil

from engine.storage.reader import RunReader
from tests.support.run_formats import change, in_format


def test_recover_and_migrate(tensatlas, small_run, tmp_path):
    path, out = shutil.copy(small_run, tmp_path / "run.tsmr"), tmp_path / "new.tsmr"
    change(path, "DELETE FROM evaluations WHERE number = 16")
    status, _, err = tensatlas("recover", path, "--out", out)
    assert status == 0
    assert "Saved 2 of 3 closed generations and 17 evaluations, 3 of them after" in err
    assert "1 evaluations are missing: 16" in err
    assert f"tensatlas resume {out}" in err
    status, _, err = tensatlas("recover", path, "--out", out)
    assert status == 2
    assert f"{out} exists" in err
    status, _, err = tensatlas("migrate", path, "--out", tmp_path / "copy.tsmr")
    assert (status, "has the present format (3) already" in err) == (2, True)
    old = in_format(small_run, tmp_path / "old.tsmr", 1)
    status, _, err = tensatlas("migrate", old, "--out", tmp_path / "copy.tsmr")
    assert (status, "is left in format 1" in err) == (0, True)
    with RunReader(tmp_path / "copy.tsmr") as reader:
        assert reader.format_version == 3


def test_slim(tensatlas, small_run, tmp_path):
    out = tmp_path / "slim.tsmr"
    status, _, err = tensatlas("slim", small_run, "--out", out)
    assert status == 0
    with RunReader(out) as reader:
        n = reader.slimmed.n_kept
    assert f"Wrote {out} with {n} robots: " in err
    assert f"tensatlas explore {out}" in err
    status, text, _ = tensatlas("info", out)
    assert f"it holds {n} robots, all that the explorer shows" in text
    assert json.loads(tensatlas("info", "--json", out)[1])["slimmed"] == {"robots": n}
    assert json.loads(tensatlas("info", "--json", small_run)[1])["slimmed"] is None
    status, _, err = tensatlas("resume", out)
    assert (status, len(err.splitlines())) == (2, 1)
    assert "is slimmed and cannot be resumed" in err
