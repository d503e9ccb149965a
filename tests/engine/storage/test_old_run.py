"""Old run files mean what they meant: their search is repeated with the evaluations that they hold."""

import dataclasses
import json
import shutil
from pathlib import Path

import numpy as np
import pytest

import engine.runs.evolve
from engine.storage.reader import RunReader
from tests.support.made_up import held

OLD = Path(__file__).parents[2] / "reference" / "first_body.tsmr"
"""600 evaluations of an earlier version, whose time step the present body would not survive."""


@pytest.fixture
def reader():
    with RunReader(OLD) as r:
        yield r


def assert_alike(found, expected):
    """Compare JSON-ready values; that version drew Gaussian numbers with the C library's last digits."""
    if isinstance(expected, dict):
        assert found.keys() == expected.keys()
        found, expected = list(found.values()), list(expected.values())
    if isinstance(expected, list):
        assert len(found) == len(expected)
        for f, e in zip(found, expected, strict=True):
            assert_alike(f, e)
    elif isinstance(expected, float):
        assert found == pytest.approx(expected, rel=1e-12)
    else:
        assert found == expected


def test_the_same_solutions_are_asked_for_and_placed_where_they_were(reader):
    known = {e.solution.number: e for e in reader.all_evaluations()}
    algorithm = engine.config.create_algorithm(reader.config)
    while solutions := algorithm.ask():
        for s in solutions:
            assert_alike(s.to_json(), known[s.number].solution.to_json())
        evaluations = [dataclasses.replace(known[s.number], solution=s) for s in solutions]
        algorithm.tell(evaluations)
        for name, cells in held(algorithm.archives).items():
            assert cells == reader.placements(name, algorithm.generation - 1)
    assert algorithm.generation == reader.last_generation() + 1
    state, state_then = json.loads(json.dumps(algorithm.state())), reader.algorithm_state()
    fit, fit_then = state.pop("descriptor"), state_then.pop("descriptor")
    assert_alike(state, state_then)
    assert fit.keys() == fit_then.keys()
    # fits of that version kept the last digits, in which kinds of processors differ
    for name, values in fit.items():
        np.testing.assert_allclose(values, fit_then[name], rtol=1e-8, atol=1e-9, err_msg=name)


def test_it_says_nothing_of_newer_options_and_has_their_defaults(reader):
    assert (reader.config.algorithm, reader.config.map_search.cell_capacity, reader.config.stiffness) == (
        "dm-me",
        1,
        "shared",
    )
    last = reader.last_generation()
    for name in ("morphology", "controller"):
        placed = reader.placements(name, last)
        assert reader.members(name) == {cell: [n] for cell, n in placed.items()}


def test_resuming_a_finished_one_changes_nothing(tmp_path):
    path = shutil.copy(OLD, tmp_path / "old.tsmr")
    with RunReader(path) as before:
        hash_before = before.canonical_hash()
    engine.runs.evolve.resume(Path(path))
    with RunReader(path) as after:
        assert after.canonical_hash() == hash_before
