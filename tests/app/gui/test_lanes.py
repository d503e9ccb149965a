from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator

import pytest

from app.gui import lanes
from app.gui.lanes import Crew, Lane, Service

PATIENCE = 30.0
MakeCrew = Callable[..., Crew]


@pytest.fixture
def make_crew() -> Iterator[MakeCrew]:
    crews: list[Crew] = []

    def make(size: int, *, overtime: float = PATIENCE) -> Crew:
        crews.append(Crew(size, overtime=overtime))
        return crews[-1]

    yield make
    for crew in crews:
        crew.close(PATIENCE)


class Held:
    """A job that says when it has begun, and ends when it may."""

    def __init__(self) -> None:
        self.begun, self.go = threading.Event(), threading.Event()

    def __call__(self) -> None:
        self.begun.set()
        assert self.go.wait(PATIENCE)


def hold(lane: Lane) -> Held:
    job = Held()
    lane.put("held", job)
    assert job.begun.wait(PATIENCE)
    return job


def finish(lane: Lane) -> None:
    """Wait until all that a lane holds is done."""
    done = threading.Event()
    lane.put("finish", done.set)
    assert done.wait(PATIENCE)


def test_of_each_kind_the_newest_is_done_after_all_that_came_before_it(make_crew: MakeCrew) -> None:
    lane, done = Lane(make_crew(3)), []
    first = hold(lane)
    for k in range(100):
        lane.put("click", lambda k=k: done.append(("click", k)))  # type: ignore[misc]
        if k == 50:
            lane.put("slide", lambda k=k: done.append(("slide", k)))  # type: ignore[misc]
    first.go.set()
    finish(lane)
    assert done == [("slide", 50), ("click", 99)]


def test_a_browser_that_sends_much_makes_another_wait_for_one_job(make_crew: MakeCrew) -> None:
    crew = make_crew(1)
    busy, other, done = Lane(crew), Lane(crew), []
    first = hold(busy)
    for k in range(100):
        busy.put(k, lambda: done.append("busy"))
    other.put("click", lambda: done.append("other"))
    first.go.set()
    finish(busy)
    assert done.index("other") <= 1
    assert len(done) == 101


def test_one_browser_has_one_thread_and_several_have_several(make_crew: MakeCrew) -> None:
    crew = make_crew(2)
    one, two = Lane(crew), Lane(crew)
    first, second, third = hold(one), Held(), Held()
    one.put("more", second)
    two.put("other", third)
    assert third.begun.wait(PATIENCE)  # beside the first one
    third.go.set()
    finish(two)
    assert not second.begun.is_set()  # although a thread has been idle
    first.go.set()
    second.go.set()
    assert second.begun.wait(PATIENCE)


def test_jobs_that_take_too_long_keep_no_thread_from_the_others(make_crew: MakeCrew) -> None:
    crew = make_crew(2, overtime=0.05)
    stuck = [hold(Lane(crew)) for _ in range(2)]
    for _ in range(3):  # one after the other: each has to find a thread
        finish(Lane(crew))
    for job in stuck:
        job.go.set()


def test_the_end_forgets_what_waits_and_comes_after_what_is_done(make_crew: MakeCrew) -> None:
    lane, done, ended = Lane(make_crew(2)), [], threading.Event()
    first = hold(lane)
    lane.put("click", lambda: done.append("click"))
    lane.close(ended.set)
    lane.put("later", lambda: done.append("later"))
    assert not ended.is_set()
    first.go.set()
    assert ended.wait(PATIENCE)
    assert done == []


def test_a_lane_holds_no_more_than_a_page_has_controls(
    make_crew: MakeCrew, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(lanes, "MAX_JOBS", 3)
    lane, done = Lane(make_crew(1)), []
    first = hold(lane)
    for k in (0, 1, 2, 3, 1):
        lane.put(k, lambda k=k: done.append(k))  # type: ignore[misc]
    first.go.set()
    deadline = time.monotonic() + PATIENCE
    while len(done) < 3:
        assert time.monotonic() < deadline
        time.sleep(0.01)
    finish(lane)
    assert done == [0, 2, 1]


def test_a_job_that_fails_does_not_end_the_thread(
    make_crew: MakeCrew, caplog: pytest.LogCaptureFixture
) -> None:
    lane = Lane(make_crew(1))

    def fail() -> None:
        raise ValueError("a made-up fault")

    lane.put("click", fail)
    finish(lane)
    assert "a made-up fault" in caplog.text


def test_closing_does_what_waits_and_leaves_no_thread() -> None:
    before, done = set(threading.enumerate()), []
    service = Service()
    for _ in range(10):
        browser = service.lanes()
        for lane in (browser.quick, browser.slow, browser.simulating):
            lane.put("click", lambda: done.append(1))
    service.close(PATIENCE)
    assert len(done) == 30
    assert not {t.name for t in threading.enumerate() if t not in before}
