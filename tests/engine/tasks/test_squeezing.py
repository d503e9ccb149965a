"""The squeezing task against hand-worked numbers, and as it is simulated."""

import dataclasses
import math
import re

import mujoco
import numpy as np
import pytest

import engine.runs.evolve
from engine.analysis.verify import verify
from engine.body.morphology import Morphology
from engine.config import RunConfig, replaced, task_of
from engine.export import export_files, write_folder
from engine.replay.dump import Dump, read_dump, write_dump
from engine.replay.dump_replay import DumpReplay
from engine.replay.replay import Replay
from engine.simulation.evaluation import LocalEvaluator, Solution
from engine.simulation.physics import Physics
from engine.simulation.rollout import ClosedLoop, Head, build_robots, settle
from engine.simulation.trials import TrialConfig
from engine.storage.reader import RunReader
from engine.tasks import SQUEEZING, get_task, sensed, target_offsets, worlds
from tests.support.made_up import TINY, a_view, evolved_controller

PHYSICS = Physics()
LEFT, RIGHT = 0, 1
TARGET = (0.5977168, 0.0522934)
"""60 cm at 5 degrees."""
GATE = (0.1494292, 0.0522934)
"""A quarter of the way, centred on the target's sideways position."""


def faces(wall):
    """Return x from, x to, y from, y to, z from, z to of a wall, in cm."""
    c, h = 100 * np.array(wall.centre), 100 * np.array(wall.half_size)
    return np.column_stack([c - h, c + h]).ravel()


def test_squeezing_is_the_published_task():
    assert (SQUEEZING.n_inputs, SQUEEZING.n_targets, SQUEEZING.target_distance) == (5, 2, 0.6)
    np.testing.assert_allclose(np.degrees(SQUEEZING.target_bearings), [5, -5])
    np.testing.assert_allclose(target_offsets(SQUEEZING)[LEFT], TARGET, atol=1e-6)


def test_walls_by_hand():
    """Two modules: b = 2 x 2 x 11.1126 + 4 = 48.4504 cm, half a wall 8.33445, half an aperture 4.00054."""
    for target, side in ((LEFT, 1.0), (RIGHT, -1.0)):
        left, right, far_left, far_right, behind = map(faces, SQUEEZING.walls(target, 2))
        gap = sorted((side * 5.22934 - 4.00054, side * 5.22934 + 4.00054))
        expected = [
            (left, [14.9429, 31.6118, gap[1], 40.1160]),
            (right, [14.9429, 31.6118, -40.1160, gap[0]]),
            (far_left, [-56.7849, 31.6118, 40.1160, 56.7849]),
            (far_right, [-56.7849, 31.6118, -56.7849, -40.1160]),
            (behind, [-56.7849, -40.1160, -40.1160, 40.1160]),
        ]
        for got, want in expected:
            np.testing.assert_allclose(got, [*want, 0.0, 12.0], atol=2e-3)
        assert left[2] - right[3] == pytest.approx(8.001, abs=1e-3)


@pytest.mark.parametrize("n", range(2, 11))
def test_the_other_walls_stand_two_robots_away(n):
    behind = SQUEEZING.walls(RIGHT, n)[4]
    assert -100 * behind.centre[0] == pytest.approx(2 * 11.1126 * n + 4, abs=1e-2)
    # nothing overlaps: the box is closed and has one way out
    walls = SQUEEZING.walls(RIGHT, n)
    for i, a in enumerate(walls):
        for b in walls[:i]:
            gap = np.abs(np.subtract(a.centre, b.centre)) - a.half_size - np.array(b.half_size)
            assert gap[:2].max() > -1e-9


def felt(position, degrees, target=LEFT, sensors="centimetres"):
    xy = target_offsets(SQUEEZING)[target]
    turn = math.radians(degrees)
    view = a_view(
        position=position,
        direction=(0.05 * math.cos(turn), 0.05 * math.sin(turn)),
        target=xy,
        walls=SQUEEZING.walls(target, 2),
    )
    return sensed(get_task("squeezing", sensors), view, np.ones((1, 1), bool))[0, 0]


