"""Faults are tried on real processes; what they share is in ``tests/support/faulty.py``."""

import pytest

from tests.support.faulty import python


@pytest.fixture(scope="session")
def made_up(tmp_path_factory):
    """A finished run of made-up figures; not to be changed."""
    path = tmp_path_factory.mktemp("undisturbed") / "made-up.tsmr"
    python("import engine.runs.evolve; engine.runs.evolve.evolve(path, SMALL)", path)
    return path
