"""New solutions come about as their configuration says."""

import collections
import dataclasses

import pytest

from engine.body.morphology import BodyRates
from engine.config import create_algorithm, replaced
from engine.control.rates import NeatRates
from engine.errors import InvalidData
from engine.search.dm_me import DoubleMapMapElites
from engine.search.map_search import MapSearchConfig
from engine.search.variation import PUBLISHED, Specialists, Variation, VariationConfig
from engine.search.vie_neat import VieNeat, VieNeatConfig
from engine.tasks import GOAL_REACHING
from engine.tasks.sides import sides_of
from tests.support.made_up import MADE_UP, generation


class Nobody:
    def pair(self):
        raise AssertionError("no crossover was asked for")

    def donor(self, n):
        raise AssertionError(f"no exchange was asked for, of {n}")

    def specialists(self):
        raise AssertionError("no switch was asked for")


class Somebody:
    """Gives the controllers that it has, and counts how often it is asked."""

    def __init__(self, *controllers):
        self.controllers, self.pairs, self.donors = controllers, 0, []

    def pair(self):
        self.pairs += 1
        return self.controllers

    def donor(self, n):
        self.donors.append(n)
        return self.controllers[0]


nobody = Nobody()


def variation(**config):
    rates = VariationConfig(**{"switch_weight": 0} | config)
    return Variation(n_inputs=2, seed=1, config=rates)


@pytest.mark.parametrize("weights", [(1, 0, 0), (0, 1, 0), (0, 0, 1), (3, 1, 0), (1, 1, 2)])
def test_operators_are_drawn_by_their_weights(weights):
    names = ("morphology_weight", "controller_weight", "both_weight")
    v = variation(**dict(zip(names, weights, strict=True)))
    parent, n = v.random(), 600
    drawn = collections.Counter(v.mutate(parent, "x", nobody).operator for _ in range(n))
    for operator, weight in zip(("morphology", "controller", "both"), weights, strict=True):
        assert drawn[operator] / n == pytest.approx(weight / sum(weights), abs=0.06 if weight else 0.0)


def test_rates_reach_the_mutants():
    v = variation(
        body=BodyRates(body_rate=0.01, face_rate=1.0), neat=NeatRates(hidden=0, neuron_add=1.0), both_weight=0
    )
    parent = v.random()
    assert len(parent.controller.nodes) == 20
    mutants = [v.mutate(parent, "x", nobody) for _ in range(200)]
    for m in mutants:
        if m.operator == "controller":
            assert len(m.controller.nodes) in (20, 21)
    faces = [
        a != b
        for m in mutants
        if m.operator == "morphology" and m.morphology.n_modules == parent.morphology.n_modules
        for a, b in zip(parent.morphology.faces, m.morphology.faces, strict=True)
    ]
    # an eighth of the redraws gives the same face again
    assert sum(faces) / len(faces) == pytest.approx(7 / 8, abs=0.08)


@pytest.mark.parametrize("make", [
    lambda variation: DoubleMapMapElites(MapSearchConfig(), n_inputs=2, budget=2000, variation=variation),
    lambda variation: VieNeat(VieNeatConfig(), n_inputs=2, budget=2000, variation=variation),
])  # fmt: skip
def test_algorithms_use_it(make):
    none = dataclasses.replace(PUBLISHED, neat=dataclasses.replace(PUBLISHED.neat, hidden=0))
    for config, n in ((PUBLISHED, 23), (none, 20)):
        assert {len(s.controller.nodes) for s in make(config).ask()} == {n}


@pytest.mark.parametrize(
    ("config", "reason"),
    [
        ({"both_weight": 101}, "both_weight must be from 0 to 100, not 101"),
        (
            {f"{kind}_weight": 0 for kind in ("morphology", "controller", "both", "switch")},
            "one of morphology_weight, controller_weight, both_weight, exchange_weight, switch_weight must be"
            " above 0",
        ),
        ({"exchange_weight": -1}, "exchange_weight must be from 0 to 100, not -1"),
        ({"donors": 0}, "donors must be from 1 to 1000, not 0"),
    ],
)
def test_weights_out_of_range_are_refused(config, reason):
    with pytest.raises(InvalidData, match=reason):
        VariationConfig(**config)


@pytest.mark.parametrize(
    ("rates", "reason"),
    [
        ({"body_rate": 0.0}, "body_rate must be from 0.01 to 1, not 0.0"),
        ({"face_rate": 1.5}, "face_rate must be from 0 to 1, not 1.5"),
        ({"module_rate": 0.6}, "module_rate must be from 0 to 0.5, not 0.6"),
    ],
)
def test_rates_of_bodies_out_of_range_are_refused(rates, reason):
    with pytest.raises(InvalidData, match=reason):
        BodyRates(**rates)


# ---- crossover


@pytest.mark.parametrize("share", [1.0, 0.3])
def test_controllers_are_crossed_as_often_as_asked(share):
    v = variation(crossover=share, morphology_weight=0, both_weight=0)
    fitter, other = v.random(), v.random()
    mates = Somebody(fitter.controller, other.controller)
    n = 300
    children = [v.mutate(other, "x", mates) for _ in range(n)]
    assert mates.pairs / n == pytest.approx(share, abs=0.08)
    own = {c.weight for c in other.controller.connections}
    crossed = [len(own & {c.weight for c in s.controller.connections}) / len(own) for s in children]
    # a crossed child has about half of each parent's weights, before a fifth of them is mutated
    assert sum(share < 0.6 for share in crossed) / n == pytest.approx(share, abs=0.08)
    assert all(s.parent == other.number and s.operator == "controller" for s in children)


