import copy
import dataclasses
import functools
import json
import random
from collections import Counter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import engine.runs.evolve
from engine.body.morphology import random_morphology
from engine.config import PRESETS, RunConfig, from_json, preset, replaced, to_json
from engine.control.network import NetworkBatch
from engine.control.operators import Neat
from engine.errors import InvalidData
from engine.search.body_space import BodySpace
from engine.search.vie_neat import VieNeat, VieNeatConfig, paired_fitness
from engine.simulation.trials import TrialConfig
from engine.storage.reader import RunReader
from tests.support.killed import run_until_killed
from tests.support.made_up import evaluate, evaluation, examples, generation, held, made_up_evaluation
from tests.support.run_hash import hash_of

SMALL = VieNeatConfig(morphologies=6, mutants=6, controllers=9, elitism=1)
TINY = dataclasses.replace(
    preset("smoke"),
    algorithm="vie-neat",
    evaluations=8,
    vie_neat=VieNeatConfig(morphologies=2, mutants=2, controllers=3, elitism=1),
    trials=TrialConfig(repeats=1, settle_time=0.2, open_loop_time=0.2, trial_time=1.0),
)
"""A run of real simulations that takes seconds."""
MADE_UP = RunConfig(algorithm="vie-neat", evaluations=70, vie_neat=SMALL)
"""A run to be evaluated with made-up figures."""
seeds = st.integers(0, 2**32)


def create(seed=0, config=SMALL, budget=70, n_inputs=2, stiffness="shared"):
    bodies = BodySpace(stiffness=stiffness)
    return VieNeat(config, n_inputs=n_inputs, bodies=bodies, seed=seed, budget=budget)


def nothing_else(numbers):
    raise AssertionError(f"the state is whole, yet it asks for {numbers}")


def failed(e):
    return dataclasses.replace(e, fitness=None, failure="x")


def key_of(algorithm):
    """Return the key of each controller in NEAT's population."""
    return {repr(c): k for k, c in algorithm.controllers.controllers.items()}


# ---- who is tried


def test_the_published_parameters():
    config = preset("paper").vie_neat
    assert (config.morphologies, config.mutants, config.boundary_rate) == (48, 48, 0.1)
    assert (config.controllers, config.elitism, config.species_elitism) == (54, 3, 2)
    assert config.compatibility_threshold == 2.85
    assert config == VieNeatConfig(maximise="inverse")
    algorithm = VieNeat(VieNeatConfig(), n_inputs=2, budget=45_000)
    solutions = algorithm.ask()
    assert 53 <= len(solutions) <= 55
    assert len({s.morphology for s in solutions}) >= 47
    assert {name: a.shape for name, a in algorithm.archives.items()} == {"morphology": (9, 10)}


@examples(10)
@given(seeds, st.sampled_from([0.0, 0.3]))
def test_everybody_new_is_tried_and_as_evenly_as_possible(seed, failing):
    algorithm = create(seed, budget=200)
    for number in range(5):
        waiting = set(algorithm.controllers.waiting)
        key = key_of(algorithm)
        solutions = algorithm.ask()
        controllers = Counter(key[repr(s.controller)] for s in solutions)
        if waiting:
            assert set(controllers) == waiting
            assert len(solutions) == max(6, len(waiting))
        assert max(controllers.values()) - min(controllers.values()) <= 1
        assert len({s.morphology for s in solutions}) <= 6
        if number == 0:
            bodies = Counter(s.morphology for s in solutions)
            assert sorted(bodies.values()) in ([1, 1, 1, 2, 2, 2], [1, 1, 1, 1, 2, 2], [1, 1, 2, 2, 2, 2])
        algorithm.tell(evaluate(solutions, seed, failing))


