"""What was compiled is found again unless its sources changed; without a folder it is compiled anew."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import engine.simulation.kernel
from engine.simulation.kernel.lanes import compiling

SOURCES = Path(engine.simulation.kernel.__file__).parent


@pytest.fixture
def copied(tmp_path):
    """A copy of the kernel's sources, as if somebody worked on them."""
    return Path(shutil.copytree(SOURCES, tmp_path / "kernel", ignore=shutil.ignore_patterns("__pycache__")))


@pytest.fixture
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv(compiling.CACHE_VARIABLE, str(tmp_path / "cache"))
    return tmp_path / "cache"


def test_a_change_in_an_imported_module_makes_a_folder_of_its_own(copied, cache):
    step = copied / "step.py"
    before = compiling.cache_folder(step, copied)
    assert before.parent == cache
    assert compiling.cache_folder(step, copied) == before
    with (copied / "physics" / "friction.py").open("a") as f:
        f.write("\n# changed\n")
    assert compiling.cache_folder(step, copied) != before


def test_a_change_elsewhere_does_not(copied, cache):
    before = compiling.cache_folder(copied / "step.py", copied)
    with (copied / "batch.py").open("a") as f:
        f.write("\n# changed\n")
    assert compiling.cache_folder(copied / "step.py", copied) == before


def test_a_folder_that_cannot_be_written_is_none(tmp_path, monkeypatch):
    file = tmp_path / "file"
    file.touch()
    monkeypatch.setenv(compiling.CACHE_VARIABLE, str(file / "below"))
    assert compiling.cache_folder(SOURCES / "step.py") is None
    assert compiling.entry_point(lambda x: x + 1)(2) == 3


@pytest.mark.parametrize("module", ["engine", "engine.runs.evolve", "app.cli.main"])
def test_numba_is_not_imported_before_it_is_needed(module):
    code = f"import sys, {module}; sys.exit('numba' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
