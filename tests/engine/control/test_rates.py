"""The rates of a controller's mutations do what their names say."""

import random

import pytest

from engine.control.operators import Neat
from engine.control.rates import PUBLISHED_RATES, NeatRates
from engine.errors import InvalidData
from tests.support.made_up import STILL


def children(n=300, **rates):
    """Return a controller and mutants of it, biases nearly untouched unless asked for."""
    neat, rng = Neat(n_inputs=2, rates=NeatRates(**(STILL | rates))), random.Random(1)
    parent = neat.random(rng)
    return parent, [neat.mutate(parent, rng) for _ in range(n)]


def weights(c):
    return [link.weight for link in c.connections]


def moved(parent, mutants, values):
    """Return what was added to each value that changed, and the share of these."""
    steps = [b - a for m in mutants for a, b in zip(values(parent), values(m), strict=True)]
    changed = [s for s in steps if s]
    return changed, len(changed) / len(steps)


def spread(values):
    return (sum(v * v for v in values) / len(values)) ** 0.5


@pytest.mark.parametrize("gene", ["weight", "bias"])
def test_rate_and_power(gene):
    values = {"weight": weights, "bias": lambda c: [n.bias for n in c.nodes]}[gene]
    steps, share = moved(*children(**{f"{gene}_rate": 0.2, f"{gene}_power": 0.3}), values)
    assert share == pytest.approx(0.2, abs=0.02)
    assert spread(steps) == pytest.approx(0.3, abs=0.02)


@pytest.mark.parametrize("gene", ["weight", "bias"])
def test_what_is_replaced_is_drawn_like_a_first_one(gene):
    values = {"weight": weights, "bias": lambda c: [n.bias for n in c.nodes]}[gene]
    parent, mutants = children(**{f"{gene}_replace": 0.4})
    new = [
        b
        for m in mutants
        for a, b in zip(values(parent), values(m), strict=True)
        if abs(b - a) > 0.01  # biases always move a little
    ]
    assert len(new) / (len(mutants) * len(values(parent))) == pytest.approx(0.4, abs=0.02)
    assert spread(new) == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize(
    ("rate", "change"),
    [
        ("link_remove", lambda p, c: len(c.connections) < len(p.connections)),
        ("neuron_add", lambda p, c: len(c.nodes) > len(p.nodes)),
        ("neuron_remove", lambda p, c: len(c.nodes) < len(p.nodes)),
    ],
    ids=lambda v: v if isinstance(v, str) else "",
)
def test_structure(rate, change):
    parent, mutants = children(**{rate: 0.25})
    assert sum(change(parent, m) for m in mutants) / len(mutants) == pytest.approx(0.25, abs=0.08)
    parent, mutants = children()
    assert not any(change(parent, m) for m in mutants)


def test_links_are_added_where_there_is_room():
    # chance proposes a pair of nodes; many pairs are joined already, or would close a circle
    parent, mutants = children(link_add=1.0)
    some = sum(len(m.connections) > len(parent.connections) for m in mutants)
    parent, mutants = children(link_add=0.2)
    fewer = sum(len(m.connections) > len(parent.connections) for m in mutants)
    assert 0 < fewer < some / 3


def test_toggled_links():
    # chance decides anew, so that half of them stay enabled
    _, mutants = children(link_toggle=0.4)
    flags = [not link.enabled for m in mutants for link in m.connections]
    assert sum(flags) / len(flags) == pytest.approx(0.2, abs=0.02)


@pytest.mark.parametrize("hidden", [0, 1, 5])
def test_hidden_neurons_at_the_start(hidden):
    neat, rng = Neat(n_inputs=2, rates=NeatRates(hidden=hidden, neuron_add=1.0)), random.Random(3)
    c = neat.random(rng)
    assert len(c.nodes) == 20 + hidden
    assert len(c.connections) == (2 * hidden + 20 * hidden if hidden else 2 * 20)
    mutant = neat.mutate(c, rng)
    # new keys begin after those of the first networks
    assert {n.key for n in mutant.nodes} - {n.key for n in c.nodes} <= {20 + hidden}


def test_the_gentle_rates_change_less_than_the_published_ones():
    def distance(rates):
        neat, rng = Neat(n_inputs=2, rates=rates), random.Random(4)
        parent = neat.random(rng)
        own = {(link.source, link.target): link.weight for link in parent.connections}
        total = 0.0
        for _ in range(100):
            for link in neat.mutate(parent, rng).connections:
                total += abs(link.weight - own.get((link.source, link.target), 0.0))
        return total

    assert distance(NeatRates()) < distance(PUBLISHED_RATES) / 5


@pytest.mark.parametrize(
    ("rates", "reason"),
    [
        ({"weight_rate": 1.1}, "weight_rate must be from 0 to 1, not 1.1"),
        ({"bias_rate": 0.0}, "bias_rate must be from 0.001 to 1, not 0.0"),
        ({"bias_power": -0.5}, "bias_power must be from 0.001 to 30, not -0.5"),
        ({"weight_power": 31.0}, "weight_power must be from 0.001 to 30"),
        ({"link_add": float("nan")}, "link_add must be from 0 to 1, not nan"),
        ({"hidden": -1}, "hidden must be from 0 to 100"),
        ({"weight_rate": 0.8, "weight_replace": 0.3}, "weight_rate and weight_replace must be at most 1"),
    ],
    ids=str,
)
def test_rates_out_of_range_are_refused(rates, reason):
    with pytest.raises(InvalidData, match=reason):
        NeatRates(**rates)
