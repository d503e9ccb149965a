"""Fixtures that several folders of tests share."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from engine.config import RunConfig, preset, replaced
from engine.runs import evolve as run
from engine.simulation.trials import TrialConfig
from engine.storage.reader import RunReader
from tests.support.grid_run import write_grid_run

_MEMORY = Path("/dev/shm")
_ENOUGH = 2 * 2**30
_BROWSER = "tests/browser/"
_LONG = (_BROWSER, "tests/benchmarks/", "tests/app/cli/test_campaign.py", "tests/faults/", "tests/app/cli/")
"""Where the tests are that take longest."""


def pytest_configure() -> None:
    """Let tests have their files in memory where there is enough.

    A run is on the disk after every generation, whatever happens to the computer; waiting for that takes half
    of the time of a test that makes one, and no test can see it.
    """
    if _MEMORY.is_dir() and os.access(_MEMORY, os.W_OK) and shutil.disk_usage(_MEMORY).free > _ENOUGH:
        os.environ.setdefault("PYTEST_DEBUG_TEMPROOT", str(_MEMORY))


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Let one of several processes run all browser tests, one after the other, the others file by file.

    A Chromium that draws on the processor keeps a core busy and more: two of them would make each other late.
    """
    from xdist.scheduler import LoadFileScheduling

    class OneBrowser(LoadFileScheduling):
        def _split_scope(self, nodeid: str) -> str:
            return _BROWSER if nodeid.startswith(_BROWSER) else super()._split_scope(nodeid)

    return OneBrowser(config, log) if config.getoption("dist") == "loadfile" else None


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with what takes longest, so that no process waits for it at the end."""

    def rank(item: pytest.Item) -> int:
        return next((k for k, place in enumerate(_LONG) if item.nodeid.startswith(place)), len(_LONG))

    items.sort(key=rank)


@pytest.fixture(scope="session")
def small_config() -> RunConfig:
    """A real run in miniature: 18 robots, four targets, trials of two seconds."""
    return replaced(
        preset("smoke"),
        evaluations=18,
        initial=10,
        batch_size=4,
        refit_generations=(0, 1),
        seed=7,
        trials=TrialConfig(repeats=1, settle_time=0.4, open_loop_time=0.4, trial_time=2.0),
    )


@pytest.fixture(scope="session")
def small_run(small_config: RunConfig, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished run file; do not write to it."""
    path = tmp_path_factory.mktemp("small_run") / "small.tsmr"
    run.evolve(path, small_config, n_threads=2)
    return path


@pytest.fixture
def small_reader(small_run: Path) -> Iterator[RunReader]:
    with RunReader(small_run) as reader:
        yield reader


@pytest.fixture(scope="session")
def grid_run(small_run: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The small run's robots in a 4-D archive, made with an older MuJoCo; do not write to it."""
    path = tmp_path_factory.mktemp("grid_run") / "grid.tsmr"
    write_grid_run(small_run, path)
    return path


@pytest.fixture
def grid_reader(grid_run: Path) -> Iterator[RunReader]:
    with RunReader(grid_run) as reader:
        yield reader
