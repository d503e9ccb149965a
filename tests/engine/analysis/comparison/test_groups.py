import dataclasses

import pytest

from engine.analysis.comparison.groups import differing, name_groups, setting_text, settings, value_text
from engine.config import from_json, preset, replaced, to_json
from engine.search.variation import PUBLISHED, VariationConfig
from tests.support.made_up import MADE_UP


def with_physics(config, **changes):
    return replaced(config, physics=dataclasses.replace(config.physics, **changes))


def names(*configs, at=None):
    return name_groups([settings(c, at) for c in configs])


def test_seed_and_task_set_nothing_apart():
    assert settings(MADE_UP) == settings(replaced(MADE_UP, seed=7, task="squeezing"))
    assert settings(MADE_UP) != settings(replaced(MADE_UP, batch_size=8))


def test_a_file_older_than_a_setting_is_in_the_group_of_the_value_that_leaves_it_as_it_was():
    old = to_json(MADE_UP)
    del old["physics"]["rod_inertia"]
    written_then = with_physics(MADE_UP, rod_inertia=1.0)
    assert settings(from_json(old)) == settings(written_then)
    assert settings(from_json(old)) != settings(MADE_UP)


def test_what_an_algorithm_does_not_read_sets_nothing_apart():
    paper, quick = (replaced(preset(p), evaluations=1080, algorithm="vie-neat") for p in ("paper", "quick"))
    assert any(k.startswith("vie_neat.") for k in settings(paper))
    same = replaced(paper, initial=30, batch_size=3)
    assert settings(same) == settings(paper)
    maps = replaced(MADE_UP, vie_neat=quick.vie_neat)
    assert settings(maps) == settings(MADE_UP)


def test_a_longer_budget_sets_runs_apart_unless_they_are_compared_before_it_ends():
    short, long = replaced(MADE_UP, evaluations=70), replaced(MADE_UP, evaluations=4000)
    assert settings(short) != settings(long)
    assert settings(short, 70) == settings(long, 70)
    assert settings(short, 100) != settings(long, 100)  # the shorter one never gets there
    assert names(short, long) == ["DM-ME, 70 evaluations", "DM-ME, 4,000 evaluations"]


def test_a_group_is_called_by_what_sets_it_apart():
    elites = replaced(MADE_UP, algorithm="map-elites")
    assert names(MADE_UP) == ["DM-ME"]
    assert names(MADE_UP, elites) == ["DM-ME", "MAP-Elites"]
    # one that differs from both in more than its algorithm needs no more of a name
    assert names(MADE_UP, replaced(elites, batch_size=24)) == ["DM-ME", "MAP-Elites"]
    assert names(MADE_UP, replaced(MADE_UP, sensory="displacements"), elites) == [
        "DM-ME",
        "DM-ME, sensory displacements",
        "MAP-Elites",
    ]


def test_two_settings_by_two_are_named_by_both():
    one, both = {"sensory": "displacements"}, {"sensory": "displacements", "stiffness": "per-module"}
    two = {"stiffness": "per-module"}
    assert names(*(replaced(MADE_UP, **c) for c in ({}, one, two, both))) == [
        "DM-ME",
        "DM-ME, sensory displacements",
        "DM-ME, stiffness per-module",
        "DM-ME, sensory displacements, stiffness per-module",
    ]


def test_settings_that_change_together_are_not_all_named_and_words_come_before_numbers():
    other = replaced(MADE_UP, initial=30, batch_size=8, sensory="displacements")
    assert names(MADE_UP, other) == ["DM-ME", "DM-ME, sensory displacements"]
    assert differing([settings(MADE_UP), settings(other)]) == ["initial", "batch_size", "sensory"]


def test_published_rates_of_neat_are_one_thing():
    published = {"variation": PUBLISHED}
    sensors = {"sensors": "centimetres"}
    gentle = replaced(MADE_UP, sensors="relative", variation=VariationConfig())
    assert names(*(replaced(gentle, **c) for c in ({}, sensors, published, sensors | published))) == [
        "DM-ME",
        "DM-ME, sensors centimetres",
        "DM-ME, NEAT as published",
        "DM-ME, sensors centimetres, NEAT as published",
    ]
    rates = dataclasses.replace(PUBLISHED.neat, link_add=0.4)
    nearly = replaced(gentle, variation=dataclasses.replace(PUBLISHED, neat=rates))
    assert names(gentle, nearly, replaced(gentle, **published)) == [
        "DM-ME",
        "DM-ME, link add 0.4",
        "DM-ME, NEAT as published",
    ]


def test_without_the_default_among_them_the_value_of_most_goes_without_saying():
    batches = [replaced(MADE_UP, batch_size=n) for n in (6, 8)]
    assert names(*batches) == ["DM-ME, batch size 6", "DM-ME, batch size 8"]
    assert names(*batches, replaced(MADE_UP, sensory="displacements")) == [
        "DM-ME",
        "DM-ME, batch size 8",
        "DM-ME, sensory displacements",
    ]
    assert names(*batches, replaced(MADE_UP, batch_size=24)) == [
        "DM-ME, batch size 6",
        "DM-ME, batch size 8",
        "DM-ME",
    ]


def test_simulators_are_groups_of_their_own():
    simulators = {r: with_physics(MADE_UP, simulator=r) for r in ("kernel", "mujoco")}
    found = names(*simulators.values())
    assert len(set(found)) == 2
    assert any("simulator" in n for n in found)


@pytest.mark.parametrize(
    ("key", "value", "text"),
    [
        ("evaluations", 45_000, "45,000 evaluations"),
        ("physics.simulator", "kernel", "simulator kernel"),
        ("neat.weights.rate", 0.8, "weights rate 0.8"),  # "rate" alone could be that of biases
        ("overlap", True, "overlap"),
        ("overlap", False, "no overlap"),
        ("refit_generations", (0, 50), "refit generations 0 50"),
        ("a_rate", 0.123456789, "a rate 0.123456789"),
    ],
)
def test_settings_in_words(key, value, text):
    among = ["evaluations", "neat.weights.rate", "neat.biases.rate", "overlap", "a_rate"]
    assert setting_text(key, value, among) == text


def test_values_in_words():
    assert [value_text(v) for v in (True, (), 1000, "a_b")] == ["yes", "none", "1,000", "a b"]