def test_founders_have_no_parent_and_mutants_the_best_evaluation_of_theirs():
    algorithm = create(1, budget=200)
    first = generation(algorithm)
    assert {(e.solution.parent, e.solution.operator, e.solution.source) for e in first} == {
        (None, "random", None)
    }
    best = {}
    for e in first:
        known = best.setdefault(e.solution.morphology, e)
        best[e.solution.morphology] = min(known, e, key=lambda e: e.fitness)
    numbers = {e.solution.number: m for m, e in best.items()}
    members = {m.number: m for m in algorithm.bodies.members}
    assert {n: m.morphology for n, m in members.items()} == numbers
    solutions = algorithm.ask()
    assert {(s.operator, s.source) for s in solutions} == {("paired", None)}
    for s in solutions:
        assert s.parent in numbers
        assert s.morphology != numbers[s.parent]


def test_bodies_are_judged_by_all_their_partners():
    algorithm = create(2)
    evaluations = generation(algorithm)
    by_body = {}
    for e in evaluations:
        by_body.setdefault(e.solution.morphology, []).append(e.fitness)
    assert {len(f) for f in by_body.values()} == {1, 2}
    for m in algorithm.bodies.members:
        known = by_body[m.morphology]
        mean = sum(known) / len(known)
        assert m.fitness == pytest.approx(mean + (max(known) - mean) / 2, abs=1e-15)


def test_controllers_are_judged_by_all_their_partners():
    # more bodies than controllers, and all controllers survive
    config = VieNeatConfig(
        morphologies=8,
        mutants=8,
        controllers=5,
        elitism=4,
        species_elitism=1,
        compatibility_threshold=100.0,
    )
    algorithm = create(2, config)
    key = key_of(algorithm)
    by_controller = {}
    for e in generation(algorithm):
        by_controller.setdefault(key[repr(e.solution.controller)], []).append(e.fitness)
    assert sorted(map(len, by_controller.values())) == [1, 1, 2, 2, 2]
    kept = algorithm.controllers.fitnesses
    assert len(kept) == 4
    for k, f in kept.items():
        known = by_controller[k]
        mean = sum(known) / len(known)
        assert f == pytest.approx(mean + (max(known) - mean) / 2, abs=1e-15)


def test_both_populations_maximise_1_over_fitness_where_asked():
    config = VieNeatConfig(morphologies=4, mutants=4, controllers=6, elitism=1, maximise="inverse")
    algorithm = create(2, config)
    told = generation(algorithm)
    keys = {repr(c): k for k, c in algorithm.controllers.controllers.items()}
    kept = algorithm.controllers.state()["genomes"]
    known = {}
    for e in told:
        known.setdefault(keys.get(repr(e.solution.controller)), []).append(e.fitness)
    stored = {key: fitness for key, fitness, _ in kept if fitness is not None}
    assert stored
    for key, fitness in stored.items():
        assert fitness == pytest.approx(1.0 / paired_fitness(known[key]))


def test_where_neat_has_nothing_but_elites_they_are_tried_again():
    # two species of three, all of them elites
    config = VieNeatConfig(morphologies=4, mutants=4, controllers=6, elitism=3, species_elitism=1)
    algorithm = create(11, config)
    generation(algorithm)
    assert [len(keys) for keys in algorithm.controllers.species.values()] == [3, 3]
    assert algorithm.controllers.waiting == []
    before = algorithm.controllers.fitnesses
    key = key_of(algorithm)
    solutions = algorithm.ask()
    assert {key[repr(s.controller)] for s in solutions} == set(before)
    evaluations = [dataclasses.replace(e, fitness=0.01) for e in evaluate(solutions)]
    algorithm.tell(evaluations)
    assert set(algorithm.controllers.fitnesses.values()) == {0.01}


# ---- the archive


@examples(8)
@given(seeds, st.sampled_from([0.0, 0.3]), st.sampled_from(["shared", "per-module"]))
def test_everybody_ever_evaluated_was_offered_to_the_archive(seed, failing, stiffness):
    algorithm = create(seed, stiffness=stiffness)
    best = {}
    while solutions := algorithm.ask():
        evaluations = evaluate(solutions, seed, failing)
        algorithm.tell(evaluations)
        for e in evaluations:
            m = e.solution.morphology
            levels = m.stiffness_level
            bounds = (levels,) if stiffness == "shared" else (min(levels), max(levels))
            cell = (m.n_modules - 2, *(level - 1 for level in bounds))
            if e.fitness is not None and e.fitness < best.get(cell, (9.0, 0))[0]:
                best[cell] = (e.fitness, e.solution.number)
        assert held(algorithm.archives) == {"morphology": {cell: n for cell, (_, n) in best.items()}}


