import dataclasses

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

import engine.runs.evolve
from engine.body.morphology import Morphology
from engine.errors import InvalidData
from engine.simulation.evaluation import LocalEvaluator, Solution
from engine.simulation.physics import Physics, check_timestep, largest_timestep, with_inertia
from engine.simulation.trials import TrialConfig
from engine.tasks import GOAL_REACHING
from tests.support.made_up import TINY, evolved_controller, examples


@examples(100)
@given(st.floats(1e-3, 1e3), st.sampled_from([0.004, 0.002, 0.0005]))
def test_another_inertia_comes_with_a_time_step_that_fits(scale, timestep):
    assume(not 0.00279 < scale < 0.0028)  # somewhere here the finest step becomes too fine
    if timestep == 0.0005 and scale < 0.0028:
        with pytest.raises(InvalidData, match="choose a larger scale"):
            with_inertia(Physics(timestep=timestep), scale)
        return
    physics = with_inertia(Physics(timestep=timestep), scale)
    assert physics.inertia_scale == scale
    assert physics.timestep <= largest_timestep(physics) * (1 + 1e-6)
    check_timestep(physics)


def test_an_inertia_that_needs_too_many_time_steps_is_refused_by_its_name():
    with pytest.raises(InvalidData, match=r"inertia_scale 0\.002 would need .* choose a larger scale"):
        with_inertia(Physics(timestep=0.0005), 0.002)
    assert with_inertia(Physics(timestep=0.004), 0.002).inertia_scale == 0.002


def test_the_same_inertia_keeps_the_time_step():
    assert with_inertia(Physics(), Physics().inertia_scale) == Physics()


@pytest.mark.parametrize("scale", [0.0, -1.0, float("nan"), float("inf"), 1e-4])
def test_impossible_inertia_is_refused(scale):
    with pytest.raises(InvalidData, match="inertia_scale"):
        with_inertia(Physics(), scale)


def test_a_time_step_that_the_inertia_does_not_stand_is_refused():
    with pytest.raises(InvalidData, match=r"too large for inertia_scale 1,.*fits is 0\.00037037"):
        check_timestep(Physics(inertia_scale=1.0))
    with pytest.raises(InvalidData, match="too large"):
        check_timestep(Physics(timestep=0.02))
    check_timestep(Physics(inertia_scale=1.0, timestep=0.00025))


def test_contacts_that_the_time_step_does_not_resolve_are_refused():
    with pytest.raises(InvalidData, match=r"contact_time 0\.008 and contact_damping 0\.5.*fits is 0\.002$"):
        check_timestep(Physics(contact_time=0.008, contact_damping=0.5))
    check_timestep(Physics(contact_time=0.01, contact_damping=0.5))


def test_a_run_refuses_it_before_its_file_is_made(tmp_path):
    config = dataclasses.replace(TINY, physics=Physics(timestep=0.005))
    with pytest.raises(InvalidData, match="too large"):
        engine.runs.evolve.evolve(tmp_path / "a.tsmr", config)
    assert not list(tmp_path.iterdir())


def test_the_real_inertia_has_no_scaled_rods():
    real = with_inertia(Physics(), 1.0)
    assert (real.inertia_scale, real.rod_inertia) == (1.0, 1.0)
    assert with_inertia(Physics(), 2.0).rod_inertia == Physics().rod_inertia


@pytest.mark.parametrize("n_modules", [2, 10])
def test_the_largest_time_step_has_some_margin_but_not_much(n_modules):
    assert 0.02 / 8 < largest_timestep(Physics()) < 0.02 / 7
    bodies = [Morphology(level, (1, 4) * (n_modules // 2)) for level in (1, 10)]
    solutions = [
        Solution(number=k, morphology=body, controller=evolved_controller(k, 0))
        for k, body in enumerate(bodies)
    ]
    failed = {}
    for steps in (7, 6):
        evaluator = LocalEvaluator(
            task=dataclasses.replace(GOAL_REACHING, target_bearings=(0.5,)),
            physics=Physics(timestep=0.02 / steps),
            trials=TrialConfig(repeats=1, settle_time=1.0, open_loop_time=0.4, trial_time=2.0),
            run_seed=0,
            n_threads=2,
        )
        found = [e for group in evaluator.evaluate(solutions) for e in group]
        failed[steps] = {e.solution.number for e in found if e.failure}
    assert failed[7] == set()
    assert 1 in failed[6]  # the stiffest body, at least
