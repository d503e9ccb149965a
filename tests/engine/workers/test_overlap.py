"""Generations that overlap: begun before the one in front of them has been told."""

import dataclasses
import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

import engine.runs.evolve
from engine.config import RunConfig, create_algorithm
from engine.errors import InvalidData
from engine.storage.reader import RunReader
from tests.support.made_up import MADE_UP, examples, held, made_up_evaluation

OVERLAPPING = dataclasses.replace(MADE_UP, overlap=3)

SIZES = MADE_UP.map_search


class Shuffled:
    """A stream that finishes solutions of all generations under way in any order."""

    def __init__(self, seed):
        self._rng = random.Random(seed)
        self._waiting = []
        self.most = 0

    def submit(self, solutions):
        self._waiting += solutions
        self.most = max(self.most, len(self._waiting))

    def collect(self):
        self._rng.shuffle(self._waiting)
        n = self._rng.randint(1, 3)
        done, self._waiting = self._waiting[:n], self._waiting[n:]
        return [made_up_evaluation(s, failing=0.1) for s in done]

    def origin(self, _number):
        return None


def evolve(monkeypatch, path, config, seed, stop_at=None):
    """Work on a run, begun or not; return its hash and the most solutions that were under way."""
    queue = Shuffled(seed)
    monkeypatch.setattr(engine.runs.evolve, "create_queue", lambda *_, **__: queue)

    def observer(progress):
        if stop_at is not None and progress.n_new >= stop_at:
            raise KeyboardInterrupt

    try:
        if path.exists():
            engine.runs.evolve.resume(path, observer=observer)
        else:
            engine.runs.evolve.evolve(path, config, observer=observer)
    except KeyboardInterrupt:
        assert stop_at is not None
    with RunReader(path) as reader:
        return reader.canonical_hash(), queue.most


@pytest.mark.parametrize("algorithm", ["dm-me", "map-elites"])
def test_the_order_of_finishing_does_not_matter(monkeypatch, tmp_path, algorithm):
    config = dataclasses.replace(OVERLAPPING, algorithm=algorithm)
    found = {evolve(monkeypatch, tmp_path / f"{seed}.tsmr", config, seed)[0] for seed in range(4)}
    assert len(found) == 1


def test_generations_are_under_way_together_but_the_first(monkeypatch, tmp_path):
    _, most = evolve(monkeypatch, tmp_path / "run.tsmr", OVERLAPPING, 0)
    assert SIZES.initial < most <= 4 * SIZES.batch_size
    with RunReader(tmp_path / "run.tsmr") as reader:
        counts = [g.n_evaluations for g in reader.generations()]
    expected = [
        *range(SIZES.initial, MADE_UP.evaluations, SIZES.batch_size),
        MADE_UP.evaluations,
    ]
    assert counts == expected


def test_none_is_the_published_algorithm(monkeypatch, tmp_path):
    with_overlap, _ = evolve(monkeypatch, tmp_path / "a.tsmr", OVERLAPPING, 0)
    without, most = evolve(monkeypatch, tmp_path / "b.tsmr", MADE_UP, 0)
    assert with_overlap != without
    assert most == SIZES.initial


@examples(8)
@given(st.integers(0, 2**32 - 1), st.lists(st.integers(1, 30), min_size=1, max_size=3))
def test_interrupted_anywhere_it_ends_like_an_undisturbed_one(tmp_path_factory, seed, stops):
    folder = tmp_path_factory.mktemp("overlap")
    config = dataclasses.replace(OVERLAPPING, seed=seed)
    with pytest.MonkeyPatch.context() as monkeypatch:
        expected, _ = evolve(monkeypatch, folder / "undisturbed.tsmr", config, 0)
        for k, stop in enumerate(stops):
            evolve(monkeypatch, folder / "run.tsmr", config, k + 1, stop)
        assert evolve(monkeypatch, folder / "run.tsmr", config, 99)[0] == expected


def test_parents_are_as_many_generations_old():
    algorithm = create_algorithm(dataclasses.replace(OVERLAPPING, overlap=2))
    algorithm.tell([made_up_evaluation(s) for s in algorithm.ask()])
    elites = {e for cells in held(algorithm.archives).values() for e in cells.values()}
    asked = [algorithm.ask() for _ in range(3)]
    assert {s.parent for generation in asked for s in generation} <= elites
    with pytest.raises(ValueError, match="tell"):
        algorithm.ask()
    assert [list(g) for g in algorithm.outstanding] == asked
    with pytest.raises(ValueError, match="exactly"):
        algorithm.tell([made_up_evaluation(s) for s in asked[1]])
    algorithm.tell([made_up_evaluation(s) for s in asked[0]])
    assert len(algorithm.ask()) == SIZES.batch_size


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"overlap": -1}, "overlap must be"),
        ({"overlap": 201}, "overlap must be"),
        ({"overlap": 1, "algorithm": "vie-neat"}, "vie-neat"),
    ],
)
def test_what_cannot_overlap_is_refused(changes, message):
    with pytest.raises(InvalidData, match=message):
        dataclasses.replace(RunConfig(), **changes)
