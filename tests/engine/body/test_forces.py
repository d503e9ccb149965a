"""What cables pull and rods bear, against MuJoCo's own tensions and against balance."""

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from engine.body import module as t
from engine.body.forces import cable_tensions, rod_compressions
from engine.body.morphology import Morphology
from engine.simulation.model import build_robot
from engine.simulation.physics import Physics

BODY = Morphology((4, 9), (1, 2))


@pytest.fixture(scope="module")
def at_rest():
    """A robot that floats at rest with its servos half contracted, and what they are told."""
    robot = build_robot(BODY, Physics(), gravity=False)
    data = mujoco.MjData(robot.model)
    data.ctrl[:] = 0.036
    mujoco.mj_step(robot.model, data, 12_000)
    pose = np.stack([np.concatenate([data.xpos[b], data.xquat[b]], axis=-1) for b in robot.rod_bodies])
    return robot.model, data, pose, np.full((2, len(t.SERVO_NODES)), 0.036)


def test_tensions_are_the_models(at_rest):
    model, data, pose, commanded = at_rest
    pulls = cable_tensions(pose, commanded, np.array(BODY.stiffnesses))
    names = [f"cable_{a}_{b}" for a, b in t.CABLES]
    for m in range(2):
        tendons = [model.tendon(f"m{m}_{name}").id for name in names]
        stretch = data.ten_length[tendons] - model.tendon_lengthspring[tendons, 1]
        stiffness = model.tendon_stiffness[tendons].reshape(len(tendons), -1)[:, 0]
        assert pulls[m, : len(names)] == pytest.approx(stiffness * np.clip(stretch, 0, None), rel=1e-6)
        actuators = [model.actuator(f"m{m}_servo_{n}").id for n in t.SERVO_NODES]
        assert pulls[m, len(names) :] == pytest.approx(-data.actuator_force[actuators], rel=1e-3, abs=1e-3)
    assert (pulls[:, len(names) :] > 0.1).any()


def test_both_ends_of_a_rod_at_rest_are_pressed_alike(at_rest):
    _, _, pose, commanded = at_rest
    stiffness = np.array(BODY.stiffnesses)
    presses = rod_compressions(pose, commanded, stiffness)
    assert presses.shape == (2, len(t.RODS))
    # a tensegrity's rods are pressed, in the stiffer module more
    assert (presses > 0.5).all()
    assert (presses[1] > presses[0]).all()
    # from the nodes alone: node 5 has passive cables only
    pulls = cable_tensions(pose, commanded, stiffness)
    turn = Rotation.from_quat(pose[..., 3:].reshape(-1, 4), scalar_first=True)
    for m in range(2):
        places = [
            turn[6 * m + t.rod_of(n)].apply(t.NODES[n] - t.ROD_MIDDLES[t.rod_of(n)])
            + pose[m, t.rod_of(n), :3]
            for n in range(len(t.NODES))
        ]
        along = (places[4] - places[5]) / t.ROD_LENGTH
        pressing = 0.0
        for pull, nodes in zip(pulls[m], t.CABLES, strict=False):
            if 5 in nodes:
                way = places[sum(nodes) - 5] - places[5]
                pressing += pull * way @ along / np.linalg.norm(way)
        assert presses[m, 2] == pytest.approx(pressing, rel=0.05)


def test_cables_of_twice_the_stiffness_press_twice_as_much(at_rest):
    _, _, pose, _ = at_rest
    released = np.full((2, len(t.SERVO_NODES)), 1.0)
    soft, stiff = (rod_compressions(pose, released, np.full(2, s)) for s in (0.4, 0.8))
    assert stiff == pytest.approx(2.0 * soft)
