"""A task of the user's that does not return."""

import pytest

from engine.storage.reader import RunReader
from tests.support.faulty import SHORT, line_of, tensatlas
from tests.support.run_hash import hash_of

TASK = """
import os, signal, time, itertools
import numpy as np
from engine.tasks import Task

calls = itertools.count()

def sense(view):
    if os.environ.get("HANG") and next(calls) > 300:
        {hang}
    return np.stack(view.to_target(), axis=-1)

TASK = Task(name="hanging", inputs=("distance", "bearing"), sense=sense, target_distance=0.3,
            target_bearings=(0.0,))
"""


@pytest.mark.parametrize(
    ("hang", "said"),
    [
        (
            "while True:\n            try: time.sleep(0.01)\n            except Exception: pass",
            "sense has not returned after 1 s (line 1",
        ),
        # as in a library that lets nothing interrupt it
        (
            "signal.pthread_sigmask(signal.SIG_BLOCK, range(1, 32)); time.sleep(1e6)",
            "sense has not returned after 6 s and cannot be interrupted",
        ),
    ],
    ids=["in Python", "in a library"],
)
def test_it_ends_the_run_with_one_line_and_the_run_can_be_gone_on_with(tmp_path, monkeypatch, hang, said):
    task, path = tmp_path / "hanging.py", tmp_path / "run.tsmr"
    task.write_text(TASK.format(hang=hang))
    environment = {"TENSATLAS_TASK_TIMEOUT": "1", "TENSATLAS_TASKS": str(task)}
    done = tensatlas("evolve", path, "--task", task, *SHORT, env=environment | {"HANG": "1"})
    assert done.returncode != 0
    assert said in line_of(done)
    assert str(task) in line_of(done)
    monkeypatch.setenv("TENSATLAS_TASKS", str(task))
    monkeypatch.setattr("engine.tasks.loading._loaded", {})
    with RunReader(path) as reader:
        assert reader.n_evaluations() < 14
    if "except" in hang:
        assert tensatlas("resume", path, "--workers", "1", env=environment).returncode == 0
        undisturbed = tmp_path / "undisturbed.tsmr"
        assert tensatlas("evolve", undisturbed, "--task", task, *SHORT, env=environment).returncode == 0
        assert hash_of(path) == hash_of(undisturbed)


def test_a_file_that_hangs_when_it_is_loaded(tmp_path):
    task = tmp_path / "hanging.py"
    task.write_text("while True:\n    pass\n")
    done = tensatlas(
        "evolve", tmp_path / "run.tsmr", "--task", task, *SHORT, env={"TENSATLAS_TASK_TIMEOUT": "1"}
    )
    assert done.returncode == 2
    assert f"{task}: has not returned after 1 s (line" in line_of(done)
    assert not (tmp_path / "run.tsmr").exists()
