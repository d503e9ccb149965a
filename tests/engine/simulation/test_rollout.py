import dataclasses

import mujoco
import numpy as np
import pytest

from engine.body import module as t
from engine.body import servo
from engine.body.morphology import Morphology
from engine.control.genome import Controller, NodeGene
from engine.simulation.evaluation import LocalEvaluator, Solution
from engine.simulation.kernel import settling
from engine.simulation.model import build_robot, face_rods
from engine.simulation.physics import Physics
from engine.simulation.rollout import ClosedLoop, Head, SimulationBatch, build_robots, find_heads, settle
from engine.simulation.trials import TrialConfig, noise_seed
from engine.tasks import GOAL_REACHING, distance_and_bearing, fitness, target_offsets
from tests.support.made_up import evolved_controller

PHYSICS, KERNEL = Physics(simulator="mujoco"), Physics(simulator="kernel")
SHORT = TrialConfig(repeats=2, settle_time=0.2, open_loop_time=0.2, trial_time=1.0)
BODIES = [Morphology(2, (1, 6)), Morphology(7, (8, 3)), Morphology(10, (5, 5))]
SOLUTIONS = [
    Solution(number=10 + i, morphology=m, controller=evolved_controller(i, 5))
    for i, m in enumerate([*BODIES, Morphology(5, (2, 4, 7))])
]


def evaluate(solutions, *, n_threads=1, physics=PHYSICS, trials=SHORT, run_seed=3):
    evaluator = LocalEvaluator(
        task=GOAL_REACHING, physics=physics, trials=trials, run_seed=run_seed, n_threads=n_threads
    )
    groups = list(evaluator.evaluate(solutions))
    return {e.solution.number: e for group in groups for e in group}


def bits(e):
    return (
        repr(e.fitness),
        e.distances.tobytes(),
        e.trajectory.tobytes(),
        e.head_is_end,
        e.failure,
    )


@pytest.fixture(scope="module")
def evaluations():
    return evaluate(SOLUTIONS)


def test_every_solution_is_evaluated_once(evaluations):
    assert sorted(evaluations) == [10, 11, 12, 13]
    for s in SOLUTIONS:
        e = evaluations[s.number]
        assert e.solution == s
        assert e.failure is None
        assert e.distances.shape == (4, 2)
        assert e.trajectory.shape == (4, 1, 2)
        assert e.trajectory.dtype == np.float32
        assert e.fitness == fitness(e.distances)


def test_two_threads_give_the_same_bits(evaluations):
    two = evaluate(SOLUTIONS, n_threads=2)
    assert {k: bits(e) for k, e in two.items()} == {k: bits(e) for k, e in evaluations.items()}


def test_head_positions_are_rounded_and_nothing_else(evaluations):
    fine = evaluate(SOLUTIONS, trials=dataclasses.replace(SHORT, trajectory_bits=0))
    for number, e in evaluations.items():
        steps = e.trajectory.astype(float) * 2**14
        assert np.array_equal(steps, np.round(steps))
        # float32 holds the exact mean only to its own last digit
        assert np.abs(e.trajectory - fine[number].trajectory).max() <= 2**-15 + 1e-8
        assert not np.signbit(e.trajectory[e.trajectory == 0.0]).any()
        assert bits(dataclasses.replace(e, trajectory=fine[number].trajectory)) == bits(fine[number])


@pytest.mark.parametrize("i", range(4))
def test_a_solution_alone_gives_the_same_bits(evaluations, i):
    s = SOLUTIONS[i]
    assert bits(evaluate([s])[s.number]) == bits(evaluations[s.number])


def test_the_order_of_solutions_does_not_matter(evaluations):
    other = evaluate(SOLUTIONS[::-1])
    assert {k: bits(e) for k, e in other.items()} == {k: bits(e) for k, e in evaluations.items()}


def test_noise_depends_on_run_solution_target_and_repeat(evaluations):
    e = evaluations[10]
    assert len(set(e.distances.ravel())) == e.distances.size
    (other_run,) = evaluate(SOLUTIONS[:1], run_seed=4).values()
    assert bits(other_run) != bits(e)
    renumbered = Solution(number=99, morphology=SOLUTIONS[0].morphology, controller=SOLUTIONS[0].controller)
    assert bits(evaluate([renumbered])[99]) != bits(e)
    seeds = {noise_seed(*s) for s in [(3, 1, 2, 0), (3, 1, 2, 1), (3, 1, 3, 0), (3, 2, 2, 0)]}
    assert len(seeds) == 4


