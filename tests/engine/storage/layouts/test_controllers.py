"""Controllers as bytes."""

import dataclasses
import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from engine.control.genome import Controller
from engine.control.operators import Neat
from engine.errors import InvalidData
from engine.storage.layouts.controllers import EMPTY, Genes, decode, encode
from tests.support.made_up import controllers, evolved_controller, examples


def survives(controller, base=EMPTY):
    content = encode(Genes.of(controller), base)
    # 0.0 equals -0.0, and 1 equals True
    assert repr(decode(content, base).controller()) == repr(controller)
    return content


@examples(40)
@given(controllers(), st.none() | controllers())
def test_a_controller_survives_to_the_last_bit_over_any_base(controller, base):
    survives(controller, EMPTY if base is None else Genes.of(base))


@examples(40)
@given(controllers(n_inputs=3), st.integers(0, 2**32), st.integers(1, 3))
def test_a_mutant_survives_over_its_ancestor(parent, seed, n):
    rng, neat, child = random.Random(seed), Neat(n_inputs=3), parent
    neat.restore({"next_node": 1000, "innovations": 1000})
    for _ in range(n):
        child = neat.mutate(child, rng)
    survives(child, Genes.of(parent))


def test_what_does_not_change_costs_next_to_nothing():
    parent = evolved_controller(3, 10)
    alone, same = survives(parent), survives(parent, Genes.of(parent))
    # most of a gene is the 53 random bits of its value
    n = 2 * len(parent.nodes) + len(parent.connections)
    assert 6 * (n - len(parent.nodes)) < len(alone) < 8.5 * n
    assert len(same) < 20
    first, *others = parent.connections
    one = dataclasses.replace(first, weight=first.weight + 0.1, enabled=not first.enabled)
    changed = dataclasses.replace(parent, connections=(one, *others))
    assert len(survives(changed, Genes.of(parent))) < len(same) + 20


def test_genes_in_another_order_survive():
    parent = evolved_controller(3, 10)
    turned = dataclasses.replace(parent, nodes=parent.nodes[::-1], connections=parent.connections[::-1])
    survives(turned, Genes.of(parent))


def test_unusual_genes_survive():
    parent = evolved_controller(0, 0)
    node, *nodes = parent.nodes
    link, *links = parent.connections
    odd = Controller(
        n_inputs=100,
        nodes=(dataclasses.replace(node, bias=-0.0, response=-1e308), *nodes, *_far_nodes(node)),
        connections=(dataclasses.replace(link, weight=5e-324, innovation=-(2**62)), *links),
    )
    survives(odd)
    survives(odd, Genes.of(parent))
    survives(parent, Genes.of(odd))
    survives(dataclasses.replace(parent, connections=()), Genes.of(parent))
    with pytest.raises(InvalidData, match="too large"):
        encode(Genes.of(dataclasses.replace(odd, connections=(dataclasses.replace(link, innovation=2**80),))))


def _far_nodes(node):
    return [dataclasses.replace(node, key=k) for k in (2**53 - 1, 500)]


@examples(200)
@given(st.data())
def test_bytes_that_are_no_controller_are_refused_or_are_one(data):
    base = Genes.of(evolved_controller(3, 4))
    content = bytearray(encode(Genes.of(evolved_controller(3, 6)), base))
    for _ in range(data.draw(st.integers(1, 3))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    end = data.draw(st.integers(0, len(content)) | st.just(len(content)))
    try:
        decode(bytes(content[:end]), base).controller()
    except InvalidData:
        return
