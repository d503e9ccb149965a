"""Which robot greets, and how it is shown."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from app.session import greeting
from app.session.greeting import LASTS, LINE, SPEED, USUAL_SPEED, Greeting, best_target
from engine.storage.reader import RunReader


class Stage:
    """Overlay, scene and transport in one, that keep what they are told."""

    circles = False

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.views: list[str] = []
        self.played: list[tuple[str, bool]] = []

    def say(self, text: str) -> None:
        self.lines.append(text)

    def begin_with(self, view: str) -> None:
        self.views.append(view)

    def play_at(self, speed: str, *, loop: bool = False) -> None:
        self.played.append((speed, loop))


@pytest.fixture
def stage() -> Stage:
    return Stage()


@pytest.fixture
def greets(stage: Stage) -> Greeting:
    told: Any = stage
    return Greeting(told, told, told)


def test_a_greeting_is_close_and_fast_until_something_is_chosen(stage: Stage, greets: Greeting) -> None:
    greets.begin(20000)
    assert stage.lines == [LINE.format(20000)] == ["Evolved in 20,000 trials. Click any square."]
    assert (stage.views, stage.played, stage.circles) == (["close"], [(SPEED, True)], True)
    greets.hold_still()
    assert not stage.circles
    greets.end()
    greets.end()
    assert (stage.lines[1:], stage.views[1:], stage.played[1:]) == ([""], ["frame"], [(USUAL_SPEED, False)])


def test_nothing_moves_by_itself_for_those_who_do_not_want_it(stage: Stage, greets: Greeting) -> None:
    greets.be_calm()
    greets.begin(5)
    assert (stage.played, stage.circles) == ([(SPEED, False)], False)


def test_a_page_that_is_left_open_comes_to_rest(
    stage: Stage, greets: Greeting, monkeypatch: pytest.MonkeyPatch
) -> None:
    now = [0.0]
    monkeypatch.setattr(greeting.time, "monotonic", lambda: now[0])
    greets.begin(5)
    now[0] = LASTS - 1.0
    greets.tick()
    assert (stage.circles, stage.played[-1]) == (True, (SPEED, True))
    now[0] = LASTS + 1.0
    greets.tick()
    assert (stage.circles, stage.played[-1]) == (False, (SPEED, False))


def test_the_best_target_is_that_with_the_least_mean_distance(small_reader: RunReader) -> None:
    evaluation = small_reader.evaluation(0)
    distances = np.array([[0.3, 0.5], [np.nan, 0.1], [0.1, 0.6], [0.35, 0.36]])
    assert best_target(dataclasses.replace(evaluation, distances=distances)) == 2
