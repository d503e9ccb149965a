"""DM-ME whose controller archive is a deep grid."""

import copy
import json
from collections import Counter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sklearn.decomposition import PCA
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from engine.errors import InvalidData
from engine.search.dm_me import DoubleMapMapElites
from engine.search.map_search import MapSearchConfig
from tests.support.made_up import REFITS, describe, evaluate, examples, generation, held, map_search, sensed

seeds = st.integers(0, 2**32)
PLENTY = 100
"""More than is ever evaluated here."""


def create(seed=0, **changes):
    return map_search(DoubleMapMapElites, seed, **({"cell_capacity": 2} | changes))


def members(algorithm):
    return {
        cell: [e.solution.number for e in there]
        for cell, there in algorithm.archives["controller"].members().items()
    }


def test_a_capacity_of_one_is_plain_dm_me():
    plain, deep = create(cell_capacity=1), create(cell_capacity=2)
    assert "members" not in plain.state()
    for algorithm in (plain, deep):
        for _ in range(3):
            generation(algorithm)
    assert held(plain.archives) != held(deep.archives)
    with pytest.raises(InvalidData, match="cell_capacity must be from 1 to 1000, not 0"):
        create(cell_capacity=0)
    with pytest.raises(InvalidData, match="not 1001"):
        MapSearchConfig(cell_capacity=1001)


@examples(12)
@given(seeds, st.sampled_from([0.0, 0.3]), st.sampled_from([1, 2, PLENTY]))
def test_everybody_sits_in_the_cell_that_describes_it_and_the_best_is_shown(seed, failing, more):
    algorithm, known = create(seed, cell_capacity=1 + more), {}
    for _ in range(9):
        known |= {e.solution.number: e for e in generation(algorithm, salt=seed, failing=failing)}
        if algorithm.state()["descriptor"] is None:
            continue
        everybody = algorithm.archives["controller"].individuals()
        _, inside, cells = describe(algorithm, everybody)
        assert inside.all()
        found = {}
        for e, cell in zip(everybody, cells, strict=True):
            found.setdefault(cell, []).append(e.solution.number)
        assert found == members(algorithm)
        assert all(1 <= len(there) <= 1 + more for there in found.values())
        assert held(algorithm.archives)["controller"] == {
            cell: min((known[n].fitness, n) for n in there)[1] for cell, there in found.items()
        }
        if more == PLENTY:
            # nobody had to go
            assert {n for there in found.values() for n in there} == {
                n for n, e in known.items() if e.fitness is not None
            }


@examples(6)
@given(seeds)
def test_the_projection_is_fitted_to_everybody_in_the_cells(seed):
    algorithm = create(seed, cell_capacity=PLENTY)
    everybody = []
    for number in range(6):
        before = list(everybody)
        everybody += generation(algorithm, salt=seed)
        if number not in REFITS:
            continue
        fitted = before or everybody
        expected = make_pipeline(StandardScaler(), PCA(n_components=2, svd_solver="full"))
        expected.fit(sensed(fitted))
        described, _, _ = describe(algorithm, everybody)
        np.testing.assert_allclose(described, expected.transform(sensed(everybody)), rtol=1e-6, atol=1e-9)


@examples(12)
@given(seeds)
def test_the_morphology_archive_stays_plain_and_never_worsens(seed):
    algorithm, best = create(seed), {}
    for _ in range(9):
        for e in generation(algorithm, salt=seed):
            m = e.solution.morphology
            cell = (m.n_modules - 2, m.stiffness_level - 1)
            best[cell] = min(best.get(cell, (9.0, 0)), (e.fitness, e.solution.number))
        archive = algorithm.archives["morphology"]
        assert {cell: (e.fitness, e.solution.number) for cell, e in archive} == best


def test_parents_come_from_a_cell_and_then_by_fitness():
    algorithm = create(3, initial=30, batch_size=2000, budget=2030, cell_capacity=30)
    generation(algorithm)
    there = algorithm.archives["controller"].members()
    assert max(map(len, there.values())) >= 2
    drawn = Counter(s.parent for s in algorithm.ask() if s.source == "controller")
    n = drawn.total()
    assert n == 1000
    for individuals in there.values():
        whole = sum(1 / e.fitness for e in individuals)
        for e in individuals:
            p = 1 / e.fitness / whole / len(there)
            assert abs(drawn[e.solution.number] - n * p) < 5 * (n * p * (1 - p)) ** 0.5


@examples(12)
@given(seeds, st.integers(0, 6), st.sampled_from([0.0, 0.3]))
def test_a_restored_search_goes_on_identically(seed, n, failing):
    original, known = create(seed), {}
    for _ in range(n):
        known |= {e.solution.number: e for e in generation(original, salt=seed, failing=failing)}
    state = json.loads(json.dumps(original.state(), allow_nan=False))
    contents = {name: dict(archive) for name, archive in original.archives.items()}
    recalled = set()

    def recall(numbers):
        recalled.update(numbers)
        return {k: copy.deepcopy(known[k]) for k in numbers}

    # the seed given here must not matter any more
    restored = create(seed + 1)
    restored.restore(state, copy.deepcopy(contents), recall)
    assert recalled == {k for there in members(original).values() for k in there}
    for _ in range(8 - n):
        assert members(restored) == members(original)
        assert held(restored.archives) == held(original.archives)
        assert restored.state() == original.state()
        one, other = original.ask(), restored.ask()
        assert repr(one) == repr(other)
        original.tell(evaluate(one, seed, failing))
        restored.tell(evaluate(other, seed, failing))
    assert restored.state() == original.state()


def test_the_state_names_who_is_in_which_cell():
    algorithm = create(1, cell_capacity=PLENTY)
    generation(algorithm)
    named = algorithm.state()["members"]
    assert list(named) == ["controller"]
    cells = {tuple(map(int, cell.split(","))): there for cell, there in named["controller"].items()}
    assert cells == members(algorithm)
    assert sorted(n for there in cells.values() for n in there) == list(range(12))
