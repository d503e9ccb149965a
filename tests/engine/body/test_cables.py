from __future__ import annotations

import mujoco
import numpy as np
import pytest

from engine.body import module as t
from engine.body import servo
from engine.body.kinematics import contraction, internal_lengths, internal_tension, passive_tension
from engine.body.morphology import Morphology
from engine.simulation.model import build_robot
from engine.simulation.physics import Physics

BODY = Morphology((3, 10, 6), (4, 7, 1))


@pytest.fixture
def data() -> tuple[mujoco.MjModel, mujoco.MjData]:
    """A robot that has been pushed about, at rest for the moment, with servos half turned."""
    model = build_robot(BODY, Physics()).model
    data = mujoco.MjData(model)
    data.ctrl[:] = np.tile(servo.target_lengths(np.array(90.0)), BODY.n_modules)
    mujoco.mj_step(model, data, 200)
    data.qvel[:] = 0.0
    mujoco.mj_forward(model, data)
    return model, data


def test_lengths_and_tensions_are_mujocos(data: tuple[mujoco.MjModel, mujoco.MjData]) -> None:
    model, state = data
    pose = state.qpos.reshape(BODY.n_modules, 6, 7)
    n = len(t.CABLES) + len(t.SERVO_NODES)
    tendons = state.ten_length[: n * BODY.n_modules].reshape(BODY.n_modules, n)
    internal = internal_lengths(pose)
    np.testing.assert_allclose(internal, tendons[:, len(t.CABLES) :], atol=1e-9)
    commanded = state.ctrl.reshape(BODY.n_modules, -1)
    np.testing.assert_allclose(
        internal_tension(internal, commanded).ravel(), -state.actuator_force, atol=1e-7
    )
    passive = passive_tension(tendons[:, : len(t.CABLES)], np.array(BODY.stiffnesses)[:, None])
    stiffness = model.tendon_stiffness[: n * BODY.n_modules].reshape(BODY.n_modules, n)[:, : len(t.CABLES)]
    over = tendons[:, : len(t.CABLES)] - t.CABLE_REST_LENGTH
    np.testing.assert_allclose(passive, np.maximum(stiffness * over, 0.0), atol=1e-9)
    assert passive.max() > 0.5


def test_contraction_goes_from_released_to_fully_turned() -> None:
    values = contraction(servo.target_lengths(np.array([0.0, 45.0, 90.0, 180.0])))
    assert values[0] == 0.0
    assert values[-1] == 1.0
    assert (np.diff(values) > 0).all()
