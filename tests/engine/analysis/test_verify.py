import dataclasses

import numpy as np
import pytest

from engine.analysis.verify import changed_physics, resimulate, verify
from engine.config import task_of
from engine.errors import InvalidData
from engine.simulation.evaluation import LocalEvaluator
from engine.storage.reader import RunReader


@pytest.fixture(scope="module")
def run(simulated_run):
    """A run's configuration and one of its elites."""
    with RunReader(simulated_run) as reader:
        held = reader.contents("morphology", reader.last_generation())
        return reader.config, min(held.values(), key=lambda e: e.fitness)


@pytest.fixture(scope="module")
def found(run):
    config, evaluation = run
    physics = changed_physics(config.physics, timestep_factor=0.5)
    return verify(config, evaluation, physics=physics, n_seeds=3, n_threads=2)


def test_the_runs_own_physics_and_noise_give_the_recorded_result(run, found):
    config, evaluation = run
    assert found.identical
    assert found.recorded == evaluation
    assert found.own.physics == config.physics
    assert found.own.recorded_noise.distances.tobytes() == evaluation.distances.tobytes()


def test_what_was_tampered_with_is_not_identical(run, found):
    _, evaluation = run
    for changes in (
        {"fitness": evaluation.fitness + 1e-12},
        {"distances": evaluation.distances + 1e-12},
        {"trajectory": evaluation.trajectory + np.float32(1e-6)},
        {"head_is_end": not evaluation.head_is_end},
    ):
        tampered = dataclasses.replace(evaluation, **changes)
        assert not dataclasses.replace(found, recorded=tampered).identical


def test_fresh_noise_is_new_each_time_and_the_same_for_both_physics(run, found):
    config, evaluation = run
    for samples in (found.own, found.changed):
        assert len(samples.fresh) == 3
        assert len({e.fitness for e in (samples.recorded_noise, *samples.fresh)}) == 4
        assert samples.mean == pytest.approx(np.mean([e.fitness for e in samples.fresh]))
        assert samples.deviation == pytest.approx(np.std([e.fitness for e in samples.fresh], ddof=1))
        assert samples.distances.shape == (4,)
    numbers = [[e.solution.number for e in s.fresh] for s in (found.own, found.changed)]
    assert numbers[0] == numbers[1]
    with_fewer = resimulate(config, evaluation, physics=config.physics, n_seeds=1)
    assert with_fewer.fitness.tolist() == found.own.fitness[:1].tolist()
    assert with_fewer.deviation is None


def test_another_physics_is_simulated_as_a_run_with_it_would_be(run, found):
    config, evaluation = run
    physics = found.changed.physics
    assert physics.timestep == config.physics.timestep / 2
    evaluator = LocalEvaluator(
        task=task_of(config), physics=physics, trials=config.trials, run_seed=config.seed
    )
    ((expected,),) = evaluator.evaluate([evaluation.solution])
    assert found.changed.recorded_noise.fitness == expected.fitness
    assert expected.fitness != evaluation.fitness


def test_mujoco_is_compared_without_the_feet_that_it_does_not_know(run, found):
    config, evaluation = run
    body = dataclasses.replace(evaluation.solution.morphology, feet="end")
    footed = dataclasses.replace(
        evaluation, solution=dataclasses.replace(evaluation.solution, morphology=body)
    )
    mujoco = changed_physics(config.physics, simulator="mujoco")
    compared = verify(config, footed, physics=mujoco, n_seeds=1)
    assert not compared.identical
    assert compared.plain.recorded_noise.distances.tobytes() == evaluation.distances.tobytes()
    assert compared.own.recorded_noise.distances.tobytes() != evaluation.distances.tobytes()
    assert compared.changed.physics == mujoco
    assert compared.changed.recorded_noise.solution.morphology.feet == "none"
    assert found.plain is None
    with pytest.raises(InvalidData, match="mujoco knows no directional feet"):
        resimulate(config, footed, physics=mujoco, n_seeds=1)


def test_motion_is_recorded(found):
    for samples in (found.own, found.changed):
        motion = samples.motion
        assert 0.0 <= motion.airborne <= 1.0
        assert 0.01 < motion.height < 0.1
        assert 0.0 < motion.final_speed <= motion.speed < 2.0


def test_without_another_physics_only_the_noise_is_new(run):
    found = verify(*run, n_seeds=1)
    assert found.changed is None
    assert found.identical


def test_a_physics_that_fails_is_reported_not_raised(run):
    config, evaluation = run
    # MuJoCo takes no such number for a command
    physics = dataclasses.replace(config.physics, simulator="mujoco", servo_noise=1e300)
    samples = verify(config, evaluation, physics=physics, n_seeds=2).changed
    assert samples.n_failed == 2
    assert samples.recorded_noise.failure
    assert samples.mean is samples.deviation is samples.distances is None
    assert samples.motion.height == 0.0


def test_changed_physics(run):
    physics = run[0].physics
    assert changed_physics(physics) == physics
    assert changed_physics(physics, inertia_scale=physics.inertia_scale) == physics
    light = changed_physics(physics, inertia_scale=physics.inertia_scale / 10, timestep_factor=0.25)
    assert light.timestep < physics.timestep / 10
    assert changed_physics(physics, simulator="kernel") == dataclasses.replace(physics, simulator="kernel")


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"inertia_scale": -1.0}, "inertia_scale"),
        ({"inertia_scale": float("nan")}, "inertia_scale"),
        ({"timestep_factor": 0.3}, "whole number of time steps"),
        ({"timestep_factor": 0.0}, "at least 0.01"),
        ({"timestep_factor": 1e-9}, "at least 0.01"),
        ({"timestep_factor": float("nan")}, "at least 0.01"),
        ({"timestep_factor": float("inf")}, "at least 0.01"),
    ],
)
def test_impossible_physics_is_refused(run, changes, reason):
    with pytest.raises(InvalidData, match=reason):
        changed_physics(run[0].physics, **changes)


def test_what_cannot_be_simulated_is_refused_before_time_is_spent(run):
    config, evaluation = run
    with pytest.raises(InvalidData, match="seeds must be"):
        verify(config, evaluation, n_seeds=0)
    with pytest.raises(InvalidData, match="too large"):
        verify(config, evaluation, physics=changed_physics(config.physics, timestep_factor=2.0))
