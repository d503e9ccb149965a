"""The compiled loop: the same bytes in any company, and what NumPy finds step by step."""

from __future__ import annotations

import dataclasses
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from numba import njit

from engine.body import servo
from engine.body.morphology import Morphology
from engine.control.network import NetworkBatch
from engine.simulation.kernel import step
from engine.simulation.kernel.lanes import simd
from engine.simulation.kernel.loop import closed_loop, noise
from engine.simulation.kernel.loop.dropped import branch
from engine.simulation.kernel.physics.state import KEPT, N_COUPLED, ROD, new_state
from engine.simulation.rollout import Head
from engine.tasks import GOAL_REACHING, SQUEEZING, GroundFrame, View
from engine.tasks.walls import Obstacles
from tests.support.kernel_driven import (
    EVERYTHING,
    MORPHOLOGY,
    PHYSICS,
    all_bytes,
    driven,
    drop,
    trial_names,
    trials,
    trials_of,
)
from tests.support.made_up import evolved_controller

TASKS = pytest.mark.parametrize("task", [GOAL_REACHING, SQUEEZING], ids=lambda t: t.name)
N = 60
"""Control updates: 1.2 s."""


@pytest.fixture(scope="module")
def wide():
    """Return per task what eight trials give in one vector."""
    found = {}
    for task in (GOAL_REACHING, SQUEEZING):
        eight = trials(driven(task))
        found[task.name] = all_bytes(eight, eight.run(N, EVERYTHING))
    return found


@TASKS
@pytest.mark.parametrize("which", [[0], [5, 2], [7, 6, 5, 4, 3, 2, 1, 0, 3], [1, 1, 4]], ids=str)
def test_bytes_do_not_depend_on_the_company(task, which, wide):
    few = trials(driven(task), which)
    assert all_bytes(few, few.run(N, EVERYTHING)) == [wide[task.name][k] for k in which]


OTHER = Morphology((1, 1), (8, 1))
"""Another of the same size: softer, and with links between other rods."""


@TASKS
def test_bytes_do_not_depend_on_the_robots_beside(task, wide):
    """Which have their own bodies, heads and controllers."""
    beside = driven(task, False, OTHER)._replace(controller=evolved_controller(7, 5, task.n_inputs))
    which = [3, 1, 5, 3, 0]
    robots = [driven(task), beside, driven(task), beside, beside]
    mixed = trials_of(robots, which, 8, PHYSICS, task)
    found = all_bytes(mixed, mixed.run(N, EVERYTHING))
    alone = trials(beside)
    expected = all_bytes(alone, alone.run(N, EVERYTHING))
    for got, k, robot in zip(found, which, robots, strict=True):
        assert got == (expected if robot is beside else wide[task.name])[k]
    assert expected[3] != wide[task.name][3]


def test_robots_that_settle_side_by_side_are_those_alone():
    """Landing on their own rods among others, and pulsing."""
    bodies = [Morphology(1, (2, 3, 4, 1, 2)), Morphology(7, (4, 4, 8, 1, 3)), Morphology(1, (1, 4, 3, 2, 8))]
    together, others = drop(*bodies), [drop(morphology) for morphology in bodies]
    recording = together.settle(30, frozenset({"poses"}))
    pulsed, touched = together.pulse(25)[0], []
    for lane, alone in enumerate(others):
        assert recording.poses[:, lane].tobytes() == alone.settle(30, frozenset({"poses"})).poses.tobytes()
        state = alone.pulse(25)[0]
        for field in KEPT:
            ours, theirs = (simd.by_lane(getattr(s, field)) for s in (pulsed, state))
            assert ours[:, lane].tobytes() == theirs[:, 0].tobytes()
        touched.append(state.work.counts[N_COUPLED] > 0)
        assert together.goes_end_first(0.4)[lane] == alone.goes_end_first(0.4)[0]
    assert touched == [True, False, True]


@TASKS
def test_pieces_give_the_same_bytes(task, wide):
    pieces = trials(driven(task))
    motions = [pieces.run(n, EVERYTHING) for n in (1, 0, 34, 20, N - 55)]
    joined = motions[0]._replace(
        path=np.concatenate([m.path for m in motions], axis=1),
        poses=np.concatenate([m.poses for m in motions]),
        commands=np.concatenate([m.commands for m in motions]),
        sensed=np.concatenate([m.sensed for m in motions]),
        forces=np.concatenate([m.forces for m in motions]),
    )
    assert all_bytes(pieces, joined) == wide[task.name]


def test_threads_give_the_same_bytes(wide):
    both = [trials(driven(GOAL_REACHING)) for _ in range(2)]
    with ThreadPoolExecutor(2) as pool:
        motions = list(pool.map(lambda t: t.run(N, EVERYTHING), both))
    for t, motion in zip(both, motions, strict=True):
        assert all_bytes(t, motion) == wide[GOAL_REACHING.name]


