"""The address on the way from what was asked to what is shown."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from app.gui.actions import Actions
from app.gui.lanes import Service
from app.session import navigation
from app.session.address import Address
from app.session.navigation import Navigation
from app.state import Choice, Selection, ShownRun
from engine.storage.reader import RunReader

PATIENCE = 30.0
BROWSER: Any = type("Browser", (), {"gui": None})()


class Bar:
    """The address bar, at which a test plays the browser."""

    arrived: Any = None
    shown: tuple[Address, ...] = ()

    def __init__(self, _gui: object, arrived: Any) -> None:
        Bar.arrived, Bar.shown = staticmethod(arrived), ()

    def show(self, address: Address) -> None:
        Bar.shown += (address,)


class App:
    """Shows runs and robots, and says so as the app does."""

    def __init__(self, reader: RunReader) -> None:
        self._reader = reader
        self._service = Service()
        self.notices: list[str] = []
        self.n_arrivals = 0
        self.actions = Actions(BROWSER, self._service.lanes())
        self.actions.notify = lambda _title, body, **_: self.notices.append(body)  # type: ignore[method-assign]
        self.run, self.choice, self.generation = ShownRun(), Choice(), 0
        library: Any = type("Library", (), {"runs": lambda _: [reader.path]})()
        self.navigation = Navigation(BROWSER, self.run, self.choice, library, self, self.actions)  # type: ignore[arg-type]

    def open_run(self, path: Path) -> None:
        self.choice.forget()
        self.run.begin(path, self._reader)
        self.navigation.update()

    def open_first(self) -> None:
        self.open_run(self._reader.path)

    def show_generation(self, number: int) -> None:
        self.run.follow_newest, self.generation = False, number
        self.navigation.update()

    def greet(self) -> None:
        if self.choice.selection is None:
            self.choice.greets = True
            self.choice.select(Selection("morphology", (0, 0), self._reader.evaluation(5), 0))

    def holder(self, _archive: str, cell: tuple[int, ...]) -> int | None:
        return 3 if cell == (1, 2) else None

    def choose(self, archive: str, cell: tuple[int, ...], number: int, _trial: object) -> None:
        self.choice.greets = False
        self.choice.select(Selection(archive, cell, self._reader.evaluation(number), 0))
        self.navigation.update()

    def arrived(self, _gui: object) -> None:
        self.n_arrivals += 1

    def wait(self) -> None:
        done = threading.Event()
        self.actions.put("wait", done.set)
        assert done.wait(PATIENCE)

    def close(self) -> None:
        self.navigation.close()
        self._service.close(PATIENCE)


@pytest.fixture
def app(small_reader: RunReader, monkeypatch: pytest.MonkeyPatch) -> Iterator[App]:
    monkeypatch.setattr(navigation, "AddressBar", Bar)
    app = App(small_reader)
    yield app
    app.close()


def test_an_address_keeps_its_robot_until_that_is_shown(app: App, small_reader: RunReader) -> None:
    app.navigation.begin(app, app)  # type: ignore[arg-type]
    Bar.arrived(Address(run="small", archive="morphology", cell=(1, 2), generation=1))
    app.wait()
    assert Bar.shown == (Address(run="small", archive="morphology", cell=(1, 2), robot=3, generation=1),)
    app.open_run(small_reader.path)
    assert Bar.shown[1:] == (Address(run="small"),)


def test_an_address_that_leads_nowhere_becomes_that_of_what_is_shown(app: App) -> None:
    app.navigation.begin(app, app)  # type: ignore[arg-type]
    Bar.arrived(Address(run="small", archive="morphology", cell=(9, 9)))
    app.wait()
    assert "empty" in app.notices[0]
    assert app.n_arrivals == 1  # pinned robots come back wherever one has arrived
    assert Bar.shown == (Address(run="small"),)
    Bar.arrived(Address(run="nowhere"))
    app.wait()
    assert "nowhere" in app.notices[1]
    assert Bar.shown[1:] == (Address(run="small"),)


def test_a_browser_that_speaks_late_is_taken_where_it_wants(
    app: App, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(navigation, "PATIENCE", 0.0)
    held, go = threading.Event(), threading.Event()

    def hold() -> None:
        held.set()
        go.wait(PATIENCE)

    app.actions.put("hold", hold)
    assert held.wait(PATIENCE)
    app.navigation.begin(app, app)  # type: ignore[arg-type]
    Bar.arrived(Address(run="small", robot=4))
    threading.Event().wait(0.2)  # in which patience ends
    go.set()
    app.wait()
    assert Bar.shown[-1].robot == 4


def test_a_program_that_never_speaks_sees_the_first_run(app: App, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(navigation, "PATIENCE", 0.0)
    app.navigation.begin(app, app)  # type: ignore[arg-type]
    deadline = threading.Event()
    while app.run.path is None:
        deadline.wait(0.01)
    app.wait()
    assert Bar.shown == (Address(run="small"),)
    # if it was a slow browser, what it names is shown before what it had side by side
    assert app.n_arrivals == 0
    Bar.arrived(Address(run="small", robot=4))
    app.wait()
    assert app.n_arrivals == 1