@pytest.mark.parametrize(
    ("position", "degrees", "expected"),
    [
        # at the start: the wall right of the aperture is 14.9 cm ahead, out of range
        ((0.0, 0.0), 0, (60.0, 5.0, 15.8315, 19.2878, 0)),
        # 6 cm on: 8.9 cm to that wall
        ((0.06, 0.0), 0, (54.0255, 5.5540, 10.3595, 30.3161, 1)),
        # just out of range and just within it
        ((0.0494, 0.0), 0, (55.0805, 5.4479, 11.2874, 27.6000, 0)),
        ((0.0495, 0.0), 0, (55.0705, 5.4489, 11.2785, 27.6233, 1)),
        # in line with the aperture: nothing ahead
        ((0.06, 0.0522934), 0, (53.7717, 0.0, 8.9429, 0.0, 0)),
        # beside the aperture, to its left: 9.3 cm is more than 9.23
        ((0.06, 0.093), 0, (53.9255, -4.3292, 9.8258, -24.4742, 1)),
        # past the entrance: the distance is negative, the gate behind
        ((0.2, 0.0522934), 0, (39.7717, 0.0, -5.0571, 180.0, 0)),
        # in the aperture, turned to its left face 4.0 cm away
        ((0.2, 0.0522934), 90, (39.7717, -90.0, -5.0571, 90.0, 1)),
        # backwards from the start: the wall behind is 40 cm away
        ((0.0, 0.0), 180, (60.0, -175.0, 15.8315, -160.7122, 0)),
    ],
)
def test_sensors_by_hand(position, degrees, expected):
    got = felt(position, degrees)
    got[[1, 3]] = np.degrees(got[[1, 3]])
    if abs(expected[3]) == 180.0:
        got[3] = abs(got[3])
    np.testing.assert_allclose(got, expected, atol=2e-3)


def test_relative_sensors_begin_near_1():
    np.testing.assert_allclose(
        felt((0.0, 0.0), 0, sensors="relative"), (1.0, 5.0 / 180.0, 1.0, 19.2878 / 180.0, 0.0), atol=1e-3
    )
    for target in (LEFT, RIGHT):
        everywhere = [
            felt(position, degrees, target, "relative")
            for position in ((0.0, 0.0), (0.06, 0.05), (0.3, 0.05), (0.5, -0.05))
            for degrees in range(-180, 180, 20)
        ]
        assert np.abs(everywhere)[:, [0, 1, 3, 4]].max() < 1.0 + 1e-12
        assert np.abs(everywhere).max() < 2.5


def test_the_targets_mirror_each_other():
    got, mirrored = felt((0.06, 0.01), 10, LEFT), felt((0.06, -0.01), -10, RIGHT)
    np.testing.assert_allclose(got * [1, -1, 1, -1, 1], mirrored, atol=1e-9)


@pytest.mark.parametrize(("depth", "bonus"), [(-0.01, 0.0), (0.0399, 0.0), (0.0401, 0.04), (0.2, 0.04)])
def test_the_bonus_needs_four_centimetres_past_the_entrance(depth, bonus):
    at = (GATE[0] + depth, GATE[1])
    view = a_view(position=at, direction=(1, 0), target=TARGET, walls=SQUEEZING.walls(LEFT, 2))
    assert SQUEEZING.score(view)[0, 0] == pytest.approx(TARGET[0] - at[0] - bonus, abs=1e-9)


@pytest.mark.parametrize(
    ("ahead", "aside", "bonus"),
    [
        (0.041, 0.0, 0.04),
        (0.039, 0.0, 0.0),
        # 3 cm past and 3 cm aside: 4.2 cm from the middle
        (0.03, 0.03, 0.04),
        (0.001, -0.041, 0.04),
        (-0.001, 0.041, 0.0),
        (-0.06, 0.0, 0.0),
    ],
)
def test_the_published_bonus_needs_four_centimetres_from_the_entrance_s_middle(ahead, aside, bonus):
    task = task_of(RunConfig(task="squeezing", bonus="distance"))
    at = np.add(GATE, (ahead, aside))
    view = a_view(position=at, direction=(1, 0), target=TARGET, walls=SQUEEZING.walls(LEFT, 2))
    assert task.score(view)[0, 0] == pytest.approx(np.linalg.norm(TARGET - at) - bonus, abs=1e-9)


BODIES = [Morphology(2, (1, 6)), Morphology(7, (8, 3)), Morphology(9, (5, 5))]
SOLUTIONS = [
    Solution(number=10 + i, morphology=m, controller=evolved_controller(i, 5, n_inputs=5))
    for i, m in enumerate([*BODIES, Morphology(5, (2, 4, 7))])
]


def evaluate(solutions, *, physics=PHYSICS, n_threads=1, keep=None):
    evaluator = LocalEvaluator(
        task=SQUEEZING,
        physics=physics,
        trials=TrialConfig(repeats=2, settle_time=0.6, open_loop_time=0.2, trial_time=1.0),
        run_seed=3,
        n_threads=n_threads,
        keep_failure=keep,
    )
    return {e.solution.number: e for group in evaluator.evaluate(solutions) for e in group}


def bits(e):
    return repr(e.fitness), e.distances.tobytes(), e.trajectory.tobytes(), e.head_is_end


