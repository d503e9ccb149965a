"""A toy problem whose optimum is known: who searches by selection finds it, who draws at random does not."""

import numpy as np
import pytest

from engine.config import RunConfig, create_algorithm, replaced
from engine.search.variation import PUBLISHED
from engine.simulation.evaluation import Evaluation

FACE, BIAS = 3, 2.0
LEAST = 0.1
"""The fitness of the optimum in m: all faces 3 and a bias of at least 2."""

MOST = 3000
SEARCHES = {
    "DM-ME": {"evaluations": 1500},
    "DM-ME, per module": {"evaluations": 1500, "stiffness": "per-module"},
    "MAP-Elites in 2-D": {"evaluations": 1500, "algorithm": "map-elites-2d"},
    "deep grid": {"evaluations": MOST, "cell_capacity": 10},
    "MAP-Elites": {"evaluations": MOST, "algorithm": "map-elites"},
    "ViE-NEAT": {"evaluations": 1000, "algorithm": "vie-neat"},
}
"""MAP-Elites searches twice as many cells, and a deep grid keeps the worse."""


def judge(solution):
    """Return the evaluation of a pair: what is wrong with its body and its first output's bias.

    The head goes one of two ways, so that even a 4-D archive fills few enough cells to search in.
    """
    body = solution.morphology
    bias = next(n.bias for n in solution.controller.nodes if n.key == 0)
    wrong = 0.08 * np.mean([face != FACE for face in body.faces]) + 0.02 * max(BIAS - bias, 0.0)
    way = 1.0 + (bias > 0.0)
    path = np.cumsum(np.full((4, 40, 2), (0.01 * way, 0.01 * way**2)), axis=1)
    return Evaluation(
        solution=solution,
        fitness=float(LEAST + wrong),
        distances=np.full((4, 2), LEAST),
        trajectory=np.float32(path),
        head_is_end=True,
    )


def search(config):
    algorithm, everybody = create_algorithm(config), []
    while solutions := algorithm.ask():
        new = [judge(s) for s in solutions]
        algorithm.tell(new)
        everybody += new
    return algorithm, everybody


@pytest.mark.parametrize("name", SEARCHES)
def test_a_known_optimum_is_found(name):
    config = replaced(RunConfig(variation=PUBLISHED), initial=200, seed=1, **SEARCHES[name])
    algorithm, everybody = search(config)
    best = min(everybody, key=lambda e: e.fitness)
    assert best.fitness == LEAST
    assert set(best.solution.morphology.faces) == {FACE}
    # every archive but a deep grid keeps it
    for archive_name, archive in algorithm.archives.items():
        if not (config.map_search.cell_capacity > 1 and archive_name == "controller"):
            assert archive.best() is best


def test_random_solutions_do_not_find_it():
    n = SEARCHES["DM-ME"]["evaluations"]
    _, everybody = search(replaced(RunConfig(), algorithm="random", evaluations=n, initial=200, seed=1))
    assert len(everybody) == n
    assert min(e.fitness for e in everybody) > LEAST
