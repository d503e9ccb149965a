"""Faults are tried on real processes; what they share is in ``faulty.py`` beside it."""

import sys
from pathlib import Path

import pytest

# evaluations that cost nothing
sys.path.append(str(Path(__file__).resolve().parents[1] / "engine"))

from faulty import python


@pytest.fixture(scope="session")
def made_up(tmp_path_factory):
    """A finished run of made-up figures; not to be changed."""
    path = tmp_path_factory.mktemp("undisturbed") / "made-up.tsmr"
    python("import engine.runs.evolve; engine.runs.evolve.evolve(path, SMALL)", path)
    return path