def test_without_noise_repeats_are_equal_and_seeds_do_not_matter():
    quiet = Physics(simulator="mujoco", servo_noise=0.0)
    (e,) = evaluate(SOLUTIONS[:1], physics=quiet).values()
    assert (e.distances[:, 0] == e.distances[:, 1]).all()
    (other,) = evaluate(SOLUTIONS[:1], physics=quiet, run_seed=4).values()
    assert bits(other) == bits(e)


def test_the_trajectory_is_the_mean_of_the_repeats(evaluations):
    # one run per repeat: targets come in the same order, so seeds are those of the run of two
    robots = build_robots(BODIES[:1], PHYSICS)
    e = evaluations[10]
    paths = []
    for repeat in range(2):
        settled = settle(robots, physics=PHYSICS, duration=SHORT.settle_time)
        loop = ClosedLoop(
            settled,
            robots,
            heads=[Head.of(BODIES[0], e.head_is_end)],
            controllers=[SOLUTIONS[0].controller],
            targets=target_offsets(GOAL_REACHING)[None],
            seeds=[[noise_seed(3, 10, target, repeat) for target in range(4)]],
            task=GOAL_REACHING,
            physics=PHYSICS,
        )
        (result,) = loop.run(SHORT.trial_time)
        assert result.scores.tolist() == e.distances[:, repeat].tolist()
        paths.append(result.trajectory)
    expected = np.mean(paths, axis=0)[:, 1:]
    # it is rounded
    np.testing.assert_allclose(e.trajectory, expected, rtol=1e-6, atol=2**-15 + 1e-8)


@pytest.mark.parametrize("n", [2, 4])
def test_a_diverging_simulation_is_a_failure_not_an_exception(n):
    physics = Physics(simulator="mujoco", timestep=0.02, control_period=0.02)
    solutions = [
        Solution(number=i, morphology=Morphology(10, (1,) * n), controller=evolved_controller(i, 0))
        for i in range(2)
    ]
    for e in evaluate(solutions, physics=physics).values():
        assert e.fitness is None
        assert "diverged" in e.failure
        assert e.trajectory.shape == (4, 1, 2)
        assert e.distances.shape == (4, 2)


def test_a_diverging_robot_does_not_disturb_its_company():
    good = build_robot(BODIES[0], PHYSICS)
    bad = build_robot(BODIES[2], Physics(timestep=0.02))
    together = settle([good, bad], physics=PHYSICS, duration=0.4)
    alone = settle([good], physics=PHYSICS, duration=0.4)
    assert together.failures[0] is None
    assert "diverged" in str(together.failures[1])
    assert together.qpos[0].tobytes() == alone.qpos[0].tobytes()


def rolled_out(morphology, commands):
    """Simulate with plain MuJoCo: one row of target lengths per control period."""
    model = build_robot(morphology, PHYSICS).model
    data = mujoco.MjData(model)
    yield data
    for lengths in commands:
        data.ctrl[:] = lengths
        mujoco.mj_step(model, data, PHYSICS.steps_per_control)
        yield data


def test_settling_is_plain_mujoco_with_the_servos_off():
    robots = build_robots(BODIES, PHYSICS)
    sim = settle(robots, physics=PHYSICS, duration=0.5)
    assert sim.time == pytest.approx(0.5)
    for k, m in enumerate(BODIES):
        *_, data = rolled_out(m, [np.full(10, 1.0)] * 25)
        np.testing.assert_allclose(sim.qpos[k, 0], data.qpos, atol=1e-9)
        assert (data.actuator_force == 0.0).all()


def test_a_robot_comes_to_rest_on_the_ground():
    robots = build_robots(BODIES, PHYSICS)
    path = []

    def watch(sim):
        path.append(sim.qpos.reshape(len(BODIES), -1, 7)[..., :3].copy())

    settle(robots, physics=PHYSICS, duration=8.0, observer=watch)
    # within half a second: centimetres while falling, at last less than 2 mm
    assert np.abs(path[24] - path[0]).max() > 0.02
    assert np.abs(path[-1] - path[-26]).max() < 0.002
    assert path[-1][..., 2].min() > 0.0
    assert path[-1][..., 2].max() < 0.12