def test_a_search_crosses_elites_of_one_archive():
    config = replaced(
        MADE_UP,
        variation=VariationConfig(crossover=1.0, morphology_weight=0, both_weight=0, switch_weight=0),
        overlap=0,
    )
    algorithm, everybody = create_algorithm(config), {}
    crossed = 0
    for _ in range(9):
        elites = {e.solution.number for a in algorithm.archives.values() for e in a.elites()}
        told = generation(algorithm)
        weights = {n: {c.weight for c in s.controller.connections} for n, s in everybody.items()}
        for s in (e.solution for e in told if e.solution.parent is not None):
            mine = {c.weight for c in s.controller.connections} - weights[s.parent]
            crossed += any(len(mine & weights[n]) > 5 for n in elites - {s.parent})
        everybody |= {e.solution.number: e.solution for e in told}
    assert crossed > 0.6 * (config.evaluations - config.map_search.initial)


# ---- exchange


def test_controllers_are_exchanged_as_often_as_asked():
    v = variation(exchange_weight=1)
    parent, mate = v.random(), v.random()
    mates, n = Somebody(mate.controller), 600
    children = [v.mutate(parent, "x", mates) for _ in range(n)]
    exchanged = [s for s in children if s.operator == "exchange"]
    assert len(exchanged) / n == pytest.approx(1 / 4, abs=0.06)
    assert mates.donors == [8] * len(exchanged)
    for s in exchanged:
        assert (s.morphology, s.controller, s.parent) == (parent.morphology, mate.controller, parent.number)


def test_a_controller_that_everybody_has_is_mutated():
    v = variation(exchange_weight=1, morphology_weight=0, controller_weight=0, both_weight=0)
    parent = v.random()
    child = v.mutate(parent, "x", Somebody(parent.controller))
    assert child.operator == "controller"
    assert child.controller != parent.controller
    assert child.morphology == parent.morphology


def test_a_search_gives_bodies_the_controllers_of_fitter_elites():
    only = VariationConfig(
        exchange_weight=1,
        donors=1000,
        morphology_weight=0,
        controller_weight=0,
        both_weight=0,
        switch_weight=0,
    )
    algorithm = create_algorithm(replaced(MADE_UP, variation=only, overlap=0))
    generation(algorithm)
    exchanged = 0
    for _ in range(6):
        best = {name: archive.best() for name, archive in algorithm.archives.items()}
        elites = {e.solution.number: e.solution for a in algorithm.archives.values() for e in a.elites()}
        for s in (e.solution for e in generation(algorithm)):
            if s.operator == "exchange":
                exchanged += 1
                assert s.morphology == elites[s.parent].morphology
                assert s.controller == best[s.source].solution.controller
    assert exchanged > 20


# ---- switch


SIDES = sides_of(GOAL_REACHING.sensing("relative"))


class Two:
    """Gives two specialists, or none."""

    def __init__(self, pair):
        self.pair, self.asked = pair, 0

    def specialists(self):
        self.asked += 1
        return self.pair


def switching(sides=SIDES, **config):
    return Variation(
        n_inputs=2,
        seed=1,
        config=VariationConfig(switch_weight=1, **config),
        sides=sides,
    )


def test_specialists_are_joined_as_often_as_asked():
    v = switching()
    parent, left, right = v.random(), v.random(), v.random()
    right = dataclasses.replace(right, morphology=left.morphology)
    mates, n = Two(Specialists(left, right, again=False)), 600
    children = [s for s in (v.mutate(parent, "x", mates) for _ in range(n)) if s.operator == "switch"]
    assert len(children) / n == pytest.approx(1 / 4, abs=0.06)
    assert mates.asked == len(children)
    numbers = collections.Counter()
    for s in children:
        assert (s.morphology, s.parent, s.source) == (left.morphology, left.number, "x")
        # 3 of each network, 3 that tell the sides apart
        assert len(s.controller.nodes) == 20 + 9
        numbers.update(n.key for n in s.controller.nodes if n.key >= 20)
        numbers.update(-c.innovation for c in s.controller.connections)
    assert set(numbers.values()) == {1}, "no two children share a new neuron or link"


def test_specialists_that_were_joined_before_are_mutated_too():
    v = switching(morphology_weight=0, controller_weight=0, both_weight=0)
    left, right = v.random(), v.random()
    for again in (False, True):
        pair = Specialists(left, dataclasses.replace(right, morphology=left.morphology), again)
        children = [v.mutate(left, "x", Two(pair)) for _ in range(4)]
        weights = {tuple(sorted(c.weight for c in s.controller.connections)) for s in children}
        assert len(weights) == (4 if again else 1)


@pytest.mark.parametrize("sides", [SIDES, None])
def test_where_there_is_nobody_to_join_the_controller_is_mutated(sides):
    v = switching(sides, morphology_weight=0, controller_weight=0, both_weight=0)
    parent = v.random()
    child = v.mutate(parent, "x", Two(None))
    assert (child.operator, child.morphology) == ("controller", parent.morphology)
    assert child.controller != parent.controller


def test_networks_that_are_too_large_together_are_not_joined():
    v = switching(neat=NeatRates(hidden=30), morphology_weight=0, controller_weight=0, both_weight=0)
    left, right = v.random(), v.random()
    pair = Specialists(left, dataclasses.replace(right, morphology=left.morphology), again=False)
    assert v.mutate(left, "x", Two(pair)).operator == "controller"
