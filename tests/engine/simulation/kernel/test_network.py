"""Networks on lanes give what NetworkBatch gives."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numba import njit

from engine.control.genome import N_OUTPUTS, ConnectionGene, Controller, NodeGene
from engine.control.network import NetworkBatch
from engine.simulation.kernel.lanes import simd
from engine.simulation.kernel.loop import network
from tests.support.made_up import controllers, examples

N_INPUTS = 3


@njit
def _activate(net, values):
    network.activate(net, values)


@njit
def _logistic(x, out):
    for i in range(len(x)):
        simd.store(out, i, network.logistic(simd.load(x, i)))


def outputs(controller, n_outputs, inputs, width):
    """Return (samples, outputs) for (samples, inputs), ``width`` samples at a time."""
    net = network.compile_networks([controller], np.full((1, width), True), n_outputs)
    values = simd.reals(net.n_inputs + len(net.bias), width=width)
    found = []
    for k in range(0, len(inputs), width):
        simd.by_lane(values)[: net.n_inputs] = inputs[k : k + width].T
        _activate(net, values)
        found.append(simd.by_lane(values)[-n_outputs:].T.copy())
    return np.concatenate(found)


@examples(100)
@given(
    controllers(N_INPUTS),
    st.sampled_from([4, 10, 20]),
    st.sampled_from([1.0, 100.0]),
    st.integers(0, 2**32 - 1),
)
def test_outputs_are_those_of_networkbatch(controller, n_outputs, size, seed):
    inputs = size * np.random.default_rng(seed).normal(size=(8, N_INPUTS))
    found = outputs(controller, n_outputs, inputs, 8)
    expected = NetworkBatch([controller], n_outputs=n_outputs).activate(inputs[None])[0]
    np.testing.assert_allclose(found, expected, rtol=1e-13)
    for width in (4, 2, 1):
        assert outputs(controller, n_outputs, inputs, width).tobytes() == found.tobytes()


def test_networks_side_by_side_are_those_alone():
    """Each in all lanes, one after the other."""
    alone = [chain([1.5, -2.0]), chain([0.3]), chain([-1.0, 2.0, 0.5])]
    net = network.compile_networks(alone, np.eye(3, 4, dtype=bool), 6)
    values = simd.reals(net.n_inputs + len(net.bias), width=4)
    inputs = np.linspace(-1.0, 1.0, 4)[:, None]
    simd.by_lane(values)[:1] = inputs.T
    _activate(net, values)
    for controller, end in zip(alone, net.end, strict=True):
        found = simd.by_lane(values)[1 + end - 6 : 1 + end].T
        assert found.tobytes() == outputs(controller, 6, inputs, 4).tobytes()
    np.testing.assert_array_equal(simd.by_lane(net.lanes), np.eye(3, 4))


def chain(weights, response=2.0):
    """Return a controller of hidden nodes in a row, whose keys fall along it, to the first output."""
    keys = [50 - k for k in range(len(weights) - 1)]
    nodes = [*(NodeGene(k, 0.25) for k in range(N_OUTPUTS)), *(NodeGene(k, -0.5, response) for k in keys)]
    path = [-1, *keys, 0]
    links = [
        ConnectionGene(a, b, w, True, i)
        for i, (a, b, w) in enumerate(zip(path, path[1:], weights, strict=False))
    ]
    return Controller(n_inputs=1, nodes=tuple(nodes), connections=tuple(links))


def test_nodes_wait_for_their_sources():
    value = 0.7
    for weight in (1.5, -2.0, 0.5):
        value = 1.0 / (1.0 + np.exp(-(2.0 * weight * value - 0.5)))
    last = 1.0 / (1.0 + np.exp(-(3.0 * value + 0.25)))
    found = outputs(chain([1.5, -2.0, 0.5, 3.0]), 2, np.array([[0.7]]), 1)
    idle = 1.0 / (1.0 + np.exp(-0.25))
    np.testing.assert_allclose(found, [[last, idle]], rtol=1e-14)


def test_logistic_to_its_bound():
    x = simd.reals(50_000, width=8)
    out = simd.reals(50_000, width=8)
    numbers = simd.by_lane(x)
    numbers[:] = np.random.default_rng(5).uniform(-60.0, 60.0, numbers.shape)
    numbers[0] = [-60.0, 60.0, -61.0, 61.0, -1e300, 1e300, 0.0, -0.0]
    _logistic(x, out)
    exact = 1.0 / (1.0 + np.exp(-np.clip(numbers, -60.0, 60.0).astype(np.longdouble)))
    ulp = np.spacing(exact.astype(float))
    assert np.max(np.abs((simd.by_lane(out).astype(np.longdouble) - exact) / ulp)) < 3.0
