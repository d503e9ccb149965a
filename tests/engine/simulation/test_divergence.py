"""Simulations that fly apart: they are stopped, nobody else notices, and the reason is kept."""

import mujoco
import numpy as np
import pytest

from engine.body.morphology import Morphology
from engine.simulation.divergence import ARENA_RADIUS, BLOCK, MAX_UPDATES, Guard, speed_limit
from engine.simulation.model import build_robot
from engine.simulation.physics import Physics, with_inertia
from engine.simulation.rollout import SimulationBatch, build_robots, settle

PHYSICS = Physics()
BODIES = [Morphology(2, (1, 6)), Morphology(7, (8, 3)), Morphology(10, (5, 5))]
EXPLOSIVE = Physics(timestep=0.02)
"""A time step several times the one that cables and contacts bear."""


def released(sim):
    return np.ones((*sim.shape, sim.n_modules, 5))


def started(n_updates=5, n_threads=1, copies=2):
    robots = build_robots(BODIES, PHYSICS)
    sim = SimulationBatch(robots, copies=copies, physics=PHYSICS, n_threads=n_threads)
    for _ in range(n_updates):
        sim.step(released(sim))
    return sim


def spoil_position(sim):
    sim.qpos[1, 0, 3] = np.nan


def spoil_velocity(sim):
    sim._qvel[2, 4] = np.inf


def throw(sim):
    sim._qvel[2].reshape(-1, 6)[:, 2] = 50.0


def carry_off(sim):
    sim.qpos[1, 0, 0::7] += 2 * ARENA_RADIUS


def spoil_control(sim):
    lengths = released(sim)
    lengths[1, 0, 1, 2] = np.nan
    return lengths


@pytest.mark.parametrize("n_threads", [1, 2])
@pytest.mark.parametrize(
    ("harm", "reason"),
    [
        (spoil_position, "position that is not finite"),
        (spoil_velocity, "velocity that is not finite"),
        (throw, "m/s, impossible above"),
        (carry_off, "outside the arena"),
        (spoil_control, "a control was not finite"),
    ],
)
def test_every_way_to_diverge_stops_that_simulation_and_no_other(harm, reason, n_threads):
    sim, undisturbed = started(n_threads=n_threads), started()
    lengths = harm(sim)
    sim.step(released(sim) if lengths is None else lengths)
    undisturbed.step(released(undisturbed))
    stopped = sim.qpos[1, 0].copy()
    for _ in range(20):
        sim.step(released(sim))
        undisturbed.step(released(undisturbed))
    # robot 1, copy 0
    failure = sim.failures[2]
    assert [k for k, f in enumerate(sim.failures) if f] == [2]
    assert reason in str(failure)
    assert "diverged 0.12 s after the drop" in str(failure)
    assert failure.n_updates == 6
    assert sim.qpos[1, 0].tobytes() == stopped.tobytes()
    others = [0, 1, 3, 4, 5]
    states, expected = sim.state().reshape(6, -1), undisturbed.state().reshape(6, -1)
    assert states[others].tobytes() == expected[others].tobytes()
    assert undisturbed.failures == [None] * 6


def judged(qpos, qvel, robot):
    warnings = np.zeros((len(qpos), mujoco.mjtWarning.mjNWARNING.value), dtype=int)
    return Guard([robot] * len(qpos)).judge(qpos, qvel, warnings, np.ones(len(qpos), dtype=bool))


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e200])
def test_no_number_that_is_not_finite_passes_wherever_it_is(value):
    robot = build_robot(BODIES[0], PHYSICS)
    n_q, n_v = robot.model.nq, robot.model.nv
    qpos, qvel = np.tile(robot.model.qpos0, (n_q + n_v + 1, 1)), np.zeros((n_q + n_v + 1, n_v))
    qpos[np.arange(n_q), np.arange(n_q)] = value
    qvel[n_q + np.arange(n_v), np.arange(n_v)] = value
    found = judged(qpos, qvel, robot)
    assert sorted(found) == list(range(n_q + n_v))
    assert set(found.values()) == {"the state is not finite"}


def test_the_limits_themselves():
    robot = build_robot(BODIES[0], PHYSICS)
    limit = speed_limit(robot)
    qpos, qvel = np.tile(robot.model.qpos0, (4, 1)), np.zeros((4, robot.model.nv))
    qpos[0, 7] = -ARENA_RADIUS
    qpos[1, 7] = 0.999 * ARENA_RADIUS
    qvel[2, 6:9] = np.array([0.6, -0.8, 0.0]) * limit * 1.001
    qvel[3, 6:9] = np.array([0.6, -0.8, 0.0]) * limit * 0.999
    found = judged(qpos, qvel, robot)
    assert sorted(found) == [0, 2]
    assert "10.0 m from the origin" in found[0]
    assert f"impossible above {limit:.1f} m/s" in found[2]


@pytest.mark.parametrize("level", [1, 10])
@pytest.mark.parametrize("inertia_scale", [0.1, 1.0, 10.0])
def test_healthy_robots_stay_far_below_the_speed_limit(level, inertia_scale):
    """Also at the moment at which they are fastest: when the built module is let go."""
    physics = with_inertia(Physics(), inertia_scale)
    robots = build_robots([Morphology(level, (1, 2, 3))], physics)
    sim = SimulationBatch(robots, copies=1, physics=physics, n_threads=1)
    fastest = 0.0
    for _ in range(25):
        sim.step(released(sim))
        fastest = max(fastest, np.linalg.norm(sim._qvel.reshape(-1, 6)[:, :3], axis=1).max())
    assert sim.failures == [None]
    assert 0.01 * speed_limit(robots[0]) < fastest < speed_limit(robots[0]) / 3