def test_axes_for_people():
    assert [a.name for a in create().axes("morphology")] == ["modules", "stiffness"]
    axes = create(stiffness="per-module").axes("morphology")
    assert [a.name for a in axes] == ["modules", "softest", "stiffest"]
    with pytest.raises(KeyError):
        create().axes("controller")


# ---- failures, budget, contract


def test_a_body_without_a_success_does_not_join():
    algorithm = create(3)
    evaluations = evaluate(algorithm.ask())
    bad = evaluations[0].solution.morphology
    algorithm.tell([failed(e) if e.solution.morphology == bad else e for e in evaluations])
    assert len(algorithm.bodies.members) == 5
    assert bad not in {m.morphology for m in algorithm.bodies.members}


def test_a_failed_pair_does_not_count_where_another_succeeded():
    algorithm = create(2)
    evaluations = evaluate(algorithm.ask())
    counts = Counter(e.solution.morphology for e in evaluations)
    body = next(m for m, n in counts.items() if n == 2)
    first, second = (e for e in evaluations if e.solution.morphology == body)
    algorithm.tell([failed(e) if e is first else e for e in evaluations])
    (member,) = (m for m in algorithm.bodies.members if m.morphology == body)
    assert (member.fitness, member.number) == (second.fitness, second.solution.number)


def test_a_first_generation_of_failures_is_founded_again_with_the_same_controllers():
    algorithm = create(4)
    first = algorithm.ask()
    algorithm.tell(list(map(failed, evaluate(first))))
    again = algorithm.ask()
    assert {s.operator for s in again} == {"random"}
    assert {s.morphology for s in again}.isdisjoint(s.morphology for s in first)
    assert {repr(s.controller) for s in again} == {repr(s.controller) for s in first}
    assert again[0].number == len(first)


def test_a_later_generation_of_failures_changes_neither_population():
    algorithm = create(4)
    generation(algorithm)
    before = algorithm.state()
    generation(algorithm, failing=1.0)
    after = algorithm.state()
    assert (after["bodies"], after["controllers"]) == (before["bodies"], before["controllers"])
    assert algorithm.generation == 2


@pytest.mark.parametrize("budget", [9, 10, 25, 70])
def test_the_budget_is_spent_exactly(budget):
    algorithm = create(budget=budget)
    numbers = []
    while solutions := algorithm.ask():
        numbers += [s.number for s in solutions]
        algorithm.tell(evaluate(solutions))
    assert numbers == list(range(budget))
    assert algorithm.ask() == []


def test_asking_twice_is_refused():
    algorithm = create()
    algorithm.ask()
    with pytest.raises(ValueError, match="tell"):
        algorithm.ask()


@pytest.mark.parametrize(
    "damage",
    [
        lambda es: es[:-1],
        lambda es: [*es[:-1], es[0]],
        lambda es: [*es, es[0]],
        lambda es: es[:0],
        lambda es: [
            made_up_evaluation(dataclasses.replace(es[0].solution, controller=es[1].solution.controller)),
            *es[1:],
        ],
    ],
    ids=["missing", "repeated", "twice", "none", "exchanged"],
)
def test_wrong_evaluations_are_refused_and_change_nothing(damage):
    algorithm, undisturbed = create(1), create(1)
    for a in (algorithm, undisturbed):
        generation(a)
    evaluations = evaluate(algorithm.ask())
    with pytest.raises(ValueError, match="exactly the solutions asked for"):
        algorithm.tell(damage(evaluations))
    algorithm.tell(evaluations)
    generation(undisturbed)
    assert algorithm.state() == undisturbed.state()


