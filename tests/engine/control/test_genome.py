import dataclasses
import itertools
import json
import math
import random

import neat
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from engine.control import genome
from engine.control.genome import (
    MAX_DEPTH,
    MAX_NODES,
    PUBLISHED_RATES,
    Controller,
    Neat,
    from_genome,
    lend_random,
    logistic,
    to_genome,
)
from engine.control.network import NetworkBatch
from engine.errors import InvalidData
from tests.support.made_up import controllers, evolved_controller, examples

INPUT, OUTPUT, HIDDEN = -1, 0, 20
json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=3),
    lambda inner: st.lists(inner, max_size=5) | st.dictionaries(st.text(max_size=3), inner, max_size=3),
    max_leaves=12,
)


def data(nodes=(), connections=(), n_inputs=2):
    """A controller's JSON form: all outputs, hidden nodes 20 and 21, and what is given."""
    return {
        "n_inputs": n_inputs,
        "nodes": [[k, 0.5, 1.0] for k in range(22)] + list(nodes),
        "connections": list(connections),
    }


def chain(n):
    """A controller's JSON form with n connections in a row."""
    nodes = [[k, 0.0, 1.0] for k in range(22, 22 + n - 2)]
    path = [-1, *range(20, 20 + n - 1), 0]
    return data(nodes, [[a, b, 1.0, True, k] for k, (a, b) in enumerate(itertools.pairwise(path))])


@examples(60)
@given(controllers(n_inputs=st.sampled_from([1, 2, 5])))
def test_json_round_trip_is_lossless(controller):
    text = json.dumps(controller.to_json(), allow_nan=False)
    read = Controller.from_json(json.loads(text))
    assert read == controller
    # the same bits, in the same order
    assert repr(read) == repr(controller)


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


def test_a_hand_made_controller_is_read():
    c = Controller.from_json(data(connections=[[-1, 20, 2.0, True, 1], [20, 0, -1.5, False, 2]]))
    assert len(c.nodes) == 22
    assert (c.connections[1].source, c.connections[1].target) == (20, 0)
    assert c.connections[1].weight == -1.5
    assert c.connections[1].enabled is False


def test_inputs_keep_their_names_in_another_task():
    links = [[-1, 20, 2.0, True, 1], [-2, 0, 3.0, True, 2], [20, 0, -1.5, False, 3]]
    c = Controller.from_json(data(connections=links))
    read = [
        (link.source, link.weight)
        for link in c.sensing(("far", "angle"), ("angle", "wall", "far")).connections
    ]
    assert read == [(-3, 2.0), (-1, 3.0), (20, -1.5)]
    # what the other task does not have is left out
    blind = c.sensing(("far", "angle"), ("wall", "angle"))
    assert [(link.source, link.weight) for link in blind.connections] == [(-2, 3.0), (20, -1.5)]
    assert (blind.n_inputs, blind.nodes) == (2, c.nodes)


@examples(40)
@given(controllers(), st.tuples(*[st.floats(-3, 3)] * 5))
def test_further_inputs_change_nothing_and_the_way_back_is_lossless(controller, sensed):
    told, tells = ("far", "angle"), ("wall", "far", "gate", "angle", "push")
    wide = controller.sensing(told, tells)
    assert wide.sensing(tells, told) == controller
    outputs = [
        NetworkBatch([c]).activate(np.array([[numbers]]))
        for c, numbers in ((wide, sensed), (controller, [sensed[1], sensed[3]]))
    ]
    np.testing.assert_array_equal(*outputs)


