"""Two controllers in one, by the side that the target is at."""

import itertools

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from engine.control.genome import Controller
from engine.control.switch import MOST_HIDDEN, switched
from tests.support.made_up import controllers, evolved_controller, examples, outputs


def join(left, right, bearing=1):
    nodes, innovations = itertools.count(500), itertools.count(900)
    return switched(
        left,
        right,
        bearing=bearing,
        reach=(3.0, 1.0),
        new_node=lambda: next(nodes),
        new_innovation=lambda: next(innovations),
    )


def constant(bias, *, links=(), hidden=(), responses=()):
    """A controller whose outputs have one bias, with the hidden nodes and links given."""
    responses = dict(responses)
    return Controller.from_json(
        {
            "n_inputs": 2,
            "nodes": [[k, bias, responses.get(k, 1.0)] for k in range(20)]
            + [[k, b, responses.get(k, 1.0)] for k, b in hidden],
            "connections": [[*link, i] for i, link in enumerate(links)],
        }
    )


def test_the_side_of_the_target_decides_who_acts():
    both = join(constant(1.0), constant(-2.0))
    ahead = 1 / (1 + np.exp(-(1.0 - 2.0) / 2))
    for bearing, expected in ((0.5, 1.0), (0.05, 1.0), (-0.05, -2.0), (-1.0, -2.0)):
        found = outputs(both, (0.7, bearing))
        np.testing.assert_allclose(found, 1 / (1 + np.exp(-expected)), atol=1e-4)
    # straight ahead both have half a say
    np.testing.assert_allclose(outputs(both, (0.7, 0.0)), ahead)


def test_neurons_are_copied_and_take_turns():
    left = constant(0.0, hidden=[(20, 0.5)], links=[(-1, 20, 2.0, True), (20, 3, 4.0, True)])
    right = constant(0.0, hidden=[(20, -1.0)], links=[(-2, 20, 3.0, True), (20, 3, -5.0, True)])
    both = join(left, right)
    inputs = [(0.7, 0.6), (0.2, -0.6)]
    np.testing.assert_allclose(outputs(both, inputs[0]), outputs(left, inputs[0]), atol=1e-5)
    np.testing.assert_allclose(outputs(both, inputs[1]), outputs(right, inputs[1]), atol=1e-5)


def test_a_response_becomes_part_of_the_weights():
    left = constant(
        0.3,
        hidden=[(20, 0.5)],
        links=[(-1, 20, 2.0, True), (20, 3, 4.0, True)],
        responses={20: -1.5, 3: 0.5},
    )
    given_ = (0.7, 0.6)
    np.testing.assert_allclose(outputs(join(left, constant(0.0)), given_), outputs(left, given_), atol=1e-5)


def test_a_link_from_an_input_to_an_output_acts_nearly_as_before():
    left = constant(0.3, links=[(-1, 3, 2.0, True), (-2, 3, -1.0, True), (-1, 4, 25.0, True)])
    both = join(left, constant(-1.0))
    for distance in (0.0, 0.2, 0.5):
        found, expected = outputs(both, (distance, 0.5)), outputs(left, (distance, 0.5))
        np.testing.assert_allclose(found[:, :4], expected[:, :4], atol=0.01)
    # a weight of 25 is more than such a neuron can give, but its sign is kept
    assert outputs(both, (0.5, 0.5))[0, 4] > 0.9
    np.testing.assert_allclose(outputs(both, (0.5, -0.5)), outputs(constant(-1.0), (0.5, -0.5)), atol=1e-5)


def test_what_does_not_matter_is_left_out():
    links = [
        (-1, 20, 1.0, True),
        (20, 0, 1.0, False),
        (-1, 21, 1.0, True),
        (21, 1, 2.0, True),
        (-2, 22, 1.0, True),
    ]
    left = constant(0.0, hidden=[(20, 0.0), (21, 0.0), (22, 0.0)], links=links)
    both = join(left, constant(0.0))
    # three that tell the sides apart, and neuron 21
    assert len(both.nodes) == 20 + 3 + 1
    numbers = [n.key for n in both.nodes if n.key >= 20]
    assert numbers == [500, 501, 502, 503]
    assert [c.innovation for c in both.connections] == list(range(900, 900 + len(both.connections)))


@examples(60)
@given(
    controllers(),
    controllers(),
    st.floats(0.0, 1.0),
    st.floats(0.1, 1.0) | st.floats(-1.0, -0.1),
)
def test_a_switch_acts_as_the_one_whose_side_it_is(left, right, distance, bearing):
    both = join(left, right)
    acting = left if bearing > 0 else right
    given_ = (distance, bearing)
    direct = any(c.enabled and c.source < 0 and c.target < 20 for c in acting.connections)
    np.testing.assert_allclose(outputs(both, given_), outputs(acting, given_), atol=0.25 if direct else 1e-3)
    assert Controller.from_json(both.to_json()) == both


def test_of_a_switch_only_the_half_that_can_act_is_joined():
    a, b, c, d = (evolved_controller(seed, 3) for seed in range(4))
    nested, plain = join(join(a, b), join(c, d)), join(a, d)
    assert len(nested.nodes) == len(plain.nodes)
    for bearing in (0.8, 0.1, -0.1, -0.8):
        np.testing.assert_allclose(outputs(nested, (0.7, bearing)), outputs(plain, (0.7, bearing)), atol=0.02)


def test_networks_that_are_too_large_together_are_not_joined():
    n = MOST_HIDDEN // 2
    large = constant(
        0.0,
        hidden=[(20 + k, 0.0) for k in range(n)],
        links=[link for k in range(n) for link in ((-2, 20 + k, 5.0, True), (20 + k, 0, 1.0, True))],
    )
    assert join(large, large) is None
    assert join(large, constant(0.0)) is not None