@examples(5)
@given(seeds, st.randoms(use_true_random=False))
def test_the_order_of_evaluations_and_the_global_random_state_do_not_matter(seed, rng):
    one, other, different = create(seed), create(seed), create(seed + 1)
    for k in range(3):
        evaluations = generation(one, salt=seed)
        generation(different, salt=seed)
        random.seed(k)
        assert [e.solution for e in evaluations] == other.ask()
        rng.shuffle(evaluations)
        other.tell(evaluations)
        assert held(one.archives) == held(other.archives)
        assert one.state() == other.state()
    assert one.state() != different.state()


# ---- resuming


@examples(8)
@given(
    seeds,
    st.integers(0, 5),
    st.sampled_from([0.0, 0.3]),
    st.sampled_from([{}, {"n_inputs": 5}, {"stiffness": "per-module"}]),
)
def test_a_restored_search_goes_on_identically(seed, n, failing, options):
    original = create(seed, **options)
    for _ in range(n):
        generation(original, salt=seed, failing=failing)
    state = json.loads(json.dumps(original.state(), allow_nan=False))
    contents = {name: dict(archive) for name, archive in original.archives.items()}
    # the seed given here must not matter any more
    restored = create(seed + 1, **options)
    restored.restore(state, copy.deepcopy(contents), nothing_else)
    assert restored.generation == n
    for _ in range(3):
        assert held(restored.archives) == held(original.archives)
        assert restored.state() == original.state()
        one, other = original.ask(), restored.ask()
        assert repr(one) == repr(other)
        original.tell(evaluate(one, seed, failing))
        restored.tell(evaluate(other, seed, failing))


def test_an_interrupted_generation_is_asked_for_again():
    original, restored = create(4), create(4)
    for _ in range(3):
        generation(original)
    state = json.loads(json.dumps(original.state()))
    contents = {name: dict(archive) for name, archive in original.archives.items()}
    lost = original.ask()
    restored.restore(state, contents, nothing_else)
    assert repr(restored.ask()) == repr(lost)


@pytest.mark.usefixtures("no_physics")
@pytest.mark.parametrize("stops", [[1], [3, 4, 2], [8, 8, 8]])
def test_a_run_interrupted_anywhere_ends_like_an_undisturbed_one(tmp_path, stops):
    engine.runs.evolve.evolve(tmp_path / "undisturbed.tsmr", MADE_UP)
    path = tmp_path / "interrupted.tsmr"
    for stop in stops:
        reports = []

        def interrupt(progress, reports=reports, stop=stop):
            reports.append(progress)
            if len(reports) == stop:
                raise KeyboardInterrupt

        go_on = (
            engine.runs.evolve.resume
            if path.exists()
            else functools.partial(engine.runs.evolve.evolve, config=MADE_UP)
        )
        with pytest.raises(KeyboardInterrupt):
            go_on(path, observer=interrupt)
    engine.runs.evolve.resume(path)
    assert hash_of(path) == hash_of(tmp_path / "undisturbed.tsmr")


def test_a_simulated_run_killed_twice_ends_like_an_undisturbed_one_on_two_threads(tmp_path):
    engine.runs.evolve.evolve(tmp_path / "undisturbed.tsmr", TINY, n_threads=2)
    path = tmp_path / "killed.tsmr"
    for limit in (1, 5):
        run_until_killed(path, TINY, limit)
    engine.runs.evolve.resume(path, n_threads=1)
    assert hash_of(path) == hash_of(tmp_path / "undisturbed.tsmr")
    with RunReader(path) as reader:
        assert reader.config == TINY
        generations = reader.generations()
        assert generations[-1].n_evaluations == 8
        assert len(generations) >= 3
        assert list(generations[-1].archives) == ["morphology"]
        assert reader.contents("morphology", generations[-1].number)


# ---- configuration


