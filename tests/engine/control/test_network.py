import math
import random
import tracemalloc
from types import SimpleNamespace

import neat
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from engine.control.genome import MAX_DEPTH, MAX_NODES, ConnectionGene, Controller, NodeGene
from engine.control.network import NetworkBatch, Plan, silenced
from engine.control.operators import Neat, to_genome
from tests.support.made_up import controllers, examples, some_controller

several = st.integers(0, 2).flatmap(
    lambda i: st.lists(controllers(n_inputs=(1, 2, 5)[i]), min_size=1, max_size=6)
)


def published(controller, inputs):
    """What NEAT-Python's own network answers to (samples, n_inputs)."""
    config = Neat(n_inputs=controller.n_inputs).config
    network = neat.nn.FeedForwardNetwork.create(
        to_genome(controller, config), SimpleNamespace(genome_config=config)
    )
    return np.array([network.activate(list(row)) for row in inputs])


def sensed(seed, *shape):
    """Inputs of the sizes that tasks produce: tens of centimetres, a few radians."""
    return np.random.default_rng(seed).normal(0.0, 20.0, size=shape)


@examples(60)
@given(several, st.integers(0, 2**32))
def test_outputs_agree_with_neat_python(networks, seed):
    inputs = sensed(seed, len(networks), 3, networks[0].n_inputs)
    got = NetworkBatch(networks).activate(inputs)
    assert got.shape == (len(networks), 3, 20)
    for controller, x, y in zip(networks, inputs, got, strict=True):
        np.testing.assert_allclose(y, published(controller, x), rtol=0, atol=1e-12)


@examples(60)
@given(several, st.integers(0, 2**32), st.integers(1, 7))
def test_outputs_are_the_same_bits_alone_and_in_company(networks, seed, n_samples):
    inputs = sensed(seed, len(networks), n_samples, networks[0].n_inputs)
    together = NetworkBatch(networks).activate(inputs)
    for k, controller in enumerate(networks):
        alone = NetworkBatch([controller])
        assert alone.activate(inputs[k : k + 1]).tobytes() == together[k].tobytes()
        for s in range(n_samples):
            one = alone.activate(inputs[k : k + 1, s : s + 1])
            assert one.tobytes() == together[k, s].tobytes()


@examples(40)
@given(several, st.integers(0, 2**32), st.integers(1, 20))
def test_fewer_outputs_are_the_first_of_all(networks, seed, n_outputs):
    inputs = sensed(seed, len(networks), 2, networks[0].n_inputs)
    few = NetworkBatch(networks, n_outputs=n_outputs).activate(inputs)
    assert few.tolist() == NetworkBatch(networks).activate(inputs)[..., :n_outputs].tolist()


def network(*connections, bias=0.0, hidden=(), n_inputs=2):
    keys = [*range(20), *hidden]
    return Controller(
        n_inputs=n_inputs,
        nodes=tuple(NodeGene(k, bias) for k in keys),
        connections=tuple(
            ConnectionGene(a, b, w, enabled, i) for i, (a, b, w, enabled) in enumerate(connections)
        ),
    )


def sigma(z):
    return 1 / (1 + math.exp(-z))


def test_a_hand_computed_network():
    c = network(
        (-1, 20, 0.5, True), (-2, 20, -1.0, True), (20, 0, 2.0, True), (-2, 1, 0.3, True),
        (-1, 1, 9.0, False), bias=0.1, hidden=(20,),
    )  # fmt: skip
    (out,) = NetworkBatch([c]).activate(np.array([[[0.8, -0.4]]]))[0]
    h = sigma(0.1 + 0.5 * 0.8 + 0.4)
    assert out[0] == pytest.approx(sigma(0.1 + 2.0 * h), abs=1e-15)
    assert out[1] == pytest.approx(sigma(0.1 - 0.3 * 0.4), abs=1e-15)
    # an output that nothing leads to says its bias
    assert out[2] == pytest.approx(sigma(0.1), abs=1e-15)


def test_hidden_nodes_in_a_row_whose_keys_run_backwards():
    c = network(
        (-1, 25, 1.0, True), (25, 22, -2.0, True), (22, 21, 3.0, True), (21, 0, 1.0, True),
        (25, 0, 0.5, True), hidden=(21, 22, 25), n_inputs=1,
    )  # fmt: skip
    (out,) = NetworkBatch([c]).activate(np.array([[[0.7]]]))[0]
    a = sigma(0.7)
    b = sigma(-2 * a)
    d = sigma(3 * b)
    assert out[0] == pytest.approx(sigma(d + 0.5 * a), abs=1e-15)


def test_a_network_without_hidden_nodes_beside_one_with():
    plain = network((-1, 0, 1.0, True))
    batch = NetworkBatch([plain, some_controller()])
    out = batch.activate(np.array([[[1.0, 2.0]], [[1.0, 2.0]]]))
    assert out[0, 0, 0] == pytest.approx(sigma(1.0))
    np.testing.assert_allclose(out[1], published(some_controller(), [[1.0, 2.0]]), atol=1e-12)


def test_a_response_scales_the_sum_but_not_the_bias():
    c = Controller(
        n_inputs=1,
        nodes=tuple(NodeGene(k, 0.2, 3.0) for k in range(20)),
        connections=(ConnectionGene(-1, 0, 0.5, True, 1),),
    )
    (out,) = NetworkBatch([c]).activate(np.array([[[0.4]]]))[0]
    assert out[0] == pytest.approx(sigma(0.2 + 3.0 * 0.5 * 0.4))
    np.testing.assert_allclose(out, published(c, [[0.4]])[0], rtol=0, atol=1e-12)


