"""Runs of every algorithm but plain DM-ME, whose runs ``test_evolve.py`` has."""

import dataclasses

import pytest

import engine.runs.evolve
from engine.config import PRESETS, preset, replaced
from engine.errors import RunFileError
from engine.search.variation import VariationConfig
from engine.storage.reader import RunReader
from engine.storage.writer import RunWriter
from tests.support.killed import run_until_killed
from tests.support.made_up import MADE_UP, TINY, held, made_up_evaluation
from tests.support.run_formats import change
from tests.support.run_hash import hash_of

CHANGES = {
    "MAP-Elites": {"algorithm": "map-elites"},
    "MAP-Elites in 2-D": {"algorithm": "map-elites-2d"},
    "rhythms": {"head_search": "rhythms", "stiffness": "per-module"},
    "random search": {"algorithm": "random"},
    "curiosity": {"parents": "curiosity"},
    "samples": {
        "reevaluations": 3,
        "parents": "curiosity",
        "variation": VariationConfig(crossover=0.5, both_weight=2, exchange_weight=2, switch_weight=2),
    },
    "deep grid": {"cell_capacity": 2},
    "DM-ME, per module": {"stiffness": "per-module"},
    "MAP-Elites, per module": {"algorithm": "map-elites", "stiffness": "per-module"},
}
CONFIGS = {name: replaced(MADE_UP, **changes) for name, changes in CHANGES.items()}


@pytest.mark.parametrize("name", ["MAP-Elites", "deep grid", "curiosity", "samples", "DM-ME, per module"])
@pytest.mark.usefixtures("no_physics")
def test_a_killed_run_ends_like_an_undisturbed_one(tmp_path, name):
    config = CONFIGS[name]
    engine.runs.evolve.evolve(tmp_path / "undisturbed.tsmr", config)
    path = tmp_path / "killed.tsmr"
    # within a generation, after a refit
    run_until_killed(path, config, 41, made_up=True)
    with RunReader(path) as reader:
        assert (reader.n_evaluations(), reader.last_generation()) == (41, 3)
    engine.runs.evolve.resume(path)
    assert hash_of(path) == hash_of(tmp_path / "undisturbed.tsmr")


@pytest.mark.parametrize("name", CONFIGS)
@pytest.mark.usefixtures("no_physics")
def test_a_run_file_holds_the_archives_of_every_generation(tmp_path, name):
    path, after, coverage = tmp_path / "run.tsmr", {}, {}

    def remember(progress):
        after.setdefault(progress.generation - 1, held(progress.archives))
        coverage.setdefault(
            progress.generation - 1, {k: len(a) / a.n_cells for k, a in progress.archives.items()}
        )

    engine.runs.evolve.evolve(path, CONFIGS[name], observer=remember)
    with RunReader(path) as reader:
        assert reader.config == CONFIGS[name]
        assert reader.last_generation() == max(after) == 9
        for generation in reader.generations():
            archives = after[generation.number]
            assert set(generation.archives) == set(archives)
            for archive, cells in archives.items():
                assert reader.placements(archive, generation.number) == cells
                figures = generation.archives[archive]
                assert figures.coverage == pytest.approx(coverage[generation.number][archive])
                assert all(len(cell) == len(figures.axes) for cell in cells)


@pytest.mark.usefixtures("no_physics")
def test_the_members_of_deep_cells_can_be_read(tmp_path):
    path = tmp_path / "run.tsmr"
    engine.runs.evolve.evolve(path, CONFIGS["deep grid"])
    with RunReader(path) as reader:
        last = reader.last_generation()
        everybody = {e.solution.number: e for e in reader.all_evaluations()}
        members = reader.members("controller")
        best = {cell: min((everybody[n].fitness, n) for n in there)[1] for cell, there in members.items()}
        assert best == reader.placements("controller", last)
        assert {len(there) for there in members.values()} == {1, 2}
        assert reader.members("morphology") == {
            cell: [n] for cell, n in reader.placements("morphology", last).items()
        }


