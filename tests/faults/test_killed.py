"""SIGKILL at random moments; ``python -m benchmarks.faults`` does it longer."""

import json
import signal

from engine.errors import RunFileError
from engine.storage.check import check_run
from engine.storage.lock import holder_of, is_being_written, lock_path
from engine.storage.reader import RunReader
from tests.support.faulty import SHORT, line_of, python, start, tensatlas, wait_until
from tests.support.run_hash import hash_of

KILL = """
import json, sys, tempfile, dataclasses
from benchmarks.faults import kill_at_random
found = kill_at_random({config}, path, kills={kills}, seed={seed})
print(json.dumps(dataclasses.asdict(found)))
"""


def check(done, kills):
    found = json.loads(done.stdout)
    assert len(found["kills"]) == kills
    assert not found["problems"]
    assert found["n_identical"] == found["n_runs"] > 0


def test_runs_that_only_write_are_killed_and_end_like_an_undisturbed_one(tmp_path):
    check(python(KILL.format(config="SMALL", kills=12, seed=1), tmp_path), 12)


def test_runs_of_real_simulations_are_killed_and_end_like_an_undisturbed_one(tmp_path):
    real = "import importlib; importlib.reload(engine.runs.evolve)\n"
    check(python(real + KILL.format(config="TINY", kills=2, seed=2), tmp_path), 2)


def can_be_read(path):
    try:
        RunReader(path).close()
    except RunFileError:
        return False
    return True


def test_two_writers_and_one_that_is_killed(tmp_path):
    path = tmp_path / "run.tsmr"
    first = start("evolve", path, *SHORT)
    try:
        wait_until(lambda: holder_of(path) is not None and can_be_read(path))
        first.send_signal(signal.SIGSTOP)  # or it may end before the other has begun
        line = line_of(tensatlas("resume", path))
        assert f"{path} is being written by another process ({first.pid} on " in line
        assert "since 20" in line
        assert f"evolve {path}" in line
        assert is_being_written(path)
    finally:
        first.kill()
        first.wait()
    assert first.returncode == -signal.SIGKILL
    # its lock is left and is known to be stale
    assert lock_path(path).exists()
    assert not is_being_written(path)
    (note,) = [f for f in check_run(path) if "ended without closing" in f.text]
    assert f"{first.pid} on" in note.text
    assert not [f for f in check_run(path) if f.verdict == "problem"]
    assert tensatlas("resume", path, "--workers", "1").returncode == 0
    assert not lock_path(path).exists()
    assert tensatlas("evolve", tmp_path / "undisturbed.tsmr", *SHORT).returncode == 0
    assert hash_of(path) == hash_of(tmp_path / "undisturbed.tsmr")
