import json
import random

import neat
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from engine.control.genome import logistic
from engine.control.network import NetworkBatch
from engine.control.operators import NEAT_PARAMETERS, Neat, from_genome, to_genome
from engine.control.rates import PUBLISHED_RATES
from engine.errors import InvalidData
from engine.search.neat_population import FloatingSizeReproduction, NeatPopulation
from tests.support.made_up import examples

seeds = st.integers(0, 2**32)
INPUTS = np.array([[45.0, 1.5], [20.0, -0.7], [3.0, 0.0], [-1.0, 3.1]])

PUBLISHED = """
[NEAT]
fitness_criterion = max
fitness_threshold = 0
no_fitness_termination = True
pop_size = 54
reset_on_extinction = True
[DefaultStagnation]
species_fitness_func = mean
max_stagnation = 15
species_elitism = 2
[DefaultReproduction]
elitism = 3
survival_threshold = 0.2
min_species_size = 2
[DefaultSpeciesSet]
compatibility_threshold = 2.85
[DefaultGenome]
num_inputs = 2
num_outputs = 20
bias_init_type = gaussian
response_init_type = gaussian
weight_init_type = gaussian
"""


def cost(controller):
    """Return a made-up fitness that can be improved: how far outputs are from a ramp."""
    outputs = NetworkBatch([controller]).activate(INPUTS[None])[0]
    return float(((outputs - np.linspace(0.1, 0.9, 20)) ** 2).mean())


def create(seed=0, **changes):
    rng = random.Random(seed)
    options = {"n_inputs": 2, "size": 12, "elitism": 1}
    return NeatPopulation(rng=rng, **(options | changes)), rng


def generation(population, rng):
    """Tell the made-up fitnesses of whoever has none, and go on."""
    controllers = population.controllers
    told = {k: cost(controllers[k]) for k in population.waiting}
    population.evolve(told, rng)
    return told


# ---- the library does the work


def test_it_goes_as_the_library_alone_would_with_the_published_configuration(tmp_path):
    class DefaultReproduction(neat.DefaultReproduction):
        # as before version 2: sizes are not corrected
        def _adjust_spawn_exact(self, spawn_amounts, *_):
            return spawn_amounts

    settings = tmp_path / "neat.cfg"
    genome = "".join(f"{k} = {v}\n" for k, v in (NEAT_PARAMETERS | PUBLISHED_RATES.parameters()).items())
    settings.write_text(PUBLISHED + genome)
    config = neat.Config(
        neat.DefaultGenome, DefaultReproduction, neat.DefaultSpeciesSet, neat.DefaultStagnation, settings
    )
    config.genome_config.add_activation("logistic", logistic)

    def evaluate(genomes, _):
        for _, genome in genomes:
            if genome.fitness is None:
                genome.fitness = -cost(from_genome(genome, 2))

    outside = random.getstate()
    try:
        random.seed(7)
        alone = neat.Population(config)
        alone.run(evaluate, 6)
        expected = {k: from_genome(g, 2) for k, g in alone.population.items()}
        state = random.getstate()
    finally:
        random.setstate(outside)
    rng = random.Random(7)
    ours = NeatPopulation(n_inputs=2, rng=rng)
    for _ in range(6):
        generation(ours, rng)
    assert ours.generation == 6
    assert ours.controllers == expected
    assert list(ours.controllers) == list(expected)
    assert {k: -f for k, f in ours.fitnesses.items()} == {
        k: g.fitness for k, g in alone.population.items() if g.fitness is not None
    }
    assert ours.species == {s.key: list(s.members) for s in alone.species.species.values()}
    assert rng.getstate() == state


def test_the_correction_of_sizes_that_is_left_out_is_still_where_it_was():
    # if the library renames it, leaving it out would quietly fail
    assert neat.DefaultReproduction._adjust_spawn_exact is not FloatingSizeReproduction._adjust_spawn_exact
    reproduction = neat.DefaultReproduction(FloatingSizeReproduction.parse_config({"elitism": 3}), None, None)
    assert reproduction._adjust_spawn_exact([20, 33], 54, 3) == [21, 33]
    ours = FloatingSizeReproduction(FloatingSizeReproduction.parse_config({"elitism": 3}), None, None)
    assert ours._adjust_spawn_exact([20, 33], 54, 3) == [20, 33]