def test_a_network_as_deep_as_may_be():
    n = MAX_DEPTH - 1
    links = [(-1, 20, 1.0, True), *[(k, k + 1, 0.5, True) for k in range(20, 20 + n - 1)]]
    c = network(*links, (20 + n - 1, 0, 1.0, True), hidden=range(20, 20 + n), n_inputs=1)
    x = 0.3
    for weight in (1.0, *[0.5] * (n - 1), 1.0):
        x = sigma(weight * x)
    assert NetworkBatch([c], n_outputs=1).activate(np.array([[[0.3]]]))[0, 0, 0] == pytest.approx(x)


def test_the_largest_networks_take_memory_for_their_links_alone():
    n, per_node = MAX_NODES - 20, 10
    hidden = range(20, 20 + n)
    # every tenth node leads to the next ten: a tenth of the longest chain that may be
    links = [
        (a, b, 1.0, True)
        for a in range(20, 20 + n, per_node)
        for b in range(a + per_node, min(a + 2 * per_node, 20 + n))
        if (b - 20) // per_node % (MAX_DEPTH - 2)
    ]
    c = network(*links, *((k, k % 20, 1.0, True) for k in hidden), hidden=hidden, n_inputs=1)
    tracemalloc.start()
    batch = NetworkBatch([c] * 4)
    batch.activate(np.zeros((4, 8, 1)))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 25e6  # four matrices of all nodes would take 125 MB


def dense(controllers, inputs):
    """What networks answer that are evaluated as matrices, with a sum over all sources, linked or not."""
    found = np.empty((*inputs.shape[:2], 20))
    for k, controller in enumerate(controllers):
        plan = Plan(controller, 20)
        n, n_hidden = controller.n_inputs, len(plan.hidden)
        weights = np.zeros((n + n_hidden, n_hidden + 20))
        for node in range(n_hidden + 20):
            links = slice(plan.first[node], plan.first[node + 1])
            weights[plan.source[links], node] = plan.weight[links]
        values = np.zeros((inputs.shape[1], n_hidden + 20))
        for _ in range(plan.depth + 1):
            sources = np.concatenate([inputs[k], values[:, :n_hidden]], axis=1)
            total = np.zeros_like(values)
            for j, row in enumerate(weights):
                total += sources[:, j, None] * row
            total += plan.bias
            values = 1.0 / (1.0 + np.exp(-np.clip(total, -60.0, 60.0)))
        found[k] = values[:, n_hidden:]
    return found


@examples(60)
@given(several, st.integers(0, 2**32))
def test_outputs_are_the_bits_that_runs_of_the_first_version_have(networks, seed):
    inputs = sensed(seed, len(networks), 3, networks[0].n_inputs)
    assert NetworkBatch(networks).activate(inputs).tobytes() == dense(networks, inputs).tobytes()


@examples(30)
@given(several)
def test_outputs_lie_between_zero_and_one_even_for_huge_inputs(networks):
    inputs = np.full((len(networks), 1, networks[0].n_inputs), 1e12)
    out = NetworkBatch(networks).activate(inputs)
    assert ((out >= 0.0) & (out <= 1.0)).all()


# ---- NEAT-Python 0.92


def of_092(controller, inputs):
    """What the network of NEAT-Python 0.92 answers to (samples, n_inputs), worked out layer by layer."""
    links = {(c.source, c.target): c.weight for c in controller.connections if c.enabled}
    nodes = {n.key: n for n in controller.nodes}
    found = []
    for row in inputs:
        values = {-1 - i: x for i, x in enumerate(row)}
        while True:
            layer = [
                k
                for k in nodes
                if k not in values
                and any(b == k for _, b in links)
                and all(a in values for a, b in links if b == k)
            ]
            if not layer:
                break
            for k in layer:
                total = sum(values[a] * w for (a, b), w in links.items() if b == k)
                z = max(-60.0, min(60.0, nodes[k].bias + nodes[k].response * total))
                values[k] = 1.0 / (1.0 + math.exp(-z))
        found.append([values.get(k, 0.0) for k in range(20)])
    return np.array(found)


@examples(60)
@given(several, st.integers(0, 2**32))
def test_silenced_networks_agree_with_neat_python_0_92(networks, seed):
    inputs = sensed(seed, len(networks), 3, networks[0].n_inputs)
    got = NetworkBatch([silenced(c) for c in networks]).activate(inputs)
    for controller, x, y in zip(networks, inputs, got, strict=True):
        np.testing.assert_allclose(y, of_092(controller, x), rtol=0, atol=1e-12)


def test_what_lacks_an_input_is_0_with_all_that_hangs_on_it():
    links = [
        (-1, 20, True), (20, 0, True),  # reached
        (21, 1, True), (20, 1, True),  # one of its neurons has no input
        (-2, 2, False),  # its only link is disabled
        (21, 22, True), (-1, 22, True), (22, 3, True),  # two steps behind a neuron without input
    ]  # fmt: skip
    net = Controller(
        n_inputs=2,
        nodes=tuple(NodeGene(k, 1.0) for k in range(23)),
        connections=tuple(ConnectionGene(a, b, 1.0, on, n) for n, (a, b, on) in enumerate(links)),
    )
    (out,) = NetworkBatch([silenced(net)]).activate(np.zeros((1, 1, 2)))[0]
    assert out[0] > 0.7
    assert out[1:].max() < 1e-20
    (out,) = NetworkBatch([net]).activate(np.zeros((1, 1, 2)))[0]
    assert out.min() > 0.7
    # nothing is lacking where every output has a neuron with an input
    new = Neat(n_inputs=2).random(random.Random(1))
    assert silenced(new) is new
