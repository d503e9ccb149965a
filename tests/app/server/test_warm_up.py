"""The simulation is compiled by another process, and whoever wants to simulate meanwhile waits for it."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from numba import njit

from app.server import warm_up
from app.server.warm_up import WarmUp
from engine.simulation.compile_kernel import NOTICE, compile_kernel


class Client:
    """A browser that remembers which notices it shows."""

    def __init__(self) -> None:
        self.notices: list[str] = []

    def add_notification(self, _title: str, body: str, **_: Any) -> SimpleNamespace:
        self.notices.append(body)
        return SimpleNamespace(remove=lambda: self.notices.remove(body))


@pytest.fixture
def compiler(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[], None]:
    """Let this machine have nothing compiled; return what makes the other process end."""
    done = tmp_path / "done"
    program = f"import os, time\nwhile not os.path.exists({str(done)!r}): time.sleep(0.02)"
    monkeypatch.setattr(warm_up, "_COMPILE", program)
    monkeypatch.setattr(warm_up, "is_compiled", lambda: False)
    return done.touch


@pytest.fixture
def loaded(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """When the compiled code was loaded."""
    times: list[float] = []
    monkeypatch.setattr(warm_up, "compile_kernel", lambda: times.append(compile_kernel()))
    return times


@pytest.fixture
def started(compiler: Callable[[], None], loaded: list[float]) -> Iterator[WarmUp]:
    ready = WarmUp()
    ready.start()
    yield ready
    ready.close()
    ready.wait()


def test_browsers_are_told_and_simulations_wait(
    started: WarmUp, compiler: Callable[[], None], loaded: list[float]
) -> None:
    early, late = Client(), Client()
    started.tell(early)  # type: ignore[arg-type]
    deadline = time.monotonic() + 30.0
    while started._compiler is None:
        assert time.monotonic() < deadline
        time.sleep(0.01)
    assert [NOTICE in text for text in early.notices] == [True]
    simulated: list[int] = []
    thread = threading.Thread(target=lambda: simulated.append(njit(lambda x: x + 1)(1)))
    thread.start()
    thread.join(0.3)
    assert simulated == []
    assert loaded == []
    compiler()
    started.wait()
    thread.join()
    assert simulated == [2]
    assert len(loaded) == 1
    assert early.notices == []
    started.tell(late)  # type: ignore[arg-type]
    assert late.notices == []


def test_who_comes_before_it_is_known_is_told_as_soon_as_it_is(
    compiler: Callable[[], None], loaded: list[float]
) -> None:
    ready, client = WarmUp(), Client()
    ready.tell(client)  # type: ignore[arg-type]
    assert client.notices == []
    ready.start()
    while ready._compiler is None:
        time.sleep(0.01)
    assert [NOTICE in text for text in client.notices] == [True]
    compiler()
    ready.wait()
    assert client.notices == []
    assert len(loaded) == 1


def test_the_other_process_ends_with_the_app(started: WarmUp, loaded: list[float]) -> None:
    while started._compiler is None:
        time.sleep(0.01)
    started.close()
    started.wait()
    assert started._compiler.returncode not in (None, 0)
    assert loaded == []


def test_what_fails_there_is_compiled_here(
    started: WarmUp, compiler: Callable[[], None], loaded: list[float]
) -> None:
    while started._compiler is None:
        time.sleep(0.01)
    started._compiler.kill()
    started.wait()
    assert len(loaded) == 1


def test_without_a_folder_to_keep_it_no_other_process_compiles(
    compiler: Callable[[], None],
    loaded: list[float],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(warm_up, "kept_in", lambda: None)
    ready = WarmUp()
    ready.start()
    ready.wait()
    assert ready._compiler is None
    assert len(loaded) == 1
    assert capsys.readouterr().out == f"{NOTICE}\n"


def test_where_it_is_compiled_it_is_only_loaded(
    loaded: list[float], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(warm_up, "is_compiled", lambda: True)
    ready, client = WarmUp(), Client()
    ready.tell(client)  # type: ignore[arg-type]
    ready.start()
    ready.wait()
    assert client.notices == []
    assert len(loaded) == 1
    assert capsys.readouterr().out == ""