def test_the_head_is_the_end_unless_the_robot_backs_away():
    duration = 2.0
    bodies = [Morphology(level, faces) for level in (1, 2, 6) for faces in ((1, 1), (1, 6), (7, 2))]
    robots = build_robots(bodies, PHYSICS)
    settled = settle(robots, physics=PHYSICS, duration=0.4)
    heads, failures = find_heads(settled, robots, bodies, physics=PHYSICS, duration=duration)
    assert failures == [None] * len(bodies)
    times = 0.4 + 0.02 * np.arange(round(duration / 0.02))
    pulses = [np.tile(servo.target_lengths(np.array(90.0 * (np.sin(np.pi * s) + 1.0))), 2) for s in times]
    for m, head in zip(bodies, heads, strict=True):
        last, opposite = m.faces[-1], t.OPPOSITE_FACE[m.faces[-1]]

        def face(data, f):
            rods = [data.body(f"m1_rod{k}").xpos[:2] for k in face_rods(f)]
            return np.mean(rods, axis=0)

        for k, data in enumerate(rolled_out(m, [np.full(10, 1.0)] * 20 + pulses)):
            if k == 20:
                start = face(data, opposite)
                ahead = face(data, last) - start
        assert head.is_end == ((face(data, opposite) - start) @ ahead >= 0.0)
    assert {h.is_end for h in heads} == {True, False}


def test_rhythms_decide_which_end_is_the_head():
    bodies = [Morphology(2, (3, 2), r) for r in ((), (4, 4), (6, 7), (0, 1))]
    robots = build_robots(bodies, PHYSICS)
    settled = settle(robots, physics=PHYSICS, duration=0.4)
    heads, failures = find_heads(settled, robots, bodies, physics=PHYSICS, duration=2.0)
    assert failures == [None] * len(bodies)
    # 0.5 Hz and phase 0 for all is what a body without rhythms does
    assert heads[0] == heads[1]
    assert {h.is_end for h in heads} == {True, False}
    at_rest = settling.settle(robots, bodies, physics=KERNEL, duration=0.4)
    assert settling.find_heads(at_rest, bodies, physics=KERNEL, duration=2.0)[0] == heads


def test_both_heads_by_hand():
    m = Morphology(5, (2, 1, 8))
    # the end: its own face in front; the start: the face opposite to where the next one hangs
    assert Head.of(m, True) == Head(2, face_rods(8), face_rods(4), True)
    assert Head.of(m, False) == Head(0, face_rods(6), face_rods(2), False)


def constant_controller(choices):
    """A network that always chooses these (frequency, phase) items, pair by pair."""
    biases = []
    for frequency, phase in choices:
        for item, n in ((frequency, 2), (phase, 4)):
            x = (item + 0.5) / n
            biases.append(np.log(x / (1 - x)))
    biases += [0.0] * (20 - len(biases))
    return Controller(
        n_inputs=2,
        nodes=tuple(NodeGene(k, float(b)) for k, b in enumerate(biases)),
        connections=(),
    )


@pytest.fixture
def commanded(monkeypatch):
    """Lists every batch's commanded lengths, with the time they are given at."""
    seen = []
    step = SimulationBatch.step

    def spy(self, lengths):
        seen.append((self.time, lengths.copy()))
        step(self, lengths)

    monkeypatch.setattr(SimulationBatch, "step", spy)
    return seen


def closed_loop(morphology, controller, *, is_end, physics=PHYSICS, seeds=None, settle_time=0.1):
    robots = build_robots([morphology], physics)
    targets = target_offsets(GOAL_REACHING)[None]
    return ClosedLoop(
        settle(robots, physics=physics, duration=settle_time),
        robots,
        heads=[Head.of(morphology, is_end)],
        controllers=[controller],
        targets=targets,
        seeds=seeds or [[(1, k) for k in range(4)]],
        task=GOAL_REACHING,
        physics=physics,
    )