def test_the_size_floats_around_its_nominal_value():
    sizes = set()
    for seed in range(2):
        rng = random.Random(seed)
        population = NeatPopulation(n_inputs=2, rng=rng)
        for _ in range(8):
            sizes.add(len(population.controllers))
            generation(population, rng)
    assert 54 in sizes
    assert len(sizes) > 1
    assert max(abs(n - 54) for n in sizes) <= 3


def test_random_controllers_are_about_as_far_apart_as_the_threshold():
    population, _ = create(1, size=40)
    config = Neat(n_inputs=2).config
    genomes = [to_genome(c, config) for c in population.controllers.values()]
    distances = [a.distance(b, config) for i, a in enumerate(genomes) for b in genomes[:i]]
    assert 2.6 < np.mean(distances) < 2.9


# ---- elites, species, new ones


@examples(3)
@given(seeds)
def test_the_best_of_each_species_survive_with_their_fitness(seed):
    population, rng = create(seed, size=20, elitism=2)
    assert population.waiting == list(population.controllers)
    for _ in range(4):
        controllers, species, before = population.controllers, population.species, population.fitnesses
        told = generation(population, rng)
        # no species dies out within the first 15 generations
        for members in species.values():
            fitness = {k: (before | told)[k] for k in members}
            for k in sorted(members, key=lambda k: (fitness[k], -k))[:2]:
                assert population.controllers[k] == controllers[k]
                assert population.fitnesses[k] == fitness[k]
        assert set(population.waiting).isdisjoint(controllers)
        assert set(population.waiting) | set(population.fitnesses) == set(population.controllers)


def test_two_species_of_the_published_size_leave_one_new_controller_for_each_mutant():
    rng = random.Random(0)
    population = NeatPopulation(n_inputs=2, rng=rng)
    seen = set()
    for _ in range(30):
        # nothing improves, so that all species but two die out
        population.evolve(dict.fromkeys(population.waiting, 0.5), rng)
        n, n_species = len(population.controllers), len(population.species)
        assert len(population.waiting) >= n - 3 * n_species
        seen.add((n, n_species, len(population.waiting)))
    assert (54, 2, 48) in seen


def test_every_controller_is_of_one_species():
    population, rng = create(3, size=20)
    for _ in range(5):
        members = sorted(k for keys in population.species.values() for k in keys)
        assert members == sorted(population.controllers)
        generation(population, rng)


def test_a_low_threshold_makes_a_species_of_each_and_too_many_are_refused():
    population, rng = create(0, size=6, elitism=2, compatibility_threshold=0.01)
    assert len(population.species) == 6
    generation(population, rng)
    generation(population, rng)
    with pytest.raises(InvalidData, match=r"6 controllers have become \d+ in \d+ species; choose a larger"):
        generation(population, rng)


def test_it_improves():
    population, rng = create(0, size=20)
    generation(population, rng)
    first = min(population.fitnesses.values())
    for _ in range(40):
        generation(population, rng)
    assert min(population.fitnesses.values()) < first / 3


def test_a_fitness_told_anew_replaces_the_old_one():
    population, rng = create(0)
    generation(population, rng)
    known = population.fitnesses
    told = dict.fromkeys(population.controllers, 0.5) | dict.fromkeys(known, 0.25)
    population.evolve(told, rng)
    assert set(population.fitnesses.values()) <= {0.25, 0.5}
    assert 0.25 in population.fitnesses.values()


# ---- failures


def test_without_any_fitness_the_population_stays():
    population, rng = create(0)
    before, state = population.state(), rng.getstate()
    population.evolve({}, rng)
    assert population.state() == before
    assert rng.getstate() == state


@examples(10)
@given(seeds)
def test_who_got_no_fitness_is_never_an_elite_unless_it_is_tried_again(seed):
    population, rng = create(seed, size=10, elitism=3)
    for _ in range(4):
        before = set(population.controllers)
        waiting = population.waiting
        controllers = population.controllers
        told = {k: cost(controllers[k]) for k in waiting[::2]}
        if not told:
            return
        population.evolve(told, rng)
        failed = set(waiting) - set(told)
        again = failed & set(population.controllers)
        assert again <= set(population.waiting)
        assert set(population.fitnesses) <= before - failed