def test_what_is_not_recorded_changes_nothing():
    one, other = trials(driven(GOAL_REACHING)), trials(driven(GOAL_REACHING))
    full, path_only = one.run(N, EVERYTHING), other.run(N)
    assert path_only.poses.shape[0] == path_only.commands.shape[0] == path_only.sensed.shape[0] == 0
    assert full.path.tobytes() == path_only.path.tobytes()
    assert one.rods.tobytes() == other.rods.tobytes()


class Again:
    """The loop of some trials, formulated again with NumPy and ``engine``'s own parts."""

    def __init__(self, robot, kernel):
        n = len(kernel.targets)
        self.robot, self.kernel = robot, kernel
        front, rear = self.faces(kernel.rods[..., :3])
        self.frame = GroundFrame.of(front[:1, None], rear[:1, None])
        assert robot.task.walls(0, 2) == () or len(kernel.walls[0]) == len(robot.task.walls(0, 2))
        self.obstacles = Obstacles([robot.task.walls(k % robot.task.n_targets, 2) for k in range(n)])
        self.network = NetworkBatch([robot.controller], n_outputs=2 * robot.numbers.n_modules)
        self.n_updates = robot.dropped.n_updates

    def faces(self, centres):
        """Return the horizontal middles (trials, 2) of front and rear face."""
        module = centres[:, self.robot.head.module]
        return (
            module[:, self.robot.head.front].mean(axis=1)[:, :2],
            module[:, self.robot.head.rear].mean(axis=1)[:, :2],
        )

    def view(self, centres):
        front, rear = self.faces(centres)
        return View(
            front=front[None],
            rear=rear[None],
            target=self.kernel.targets[None],
            frame=self.frame,
            obstacles=self.obstacles,
            time=0.0,
            rods=lambda: centres[None],
            height=lambda: None,
        )

    def update(self, centres):
        """Return what is sensed in a state and what is commanded then."""
        sensed = self.robot.task.sense(self.view(centres)) * self.robot.task.units
        outputs = self.network.activate(sensed)[0]
        frequency = servo.pick(servo.FREQUENCIES, outputs[:, 0::2])
        phase = servo.pick(servo.PHASES, outputs[:, 1::2])
        command = servo.command_angle(frequency, phase, self.n_updates * PHYSICS.control_period)
        if self.robot.head.is_end:
            command = command[:, ::-1]
        draws = drawn(len(centres), self.robot.task, self.n_updates, 5 * self.robot.numbers.n_modules)
        self.n_updates += 1
        lengths = servo.target_lengths(command)
        return sensed[0], lengths + PHYSICS.servo_noise * draws.reshape(lengths.shape)


@njit
def _gaussians(streams, update, draws):
    noise.gaussians(streams, update, draws)


def drawn(n_trials, task, update, n):
    draws = simd.reals(n, width=n_trials)
    _gaussians(noise.streams(trial_names(n_trials, task), width=n_trials), update, draws)
    return simd.by_lane(draws).T.copy()


