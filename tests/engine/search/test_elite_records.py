"""What a search remembers of its elites, worked out by hand and against a search."""

import random
from collections import Counter

import pytest

from engine.config import create_algorithm, replaced
from engine.search.elite_records import Curiosity
from engine.simulation.evaluation import Solution
from tests.support.made_up import MADE_UP, evaluation, generation


def child(number, parent):
    made = evaluation(number).solution
    return Solution(number=number, morphology=made.morphology, controller=made.controller, parent=parent)


# ---- curiosity


def test_scores_rise_by_1_and_fall_by_half_down_to_a_tenth():
    c = Curiosity()
    assert c.score(7) == 1.0
    c.learn([child(10, 7), child(11, 7), child(12, 8), child(13, None)], held={7, 8, 10})
    assert (c.score(7), c.score(8), c.score(10)) == (1.5, 0.5, 1.0)
    c.learn([child(14, 8), child(15, 8)], held={7, 8, 10})
    assert c.score(8) == 0.1
    c.learn([child(16, 8)], held={7, 8, 16})
    assert c.score(8) == 1.1


def test_who_lost_its_place_is_forgotten():
    c = Curiosity()
    c.learn([child(10, 7), child(11, 7)], held={7, 10, 11})
    assert c.state() == {"7": 3.0}
    c.learn([], held={10, 11})
    assert c.state() == {}
    assert c.score(7) == 1.0


def test_parents_are_drawn_in_proportion():
    c = Curiosity()
    c.learn([child(10, 1), child(11, 1), child(12, 2)], held={1, 2, 3, 10, 11})
    elites = [evaluation(number) for number in (1, 2, 3)]
    n = 6000
    drawn = Counter(e.solution.number for e in c.draw(elites, n, random.Random(1)))
    for number, score in ((1, 3.0), (2, 0.5), (3, 1.0)):
        assert drawn[number] / n == pytest.approx(score / 4.5, abs=0.03)
    with pytest.raises(IndexError):
        c.draw([], 1, random.Random(1))


def test_a_search_learns_from_what_its_archives_hold():
    config = replaced(MADE_UP, parents="curiosity")
    algorithm, expected = create_algorithm(config), {}
    for _ in range(9):
        told = generation(algorithm)
        held = {e.solution.number for a in algorithm.archives.values() for e in a.elites()}
        for e in told:
            if (parent := e.solution.parent) is not None:
                step = 1.0 if e.solution.number in held else -0.5
                expected[parent] = max(0.1, expected.get(parent, 1.0) + step)
        expected = {number: score for number, score in expected.items() if number in held}
        assert algorithm.state()["curiosity"] == {str(n): s for n, s in expected.items()}
    assert max(expected.values()) > 1.0 > min(expected.values())
