"""Many trials at once are the trials that a replay simulates one by one."""

import numpy as np
import pytest

from engine.config import replaced
from engine.replay.every_target import replay_every_target
from engine.replay.replay import Replay
from engine.storage.reader import RunReader
from tests.support.exploded import EXPLOSIVE


@pytest.fixture(scope="module")
def evaluations(small_run):
    with RunReader(small_run) as reader:
        return reader.config, [e for e in reader.all_evaluations() if e.fitness is not None][:5]


def test_they_equal_replays_to_the_last_bit(evaluations):
    config, robots = evaluations
    seconds = []
    found = list(replay_every_target(config, robots, updates_per_frame=10, progress=seconds.append))
    assert sorted(e.solution.number for e, _ in found) == sorted(e.solution.number for e in robots)
    sizes = [e.solution.morphology.n_modules for e, _ in found]
    assert sizes == sorted(sizes, reverse=True)
    for evaluation, trials in found[:2]:
        for k in (0, len(trials) - 1):
            replay = Replay(config, evaluation, target=k)
            replay.advance(replay.end_time)
            own, period = trials[k], config.physics.control_period
            assert len(own.poses) == round(config.trials.trial_time / (10 * period)) + 1
            times = np.array([frame.time for frame in replay.frames])
            for f, (pose, lengths) in enumerate(zip(own.poses, own.lengths, strict=True)):
                i = int(np.argmin(np.abs(times - 10 * f * period)))
                np.testing.assert_array_equal(pose, replay.frames[i].pose)
                np.testing.assert_array_equal(lengths, replay.frames[i].lengths)
            np.testing.assert_array_equal(own.target, replay.target)
            assert own.score == replay.score == pytest.approx(evaluation.distances[k, 0])
            assert own.failure is None
    assert sum(seconds) == pytest.approx(len(robots) * len(trials) * config.trials.trial_time)


def test_of_a_trial_that_fails_only_what_came_before_is_kept(evaluations, monkeypatch):
    monkeypatch.setattr("engine.replay.every_target.check_timestep", lambda _physics: None)
    config, robots = evaluations
    config = replaced(config, physics=EXPLOSIVE)
    trials = [t for _, own in replay_every_target(config, robots[:2], updates_per_frame=5) for t in own]
    failed = [t for t in trials if t.failure is not None]
    assert failed
    for trial in failed:
        assert trial.failure.startswith("diverged")
        assert trial.score is None
        assert len(trial.poses) == len(trial.lengths) < round(2.0 / 0.1) + 1
        assert np.isfinite(trial.poses).all()


def test_what_progress_raises_ends_it(evaluations):
    def stop(_seconds):
        raise KeyboardInterrupt

    config, robots = evaluations
    with pytest.raises(KeyboardInterrupt):
        list(replay_every_target(config, robots, updates_per_frame=10, progress=stop))
