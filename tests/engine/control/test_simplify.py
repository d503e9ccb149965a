"""Networks without the neurons that never change."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from engine.control.genome import Controller
from engine.control.simplify import simplified
from tests.support.made_up import controllers, examples, outputs


def network(hidden, links):
    return Controller.from_json(
        {
            "n_inputs": 2,
            "nodes": [[k, 0.5, 1.0] for k in range(20)] + [[k, b, r] for k, b, r in hidden],
            "connections": [[*link, i] for i, link in enumerate(links)],
        }
    )


def test_a_neuron_that_is_held_down_becomes_part_of_a_bias():
    # neuron 20 is 1 wherever the second input is above 0.5, neuron 21 never changes much
    c = network(
        [(20, 0.0, 1.0), (21, -8.0, 1.0), (22, 0.0, 1.0)],
        [
            (-2, 20, 30.0, True),
            (-1, 21, 1.0, True),
            (-1, 22, 1.0, True),
            (20, 3, 2.0, True),
            (21, 3, 5.0, True),
            (22, 3, 1.0, True),
        ],
    )
    smaller = simplified(c, [(-1.0, 1.0), (0.5, 1.0)])
    assert [n.key for n in smaller.nodes if n.key >= 20] == [22]
    assert {(link.source, link.target) for link in smaller.connections} == {(-1, 22), (22, 3)}
    # 2 x 1, and 5 x what neuron 21 is at most and at least, 0.0009 and 0.0001
    assert next(n.bias for n in smaller.nodes if n.key == 3) == pytest.approx(0.5 + 2.0 + 0.0026, abs=1e-4)
    inputs = (0.3, 0.7)
    np.testing.assert_allclose(outputs(smaller, inputs), outputs(c, inputs), atol=0.01)
    # with wider limits neuron 20 can change
    assert [n.key for n in simplified(c, [(-1, 1), (-1, 1)]).nodes if n.key >= 20] == [20, 22]


def test_a_chain_to_a_still_neuron_goes_with_it():
    c = network(
        [(20, 0.0, 1.0), (21, 0.0, 0.0), (22, 0.0, -2.0)],
        [(-1, 20, 1.0, True), (20, 21, 3.0, True), (21, 22, 1.0, True), (22, 0, 4.0, True)],
    )
    smaller = simplified(c, [(-1.0, 1.0), (-1.0, 1.0)])
    assert len(smaller.nodes) == 20
    assert not smaller.connections
    np.testing.assert_allclose(outputs(smaller, (0.4, 0.4)), outputs(c, (0.4, 0.4)), atol=1e-12)


@examples(80)
@given(controllers(), st.floats(0, 1), st.floats(-1, 1))
def test_little_changes_within_the_limits(controller, distance, bearing):
    smaller = simplified(controller, [(0.0, 1.0), (-1.0, 1.0)])
    inputs = (distance, bearing)
    assert len(smaller.nodes) <= len(controller.nodes)
    np.testing.assert_allclose(outputs(smaller, inputs), outputs(controller, inputs), atol=0.05)
    assert simplified(smaller, [(0.0, 1.0), (-1.0, 1.0)]) == smaller
