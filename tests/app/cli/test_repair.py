"""``recover`` and ``migrate`` as a user types them."""

import shutil
import sqlite3

from engine.storage.reader import RunReader


def test_recover_and_migrate(tensatlas, small_run, tmp_path):
    path, out = shutil.copy(small_run, tmp_path / "run.tsmr"), tmp_path / "new.tsmr"
    db = sqlite3.connect(path, isolation_level=None)
    db.execute("DELETE FROM evaluations WHERE number = 16")
    db.close()
    status, _, err = tensatlas("recover", path, "--out", out)
    assert status == 0
    assert "Saved 2 of 3 closed generations and 17 evaluations, 3 of them after" in err
    assert "1 evaluations are missing: 16" in err
    assert f"tensatlas resume {out}" in err
    status, _, err = tensatlas("recover", path, "--out", out)
    assert status == 2
    assert f"{out} exists" in err
    status, _, err = tensatlas("migrate", path, "--out", tmp_path / "copy.tsmr")
    assert (status, "has the present format (2) already" in err) == (2, True)
    db = sqlite3.connect(path, isolation_level=None)
    for table in ("digests", "computed", "computers"):
        db.execute(f"DROP TABLE {table}")
    db.execute("PRAGMA user_version=1")
    db.close()
    status, _, err = tensatlas("migrate", path, "--out", tmp_path / "copy.tsmr")
    assert (status, "is left in format 1" in err) == (0, True)
    with RunReader(tmp_path / "copy.tsmr") as reader:
        assert reader.format_version == 2