def test_a_run_file_without_the_parameters_has_the_published_ones():
    assert from_json({}).vie_neat == VieNeatConfig()
    assert from_json({"vie_neat": {"mutants": 7}}).vie_neat == VieNeatConfig(mutants=7)


@pytest.mark.parametrize("name", PRESETS)
def test_presets_suit_the_algorithm(name):
    config = dataclasses.replace(preset(name), algorithm="vie-neat")
    assert from_json(json.loads(json.dumps(to_json(config)))) == config
    algorithm = engine.config.create_algorithm(config)
    sizes = []
    while len(sizes) < 4 and (solutions := algorithm.ask()):
        sizes.append(len(solutions))
        algorithm.tell(evaluate(solutions))
    # enough generations to evolve, about one controller per mutant
    assert config.evaluations / sizes[0] >= 4
    assert all(config.vie_neat.mutants <= n <= 1.25 * config.vie_neat.mutants for n in sizes[1:])


def test_the_schedule_of_the_other_algorithms_does_not_matter():
    config = RunConfig(algorithm="vie-neat", evaluations=100)
    assert config.map_search.initial > config.evaluations
    with pytest.raises(InvalidData, match="at least the 54 of ViE-NEAT's first generation"):
        RunConfig(algorithm="vie-neat", evaluations=53)
    assert replaced(RunConfig(), evaluations=53, initial=20).vie_neat == VieNeatConfig()


@pytest.mark.parametrize(
    "changes",
    [
        {"morphologies": 1},
        {"morphologies": 10**6},
        {"mutants": 0},
        {"controllers": 1},
        {"elitism": -1},
        {"elitism": 54},
        {"elitism": 27},
        {"elitism": 54, "species_elitism": 0},
        {"species_elitism": -1},
        {"boundary_rate": 0.0},
        {"boundary_rate": 1.5},
        {"boundary_rate": float("nan")},
        {"compatibility_threshold": 0.0},
        {"compatibility_threshold": float("inf")},
    ],
    ids=str,
)
def test_impossible_parameters_are_refused(changes):
    with pytest.raises(InvalidData, match=next(iter(changes))):
        VieNeatConfig(**changes)
    with pytest.raises(InvalidData):
        from_json({"vie_neat": changes})


# ---- a known optimum

INPUTS = np.array([[[45.0, 1.5], [45.0, -1.5], [20.0, 0.5], [20.0, -0.5]]])
RAMP = np.linspace(0.1, 0.9, 20)


def toy(pairs):
    """Return per pair 0 for seven modules of stiffness 0.3 whose outputs are a ramp, more for others."""
    outputs = NetworkBatch([c for _, c in pairs]).activate(np.repeat(INPUTS, len(pairs), axis=0))
    errors = ((outputs - RAMP) ** 2).mean(axis=(1, 2))
    return [
        0.05 * abs(m.n_modules - 7) + 0.05 * abs(m.stiffness_level - 3) + float(error)
        for (m, _), error in zip(pairs, errors, strict=True)
    ]


def test_a_known_optimum_is_found():
    config = preset("quick").vie_neat
    algorithm = VieNeat(config, n_inputs=2, seed=5, budget=1000)
    while solutions := algorithm.ask():
        fitnesses = toy([(s.morphology, s.controller) for s in solutions])
        algorithm.tell(
            [
                dataclasses.replace(evaluation(fitness=f), solution=s)
                for s, f in zip(solutions, fitnesses, strict=True)
            ]
        )
    best = algorithm.archives["morphology"].best()
    assert (best.solution.morphology.n_modules, best.solution.morphology.stiffness_level) == (7, 3)
    assert best.fitness < 0.025
    # the same budget of random pairs stays far from it
    rng, neat = random.Random(5), Neat(n_inputs=2)
    pairs = [(random_morphology(rng), neat.random(rng)) for _ in range(1000)]
    assert min(toy(pairs)) > 2.5 * best.fitness
    # and both populations have closed in
    assert algorithm.bodies.boundary < 0.15
    assert len(algorithm.bodies.members) < 2 * config.morphologies