def test_the_speed_limit_follows_from_the_energy():
    slow, fast = (speed_limit(build_robot(BODIES[0], Physics(inertia_scale=s))) for s in (10.0, 0.1))
    assert fast == pytest.approx(10 * slow, rel=0.01)
    soft, stiff = (speed_limit(build_robot(Morphology(k, (1, 6)), PHYSICS)) for k in (1, 10))
    assert soft < stiff
    # a chain's modules do not lend each other their energy
    chain = speed_limit(build_robot(Morphology(1, (1, 6, 1, 6, 1)), PHYSICS))
    assert chain == pytest.approx(soft, rel=0.01)
    # the stiffest of a mixed chain is not limited to the mean
    assert speed_limit(build_robot(Morphology((1, 10, 1), (1, 6, 1)), PHYSICS)) >= 0.99 * stiff
    # by hand, stiffness 1.0: 24 cables of 0.0348 m strain, five pulls of 0.654 N
    assert stiff == pytest.approx(18.2, abs=1.0)


def exploded(n_updates=40):
    sim = SimulationBatch(
        [build_robot(BODIES[0], PHYSICS), build_robot(BODIES[2], EXPLOSIVE)],
        copies=1,
        physics=PHYSICS,
        n_threads=1,
    )
    rng = np.random.default_rng(0)
    for _ in range(n_updates):
        sim.step(rng.uniform(0.02, 0.1, size=(*sim.shape, 2, 5)))
    return sim


def test_a_model_made_to_explode_is_caught():
    sim = exploded()
    assert sim.failures[0] is None
    failure = sim.failures[1]
    assert failure is not None
    assert len(failure.controls) == failure.n_updates < 40


def test_what_is_kept_simulates_the_failure_again():
    failure = exploded().failures[1]
    model = build_robot(BODIES[2], EXPLOSIVE).model
    data = mujoco.MjData(model)
    mujoco.mj_setState(model, data, failure.state, mujoco.mjtState.mjSTATE_INTEGRATION)
    guard = Guard([build_robot(BODIES[2], EXPLOSIVE)])
    bad = []
    for controls in failure.controls:
        data.ctrl[:] = controls
        mujoco.mj_step(model, data, PHYSICS.steps_per_control)
        warnings = np.array([[w.number for w in data.warning]])
        bad.append(guard.judge(data.qpos[None], data.qvel[None], warnings, np.array([True])))
    assert not any(bad[:-1])
    assert bad[-1][0] in failure.reason


@pytest.mark.parametrize("n", [1, BLOCK - 1, BLOCK, BLOCK + 1, 2 * BLOCK, 2 * BLOCK + 7, 3 * BLOCK])
def test_the_last_one_to_two_blocks_are_kept_to_the_last_bit(n):
    """A failure after n updates, of a robot that is healthy until then, on a branch of another batch."""
    robots, rng = build_robots(BODIES[:1], PHYSICS), np.random.default_rng(n)
    commands = rng.uniform(0.02, 0.1, size=(n, 2, 5))
    first = SimulationBatch(robots, copies=1, physics=PHYSICS, n_threads=1)
    states = []
    for lengths in commands[: n // 2]:
        states.append(first.state()[0, 0])
        first.step(lengths[None, None])
    sim = SimulationBatch(robots, copies=3, physics=PHYSICS, n_threads=1)
    sim.branch(first)
    for lengths in commands[n // 2 :]:
        states.append(sim.state()[0, 1])
        if len(states) == n:
            carry = np.zeros((1, 3, 2, 5)) + lengths
            carry[0, 1, 0, 0] = np.nan
            sim.step(carry)
        else:
            sim.step(np.broadcast_to(lengths, (1, 3, 2, 5)))
    assert [f is None for f in sim.failures] == [True, False, True]
    failure = sim.failures[1]
    k = len(failure.controls)
    assert (failure.n_updates, k) == (n, n if n <= MAX_UPDATES else k)
    assert min(n, BLOCK) <= k <= MAX_UPDATES
    n_controls = failure.controls.shape[1]
    assert failure.controls[:-1].tobytes() == commands[n - k : -1].reshape(-1, n_controls).tobytes()
    assert np.isnan(failure.controls[-1]).sum() == 1
    kept, before = failure.state, states[n - k]
    size = mujoco.mj_stateSize(robots[0].model, mujoco.mjtState.mjSTATE_INTEGRATION)
    assert kept.shape == (size,)
    # everything but the commands, which belong to the update that follows
    spec = mujoco.mjtState.mjSTATE_PHYSICS
    n_physics = mujoco.mj_stateSize(robots[0].model, spec)
    parts = []
    for state in (kept, before):
        part = np.empty(n_physics)
        mujoco.mj_extractState(robots[0].model, state, mujoco.mjtState.mjSTATE_INTEGRATION, part, spec)
        parts.append(part)
    assert parts[0].tobytes() == parts[1].tobytes()


def test_a_failure_while_settling_is_the_failure_of_every_branch():
    settled = settle(
        [build_robot(BODIES[2], EXPLOSIVE), build_robot(BODIES[0], PHYSICS)], physics=PHYSICS, duration=0.4
    )
    sim = SimulationBatch(build_robots(BODIES[:2], PHYSICS), copies=3, physics=PHYSICS, n_threads=1)
    sim.branch(settled)
    sim.step(released(sim))
    assert settled.failures[0] is not None
    assert sim.failures == [settled.failures[0]] * 3 + [None] * 3
