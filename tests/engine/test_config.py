import dataclasses
import json
import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from engine.body.feet import BodyConfig
from engine.body.morphology import BodyRates, Morphology
from engine.config import (
    PRESETS,
    RunConfig,
    create_algorithm,
    from_json,
    physics_from_json,
    preset,
    replaced,
    task_of,
    to_json,
)
from engine.control.operators import Neat
from engine.control.rates import NeatRates
from engine.errors import InvalidData
from engine.search.variation import PUBLISHED, GivenRobot, VariationConfig
from engine.search.vie_neat import VieNeatConfig
from engine.simulation.physics import Physics, with_inertia
from engine.simulation.trials import TrialConfig
from engine.tasks import GOAL_REACHING
from tests.support.made_up import examples

NAN, INF = float("nan"), float("inf")
positive = st.floats(1e-3, 1e3)
whole_periods = st.integers(0, 5000).map(lambda n: 0.02 * n)
configs = st.builds(
    lambda **fields: replaced(RunConfig(), **fields),
    evaluations=st.integers(100, 10**6),
    initial=st.integers(2, 100),
    batch_size=st.integers(1, 50).map(lambda n: 2 * n),
    refit_generations=st.sets(st.integers(1, 5000)).map(lambda s: (0, *sorted(s))),
    sensory=st.sampled_from(["positions", "displacements"]),
    cell_capacity=st.integers(1, 1000),
    stiffness=st.sampled_from(["shared", "per-module"]),
    vie_neat=st.builds(
        VieNeatConfig,
        morphologies=st.integers(2, 100),
        mutants=st.integers(1, 100),
        boundary_rate=st.floats(0.01, 1.0),
        maximise=st.sampled_from(["negative", "inverse"]),
        controllers=st.integers(31, 100),
        elitism=st.integers(0, 10),
        species_elitism=st.integers(0, 3),
        compatibility_threshold=positive,
    ),
    sensors=st.sampled_from(["centimetres", "relative"]),
    bonus=st.sampled_from(["depth", "distance"]),
    head_search=st.sampled_from(["together", "rhythms"]),
    controller_cells=st.tuples(st.integers(1, 50), st.integers(1, 50)),
    variation=st.builds(
        VariationConfig,
        body=st.builds(BodyRates, body_rate=st.floats(0.01, 1.0), module_rate=st.floats(0.0, 0.5)),
        neat=st.builds(
            NeatRates,
            hidden=st.integers(0, 9),
            weight_power=st.floats(0.001, 30.0),
            version=st.sampled_from(["2.0", "0.92"]),
        ),
        both_weight=st.integers(0, 100),
        exchange_weight=st.integers(0, 100),
        switch_weight=st.integers(0, 100),
        donors=st.integers(1, 1000),
        crossover=st.floats(0.0, 1.0),
    ),
    seed=st.integers(0, 2**32 - 1),
    trials=st.builds(
        TrialConfig,
        repeats=st.integers(1, 9),
        settle_time=whole_periods,
        open_loop_time=whole_periods,
        trial_time=st.integers(1, 100).map(float),
        unfed_outputs=st.sampled_from(["bias", "zero"]),
    ),
    physics=st.builds(
        lambda scale, **others: with_inertia(Physics(**others), scale),
        scale=positive,
        friction=positive,
        impratio=positive,
        servo_noise=positive,
    ),
)


@examples(60)
@given(configs)
def test_json_round_trip_is_lossless(config):
    assert from_json(json.loads(json.dumps(to_json(config), allow_nan=False))) == config


def test_the_paper_preset_is_the_published_experiment():
    c = preset("paper")
    assert (c.sensors, c.map_search.sensory, c.bonus) == ("centimetres", "displacements", "distance")
    assert c.head_search == "rhythms"
    old = dataclasses.replace(PUBLISHED.neat, version="0.92")
    assert c.variation == dataclasses.replace(PUBLISHED, neat=old)
    assert (c.vie_neat.maximise, c.trials.unfed_outputs) == ("inverse", "zero")
    assert (c.evaluations, c.map_search.initial, c.map_search.batch_size) == (45_000, 1080, 24)
    assert c.map_search.refit_generations == (0, 50, 150, 350, 750, 1550)
    assert c.trials.repeats == 2
    assert (c.trials.settle_time, c.trials.open_loop_time, c.trials.trial_time) == (3.0, 10.0, 40.0)
    assert c.physics.servo_noise == 0.00035
    assert c.physics.inertia_scale == 10.0


def test_a_deep_grid_is_dm_me_s():
    assert replaced(preset("paper"), cell_capacity=50).algorithm == "dm-me"
    with pytest.raises(InvalidData, match="cell_capacity above 1 is for dm-me only; map-elites has no"):
        replaced(RunConfig(), algorithm="map-elites", cell_capacity=50)


