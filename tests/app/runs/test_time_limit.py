from __future__ import annotations

import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from app.runs.time_limit import TimeLimit

HERE, THERE = Path("/here"), Path("/there")


@pytest.fixture
def go() -> Iterator[threading.Event]:
    go = threading.Event()
    yield go
    go.set()


def fail() -> None:
    raise KeyError("a made-up fault")


def test_what_ends_in_time_returns_or_raises_what_it_does() -> None:
    limit = TimeLimit(30.0)
    assert limit.call(HERE, "a", lambda: 7) == 7
    with pytest.raises(KeyError, match="a made-up fault"):
        limit.call(HERE, "a", fail)
    assert limit.call(HERE, "a", lambda: 8) == 8


def test_what_does_not_end_is_waited_for_once_and_not_begun_again(go: threading.Event) -> None:
    limit, begun = TimeLimit(0.05), []

    def stuck() -> None:
        begun.append(1)
        go.wait(30)

    with pytest.raises(TimeoutError):
        limit.call(HERE, "a", stuck)
    for kind in ("a", "b", "c"):  # nor is anything else tried in that folder
        with pytest.raises(TimeoutError):
            limit.call(HERE, kind, stuck)
    assert begun == [1]
    slow = TimeLimit(30.0)
    assert slow.call(THERE, "a", lambda: 1) == 1
    go.set()
    for _ in range(3000):
        try:
            assert limit.call(HERE, "b", lambda: 2) == 2
            break
        except TimeoutError:  # until the first one's end is noticed
            threading.Event().wait(0.01)
    else:
        pytest.fail("the folder is given up although it answers")


def test_who_asks_for_the_same_meanwhile_gets_the_same(go: threading.Event) -> None:
    limit, found = TimeLimit(30.0), []

    def look() -> object:
        go.wait(30)
        return object()

    threads = [threading.Thread(target=lambda: found.append(limit.call(HERE, "a", look))) for _ in range(3)]
    for thread in threads:
        thread.start()
    threading.Event().wait(0.1)
    go.set()
    for thread in threads:
        thread.join(30)
    assert len(found) == 3
    assert len(set(map(id, found))) < 3