NAN, INF = float("nan"), float("inf")
MALFORMED = {
    "nothing": None,
    "a list": [],
    "text": "controller",
    "an empty table": {},
    "a missing key": {"n_inputs": 2, "nodes": []},
    "an additional key": {**data(), "more": 1},
    "no nodes": {"n_inputs": 2, "nodes": [], "connections": []},
    "nodes missing": {"n_inputs": 2, "nodes": None, "connections": []},
    "nodes as a number": {"n_inputs": 2, "nodes": 5, "connections": []},
    "nodes as text": {"n_inputs": 2, "nodes": "abc", "connections": []},
    "nodes as a table": {"n_inputs": 2, "nodes": {"abc": 1}, "connections": []},
    "connections as a number": {**data(), "connections": 1},
    "a missing output": {**data(), "nodes": data()["nodes"][1:]},
    "a repeated node": data(nodes=[[21, 0.0, 1.0]]),
    "a node that is an input": data(nodes=[[-1, 0.0, 1.0]]),
    "a node without bias": data(nodes=[[30]]),
    "a node with too many fields": data(nodes=[[30, 0.0, 1.0, 1.0]]),
    "a node that is a number": data(nodes=[30]),
    "a node key that is a float": data(nodes=[[30.0, 0.0, 1.0]]),
    "a node key that is a truth value": data(nodes=[[True, 0.0, 1.0]]),
    "a node key that is a list": data(nodes=[[[30], 0.0, 1.0]]),
    "a node key beyond exact numbers": data(nodes=[[2**53, 0.0, 1.0]]),
    "a bias that is not a number": data(nodes=[[30, NAN, 1.0]]),
    "an infinite response": data(nodes=[[30, 0.0, INF]]),
    "a bias that is text": data(nodes=[[30, "0.0", 1.0]]),
    "a bias that is a truth value": data(nodes=[[30, True, 1.0]]),
    "a bias that is missing": data(nodes=[[30, None, 1.0]]),
    "a bias too large for a float": data(nodes=[[30, 10**400, 1.0]]),
    "no inputs": data(n_inputs=0),
    "too many inputs": data(n_inputs=101),
    "inputs as a float": data(n_inputs=2.0),
    "inputs as a truth value": data(n_inputs=True),
    "a dangling source": data(connections=[[99, 0, 1.0, True, 1]]),
    "a dangling target": data(connections=[[-1, 99, 1.0, True, 1]]),
    "an input that does not exist": data(connections=[[-3, 0, 1.0, True, 1]]),
    "a link into an input": data(connections=[[20, -1, 1.0, True, 1]]),
    "a link from an output": data(connections=[[0, 20, 1.0, True, 1]]),
    "a repeated link": data(connections=[[-1, 0, 1.0, True, 1], [-1, 0, 2.0, True, 2]]),
    "a loop": data(connections=[[20, 20, 1.0, True, 1]]),
    "a cycle": data(connections=[[20, 21, 1.0, True, 1], [21, 20, 1.0, True, 2]]),
    "a cycle of disabled links": data(connections=[[20, 21, 1.0, False, 1], [21, 20, 1.0, False, 2]]),
    "a cycle behind an input": data(
        connections=[[-1, 20, 1.0, True, 3], [20, 21, 1.0, True, 1], [21, 20, 1.0, True, 2]]
    ),
    "a weight that is not a number": data(connections=[[-1, 0, NAN, True, 1]]),
    "an infinite weight": data(connections=[[-1, 0, -INF, True, 1]]),
    "a weight that is text": data(connections=[[-1, 0, "1", True, 1]]),
    "a weight too large for a float": data(connections=[[-1, 0, 10**400, True, 1]]),
    "enabled as a number": data(connections=[[-1, 0, 1.0, 1, 1]]),
    "an innovation that is a float": data(connections=[[-1, 0, 1.0, True, 1.0]]),
    "an end that is a float": data(connections=[[-1.0, 0, 1.0, True, 1]]),
    "an end that is a list": data(connections=[[[-1], 0, 1.0, True, 1]]),
    "a link with too few fields": data(connections=[[-1, 0]]),
    "a link that is nothing": data(connections=[None]),
    "too many nodes": data(nodes=[[k, 0.0, 1.0] for k in range(30, 30 + MAX_NODES)]),
    "too many connections": data(
        nodes=[[k, 0.0, 1.0] for k in range(30, 230)],
        connections=[[a, b, 1.0, False, 1] for a in range(30, 130) for b in (*range(130, 230), *range(20))]
        * 2,
    ),
    "too many connections in a row": chain(MAX_DEPTH + 1),
}


@pytest.mark.parametrize("case", MALFORMED)
def test_malformed_json_is_refused(case):
    with pytest.raises(InvalidData):
        Controller.from_json(MALFORMED[case])


@examples(80)
@given(json_values, json_values, json_values)
def test_any_json_is_read_or_refused(n_inputs, nodes, connections):
    for candidate in (
        nodes,
        {"n_inputs": n_inputs, "nodes": nodes, "connections": connections},
        data(nodes if isinstance(nodes, list) else [], [connections]),
        data([], connections if isinstance(connections, list) else [connections]),
    ):
        try:
            controller = Controller.from_json(candidate)
        except InvalidData:
            continue
        assert Controller.from_json(controller.to_json()) == controller


@examples(40)
@given(controllers(), st.data())
def test_a_damaged_gene_is_refused(controller, draw):
    damaged = controller.to_json()
    kind = draw.draw(st.sampled_from([k for k in ("nodes", "connections") if damaged[k]]))
    row = draw.draw(st.integers(0, len(damaged[kind]) - 1))
    column = draw.draw(st.integers(0, len(damaged[kind][row]) - 1))
    damaged[kind][row][column] = draw.draw(st.sampled_from([None, "x", NAN, [], {}, -(10**6)]))
    value = damaged[kind][row][column]
    is_number_for_float = value == -(10**6) and (kind, column) in {
        ("nodes", 1),
        ("nodes", 2),
        ("connections", 2),
        ("connections", 4),
    }
    if is_number_for_float:
        assert Controller.from_json(damaged).to_json() == damaged
    else:
        with pytest.raises(InvalidData):
            Controller.from_json(damaged)


@pytest.mark.parametrize(
    ("case", "reason"),
    [
        ("too many nodes", "at most 2000 nodes and 20000 connections, not 2022 and 0"),
        ("too many connections", "at most 2000 nodes and 20000 connections, not 222 and 24000"),
        ("too many connections in a row", "at most 200 connections in a row, not 201"),
    ],
)
def test_a_network_that_costs_too_much_is_refused_with_its_size(case, reason):
    with pytest.raises(InvalidData, match=reason):
        Controller.from_json(MALFORMED[case])


def test_a_chain_as_long_as_may_be_is_read():
    assert len(Controller.from_json(chain(MAX_DEPTH)).connections) == MAX_DEPTH


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


def test_the_plain_logistic():
    assert logistic(0.0) == 0.5
    assert logistic(1.0) == pytest.approx(1 / (1 + math.exp(-1)))
    assert logistic(-2.0) + logistic(2.0) == pytest.approx(1.0)
    assert logistic(1e6) == pytest.approx(1.0)
    assert 0.0 < logistic(-1e6) < 1e-20


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
