"""The kernel does what MuJoCo does, solved by Newton to a tight tolerance."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from engine.body.morphology import Morphology
from engine.simulation.kernel.batch import KernelBatch
from engine.simulation.model import build_robot, with_walls
from tests.support.kernel_recorded import (
    ACROSS,
    BETWEEN,
    FREE,
    GATE,
    PHYSICS,
    STEPS,
    commands,
    newton,
    of_centres,
    record,
    stepped,
)

EXACT = {"settled": 1e-12, "most_sweeps": 20_000}
SETTLED = 70
"""Control updates after which a robot rests."""
CHAIN = build_robot(Morphology(3, (2, 7, 1, 4)), PHYSICS)


@pytest.fixture(scope="module", params=["free", "gate", "steps"])
def recorded(request):
    robot, walls, seconds = {"free": (FREE, (), 6), "gate": (BETWEEN, GATE, 3), "steps": (ACROSS, STEPS, 3)}[
        request.param
    ]
    return robot, walls, record(robot, walls, seconds, seed=4)


def test_states_have_what_they_are_recorded_for(recorded):
    _, walls, states = recorded
    assert states.on_ground.max() >= 4
    assert (states.on_walls.sum() >= 40) if walls else (states.of_rods.sum() > 10)
    # some fall freely, some slide
    assert (states.on_ground == 0).any()
    assert (np.abs(of_centres(states.qvel)).max(axis=(1, 2))[states.on_ground > 0] > 0.1).any()


def test_a_step_is_newtons(recorded):
    """Within what Newton's own tolerance leaves, some 1e-9 m/s."""
    robot, walls, states = recorded
    error = np.abs(of_centres(stepped(robot, walls, states, **EXACT)) - of_centres(states.next_qvel))
    assert error.max() < 5e-9
    assert np.median(error.max(axis=(1, 2))) < 1e-10


def test_a_step_of_a_run_is_newtons(recorded):
    """A run's sweeps end early; states without known forces are the worst for it."""
    robot, walls, states = recorded
    error = np.abs(of_centres(stepped(robot, walls, states)) - of_centres(states.next_qvel)).max(axis=(1, 2))
    assert error.max() < (1e-8 if walls else 2e-7)
    assert np.quantile(error, 0.9) < (3e-9 if walls else 1e-7)
    assert np.median(error) < (1e-9 if walls else 3e-8)


@pytest.mark.parametrize(
    ("robot", "walls", "seed", "bound"),
    [(FREE, (), 2, 1e-5), (CHAIN, (), 2, 1e-7), (BETWEEN, GATE, 2, 1e-8), (ACROSS, STEPS, 3, 1e-7)],
    ids=["free", "chain", "gate", "steps"],
)
def test_forty_seconds_are_newtons(robot, walls, seed, bound):
    """From a settled robot on, all rods stay within a bound in m; within 1e-8 m for the first second."""
    lengths = commands(robot.n_modules, SETTLED + 2000, seed, released=SETTLED)
    model = newton(with_walls(robot, walls))
    data = mujoco.MjData(model)
    kernel = KernelBatch([robot], copies=1, physics=PHYSICS, walls=[walls])
    far, path = [], [0.0]
    for control in lengths:
        before = data.qpos.copy()
        data.ctrl[:] = control
        mujoco.mj_step(model, data, PHYSICS.steps_per_control)
        kernel.step(control.reshape(1, 1, -1, 5))
        rods = data.qpos.reshape(-1, 7)[:, :3]
        far.append(np.abs(kernel.all_rods().reshape(-1, 3) - rods).max())
        path.append(np.abs(data.qpos - before).max())
    assert max(far[: SETTLED + 50]) < 1e-8
    assert max(far) < bound
    # it is no rest that is compared
    assert min(path[SETTLED + 50 :]) > 1e-5
    assert kernel.alive.all()
