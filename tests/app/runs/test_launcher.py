from __future__ import annotations

import dataclasses
import os
import signal
import time
import typing
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.cli import main
from app.cli.evolve import Evolve
from app.runs import launcher
from app.runs.launcher import NewRun, choices, flags, last_words, log_path, pause, resume, start
from app.runs.library import run_state
from engine.config import PRESETS, AlgorithmName, RunConfig, preset, replaced
from engine.errors import InvalidData, RunFileError
from engine.fabrication.as_built import search_physics
from engine.fabrication.materials import load_materials
from engine.runs.breeding import Breeding, breeding_config
from engine.runs.described import describe
from engine.storage.lock import holder_of
from engine.storage.reader import RunReader
from engine.storage.writer import is_being_written
from engine.tasks import BUILT_IN

NEW = NewRun(
    name="new",
    preset="smoke",
    config=replaced(preset("smoke"), evaluations=4, initial=4),
    workers=1,
)
LONG = dataclasses.replace(
    NEW,
    config=replaced(preset("smoke"), evaluations=400, initial=4, batch_size=2, refit_generations=(0,)),
)


@pytest.fixture
def workplace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).resolve().parents[3]))
    return tmp_path


def test_the_form_offers_what_the_configuration_allows() -> None:
    assert choices("algorithm") == typing.get_args(AlgorithmName)
    assert choices("task") == tuple(BUILT_IN)


@pytest.mark.parametrize(
    ("change", "what"),
    [
        ({"preset": "huge"}, "huge"),
        ({"preset": "--help"}, "--help"),
        ({"workers": 0}, "workers"),
        ({"workers": 10**6}, "workers"),
        ({"name": "../up"}, "letters, digits"),
        ({"name": "-v"}, "letters, digits"),
        ({"name": ""}, "letters, digits"),
    ],
)
def test_what_is_not_on_offer_starts_nothing(
    change: dict[str, Any], what: str, workplace: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    started: list[object] = []
    monkeypatch.setattr(launcher.subprocess, "Popen", lambda *a, **_: started.append(a))
    with pytest.raises(InvalidData, match=what):
        start(dataclasses.replace(NEW, **change))
    assert not started
    assert list(workplace.iterdir()) == []


def test_a_task_of_the_users_is_started_from_the_command_line_only(
    workplace: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = Path(__file__).resolve().parents[3] / "docs" / "tasks" / "climb_step.py"
    monkeypatch.setenv("TENSATLAS_TASKS", str(file))
    config = dataclasses.replace(NEW.config, task="climb-step")
    with pytest.raises(InvalidData, match="climb-step"):
        start(dataclasses.replace(NEW, config=config))
    assert list(workplace.iterdir()) == []


configurations = st.builds(
    lambda base, **change: replaced(
        base,
        **{k: v for k, v in change.items() if k not in ("friction", "noise", "repeats", "threshold")},
        physics=dataclasses.replace(base.physics, friction=change["friction"], servo_noise=change["noise"]),
        trials=dataclasses.replace(base.trials, repeats=change["repeats"]),
        vie_neat=dataclasses.replace(base.vie_neat, compatibility_threshold=change["threshold"]),
    ),
    st.sampled_from(list(PRESETS.values())),
    task=st.sampled_from(list(BUILT_IN)),
    seed=st.integers(0, 2**32 - 1),
    batch_size=st.integers(1, 25).map(lambda n: 2 * n),
    refit_generations=st.lists(st.integers(1, 9), unique=True, max_size=3).map(lambda v: (0, *sorted(v))),
    sensory=st.sampled_from(["positions", "displacements"]),
    friction=st.floats(1e-3, 2.0),
    noise=st.floats(0.0, 1e-3),
    repeats=st.integers(1, 4),
    threshold=st.floats(0.5, 9.0),
)


@pytest.fixture(scope="module")
def described(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("described") / "x.toml"


@settings(deadline=None, max_examples=25)
@given(configurations, st.sampled_from(list(PRESETS)))
def test_the_command_line_is_read_as_the_configuration_that_it_was_made_of(
    described: Path, config: RunConfig, name: str
) -> None:
    described.write_text(describe(config), encoding="utf-8")
    arguments = flags(NewRun(name="x", preset=name, config=config, workers=3), described)
    parsed = main._parse(["evolve", "x.tsmr", *arguments])
    assert isinstance(parsed, Evolve)
    assert parsed.config == config
    assert parsed.computing.workers == 3


def test_a_run_from_given_robots_names_them_on_the_command_line(described: Path) -> None:
    given = ("/a b/mine.tsmr#63,7", "/a b/other.tsmr#1")
    config = breeding_config(Breeding(strength=0.3, hold="bodies", seed=4), [PRESETS["paper"]] * 2)
    physics = search_physics(config.physics, load_materials("latex-sheet"), spread=True)
    config = dataclasses.replace(config, physics=physics)
    described.write_text(describe(config), encoding="utf-8")
    new = dataclasses.replace(NEW, config=config, given=given, in_one_process=True)
    parsed = main._parse(["evolve", "x.tsmr", *flags(new, described)])
    assert isinstance(parsed, Evolve)
    assert parsed.computing.pool == "threads"
    assert parsed.given == given
    assert parsed.config == config


def test_a_run_pauses_goes_on_and_is_found_after_it_was_killed(workplace: Path) -> None:
    path = start(dataclasses.replace(LONG, name="long.tsmr"))
    try:
        assert path == workplace / "runs" / "long.tsmr"
        assert not path.with_suffix(".toml").exists()
        assert is_being_written(path)
        with pytest.raises(RunFileError, match="exists already"):
            start(dataclasses.replace(LONG, name="long"))
        with pytest.raises(RunFileError, match="running already"):
            resume(path, workers=1)
        _wait(lambda: _n_evaluations(path) >= 4)
        pause(path)
        _wait(lambda: not is_being_written(path))
        n = _n_evaluations(path)
        assert run_state(path, live=False, complete=False) == "paused"
        assert last_words(path) is None
        with pytest.raises(RunFileError, match="not running"):
            pause(path)

        resume(path, workers=1)
        assert run_state(path, live=False, complete=False) == "stopped"
        _wait(lambda: _n_evaluations(path) > n)
        os.kill(_writer(path), signal.SIGKILL)
        _wait(lambda: not is_being_written(path))
        words = last_words(path)
        assert words is not None
        assert any("evaluations" in line or "Stopped" in line for line in words)
    finally:
        if is_being_written(path):
            os.kill(_writer(path), signal.SIGKILL)


def test_a_run_that_cannot_start_says_why_and_leaves_nothing(workplace: Path) -> None:
    physics = dataclasses.replace(NEW.config.physics, timestep=0.02)
    config = dataclasses.replace(NEW.config, physics=physics)
    with pytest.raises(RunFileError, match="time"):
        start(dataclasses.replace(NEW, config=config))
    assert not log_path(workplace / "runs" / "new.tsmr").exists()
    assert not (workplace / "runs" / "new.tsmr").exists()


def _writer(path: Path) -> int:
    holder = holder_of(path)
    assert holder is not None
    return holder.pid


def _n_evaluations(path: Path) -> int:
    with RunReader(path) as reader:
        return reader.n_evaluations()


def _wait(condition: Callable[[], bool], seconds: float = 60.0) -> None:
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, "waited in vain"
        time.sleep(0.05)