@pytest.mark.parametrize("is_end", [True, False])
def test_the_first_pair_of_outputs_drives_the_head_module(is_end, commanded):
    choices = [(0, 1), (1, 2), (1, 0)]
    loop = closed_loop(
        Morphology(5, (1, 2, 3)),
        constant_controller(choices),
        is_end=is_end,
        physics=Physics(servo_noise=0.0),
    )
    commanded.clear()
    loop.run(0.4)
    assert len(commanded) == 20
    # settling counts
    assert commanded[0][0] == pytest.approx(0.1)
    for time, lengths in commanded:
        assert lengths.shape == (1, 4, 3, 5)
        for pair, (frequency, phase) in enumerate(choices):
            module = 2 - pair if is_end else pair
            angle = 90 * (
                np.sin(2 * np.pi * (0.25, 0.5)[frequency] * time + (0, 1.57, 3.14, 4.71)[phase]) + 1
            )
            expected = servo.target_lengths(np.array(angle))
            np.testing.assert_allclose(lengths[0, :, module], [expected] * 4, atol=1e-12)


def test_noise_is_gaussian_and_of_the_published_size(commanded):
    body, controller = Morphology(5, (1, 2)), constant_controller([(0, 0), (0, 0)])
    loop = closed_loop(body, controller, is_end=True)
    quiet = closed_loop(body, controller, is_end=True, physics=Physics(servo_noise=0.0))
    commanded.clear()
    loop.run(1.0)
    noisy = np.array([lengths for _, lengths in commanded])
    commanded.clear()
    quiet.run(1.0)
    noise = noisy - np.array([lengths for _, lengths in commanded])
    # 2000 draws
    assert noise.size == 50 * 4 * 2 * 5
    assert noise.std() == pytest.approx(0.00035, rel=0.1)
    assert abs(noise.mean()) < 5 * 0.00035 / noise.size**0.5
    assert (np.abs(noise) < 0.00035).mean() == pytest.approx(0.683, abs=0.06)
    assert len(np.unique(noise)) == noise.size


def test_targets_are_placed_relative_to_the_settled_head():
    for is_end in (True, False):
        m = Morphology(5, (3, 6))
        loop = closed_loop(m, constant_controller([]), is_end=is_end)
        head = Head.of(m, is_end)
        rods = loop.sim.qpos[0, 0].reshape(2, 6, 7)[head.module, :, :2]
        front, rear = rods[list(head.front)].mean(axis=0), rods[list(head.rear)].mean(axis=0)
        distance, bearing = distance_and_bearing(front, front - rear, loop.targets[0])
        np.testing.assert_allclose(distance, 0.45)
        np.testing.assert_allclose(np.degrees(bearing), [90, 45, -45, -90])
        np.testing.assert_allclose(loop.scores(), 0.45)
        np.testing.assert_allclose(loop.head(), 0.0, atol=1e-12)


def test_the_trajectory_ends_where_the_distance_is_measured():
    m = Morphology(1, (1, 1))
    loop = closed_loop(m, evolved_controller(2, 3), is_end=True)
    steps = []
    (result,) = loop.run(2.0, observer=lambda sim: steps.append(sim.time))
    assert len(steps) == 100
    assert result.failed is None
    assert result.trajectory.shape == (4, 3, 2)
    np.testing.assert_allclose(result.trajectory[:, 0], 0.0, atol=1e-12)
    assert np.abs(result.trajectory[:, 2]).max() > 1e-4
    to_target = target_offsets(GOAL_REACHING) - result.trajectory[:, -1]
    np.testing.assert_allclose(np.linalg.norm(to_target, axis=1), result.scores)


def test_branches_start_as_exact_copies_and_go_their_own_way():
    robots = build_robots(BODIES[:1], PHYSICS)
    settled = settle(robots, physics=PHYSICS, duration=0.1)
    before = settled.state()
    branch = SimulationBatch(robots, copies=3, physics=PHYSICS, n_threads=1)
    branch.branch(settled)
    assert branch.time == settled.time
    assert (branch.state() == before).all()
    lengths = np.ones((1, 3, 2, 5))
    lengths[0, 1] = 0.02
    branch.step(lengths)
    states = branch.state()[0]
    assert (states[0] == states[2]).all()
    assert (states[0] != states[1]).any()
    assert (settled.state() == before).all()


def test_an_observer_may_abandon_a_roll_out():
    def stop(sim):
        raise KeyboardInterrupt

    robots = build_robots(BODIES[:1], PHYSICS)
    with pytest.raises(KeyboardInterrupt):
        settle(robots, physics=PHYSICS, duration=1.0, observer=stop)
