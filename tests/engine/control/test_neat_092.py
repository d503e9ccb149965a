"""The operators of NEAT-Python 0.92, each against what the library's own of version 2 does."""

import random

import pytest

from engine.control.operators import Neat
from engine.control.rates import NeatRates
from tests.support.made_up import STILL


def neat_of(version, **rates):
    return Neat(n_inputs=2, rates=NeatRates(**(STILL | rates), version=version))


def added(version, n=6000):
    """Return the links that mutations added to one new network."""
    neat, rng = neat_of(version, link_add=1.0), random.Random(1)
    parent = neat.random(rng)
    before = {(c.source, c.target) for c in parent.connections}
    children = [neat.mutate(parent, rng) for _ in range(n)]
    return [
        (c.source, c.target) for m in children for c in m.connections if (c.source, c.target) not in before
    ]


def test_links_from_an_input_to_an_output_are_five_times_rarer():
    n = 6000
    # of 23 ends and, in 0.92, 25 beginnings: 2 inputs x 20 outputs
    old, new = added("0.92", n), added("2.0", n)
    assert not any(0 <= source < 20 for source, _ in old)
    direct = [sum(source < 0 and target < 20 for source, target in links) / n for links in (old, new)]
    assert direct == [pytest.approx(40 / (23 * 25), abs=0.012), pytest.approx(40 / (23 * 5), abs=0.02)]


@pytest.mark.parametrize(("version", "spread"), [("0.92", 1.0), ("2.0", 0.0)])
def test_the_bias_of_a_new_neuron(version, spread):
    neat, rng = neat_of(version, neuron_add=1.0), random.Random(2)
    parent = neat.random(rng)
    biases = [neat.mutate(parent, rng).nodes[-1].bias for _ in range(600)]
    # its bias may be mutated at once, by next to nothing
    assert (sum(b * b for b in biases) / len(biases)) ** 0.5 == pytest.approx(spread, abs=0.08)


def test_crossover_lines_links_up_by_the_nodes_that_they_join():
    rng = random.Random(3)
    neat = neat_of("0.92", link_add=1.0)
    parent = neat.random(rng)
    both = []
    while len(both) < 2:
        neat.new_generation()
        child = neat.mutate(parent, rng)
        both += [child] if any((c.source, c.target) == (-1, 7) for c in child.connections) else []
    fitter, other = both
    links = [next(c for c in x.connections if (c.source, c.target) == (-1, 7)) for x in both]
    assert links[0].innovation != links[1].innovation
    drawn = []
    for _ in range(200):
        child = neat.cross(fitter, other, rng)
        assert [n.key for n in child.nodes] == [n.key for n in fitter.nodes]
        (mine,) = [c for c in child.connections if (c.source, c.target) == (-1, 7)]
        assert mine.innovation == links[0].innovation
        drawn.append(mine.weight)
    assert {w: drawn.count(w) for w in drawn}.keys() == {links[0].weight, links[1].weight}
    assert drawn.count(links[1].weight) / 200 == pytest.approx(0.5, abs=0.12)


@pytest.mark.parametrize(("version", "share"), [("0.92", 0.5), ("2.0", 0.5 + 0.5 * 0.75)])
def test_links_disabled_in_one_parent(version, share):
    rng = random.Random(4)
    toggling = neat_of(version, link_toggle=1.0)
    parent = toggling.random(rng)
    mutant = toggling.mutate(parent, rng)
    disabled = {c.innovation for c in mutant.connections if not c.enabled}
    assert len(disabled) > 20
    children = [toggling.cross(parent, mutant, rng) for _ in range(60)]
    off = [not c.enabled for child in children for c in child.connections if c.innovation in disabled]
    assert sum(off) / len(off) == pytest.approx(share, abs=0.04)
    assert all(c.enabled for child in children for c in child.connections if c.innovation not in disabled)
