"""The simulations whose outcome is known."""

from __future__ import annotations

import functools
import json

import mujoco
import numpy as np
import pytest

from engine.control.genome import Controller
from engine.simulation import self_check
from engine.simulation.evaluation import LocalEvaluator, Solution
from engine.simulation.physics import Physics
from engine.simulation.provenance import KNOWN_SIMULATION, versions
from engine.tasks import GOAL_REACHING

KINDS = {int(mujoco.mjtGeom.mjGEOM_PLANE): "plane", int(mujoco.mjtGeom.mjGEOM_BOX): "box"}


@pytest.fixture(scope="module")
def found():
    return self_check.compare()


def test_the_known_simulations_come_out_to_the_last_bit(found):
    # after a change of the physics: python -m engine.simulation.self_check
    assert found.same_body
    assert found.identical, found
    assert found.good
    assert found.deviation == 0.0
    assert found.digest == json.loads(KNOWN_SIMULATION.read_text())["digest"]
    assert versions()["kernel"] == found.digest


def test_one_wrong_bit_is_noticed(found, tmp_path, monkeypatch):
    known = json.loads(KNOWN_SIMULATION.read_text())
    distance = known["simulations"][1]["distances"][0][0]
    known["simulations"][1]["distances"][0][0] = float(np.nextafter(distance, 1.0))
    known["digest"] = "0" * 16
    monkeypatch.setattr(self_check, "KNOWN_SIMULATION", tmp_path / "known.json")
    (tmp_path / "known.json").write_text(json.dumps(known))
    wrong = self_check.compare()
    assert not wrong.good
    assert 0.0 < wrong.deviation < 1e-15
    assert wrong.digest == found.digest


def test_feet_that_grip_otherwise_are_noticed(found, monkeypatch):
    """Only a robot with feet tells whether they are simulated as they were."""
    rougher = functools.partial(Physics, feet_backward=0.81)
    monkeypatch.setattr(self_check, "Physics", rougher)
    wrong = self_check.compare()
    assert wrong.digest == found.digest
    assert not wrong.identical
    assert 0.0 < wrong.deviation < 0.05


def test_rods_touch_ground_walls_and_each_other():
    """In the simulations that are known, so that a change of any contact shows."""
    kinds = [_touched(task, body) for task, body in self_check.KNOWN]
    assert {"plane", "rod"} <= kinds[0]
    assert {"plane", "box"} <= kinds[1]


def _touched(task, body):
    """Return what rods touch in the trials of a known simulation."""
    known = json.loads(KNOWN_SIMULATION.read_text())["simulations"][task is not GOAL_REACHING]
    touched = set()

    def watch(sim):
        model = sim.model(0)
        data = mujoco.MjData(model)
        data.qpos[:] = sim.qpos[0, 0]
        mujoco.mj_fwdPosition(model, data)
        for pair in data.contact.geom:
            others = [KINDS[kind] for kind in model.geom_type[pair].tolist() if kind in KINDS]
            touched.update(others or ["rod"])

    solution = Solution(number=0, morphology=body, controller=Controller.from_json(known["controller"]))
    evaluator = LocalEvaluator(
        task=task, physics=Physics(), trials=self_check.TRIALS, run_seed=0, observer=watch
    )
    (evaluation,) = next(evaluator.evaluate([solution]))
    assert evaluation.failure is None
    return touched