def test_a_run_without_a_generation_has_no_members(tmp_path):
    path = tmp_path / "run.tsmr"
    RunWriter.create(path, CONFIGS["deep grid"], {}).close()
    with RunReader(path) as reader:
        assert reader.members("controller") == {}


GARBAGE = """
null
7
{}
{"controller": []}
{"controller": {"x": [0]}}
{"controller": {"99,0": [0]}}
{"controller": {"0,0": "x"}}
{"controller": {"0,0": []}}
{"controller": {"0,0": [999]}}
{"controller": {"0,0": [[0]]}}
{"controller": {"0,0": [0, 1, 2]}}
"""


@pytest.mark.parametrize("members", GARBAGE.strip().splitlines())
@pytest.mark.usefixtures("no_physics")
def test_garbage_members_are_one_line(tmp_path, members):
    path = tmp_path / "run.tsmr"

    def interrupt(progress):
        if progress.n_evaluations >= 30:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        engine.runs.evolve.evolve(path, CONFIGS["deep grid"], observer=interrupt)
    sql = "UPDATE state SET algorithm = packed(json_set(unpacked(algorithm), '$.members', json(?)))"
    change(path, (sql, (members,)))
    with pytest.raises(RunFileError, match=r"run\.tsmr") as e:
        engine.runs.evolve.resume(path)
    assert "\n" not in str(e.value)


def test_a_body_of_the_other_kind_does_not_fit_the_run(tmp_path):
    path = tmp_path / "run.tsmr"
    strangers = engine.config.create_algorithm(CONFIGS["DM-ME, per module"]).ask()[:2]
    with RunWriter.create(path, MADE_UP, {}) as writer:
        writer.add_evaluations(0, [made_up_evaluation(s) for s in strangers])
    with RunReader(path) as reader, pytest.raises(RunFileError, match="does not fit the run's conf"):
        reader.all_evaluations()


def test_simulated_unlike_modules_are_the_same_on_any_number_of_threads(tmp_path):
    changes = {"algorithm": "map-elites", "stiffness": "per-module", "evaluations": 6, "initial": 4}
    config = replaced(TINY, **changes)
    for n in (1, 2):
        engine.runs.evolve.evolve(tmp_path / f"{n}.tsmr", config, n_threads=n)
    assert hash_of(tmp_path / "1.tsmr") == hash_of(tmp_path / "2.tsmr")
    with RunReader(tmp_path / "1.tsmr") as reader:
        assert reader.generations()[-1].n_failed == 0
        assert reader.contents("grid", 1)


@pytest.mark.parametrize("algorithm", ["dm-me", "map-elites", "vie-neat"])
@pytest.mark.parametrize("name", PRESETS)
@pytest.mark.usefixtures("no_physics")
def test_every_preset_repeats_its_hash(tmp_path, name, algorithm):
    whole = preset(name)
    sizes = {"evaluations": 60, "initial": 20, "batch_size": 6, "refit_generations": (0, 2)}
    config = replaced(
        whole,
        **sizes,
        algorithm=algorithm,
        seed=3,
        # the made-up figures are those of such trials
        trials=dataclasses.replace(whole.trials, repeats=2, trial_time=40.0),
        vie_neat=dataclasses.replace(whole.vie_neat, morphologies=8, mutants=8, controllers=10, elitism=1),
    )
    for file in ("a.tsmr", "b.tsmr"):
        engine.runs.evolve.evolve(tmp_path / file, config)
    assert hash_of(tmp_path / "a.tsmr") == hash_of(tmp_path / "b.tsmr")
    if name == "atlas":  # the presets differ in nothing that the seed is for
        engine.runs.evolve.evolve(tmp_path / "c.tsmr", replaced(config, seed=4))
        assert hash_of(tmp_path / "c.tsmr") != hash_of(tmp_path / "a.tsmr")
