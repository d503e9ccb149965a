"""Runs and tasks for workers to compute."""

import pytest

from engine.config import preset, replaced
from engine.simulation.trials import TrialConfig
from engine.tasks import load_task, loading
from tests.support.run_hash import hash_of

TASK = """
import os, signal, time
import numpy as np
from engine.tasks import Task, distance_and_bearing

def walls(target, n_modules):
    if n_modules == 3:
        {then}
    return ()

TASK = Task(
    name="{name}", summary="its worlds for robots of three modules are bad", inputs=("distance", "bearing"),
    sense=lambda view: np.stack(view.to_target(), axis=-1),
    target_distance=0.3, target_bearings=(0.0, 0.0), names=("one", "two"), walls=walls,
)
"""


@pytest.fixture(scope="session")
def tiny_run(simulated_run):
    """A finished run of real simulations on a thread of this process, and its hash; not to be changed."""
    return simulated_run, hash_of(simulated_run)


@pytest.fixture
def bad_task(tmp_path):
    """Return what makes a configuration whose robots of three modules do something to their worker."""
    made = []

    def make(name, then):
        file = tmp_path / f"{name}.py"
        file.write_text(TASK.format(name=name, then=then))
        load_task(file)
        made.append(name)
        return replaced(
            preset("smoke"),
            task=name,
            evaluations=4,
            initial=4,
            refit_generations=(0,),
            seed=3,  # one of the four has three modules
            trials=TrialConfig(repeats=1, settle_time=0.2, open_loop_time=0.2, trial_time=1.0),
        )

    yield make
    for name in made:
        loading._loaded.pop(name)
