"""Breeding is a run that starts from chosen robots, made of a few choices."""

import dataclasses

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import engine.runs.evolve
from engine.body.morphology import Morphology
from engine.config import PRESETS, create_algorithm, from_json, replaced, to_json
from engine.errors import InvalidData
from engine.runs.breeding import CHILDREN, MAX_PARENTS, Breeding, breeding_config
from engine.search.variation import GivenRobot
from engine.storage.reader import RunReader
from tests.support.made_up import MADE_UP, MadeUpEvaluator, evolved_controller
from tests.support.run_hash import hash_of

strengths = st.floats(0.0, 1.0)


def robots(n):
    return [
        GivenRobot(Morphology(2 + i, (1, 2, 1 + i)), evolved_controller(i, 12), f"other.tsmr robot {i}")
        for i in range(n)
    ]


def rates(config):
    """Return all numbers of a variation that a strength decides."""
    v = config.variation
    return dataclasses.astuple(v.body) + tuple(x for x in dataclasses.astuple(v.neat) if type(x) is float)


@given(strengths, strengths)
def test_a_greater_strength_lowers_no_rate(one, other):
    near, far = (
        rates(breeding_config(Breeding(strength=s), [PRESETS["atlas"]])) for s in sorted((one, other))
    )
    assert all(a <= b for a, b in zip(near, far, strict=True))
    if abs(one - other) > 0.01:
        assert all(a < b for a, b in zip(near[:2] + near[3:], far[:2] + far[3:], strict=True))


def test_the_middle_is_what_other_runs_have():
    assert rates(breeding_config(Breeding(), [PRESETS["atlas"]])) == pytest.approx(rates(PRESETS["atlas"]))


@settings(deadline=None, max_examples=8)
@given(
    st.sampled_from(["nothing", "bodies", "controllers"]), strengths, st.integers(1, 8), st.integers(0, 99)
)
def test_what_is_held_never_changes_and_nobody_is_random(hold, strength, n, seed):
    parents = robots(n)
    config = breeding_config(Breeding(strength=strength, hold=hold, generations=3, seed=seed), [MADE_UP] * n)
    algorithm, evaluator, born = create_algorithm(config, parents), MadeUpEvaluator(), []
    while asked := algorithm.ask():
        born += asked
        algorithm.tell([e for group in evaluator.evaluate(asked) for e in group])
    assert len(born) == n + 3 * CHILDREN == config.evaluations
    assert {s.operator for s in born[n:]} <= {"morphology", "controller", "both"}
    assert [s.parent for s in born[n : n + CHILDREN]] == [k % n for k in range(n, n + CHILDREN)]
    bodies, networks = ({getattr(p, part) for p in parents} for part in ("morphology", "controller"))
    if hold == "bodies":
        assert {s.morphology for s in born} == bodies
    else:
        assert {s.morphology for s in born} > bodies
    if hold == "controllers":
        assert {s.controller for s in born} == networks
    else:
        assert {s.controller for s in born} > networks


def test_a_run_can_be_interrupted_and_has_the_children_s_parents(tmp_path, monkeypatch):
    monkeypatch.setattr(engine.runs.evolve, "create_evaluator", lambda *_: MadeUpEvaluator())
    parents = robots(3)
    config = breeding_config(Breeding(generations=4), [MADE_UP] * 3)
    config = dataclasses.replace(config, trials=MADE_UP.trials)  # which the made-up evaluations have

    def interrupt(progress):
        if progress.n_evaluations >= 5:
            raise KeyboardInterrupt

    engine.runs.evolve.evolve(tmp_path / "whole.tsmr", config, given=parents)
    with pytest.raises(KeyboardInterrupt):
        engine.runs.evolve.evolve(tmp_path / "cut.tsmr", config, given=parents, observer=interrupt)
    engine.runs.evolve.resume(tmp_path / "cut.tsmr")
    assert hash_of(tmp_path / "cut.tsmr") == hash_of(tmp_path / "whole.tsmr")
    with RunReader(tmp_path / "whole.tsmr") as reader:
        assert [a.operator for a in reader.lineage(config.evaluations - 1)][-1] == "given"
        assert reader.evaluation(4).solution.parent == 1


def test_the_world_is_the_parents_and_the_rest_is_fast():
    base = replaced(PRESETS["paper"], task="squeezing", stiffness="per-module", bonus="depth")
    base = dataclasses.replace(
        base,
        physics=dataclasses.replace(base.physics, friction=0.7, simulator="mujoco"),
        trials=dataclasses.replace(base.trials, repeats=3, trial_time=20.0, trajectory_bits=0),
    )
    config = breeding_config(Breeding(seed=4), [base, base])
    for name in ("task", "sensors", "stiffness", "head_search", "bonus"):
        assert getattr(config, name) == getattr(base, name)
    assert config.variation.neat.version == "0.92"
    assert (config.physics.friction, config.physics.simulator) == (0.7, "kernel")
    assert (config.trials.trial_time, config.trials.repeats, config.trials.trajectory_bits) == (20.0, 1, 14)
    assert config.seed == 4
    assert from_json(to_json(config)) == config


def test_choices_that_are_none_are_refused():
    atlas = PRESETS["atlas"]
    with pytest.raises(InvalidData, match="choose 1 to 8 robots to breed from, not 0"):
        breeding_config(Breeding(), [])
    with pytest.raises(InvalidData, match="not 9"):
        breeding_config(Breeding(), [atlas] * (MAX_PARENTS + 1))
    with pytest.raises(InvalidData, match=r"their tasks differ \(goal-reaching and squeezing\)"):
        breeding_config(Breeding(), [atlas, replaced(atlas, task="squeezing")])
    for wrong in ({"strength": 1.1}, {"strength": float("nan")}, {"hold": "all"}, {"generations": 0}):
        with pytest.raises(InvalidData, match=next(iter(wrong))):
            Breeding(**wrong)
    with pytest.raises(InvalidData, match="fill = mutants needs robots to start from"):
        create_algorithm(breeding_config(Breeding(), [atlas]))