def test_a_share_of_the_parents_is_dm_me_s():
    assert replaced(preset("atlas"), controller_share=0.25).map_search.controller_share == 0.25
    with pytest.raises(InvalidData, match="controller_share is for dm-me only; parents of map-elites are"):
        replaced(RunConfig(), algorithm="map-elites", controller_share=0.25)


@pytest.mark.parametrize("name", PRESETS)
@pytest.mark.parametrize("options", [{"algorithm": "map-elites"}, {"stiffness": "per-module"}], ids=str)
def test_presets_are_for_every_algorithm(name, options):
    config = dataclasses.replace(preset(name), **options)
    assert from_json(json.loads(json.dumps(to_json(config)))) == config
    small = replaced(config, initial=20)
    assert len(create_algorithm(small).ask()) == 20


@pytest.mark.parametrize("name", PRESETS)
def test_presets_survive_a_file(name):
    assert from_json(json.loads(json.dumps(to_json(preset(name))))) == preset(name)


def test_presets_differ():
    assert len(set(PRESETS.values())) == len(PRESETS) >= 4


def test_atlas_is_the_default_and_quick_a_short_one():
    atlas, quick = preset("atlas"), preset("quick")
    assert atlas == RunConfig()
    assert (atlas.sensors, atlas.variation) == ("relative", VariationConfig())
    shortened = ("evaluations", "map_search", "vie_neat", "trials")
    assert dataclasses.replace(atlas, **{f: getattr(quick, f) for f in shortened}) == quick


def test_an_unknown_preset_is_refused_with_the_choices():
    with pytest.raises(InvalidData, match=r"huge.*paper.*smoke"):
        preset("huge")


OLD = RunConfig(sensors="centimetres", variation=PUBLISHED)


def test_what_a_file_leaves_out_has_its_default_or_was_as_published():
    assert from_json({}) == OLD
    c = from_json({"seed": 3, "trials": {"repeats": 3}})
    trials = TrialConfig(repeats=3, trajectory_bits=0)
    assert c == dataclasses.replace(OLD, seed=3, trials=trials)


def test_a_file_from_before_positions_were_rounded_keeps_every_digit_and_its_hash():
    old = to_json(RunConfig())
    del old["trials"]["trajectory_bits"]
    assert from_json(old).trials.trajectory_bits == 0
    assert to_json(from_json(old)) == old


def test_a_file_from_before_there_were_feet_has_none_and_keeps_its_hash():
    old = to_json(RunConfig(seed=3))
    assert "feet" not in json.dumps(old)
    assert from_json(old).body == BodyConfig()
    assert to_json(from_json(old)) == old


@pytest.mark.parametrize(
    "config",
    [
        RunConfig(body=BodyConfig(feet="evolved")),
        RunConfig(body=BodyConfig(feet="evolved", feet_axis=True)),
        RunConfig(body=BodyConfig(feet="directional", feet_toward="start")),
        RunConfig(body=BodyConfig(feet="directional"), physics=Physics(feet_forward=0.2)),
        RunConfig(physics=Physics(feet_backward=0.9)),
        RunConfig(variation=VariationConfig(body=BodyRates(feet_rate=0.5))),
    ],
)
def test_feet_survive_a_file(config):
    assert from_json(json.loads(json.dumps(to_json(config)))) == config


def test_runs_from_before_feet_were_an_axis_keep_their_hash():
    assert "feet_axis" not in json.dumps(to_json(RunConfig(body=BodyConfig(feet="evolved"))))


def test_runs_that_mujoco_simulates_have_no_feet():
    with pytest.raises(InvalidData, match="mujoco knows no directional feet"):
        RunConfig(body=BodyConfig(feet="evolved"), physics=Physics(simulator="mujoco"))


def test_given_robots_have_feet_that_the_run_allows():
    body = Morphology(5, (1, 2), (), "end")
    robot = GivenRobot(body, Neat(n_inputs=2).random(random.Random(0)), "robot 3")
    with pytest.raises(InvalidData, match="robot 3 has feet toward the end; this run's are none"):
        create_algorithm(RunConfig(), [robot])
    evolved = replaced(RunConfig(), initial=40, body=BodyConfig(feet="evolved"))
    drawn = create_algorithm(evolved, [robot]).ask()
    assert drawn[0].morphology == body
    assert {s.morphology.feet for s in drawn} == {"none", "start", "end"}


@pytest.mark.parametrize("algorithm", ["dm-me", "vie-neat", "random", "map-elites-2d"])
def test_every_algorithm_draws_the_feet_of_its_run(algorithm):
    body = BodyConfig(feet="directional", feet_toward="start")
    drawn = create_algorithm(replaced(RunConfig(), algorithm=algorithm, body=body, initial=20)).ask()
    assert {s.morphology.feet for s in drawn} == {"start"}


