"""What a campaign's file says."""

from pathlib import Path

import pytest

from engine.config import preset
from engine.errors import InvalidData
from engine.runs.campaign import plan, read_campaign

SMALL = {"preset": "smoke", "tasks": ["goal-reaching", "squeezing"], "algorithms": ["dm-me"], "seeds": [1, 2]}
CAMPAIGNS = Path(__file__).parents[3] / "docs" / "campaigns"


def test_every_combination_is_a_run():
    runs = plan({**SMALL, "algorithms": ["dm-me", "map-elites"]})
    assert len(runs) == len({r.file for r in runs}) == 8
    assert {(r.config.task, r.config.algorithm, r.config.seed) for r in runs} == {
        (t, a, s) for t in SMALL["tasks"] for a in ("dm-me", "map-elites") for s in (1, 2)
    }
    assert runs[0].file == "goal-reaching_dm-me_1.tsmr"
    assert runs[0].config.trials == preset("smoke").trials


def test_repetitions_give_every_run_a_seed_of_its_own():
    shared = {k: v for k, v in SMALL.items() if k != "seeds"}
    runs = plan({**shared, "repetitions": 3})
    assert [r.config.seed for r in runs] == [1, 2, 3, 4, 5, 6]
    assert [r.config.task for r in runs] == ["goal-reaching", "squeezing"] * 3
    assert len({r.file for r in runs}) == 6
    later = plan({**shared, "repetitions": 1, "first_seed": 7})  # an experiment that goes on
    assert [r.config.seed for r in later] == [7, 8]


def test_fields_for_all_and_for_a_variant():
    (run,) = plan(
        {
            **SMALL,
            "tasks": ["squeezing"],
            "seeds": [3],
            "algorithms": ["deep"],
            "config": {"evaluations": 80, "trials": {"trial_time": 2.0}},
            "variants": {"deep": {"algorithm": "dm-me", "cell_capacity": 50}},
        }
    )
    assert run.file == "squeezing_deep_3.tsmr"
    assert run.config.map_search.cell_capacity == 50
    assert run.config.evaluations == 80
    assert run.config.trials.trial_time == 2.0
    assert run.config.trials.settle_time == preset("smoke").trials.settle_time


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"tasks": []}, "tasks must be a list"),
        ({"tasks": ["swimming"]}, "unknown task 'swimming'"),
        ({"algorithms": ["cma-me"]}, "cma-me"),
        ({"repetitions": 2}, "either seeds or repetitions"),
        ({"first_seed": 3}, "first_seed belongs to repetitions"),
        ({"seeds": ["1"]}, "seeds must be a list of whole numbers"),
        ({"seeds": [1, 1]}, "seeds names something twice"),
        ({"seeds": [-1]}, "seed must be"),
        ({"seeds": list(range(6000))}, "more than 10000 runs"),
        ({"preset": "huge"}, "preset must be one of"),
        ({"config": {"wheels": 1}}, "configuration: unknown 'wheels'; known are task, "),
        ({"config": {"evalutions": 1}}, "unknown 'evalutions'; did you mean evaluations?"),
        ({"config": 3}, "config must be a table"),
        ({"algorithm": "dm-me"}, "unknown 'algorithm'"),
        ({"algorithms": ["deep"], "variants": {"deep": {"cell_capacity": 5}}}, "variants.deep"),
        ({"algorithms": ["../x"], "variants": {"../x": {"algorithm": "dm-me"}}}, "simple name"),
    ],
)
def test_a_mistake_gets_one_line(changes, message):
    with pytest.raises(InvalidData, match=message) as caught:
        plan(SMALL | changes)
    assert "\n" not in str(caught.value)


def test_a_file_that_is_none_is_named(tmp_path):
    with pytest.raises(InvalidData, match="cannot be read"):
        read_campaign(tmp_path / "nowhere.toml")
    file = tmp_path / "bad.toml"
    file.write_text("tasks = [")
    with pytest.raises(InvalidData, match=r"bad.toml"):
        read_campaign(file)


def test_the_published_experiment_is_shipped():
    runs = read_campaign(CAMPAIGNS / "paper.toml")
    assert len(runs) == 60
    assert {r.config.evaluations for r in runs} == {45_000}
    assert {r.config.algorithm for r in runs} == {"dm-me", "map-elites", "vie-neat"}
    assert len(read_campaign(CAMPAIGNS / "quick.toml")) == 6


def test_a_file_nested_beyond_all_measure_gets_one_line(tmp_path):
    file = tmp_path / "deep.toml"
    file.write_text("x = " + "[" * 100_000)
    with pytest.raises(InvalidData, match=r"deep.toml: not a TOML file"):
        read_campaign(file)
