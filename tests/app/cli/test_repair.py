"""``recover`` and ``migrate`` as a user types them."""

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