def test_the_task_of_a_run_has_its_sensors():
    for sensors, units in (("relative", GOAL_REACHING.relative_units), ("centimetres", (100.0, 1.0))):
        assert task_of(RunConfig(sensors=sensors)).units == units


def test_a_file_from_before_rods_were_heavier_has_rods_as_they_were():
    old = {"timestep": 0.005, "control_period": 0.02, "inertia_scale": 10.0, "friction": 0.5}
    expected = Physics(**old, simulator="mujoco", rod_inertia=1.0, contact_time=0.02, contact_damping=1.0)
    assert from_json({"physics": old}).physics == physics_from_json(old) == expected


def test_whole_numbers_are_read_where_fractions_are_expected():
    c = from_json({"trials": {"trial_time": 5}})
    assert c.trials.trial_time == 5.0
    assert type(c.trials.trial_time) is float


@pytest.mark.parametrize(
    "data",
    [
        None,
        [],
        "paper",
        3,
        {"unknown": 1},
        {"task": "flying"},
        {"task": None},
        {"task": ["goal-reaching"]},
        {"algorithm": "hill-climbing"},
        {"sensory": "smell"},
        {"stiffness": "none"},
        {"sensors": "feet"},
        {"controller_cells": [9]},
        {"controller_cells": [9, 10, 11]},
        {"controller_cells": [0, 10]},
        {"variation": {"body": {"body_rate": 1.5}}},
        {"variation": {"neat": {"weight_rate": 0.5, "unknown": 1}}},
        {"variation": {"both_weight": 0.5}},
        {"cell_capacity": 0},
        {"cell_capacity": 1001},
        {"cell_capacity": 1.5},
        {"algorithm": "map-elites", "cell_capacity": 2},
        {"evaluations": 100.0},
        {"evaluations": "100"},
        {"evaluations": True},
        {"evaluations": None},
        {"evaluations": 1},
        {"initial": 50_000},
        {"batch_size": 23},
        {"refit_generations": 0},
        {"refit_generations": "0"},
        {"refit_generations": []},
        {"refit_generations": [1]},
        {"refit_generations": [0, 1.5]},
        {"refit_generations": [0, None]},
        {"seed": -1},
        {"seed": 2**32},
        {"seed": 10**400},
        {"trials": None},
        {"trials": []},
        {"trials": {"unknown": 1}},
        {"trials": {"repeats": 0}},
        {"trials": {"repeats": 1.5}},
        {"trials": {"trial_time": 0.5}},
        {"trials": {"trial_time": NAN}},
        {"trials": {"trial_time": INF}},
        {"trials": {"trial_time": "40"}},
        {"trials": {"trial_time": True}},
        {"trials": {"trial_time": 10**400}},
        {"trials": {"settle_time": -1.0}},
        {"physics": {"timestep": 0.0}},
        {"physics": {"timestep": 0.003}},
        {"physics": {"friction": None}},
        {"physics": {"friction": NAN}},
    ],
    ids=lambda d: str(d)[:60],
)
def test_malformed_json_is_refused(data):
    with pytest.raises(InvalidData):
        from_json(data)


@pytest.mark.parametrize("field", ["settle_time", "open_loop_time", "trial_time"])
@pytest.mark.parametrize("value", [NAN, INF, -1.0, 1001.0, 1e15])
def test_impossible_times_are_refused(field, value):
    with pytest.raises(InvalidData, match=field):
        TrialConfig(**{field: value})


@pytest.mark.parametrize("value", [-1, 31])
def test_positions_are_rounded_to_30_digits_at_most(value):
    with pytest.raises(InvalidData, match="trajectory_bits must be from 0 to 30"):
        TrialConfig(trajectory_bits=value)


@pytest.mark.parametrize("value", [1e-320, 1e-12])
@pytest.mark.parametrize("field", ["timestep", "control_period"])
def test_steps_of_next_to_nothing_are_refused(field, value):
    changes = {"timestep": value} if field == "timestep" else {"timestep": value / 2, "control_period": value}
    with pytest.raises(InvalidData, match="100000 at most"):
        Physics(**changes)


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"evaluations": 1, "initial": 1}, "evaluations must be at least 2"),
        ({"evaluations": 10, "initial": 11}, r"initial \(11\)"),
        ({"batch_size": 5}, "batch_size must be an even number"),
        ({"refit_generations": (5,)}, "refit_generations must include 0"),
        ({"seed": -1}, "seed must be"),
        ({"seed": 2**32}, "seed must be"),
        ({"task": "flying"}, "unknown task 'flying'"),
        # its last second would end within a control period
        ({"trials": TrialConfig(trial_time=1.995)}, "trial_time"),
        ({"trials": TrialConfig(settle_time=0.03)}, "settle_time"),
    ],
    ids=str,
)
def test_contradictions_are_refused(changes, reason):
    with pytest.raises(InvalidData, match=reason):
        replaced(RunConfig(), **changes)