def test_threads_and_company_do_not_matter():
    together, two = evaluate(SOLUTIONS), evaluate(SOLUTIONS[::-1], n_threads=2)
    for s in SOLUTIONS:
        assert together[s.number].failure is None
        assert bits(together[s.number]) == bits(two[s.number])
    (alone,) = evaluate(SOLUTIONS[1:2]).values()
    assert bits(alone) == bits(together[11])


def test_walls_stand_round_the_settled_head_wherever_it_looks():
    robots = build_robots(BODIES, PHYSICS)
    settled = settle(robots, physics=PHYSICS, duration=0.5)
    loop = ClosedLoop(
        settled,
        robots,
        heads=[Head.of(m, k != 1) for k, m in enumerate(BODIES)],
        controllers=[s.controller for s in SOLUTIONS[:3]],
        targets=np.broadcast_to(target_offsets(SQUEEZING), (3, 2, 2)),
        seeds=[[(k, c) for c in range(2)] for k in range(3)],
        task=SQUEEZING,
        physics=PHYSICS,
        walls=worlds(SQUEEZING, 2),
    )
    view = loop.view()
    np.testing.assert_allclose(view.position, 0.0, atol=1e-12)
    np.testing.assert_allclose(view.direction, np.broadcast_to([1.0, 0.0], (3, 2, 2)), atol=1e-12)
    np.testing.assert_allclose(view.target, np.broadcast_to(target_offsets(SQUEEZING), (3, 2, 2)), atol=1e-12)
    np.testing.assert_allclose(view.modules.mean(axis=2)[..., 0], -0.04, atol=0.03)  # it lies behind
    np.testing.assert_allclose(view.clearance, GATE[0], atol=1e-6)
    assert ((view.height > 0.0) & (view.height < 0.09)).all()
    # and in the world a target is straight behind the middle of its aperture
    for robot in range(3):
        for copy in range(2):
            left, right = loop.walls[robot][copy][:2]
            along = np.array([math.cos(left.yaw), math.sin(left.yaw)])
            across = np.array([-along[1], along[0]])
            edges = (
                across @ left.centre[:2] - left.half_size[1],
                across @ right.centre[:2] + right.half_size[1],
            )
            assert across @ loop.targets[robot, copy] == pytest.approx(np.mean(edges), abs=1e-9)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    path = tmp_path_factory.mktemp("squeezing") / "run.tsmr"
    config = replaced(TINY, task="squeezing", evaluations=6, initial=4)
    config = dataclasses.replace(config, trials=dataclasses.replace(TINY.trials, repeats=2))
    engine.runs.evolve.evolve(path, config, n_threads=1)
    with RunReader(path) as reader:
        yield reader


def test_replays_exports_and_verification_repeat_the_evaluation(run, tmp_path):
    found = [e for e in run.all_evaluations() if e.fitness is not None]
    e = min(found, key=lambda e: e.solution.morphology.n_modules)
    replay = Replay(run.config, e, target=RIGHT, repeat=1)
    assert replay.walls == ()
    replay.advance(1.0)
    assert replay.score == e.distances[RIGHT, 1]
    assert len(replay.walls) == 5
    assert verify(run.config, e, n_seeds=1).identical

    files = export_files(run, e.solution.number)
    assert files["robot.xml"].count(b'name="wall') == 5
    assert b"TensAtlas's own kernel" in files["README.md"]
    assert b"5\xc2\xb0 left" in files["README.md"]
    write_folder(files, tmp_path / "robot")
    namespace = {"__file__": str(tmp_path / "robot" / "play.py"), "__name__": "play"}
    exec((tmp_path / "robot" / "play.py").read_text(), namespace)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sys.argv", ["play.py"])
        printed = []
        namespace["print"] = printed.append
        namespace["main"]()
    distance = re.search(r"at most (\S+) mm", printed[-1])
    assert float(distance[1]) < 0.001


def test_a_failure_among_walls_is_dumped_with_them(tmp_path):
    # one command in 2000 is beyond what MuJoCo takes for a number; those before make the robots twitch
    wild = Physics(simulator="mujoco", servo_noise=mujoco.mjMAXVAL / 3.5)
    kept = []
    evaluate(SOLUTIONS, physics=wild, keep=lambda failed: kept.append(failed) or "")
    among = [f for f in kept if f.stage == "trial"]
    assert len(among) >= 2
    for failed in among:
        path = tmp_path / "a.tsdump"
        write_dump(Dump("squeezing", wild, 3, failed, {}), path)
        dump = read_dump(path)
        assert dump.failed.walls == failed.walls
        assert len(failed.walls) == 5
        # the world before the walls went up is not part of it
        assert len(failed.failure.controls) <= failed.failure.n_updates - 30
        replay = DumpReplay(dump)
        replay.advance()
        assert replay.walls == failed.walls
        assert replay.reproduced is True
    assert max(len(f.failure.controls) for f in among) > 5
