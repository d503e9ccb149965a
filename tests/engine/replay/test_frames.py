"""Frames that are recorded at once are those that one sees by looking after every control update."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from engine.body.morphology import Morphology
from engine.config import task_of
from engine.replay.frames import FrameMaker
from engine.replay.recording import UPDATES_PER_FRAME, ContactFinder
from engine.replay.replay import Replay, repeat_trial
from engine.simulation.batch import FIRST_SPAN, SPAN, Span
from engine.simulation.evaluation import LocalEvaluator, Solution
from engine.simulation.model import build_robot
from engine.simulation.physics import Physics
from engine.simulation.rollout import Head
from engine.simulation.trials import TrialConfig
from engine.tasks import GOAL_REACHING, SQUEEZING
from tests.support.made_up import TINY, evolved_controller

# neither settling nor the trial are whole numbers of spans, nor of frames
TIMES = TrialConfig(repeats=2, settle_time=1.1, open_loop_time=0.2, trial_time=2.3)


def config_of(physics, task):
    return dataclasses.replace(TINY, task=task.name, physics=physics, trials=TIMES)


def evaluated(config):
    task = task_of(config)
    solution = Solution(
        number=3, morphology=Morphology(6, (1, 5)), controller=evolved_controller(4, 6, task.n_inputs)
    )
    evaluator = LocalEvaluator(
        task=task_of(config), physics=config.physics, trials=TIMES, run_seed=config.seed
    )
    ((evaluation,),) = evaluator.evaluate([solution])
    return evaluation


@pytest.mark.parametrize("simulator", ["kernel", "mujoco"])
@pytest.mark.parametrize("task", [GOAL_REACHING, SQUEEZING], ids=lambda task: task.name)
def test_a_replay_shows_what_each_control_update_does(simulator, task):
    config = config_of(Physics(simulator=simulator), task)
    evaluation = evaluated(config)
    replay = Replay(config, evaluation, target=1, repeat=1)
    for until in (0.5, 0.51, 2.3):  # in pieces of any size
        replay.advance(until)
    assert replay.score == evaluation.distances[1, 1]
    loop = repeat_trial(config, evaluation, target=1, repeat=1)
    shown = [f for f in replay.frames if f.time > 1e-9]
    for _ in range(115):
        loop.update()
        if loop.sim.n_updates % UPDATES_PER_FRAME:
            continue
        frame = shown.pop(0)
        assert frame.time == pytest.approx(loop.sim.n_updates * 0.02 - 1.1)
        np.testing.assert_array_equal(frame.pose.ravel(), loop.sim.qpos[0, 0].astype(np.float32))
        np.testing.assert_array_equal(frame.lengths, loop.sim.commanded[0, 0].astype(np.float32))
        np.testing.assert_array_equal(frame.sensed, loop.sensed[0, 0])
        np.testing.assert_allclose(
            frame.head, frame.pose[replay.head.module, list(replay.head.front), :2].mean(axis=0), atol=1e-7
        )
        found = ContactFinder(loop.sim.model(0)).find(frame.pose.ravel())
        np.testing.assert_array_equal(frame.contacts, found)
        assert frame.contacts is frame.contacts
    assert not shown
    assert len(replay.frames) == (55 + 115) // 2


def test_every_control_update_is_observed_once():
    config = config_of(Physics(), GOAL_REACHING)
    seen = []
    replay = Replay(config, evaluated(config), observer=seen.append)
    replay.advance(TIMES.trial_time)
    assert [n for span in seen for n in span.updates] == [*range(1, 171)]
    assert [len(span.updates) for span in seen] == [FIRST_SPAN, 45, SPAN, 15]
    assert [span.sensed is None for span in seen] == [True, True, False, False]


def test_frames_end_before_a_simulation_fails():
    head = Head.of(Morphology(5, (1, 2)), True)
    model = build_robot(Morphology(5, (1, 2)), Physics()).model
    failures = [None, SimpleNamespace(n_updates=8)]
    sim = SimpleNamespace(failures=failures, model=lambda _copy: model)
    maker = FrameMaker(head, settle_time=0.06, control_period=0.02, copy=1)

    def span(end, n):
        return Span(sim, end, np.zeros((n, 1, 2, 84)), np.zeros((n, 1, 2, 2, 5)), None)

    assert [f.time for f in maker.frames(span(5, 5))] == pytest.approx([-0.02, 0.02])
    assert [f.time for f in maker.frames(span(10, 5))] == pytest.approx([0.06])
    assert maker.frames(span(15, 5)) == []
    failures[1] = None
    assert len(maker.frames(span(15, 5))) == 2


@pytest.mark.parametrize("settle_time", [1.6, 0.0], ids=["while it settles", "in its trial"])
def test_a_failed_replay_says_when_as_the_evaluation_did(monkeypatch, settle_time):
    """What fails is noticed at its control update, however many are simulated at once."""
    monkeypatch.setattr("engine.replay.replay.check_timestep", lambda _physics: None)
    times = TrialConfig(repeats=1, settle_time=settle_time, open_loop_time=0.0, trial_time=2.0)
    config = dataclasses.replace(config_of(Physics(timestep=0.004), GOAL_REACHING), trials=times)
    solution = Solution(
        number=20, morphology=Morphology(10, (1, 2, 3)), controller=evolved_controller(0, 3, 2)
    )
    evaluator = LocalEvaluator(
        task=task_of(config), physics=config.physics, trials=times, run_seed=config.seed
    )
    ((evaluation,),) = evaluator.evaluate([solution])
    assert evaluation.failure.startswith("diverged")
    replay = Replay(config, evaluation)
    replay.advance(2.0)
    assert replay.failure == evaluation.failure
    failed_at = float(replay.failure.split()[1]) - settle_time
    assert all(f.time < failed_at for f in replay.frames)
    assert replay.score is None
