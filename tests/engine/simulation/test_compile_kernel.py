"""What is compiled beforehand is all that simulating needs."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

# whoever imports it while a test names another cache folder would have the whole session compile
import engine.simulation.kernel.loop.closed_loop  # noqa: F401
from engine.simulation.compile_kernel import is_compiled, kept_in
from engine.simulation.kernel.lanes import compiling

EVERYTHING = """
import dataclasses
from engine.body.morphology import Morphology
from engine.export import simulate_trial
from engine.fabrication.firmware import firmware_files
from engine.replay.replay import Replay
from engine.replay.what_if import WhatIf
from engine.simulation.compile_kernel import compile_kernel, is_compiled
from engine.simulation.evaluation import LocalEvaluator, Solution
from engine.simulation.physics import Physics
from engine.simulation.trials import TrialConfig
from engine.tasks import GOAL_REACHING, SQUEEZING
from tests.support.made_up import TINY, evolved_controller

compile_kernel()
assert is_compiled()
from engine.simulation.kernel import step
from engine.simulation.kernel.loop import closed_loop
before = [len(f.signatures) for f in (step.run, closed_loop.begin, closed_loop.run)]
assert before == [0, 1, 1], before
trials = TrialConfig(repeats=2, settle_time=0.2, open_loop_time=0.2, trial_time=1.0)
own = dataclasses.replace(GOAL_REACHING, name="own", sense=lambda view: GOAL_REACHING.sense(view))
for task in (GOAL_REACHING, SQUEEZING, own):
    controller = evolved_controller(1, 3, task.n_inputs)
    solutions = [
        Solution(number=n, morphology=Morphology(5, (1,) * n), controller=controller) for n in (2, 5)
    ]
    evaluator = LocalEvaluator(task=task, physics=Physics(), trials=trials, run_seed=0, n_threads=2)
    found = [e for group in evaluator.evaluate(solutions) for e in group]
    if task is own:
        continue
    config = dataclasses.replace(TINY, task=task.name, physics=Physics(), trials=trials)
    Replay(config, found[0]).advance(1.4)
    WhatIf(config, found[0], Morphology(4, (1, 2, 3))).run()
    simulate_trial(config, found[1])
    firmware_files(config, found[1], run="a")
assert [len(f.signatures) for f in (step.run, closed_loop.begin, closed_loop.run)] == before
"""


def test_nothing_else_is_compiled_by_evaluating_replaying_changing_and_exporting():
    done = subprocess.run([sys.executable, "-c", EVERYTHING], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_another_cache_folder_has_nothing_compiled(tmp_path):
    code = (
        "from engine.simulation.compile_kernel import is_compiled, kept_in; print(is_compiled(), kept_in())"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        env=os.environ | {compiling.CACHE_VARIABLE: str(tmp_path / "cache")},
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout == f"False {tmp_path / 'cache'}\n"


@pytest.fixture
def unwritable(tmp_path, monkeypatch):
    (tmp_path / "file").touch()
    monkeypatch.setenv(compiling.CACHE_VARIABLE, str(tmp_path / "file" / "below"))


@pytest.mark.usefixtures("unwritable")
def test_where_nothing_can_be_kept_it_is_compiled_all_the_same():
    assert kept_in() is None
    assert not is_compiled()
    assert compiling.entry_point(lambda x: 2 * x)(2) == 4


def test_another_processor_has_a_folder_of_its_own(monkeypatch):
    source = Path(compiling.__file__)
    here = compiling.cache_folder(source)
    monkeypatch.setattr(compiling.numba.config, "CPU_NAME", "generic")
    assert compiling.cache_folder(source) != here