def test_the_worst_fitness_stands_in_for_a_failure():
    population, rng = create(5, size=30, elitism=1, compatibility_threshold=100.0)
    (members,) = population.species.values()
    told = {k: 0.1 * i for i, k in enumerate(members[:-1])}
    population.evolve(told, rng)
    (species,) = population.state()["species"]
    assert species["history"] == [pytest.approx(-(sum(told.values()) + max(told.values())) / 30)]


# ---- the bridge


@examples(8)
@given(seeds, st.integers(0, 6), st.sampled_from([2, 5]))
def test_genomes_of_a_population_survive_the_bridge_and_their_networks_agree(seed, n, n_inputs):
    population, rng = create(seed, n_inputs=n_inputs)
    inputs = np.random.default_rng(seed).normal(0.0, 3.0, size=(1, 5, n_inputs))
    for _ in range(n):
        population.evolve({k: rng.random() for k in population.waiting}, rng)
    config = Neat(n_inputs=n_inputs).config
    whole = type("Config", (), {"genome_config": config})
    for controller in population.controllers.values():
        genome = to_genome(controller, config)
        again = from_genome(genome, n_inputs)
        assert again == controller
        assert repr(again) == repr(controller)
        network = neat.nn.FeedForwardNetwork.create(genome, whole)
        theirs = [network.activate(list(x)) for x in inputs[0]]
        ours = NetworkBatch([controller]).activate(inputs)[0]
        np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-12)
        assert (NetworkBatch([again]).activate(inputs)[0] == ours).all()


# ---- state


@examples(4)
@given(seeds, st.integers(0, 5), st.sampled_from([2.85, 2.6]))
def test_a_restored_population_goes_on_identically(seed, n, threshold):
    one, rng = create(seed, compatibility_threshold=threshold)
    for _ in range(n):
        generation(one, rng)
    # another seed and another history, which must not matter any more
    other, _ = create(seed + 1, compatibility_threshold=threshold)
    generation(other, random.Random(0))
    other.restore(json.loads(json.dumps(one.state(), allow_nan=False)))
    other_rng = random.Random()
    other_rng.setstate(rng.getstate())
    assert other.generation == n
    for _ in range(4):
        assert other.state() == one.state()
        assert repr(other.controllers) == repr(one.controllers)
        assert other.waiting == one.waiting
        assert other.fitnesses == one.fitnesses
        assert other.species == one.species
        generation(one, rng)
        generation(other, other_rng)
    assert other_rng.getstate() == rng.getstate()


def test_keys_are_never_given_twice_after_restoring():
    one, rng = create(0)
    for _ in range(3):
        generation(one, rng)
    before = one.state()
    other, _ = create(1)
    other.restore(json.loads(json.dumps(before)))
    generation(other, rng)
    after = other.state()
    new = set(other.controllers) - {g[0] for g in before["genomes"]}
    assert min(new) == before["next_genome"]
    assert after["next_genome"] == before["next_genome"] + len(new)
    assert after["next_node"] > before["next_node"] > 20 + 3 * 12
    assert after["innovations"] > before["innovations"]


def test_stagnant_species_die_out_as_their_histories_say_also_after_restoring():
    # three species that never improve: all but two are gone after 15 generations
    one, rng = create(0, size=30, compatibility_threshold=2.7)
    assert len(one.species) > 3
    first = set(one.species)
    for k in range(18):
        if k == 10:
            state = json.loads(json.dumps(one.state()))
            one, _ = create(1, size=30, compatibility_threshold=2.7)
            one.restore(state)
        one.evolve(dict.fromkeys(one.waiting, 0.5), rng)
        if k < 14:
            assert first <= set(one.species)
    assert len(first & set(one.species)) <= 2


def test_the_global_random_state_is_lent_and_put_back():
    random.seed(3)
    before = random.getstate()
    one, rng = create(0)
    generation(one, rng)
    assert random.getstate() == before
    random.seed(99)
    other, other_rng = create(0)
    generation(other, other_rng)
    assert one.state() == other.state()
