import dataclasses
import json
import random

import neat
import pytest
from hypothesis import given
from hypothesis import strategies as st

from engine.control import genome
from engine.control.genome import Controller
from engine.control.operators import Neat, from_genome, lend_random, to_genome
from engine.control.rates import PUBLISHED_RATES
from tests.support.made_up import controllers, evolved_controller, examples


@examples(40)
@given(controllers(), st.integers(0, 2**32))
def test_a_controller_that_was_read_back_evolves_like_the_original(controller, seed):
    read = Controller.from_json(json.loads(json.dumps(controller.to_json())))
    children = []
    for parent in (controller, read):
        neat = Neat(n_inputs=2)
        neat.restore({"next_node": 1000, "innovations": 1000})
        children.append(neat.mutate(parent, random.Random(seed)))
    assert repr(children[0]) == repr(children[1])


@examples(40)
@given(controllers())
def test_genome_round_trip_is_lossless(controller):
    neat = Neat(n_inputs=2)
    assert repr(from_genome(to_genome(controller, neat.config), 2)) == repr(controller)


@pytest.mark.parametrize(("limit", "most"), [("MAX_NODES", 24), ("MAX_CONNECTIONS", 70), ("MAX_DEPTH", 2)])
def test_a_network_at_a_limit_goes_on_changing_but_grows_no_further(limit, most, monkeypatch):
    monkeypatch.setattr(genome, limit, most)
    rates = dataclasses.replace(
        PUBLISHED_RATES, neuron_add=1.0, link_add=1.0, neuron_remove=0.0, link_remove=0.0
    )
    rng, neat = random.Random(0), Neat(n_inputs=2, rates=rates)
    controller = neat.random(rng)
    for _ in range(20):
        parent, controller = controller, neat.mutate(controller, rng)
        assert controller != parent
    assert neat.config.node_add_prob == 1.0


@examples(30)
@given(st.integers(0, 2**32), st.sampled_from([2, 5]))
def test_a_random_controller_joins_all_inputs_over_three_hidden_nodes_to_all_outputs(seed, n_inputs):
    c = Neat(n_inputs=n_inputs).random(random.Random(seed))
    inputs = {-1 - i for i in range(n_inputs)}
    assert {n.key for n in c.nodes} == set(range(20 + 3))
    assert {(link.source, link.target) for link in c.connections} == {
        (a, b) for a in inputs for b in (20, 21, 22)
    } | {(a, b) for a in (20, 21, 22) for b in range(20)}
    assert all(link.enabled for link in c.connections)
    assert all(n.response == 1.0 for n in c.nodes)


@examples(20)
@given(st.integers(0, 2**32), st.integers(1, 15))
def test_same_seed_same_genomes(seed, n):
    assert repr(evolved_controller(seed, n)) == repr(evolved_controller(seed, n))


def test_another_seed_gives_another_genome():
    assert evolved_controller(1, 0) != evolved_controller(2, 0)


@examples(20)
@given(st.integers(0, 2**32), st.integers(0, 2**32))
def test_pythons_global_random_state_is_untouched(outside, seed):
    random.seed(outside)
    before = random.getstate()
    neat, rng = Neat(n_inputs=2), random.Random(seed)
    neat.mutate(neat.random(rng), rng)
    assert random.getstate() == before
    # and does not matter
    random.seed(outside + 1)
    again, rng = Neat(n_inputs=2), random.Random(seed)
    one = again.mutate(again.random(rng), rng)
    random.seed(outside + 2)
    again, rng = Neat(n_inputs=2), random.Random(seed)
    assert repr(again.mutate(again.random(rng), rng)) == repr(one)


def test_the_callers_generator_moves_on():
    neat, rng = Neat(n_inputs=2), random.Random(0)
    assert neat.random(rng) != neat.random(rng)


def test_gaussian_draws_are_pythons_to_rounding():
    """Each pair of uniform numbers gives two draws, whatever is drawn between them."""
    rng, expected = random.Random(7), random.Random(7)
    found, ours = [], []
    with lend_random(rng):
        for _ in range(1001):
            found += [neat.attributes.gauss(1.0, 2.0), random.random()]
    for _ in range(1001):
        ours += [expected.gauss(1.0, 2.0), expected.random()]
    assert found == pytest.approx(ours, rel=1e-14, abs=1e-14)
    assert rng.getstate()[:2] == expected.getstate()[:2]


def test_no_library_rounds_the_weights_of_a_network(monkeypatch):
    for name in ("_log", "_sin", "_cos"):
        assert hasattr(random, name)
        monkeypatch.setattr(random, name, None)
    drawn = Neat(n_inputs=2).random(random.Random(1))
    assert Neat(n_inputs=2).mutate(drawn, random.Random(2)) != drawn


def test_the_global_generator_is_put_back_after_an_error(monkeypatch):
    neat = Neat(n_inputs=2)
    controller = neat.random(random.Random(0))

    def broken(*_):
        random.random()
        raise RuntimeError("broken")

    monkeypatch.setattr("neat.DefaultGenome.mutate", broken)
    before = random.getstate()
    with pytest.raises(RuntimeError, match="broken"):
        neat.mutate(controller, random.Random(1))
    assert random.getstate() == before


