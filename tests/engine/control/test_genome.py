import itertools
import json
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from engine.control.genome import MAX_DEPTH, MAX_NODES, Controller, logistic
from engine.control.network import NetworkBatch
from engine.errors import InvalidData
from tests.support.made_up import controllers, examples

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


def test_the_plain_logistic():
    assert logistic(0.0) == 0.5
    assert logistic(1.0) == pytest.approx(1 / (1 + math.exp(-1)))
    assert logistic(-2.0) + logistic(2.0) == pytest.approx(1.0)
    assert logistic(1e6) == pytest.approx(1.0)
    assert 0.0 < logistic(-1e6) < 1e-20
