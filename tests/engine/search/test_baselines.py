"""The searches that DM-ME is compared with draw their parents, if any, where they say."""

import collections

import pytest

from engine.config import create_algorithm, replaced
from tests.support.made_up import MADE_UP, made_up_evaluation


def generations(algorithm_name):
    """Return a run's algorithm and, after generation 0, the solutions of every generation."""
    algorithm = create_algorithm(replaced(MADE_UP, algorithm=algorithm_name))
    asked = []
    while solutions := algorithm.ask():
        asked.append(solutions)
        algorithm.tell([made_up_evaluation(s) for s in solutions])
    return algorithm, asked[1:]


@pytest.mark.parametrize("name", ["random", "map-elites-2d"])
def test_both_maps_are_filled(name):
    algorithm, _ = generations(name)
    assert set(algorithm.archives) == {"morphology", "controller"}
    assert all(len(archive) > 3 for archive in algorithm.archives.values())


def test_random_search_has_no_parents():
    _, asked = generations("random")
    assert len(asked) > 3
    assert all(s.operator == "random" and s.parent is None for solutions in asked for s in solutions)


def test_map_elites_in_2d_mutates_elites_of_bodies_only():
    _, asked = generations("map-elites-2d")
    sources = collections.Counter(s.source for solutions in asked for s in solutions)
    assert sources == {"morphology": sum(map(len, asked))}