@examples(30)
@given(controllers(), st.integers(0, 2**32))
def test_mutation_leaves_the_parent_alone_and_stays_in_range(parent, seed):
    before = repr(parent)
    neat = Neat(n_inputs=2)
    neat.restore({"next_node": 10_000, "innovations": 10_000})
    child = neat.mutate(parent, random.Random(seed))
    assert repr(parent) == before
    assert all(-30 <= n.bias <= 30 and n.response == 1.0 for n in child.nodes)
    assert all(-30 <= link.weight <= 30 for link in child.connections)


def test_new_nodes_never_reuse_a_key():
    neat, rng = Neat(n_inputs=2), random.Random(4)
    parent = neat.random(rng)
    known = {n.key for n in parent.nodes}
    added = []
    for _ in range(100):
        child = neat.mutate(parent, rng)
        added += [n.key for n in child.nodes if n.key not in known]
    assert len(added) > 10
    assert len(set(added)) == len(added)


def test_mutation_frequencies_of_the_published_configuration():
    neat, rng = Neat(n_inputs=2), random.Random(6)
    parent = neat.random(rng)
    old_nodes = {n.key: n for n in parent.nodes}
    n, grown, shrunk, biases, total = 600, 0, 0, 0, 0
    for _ in range(n):
        neat.new_generation()
        child = neat.mutate(parent, rng)
        keys = {k.key for k in child.nodes}
        grown += bool(keys - set(old_nodes))
        shrunk += bool(set(old_nodes) - keys)
        for node in child.nodes:
            if node.key in old_nodes:
                total += 1
                biases += node.bias != old_nodes[node.key].bias
    # five standard deviations are 0.08 for a probability of 0.2; a node that was added may be
    # deleted again at once
    assert grown / n == pytest.approx(0.2, abs=0.09)
    assert shrunk / n == pytest.approx(0.2, abs=0.09)
    # 0.7 are nudged, 0.1 are redrawn
    assert biases / total == pytest.approx(0.8, abs=0.02)


def test_equal_innovations_of_a_generation_share_a_number():
    rng = random.Random(8)
    neat = Neat(n_inputs=2)
    parents = [neat.random(rng) for _ in range(2)]
    numbers = [{(c.source, c.target): c.innovation for c in parent.connections} for parent in parents]
    assert numbers[0] == numbers[1]
    neat.new_generation()
    later = {(c.source, c.target): c.innovation for c in neat.random(rng).connections}
    assert not set(later.values()) & set(numbers[0].values())


@examples(20)
@given(st.integers(0, 2**32), st.integers(1, 10))
def test_counters_carry_over_an_interruption(seed, n):
    rng, neat = random.Random(seed), Neat(n_inputs=2)
    controller = neat.random(rng)
    for _ in range(n):
        controller = neat.mutate(controller, rng)
    neat.new_generation()
    resumed = Neat(n_inputs=2)
    resumed.restore(json.loads(json.dumps(neat.state())))
    rng_copy = random.Random()
    rng_copy.setstate(rng.getstate())
    assert repr(neat.mutate(controller, rng)) == repr(resumed.mutate(controller, rng_copy))
    assert neat.state() == resumed.state()


# ---- crossover


@examples(20)
@given(st.integers(0, 2**32), st.integers(0, 12))
def test_a_cross_has_the_fitters_structure_and_the_numbers_of_both(seed, n):
    neat, rng = Neat(n_inputs=2), random.Random(seed)
    common = neat.random(rng)
    fitter, other = common, common
    for _ in range(n):
        fitter, other = neat.mutate(fitter, rng), neat.mutate(other, rng)
    child = neat.cross(fitter, other, rng)
    assert [node.key for node in child.nodes] == [node.key for node in fitter.nodes]
    ours, theirs = ({c.innovation: c for c in parent.connections} for parent in (fitter, other))
    assert {c.innovation for c in child.connections} <= set(ours)
    for c in child.connections:
        own, mate = ours[c.innovation], theirs.get(c.innovation, ours[c.innovation])
        assert (c.source, c.target) == (own.source, own.target)
        assert c.weight in (own.weight, mate.weight)
    for node, own in zip(child.nodes, fitter.nodes, strict=True):
        mates = [m.bias for m in other.nodes if m.key == node.key]
        assert node.bias in (own.bias, *mates)


def test_a_cross_takes_half_from_either_parent():
    neat, rng = Neat(n_inputs=2), random.Random(1)
    fitter, other = neat.random(rng), neat.random(rng)
    weights = {c.weight for c in fitter.connections}
    children = [neat.cross(fitter, other, rng) for _ in range(60)]
    shares = [sum(c.weight in weights for c in child.connections) / len(weights) for child in children]
    assert sum(shares) / len(shares) == pytest.approx(0.5, abs=0.05)
    assert neat.cross(fitter, fitter, rng) == fitter