@TASKS
@pytest.mark.parametrize("is_end", [True, False], ids=["end", "start"])
def test_every_update_is_what_numpy_finds(task, is_end):
    robot = driven(task, is_end)
    kernel = trials(robot)
    again = Again(robot, kernel)
    centres = kernel.rods[..., :3]
    motion = kernel.run(N, EVERYTHING)
    for k in range(N):
        sensed, commands = again.update(centres)
        np.testing.assert_allclose(motion.sensed[k], sensed, rtol=0.0, atol=1e-11)
        np.testing.assert_allclose(motion.commands[k], commands, rtol=0.0, atol=1e-13)
        centres = motion.poses[k, ..., :3]
        if again.n_updates - robot.dropped.n_updates == 50:
            view = again.view(centres)
            np.testing.assert_allclose(motion.path[:, 0], view.position[0], rtol=0.0, atol=1e-14)
    view = again.view(centres)
    np.testing.assert_allclose(kernel.scores, task.score(view)[0], rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(kernel.head, view.position[0], rtol=0.0, atol=1e-14)
    assert motion.path.shape == (8, 1, 2)


@TASKS
def test_poses_are_those_of_the_physics_alone(task):
    robot = driven(task)
    kernel = trials(robot)
    walls = simd.by_lane(kernel.states[0].walls).copy()
    state = new_state(robot.dropped.model, n_walls=len(kernel.walls[0]))
    for lane in range(8):
        branch(state, lane, robot.dropped.state, 0)
    simd.by_lane(state.walls)[:] = walls
    motion = kernel.run(20, EVERYTHING)
    for k in range(20):
        simd.by_lane(state.commanded)[:] = motion.commands[k].reshape(8, -1).T
        step.run(robot.dropped.model, state, PHYSICS.steps_per_control)
        rods = simd.by_lane(state.rods).T.reshape((*motion.poses[k].shape[:3], -1))
        assert rods[..., :7].tobytes() == motion.poses[k].tobytes()


def test_a_task_in_python_drives_the_same_loop():
    """Given what the kernel would have sensed, everything is the same bytes."""
    robot = driven(SQUEEZING)
    which = [*range(8), 3]  # more than one vector
    kernel = trials(robot, which)
    motion = kernel.run(N, EVERYTHING)
    mine = dataclasses.replace(SQUEEZING, sense=lambda view: SQUEEZING.sense(view))
    python = trials(robot, which, task=mine)
    assert not python.in_kernel
    path = []
    for k in range(N):
        python.give(motion.sensed[k])
        part = python.run(1, EVERYTHING)
        path.append(part.path)
        assert part.commands[0].tobytes() == motion.commands[k].tobytes()
        assert part.poses[0].tobytes() == motion.poses[k].tobytes()
    assert np.concatenate(path, axis=1).tobytes() == motion.path.tobytes()
    assert python.faces.tobytes() == kernel.faces.tobytes()


def test_a_failure_stops_one_lane_and_no_other(wide):
    robot = driven(GOAL_REACHING)
    broken = trials(robot)
    first = broken.run(30, EVERYTHING)
    simd.by_lane(broken.states[0].rods)[7, 3] = 1e4
    second = broken.run(N - 30, EVERYTHING)
    assert np.flatnonzero(broken.failures).tolist() == [3]
    assert np.flatnonzero(broken.failed_at).tolist() == [3]
    assert broken.failed_at[3] == robot.dropped.n_updates + 31
    assert np.isfinite(second.path).all()
    assert np.isfinite(broken.scores).all()
    joined = second._replace(
        **{f: np.concatenate([getattr(first, f), getattr(second, f)]) for f in EVERYTHING}
    )
    found = all_bytes(broken, joined)
    assert [k for k in range(8) if found[k] != wide[GOAL_REACHING.name][k]] == [3]
    # the head is where it was before the failure
    stopped = trials(robot)
    stopped.run(30)
    np.testing.assert_array_equal(broken.head[3], stopped.head[3])


@TASKS
def test_a_robot_that_failed_before_has_a_path_of_zeros(task):
    robot = driven(task)
    failed = drop(MORPHOLOGY)
    branch(failed.state, 0, robot.dropped.state, 0)
    failed.n_updates = 40
    simd.by_lane(failed.state.failed)[:] = 1
    simd.by_lane(failed.state.rods)[:] = np.nan
    lost = trials(robot._replace(dropped=failed))
    motion = lost.run(N, EVERYTHING)
    assert not motion.path.any()
    assert lost.failures.all()
    assert (lost.failed_at == 40).all()
    assert np.isfinite(lost.scores).all()
    assert np.isfinite(motion.sensed).all()


def test_settling_is_the_physics_with_slack_cables():
    dropped, alone = drop(MORPHOLOGY), drop(MORPHOLOGY)
    recording = dropped.settle(20, frozenset({"poses"}))
    simd.by_lane(alone.state.commanded)[:] = closed_loop.SLACK
    step.run(alone.model, alone.state, 20 * PHYSICS.steps_per_control)
    assert dropped.n_updates == 20
    assert dropped.state.rods.tobytes() == alone.state.rods.tobytes()
    rods = simd.by_lane(alone.state.rods)[:, 0].reshape(-1, ROD)
    np.testing.assert_array_equal(recording.poses[-1, 0], rods[:, :7])


@pytest.mark.parametrize(
    ("faces", "rhythms", "end_first"),
    [((3, 2), (), True), ((8, 7), (), False), ((3, 2), (6, 1), False)],
)
def test_the_head_goes_first(faces, rhythms, end_first):
    morphology = dataclasses.replace(MORPHOLOGY, faces=faces, rhythms=rhythms)
    dropped = drop(morphology)
    dropped.settle(20)
    before = dropped.state.rods.tobytes()
    assert dropped.goes_end_first(2.0) == [(end_first, 0)]
    assert dropped.state.rods.tobytes() == before
    # the same again without noise, with NumPy's commands
    numbers = np.array(rhythms or (4, 4))
    frequency, phase = servo.FREQUENCIES[numbers // 4], servo.PHASES[numbers % 4]
    assert rhythms or (frequency.tolist(), phase.tolist()) == ([0.5, 0.5], [0.0, 0.0])
    end, state = Head.of(morphology, True), dropped.state
    rods = simd.by_lane(state.rods)[:, 0].reshape(2, 6, ROD)

    def face(of):
        return rods[end.module, list(of), :2].mean(axis=0)

    front, rear = face(end.front), face(end.rear)
    for k in range(20, 120):
        command = servo.command_angle(frequency, phase, k * PHYSICS.control_period)
        simd.by_lane(state.commanded)[:] = servo.target_lengths(command).reshape(-1, 1)
        step.run(dropped.model, state, PHYSICS.steps_per_control)
    assert ((face(end.rear) - rear) @ (front - rear) >= 0.0) == end_first


def test_one_compilation_serves_everything_of_a_width():
    """Compiling takes many seconds; whatever differs in type between callers would do it again."""
    widths = [s[1].types[0].dtype.size // 8 for s in closed_loop.run.signatures]
    assert len(widths) == len(set(widths))
