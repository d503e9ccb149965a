"""Fixtures of the engine's tests; what tests build for themselves is in ``tests/support/made_up.py``."""

import pytest

import engine.runs.evolve
from tests.support.made_up import TINY, MadeUpEvaluator


@pytest.fixture(scope="session")
def simulated_run(tmp_path_factory):
    """A finished run of real simulations on one thread; not to be changed."""
    path = tmp_path_factory.mktemp("simulated") / "undisturbed.tsmr"
    engine.runs.evolve.evolve(path, TINY, n_threads=1)
    return path


@pytest.fixture
def no_physics(monkeypatch):
    """Let runs evaluate with made-up figures instead of simulations."""
    monkeypatch.setattr(engine.runs.evolve, "create_evaluator", lambda *_: MadeUpEvaluator())
