from __future__ import annotations

import threading

from hypothesis import given
from hypothesis import strategies as st

from app.maps import generation_player
from app.maps.generation_player import FASTEST, LONGEST, SLOWEST, GenerationPlayer, pace


class Screen:
    """Keeps what is shown; can refuse after some generations."""

    def __init__(self, enough: int = 10**6) -> None:
        self.shown: list[int] = []
        self.playing: list[bool] = []
        self.ended = threading.Event()
        self.enough = enough

    def show(self, number: int) -> bool:
        self.shown.append(number)
        return len(self.shown) < self.enough

    def changed(self, playing: bool) -> None:
        self.playing.append(playing)
        if not playing:
            self.ended.set()


@given(st.integers(0, 100_000))
def test_a_run_of_any_length_plays_at_a_pleasant_pace(n: int) -> None:
    seconds, step = pace(n)
    assert FASTEST <= seconds <= SLOWEST
    assert step >= 1
    assert seconds * n / step <= LONGEST * 1.001


def test_it_goes_on_to_the_end_though_that_moves_and_begins_anew_there(monkeypatch) -> None:
    monkeypatch.setattr(generation_player, "FASTEST", 0.001)
    monkeypatch.setattr(generation_player, "SLOWEST", 0.001)
    screen, last = Screen(), iter([4, 4, 4, 4, 4, 5, 5, 5, 5, 5, 5, 5, 5, 5, 5, 5, 5])
    player = GenerationPlayer(screen.show, screen.changed)
    player.play(2, lambda: next(last))
    assert screen.ended.wait(10)
    assert screen.shown == [2, 3, 4, 5]
    assert screen.playing == [True, False]
    screen.ended.clear()
    player.play(2, lambda: 2)
    assert screen.ended.wait(10)
    assert screen.shown[4:] == [0, 1, 2]
    assert not player.playing


def test_it_stops_at_once_and_when_nobody_looks_any_more() -> None:
    screen = Screen()
    player = GenerationPlayer(screen.show, screen.changed)
    player.play(0, lambda: 9)
    player.play(0, lambda: 9)  # it plays already
    player.stop()
    assert not player.playing
    assert screen.playing == [True, False]
    assert screen.shown in ([], [0])
    screen = Screen(enough=1)
    GenerationPlayer(screen.show, screen.changed).play(0, lambda: 9)
    assert screen.ended.wait(10)
    assert screen.shown == [0]


def test_a_run_of_one_generation_does_not_play() -> None:
    screen = Screen()
    GenerationPlayer(screen.show, screen.changed).play(0, lambda: 0)
    assert screen.playing == []
