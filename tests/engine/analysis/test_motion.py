import mujoco
import numpy as np
import pytest

from engine.analysis.verify import MotionRecorder
from engine.body.morphology import Morphology
from engine.simulation.batch import SimulationBatch
from engine.simulation.model import build_robot
from engine.simulation.physics import Physics

PHYSICS = Physics()


def touches_ground(model, qpos):
    """Ask MuJoCo's own collision detection."""
    data = mujoco.MjData(model)
    data.qpos[:] = qpos
    mujoco.mj_forward(model, data)
    ground = model.geom("ground").id
    return any(ground in pair for pair in data.contact.geom[: data.ncon])


@pytest.mark.parametrize("body", [Morphology(3, (1, 6)), Morphology(9, (2, 8, 5, 4))])
def test_contact_height_and_speed_are_those_of_plain_mujoco(body):
    robot = build_robot(body, PHYSICS)
    sim = SimulationBatch([robot], copies=1, physics=PHYSICS, n_threads=1)
    recorder = MotionRecorder(robot, PHYSICS)
    released = np.ones((*sim.shape, sim.n_modules, 5))
    contacts, centres, velocities = [], [], []
    for _ in range(60):
        sim.step(released)
        recorder(sim)
        contacts.append(touches_ground(robot.model, sim.qpos[0, 0]))
        centres.append(sim.qpos[0, 0].reshape(body.n_modules, 6, 7)[..., :3].mean(axis=1))
    velocities = np.linalg.norm(np.diff(centres, axis=0), axis=-1) / PHYSICS.control_period
    motion = recorder.motion()
    assert 0 < sum(contacts) < 60  # it starts in the air and lands
    assert motion.airborne == pytest.approx(1.0 - sum(contacts) / 60)
    assert motion.height == np.max(np.array(centres)[..., 2])
    assert motion.speed == pytest.approx(velocities.max(), rel=1e-12)
    assert motion.final_speed == pytest.approx(velocities[-1].max(), rel=1e-12)


def test_a_jump_to_another_batch_is_no_speed():
    robot = build_robot(Morphology(3, (1, 6)), PHYSICS)
    recorder = MotionRecorder(robot, PHYSICS)
    for _ in range(2):
        sim = SimulationBatch([robot], copies=2, physics=PHYSICS, n_threads=1)
        sim.qpos[..., 0::7] += 1.0
        recorder(sim)
    assert recorder.motion().speed == 0.0
    assert recorder.motion().airborne == 1.0
