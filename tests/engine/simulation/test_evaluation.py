"""Evaluations of robots that differ although they are of one design."""

from __future__ import annotations

import dataclasses
import random

import numpy as np
import pytest

from engine.body.morphology import Morphology
from engine.config import RunConfig, from_json, preset, to_json
from engine.control.operators import Neat
from engine.replay.replay import Replay
from engine.simulation.built import NO_SPREAD, Built, Spread
from engine.simulation.evaluation import Evaluation, FailedTrial, LocalEvaluator, Solution
from engine.simulation.physics import Physics, as_built
from engine.simulation.trials import TrialConfig
from engine.tasks import GOAL_REACHING

SHORT = TrialConfig(repeats=2, settle_time=0.4, open_loop_time=0.4, trial_time=1.0, trajectory_bits=0)
SPREAD = Spread(stiffness=0.2, line_errors=0.001, friction=0.2)


def solution(number: int) -> Solution:
    return Solution(
        number=number,
        morphology=Morphology(4, (1, 8, 1)),
        controller=Neat(n_inputs=2).random(random.Random(number)),
    )


def evaluate(physics: Physics, *solutions: Solution, **options: object) -> dict[int, Evaluation]:
    evaluator = LocalEvaluator(
        task=GOAL_REACHING,
        physics=physics,
        trials=SHORT,
        run_seed=3,
        **options,  # type: ignore[arg-type]
    )
    return {e.solution.number: e for group in evaluator.evaluate(solutions) for e in group}


@pytest.fixture(scope="module")
def quiet() -> Physics:
    """Return a physics in which only robots differ, not the noise on their cables."""
    return dataclasses.replace(Physics(), servo_noise=0.0)


def test_every_repeat_has_another_robot(quiet: Physics) -> None:
    alike = evaluate(quiet, solution(1))[1]
    assert np.ptp(alike.distances, axis=1).max() == 0.0
    differ = evaluate(as_built(quiet, Built(), SPREAD), solution(1))[1]
    assert np.ptp(differ.distances, axis=1).min() > 0.0
    assert differ.distances.shape == alike.distances.shape
    assert differ.trajectory.shape == alike.trajectory.shape
    # the head is that of the design
    assert differ.head_is_end == alike.head_is_end


def test_robots_do_not_depend_on_who_is_evaluated_with_them(quiet: Physics) -> None:
    physics = as_built(quiet, Built(), SPREAD)
    together, alone = evaluate(physics, solution(1), solution(2)), evaluate(physics, solution(2))
    assert (together[2].distances == alone[2].distances).all()
    assert (together[2].trajectory == alone[2].trajectory).all()
    assert (together[1].distances != together[2].distances).any()


def test_a_replay_has_the_robot_of_its_repeat(quiet: Physics) -> None:
    config = dataclasses.replace(
        preset("smoke"), seed=3, trials=SHORT, physics=as_built(quiet, Built(), SPREAD), sensors="centimetres"
    )
    evaluation = evaluate(config.physics, solution(1))[1]
    for repeat in range(2):
        replay = Replay(config, evaluation, target=1, repeat=repeat)
        replay.advance(SHORT.trial_time)
        assert replay.score == evaluation.distances[1, repeat]


def test_a_run_file_holds_what_its_robots_are_like() -> None:
    config = dataclasses.replace(
        preset("smoke"),
        physics=as_built(
            Physics(), Built(winding="even", line_errors=(0.001,) * 5, stiffness=(1.1,) * 10), SPREAD
        ),
    )
    assert from_json(to_json(config)) == config
    published = to_json(dataclasses.replace(config, physics=as_built(Physics(), Built(), NO_SPREAD)))
    assert published == to_json(preset("smoke"))
    assert not {"built", "spread"} & set(published["physics"])
    assert isinstance(from_json(published), RunConfig)


def test_a_failure_names_the_robot_that_failed(monkeypatch: pytest.MonkeyPatch) -> None:
    failed: list[FailedTrial] = []

    def keep(failure: FailedTrial) -> str:
        failed.append(failure)
        return ""

    # a step that no robot survives
    flying = dataclasses.replace(Physics(), timestep=0.02)
    monkeypatch.setattr("engine.simulation.evaluation.physics_of", lambda *_: flying)
    evaluation = evaluate(dataclasses.replace(Physics(), spread=SPREAD), solution(1), keep_failure=keep)[1]
    assert evaluation.fitness is None
    assert len(failed) == 1
    assert failed[0].physics == flying
