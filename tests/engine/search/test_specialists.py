"""Specialists: who does best for targets at one side."""

import dataclasses
import math
import random

import numpy as np
import pytest

from engine.body.morphology import Morphology
from engine.config import create_algorithm, replaced
from engine.search.body_space import PUBLISHED_BODIES
from engine.search.dm_me import DoubleMapMapElites
from engine.search.elite_records import BODIES, SpecialistMemory
from engine.search.map_search import MapSearchConfig
from engine.search.variation import VariationConfig
from engine.simulation.evaluation import Solution
from engine.tasks import GOAL_REACHING, SQUEEZING
from engine.tasks.sides import sides_of
from tests.support.made_up import MADE_UP, evolved_controller, generation, made_up_evaluation

SIDES = sides_of(GOAL_REACHING)
CELL = (0, 0)


def evaluation(number, left, right, body=0):
    """One of a body with such distances at its left and right, in cm; both repeats alike."""
    morphology = Morphology(1, tuple(1 + (body >> k) % 4 for k in (0, 2, 4)))
    e = made_up_evaluation(
        Solution(number=number, morphology=morphology, controller=evolved_controller(number, 1))
    )
    distances = np.repeat([[left[0]], [left[1]], [right[0]], [right[1]]], 2, axis=1) / 100
    return dataclasses.replace(e, distances=distances)


def drawn(memory, seed=1):
    found = memory.draw(CELL, random.Random(seed))
    return None if found is None else (found.left.number, found.right.number, found.again)


def test_the_better_of_each_side_are_the_specialists():
    memory = SpecialistMemory(SIDES)
    memory.tell(CELL, evaluation(0, (40, 30), (20, 30)))
    assert drawn(memory) is None  # one is best at both sides
    memory.tell(CELL, evaluation(1, (10, 30), (45, 45)))
    assert drawn(memory) == (1, 0, False)
    memory.tell(CELL, evaluation(2, (10, 31), (20, 31)))  # worse at both
    assert drawn(memory) == (1, 0, True)
    memory.tell(CELL, evaluation(3, (44, 44), (1, 1)))
    assert drawn(memory) == (1, 3, False)
    assert memory.draw((5, 5), random.Random(1)) is None


def test_new_pairs_come_first_and_the_most_promising_of_them():
    memory = SpecialistMemory(SIDES)
    for body, gain in enumerate((30, 10, 20)):
        memory.tell(CELL, evaluation(2 * body, (gain, gain), (50, 50), body))
        memory.tell(CELL, evaluation(2 * body + 1, (50, 50), (gain, gain), body))
    assert [drawn(memory) for _ in range(3)] == [(2, 3, False), (4, 5, False), (0, 1, False)]
    again = {drawn(memory, seed) for seed in range(40)}
    assert again == {(2, 3, True), (4, 5, True), (0, 1, True)}


def test_the_least_promising_bodies_are_forgotten():
    memory = SpecialistMemory(SIDES)
    for body in range(BODIES + 4):
        gain = (7 * body) % (BODIES + 4)
        memory.tell(CELL, evaluation(2 * body, (gain, gain), (50, 50), body))
        memory.tell(CELL, evaluation(2 * body + 1, (50, 50), (gain, gain), body))
    assert len(memory.state()["0,0"]) == BODIES


def test_a_memory_goes_on_where_it_was():
    memory, known = SpecialistMemory(SIDES), {}
    rng = random.Random(3)
    for number in range(60):
        e = evaluation(
            number, *[(rng.uniform(1, 50), rng.uniform(1, 50)) for _ in range(2)], body=number % 11
        )
        known[number] = e
        memory.tell((number % 2, 0), e)
        if number % 5 == 0:
            memory.draw((0, 0), rng)
    other = SpecialistMemory(SIDES)
    other.restore(memory.state(), lambda numbers: {n: known[n] for n in numbers})
    assert other.state() == memory.state()
    for seed in range(30):
        cell = (seed % 2, 0)
        assert memory.draw(cell, random.Random(seed)) == other.draw(cell, random.Random(seed))
    assert other.state() == memory.state()


def test_which_tasks_have_sides():
    goal, squeezing = sides_of(GOAL_REACHING), sides_of(SQUEEZING.sensing("relative"))
    assert (goal.bearing, goal.left, goal.right) == (1, (0, 1), (2, 3))
    assert goal.reach == pytest.approx((200.0, math.pi))
    assert (squeezing.bearing, squeezing.left, squeezing.right) == (1, (0,), (1,))
    assert squeezing.reach == pytest.approx((2 / 0.6, 1.0, 2 / 0.1583, 1.0, 1.0))
    # straight ahead is at both sides
    ahead = sides_of(dataclasses.replace(GOAL_REACHING, target_bearings=(0.5, 0.0, -0.5), name="ahead"))
    assert (ahead.left, ahead.right) == ((0, 1), (1, 2))
    assert sides_of(dataclasses.replace(GOAL_REACHING, inputs=("distance", "angle"))) is None
    assert sides_of(dataclasses.replace(GOAL_REACHING, target_bearings=(0.5, 0.1))) is None


@pytest.mark.parametrize("algorithm", ["dm-me", "map-elites"])
def test_a_search_joins_what_is_good_at_either_side(algorithm):
    variation = VariationConfig(switch_weight=1, morphology_weight=0, both_weight=0)
    search = create_algorithm(replaced(MADE_UP, variation=variation, algorithm=algorithm))
    told, joined = [], 0
    for _ in range(8):
        cells = {}
        for e in told:
            cells.setdefault(PUBLISHED_BODIES.cell(e.solution.morphology), []).append(e)
        known = {e.solution.number: e for e in told}
        for e in generation(search):
            s = e.solution
            told.append(e)
            if s.operator == "switch":
                joined += 1
                left = known[s.parent]
                assert s.morphology == left.solution.morphology
                rivals = [o for o in known.values() if o.solution.morphology == s.morphology]
                assert len(rivals) > 1
                best = min(rivals, key=lambda o: SIDES.remaining(o.distances)[0])
                assert left is best
    assert joined > 3


def test_for_a_task_without_sides_controllers_are_mutated_instead():
    variation = VariationConfig(switch_weight=100, morphology_weight=0, both_weight=0)
    config = MapSearchConfig(initial=12, batch_size=8)
    search = DoubleMapMapElites(config, n_inputs=2, budget=60, variation=variation)
    told = [e.solution.operator for _ in range(5) for e in generation(search)]
    assert set(told[12:]) == {"controller"}
    assert "specialists" not in search.state()
