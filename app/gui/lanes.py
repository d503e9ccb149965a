"""Who is served when: every browser has a lane, and a small crew of threads serves the lanes in turn.

viser would run whatever any browser sets off on one pool of threads: a browser that sends a thousand clicks
occupies all of them. A lane holds one job of a kind at most, the newest, and one of its jobs is done at a
time; then the other lanes have their turn. However much a browser sends, the others wait for one job of it.
"""

from __future__ import annotations

import dataclasses
import logging
import os
import threading
import time
from collections import deque
from collections.abc import Callable, Hashable
from typing import Final

log = logging.getLogger(__name__)

Job = Callable[[], None]
CREW: Final = max(2, os.cpu_count() or 1)
"""Threads that serve; more would only take Python's lock from one another."""
OVERTIME: Final = 2.0
"""Seconds after which a job no longer keeps the others waiting: one more thread serves them."""
MAX_THREADS: Final = 64
"""Threads in all, with those whose jobs do not end."""
MAX_JOBS: Final = 256
"""Jobs that may wait in a lane; a page has fewer controls."""


class Crew:
    """Threads that serve the lanes of all browsers.

    Args:
        size: how many lanes are served at once.
        overtime: as ``OVERTIME``, in s.
    """

    def __init__(self, size: int = CREW, *, overtime: float = OVERTIME) -> None:
        self._size, self._overtime = size, overtime
        self._news = threading.Condition()
        self._waiting: deque[Lane] = deque()
        self._began: dict[int, float] = {}
        """When the threads at work have begun what they do, by their idents."""
        self._n_threads = 0
        self._closed = False
        self._watcher = threading.Thread(target=self._watch, name="lanes", daemon=True)
        self._watcher.start()

    def serve(self, lane: Lane) -> None:
        """Do one job of a lane when it is its turn."""
        with self._news:
            self._waiting.append(lane)
            self._man()
            self._news.notify_all()

    def close(self, patience: float) -> None:
        """Do what is waiting and end all threads.

        Args:
            patience: seconds to wait for that.
        """
        with self._news:
            self._closed = True
            self._news.notify_all()
            self._news.wait_for(lambda: not self._n_threads, patience)
        self._watcher.join(patience)

    def _man(self) -> None:
        """Start a thread if one is missing; the mutex is held."""
        late = time.monotonic() - self._overtime
        n_late = sum(began < late for began in self._began.values())
        n_idle = self._n_threads - len(self._began)
        if self._waiting and not n_idle and self._n_threads < min(self._size + n_late, MAX_THREADS):
            self._n_threads += 1
            threading.Thread(target=self._work, name="lane", daemon=True).start()

    def _watch(self) -> None:
        """Find a thread for lanes that wait while all others are late."""
        with self._news:
            while not self._closed:
                self._news.wait_for(lambda: self._waiting or self._closed)
                self._man()
                self._news.wait_for(lambda: self._closed, self._overtime / 4)

    def _work(self) -> None:
        me = threading.get_ident()
        while True:
            with self._news:
                self._news.wait_for(lambda: self._waiting or self._closed)
                if not self._waiting or self._n_threads - len(self._began) > self._size:
                    self._n_threads -= 1
                    self._news.notify_all()
                    return
                lane = self._waiting.popleft()
                self._began[me] = time.monotonic()
            goes_on = lane.step()
            with self._news:
                del self._began[me]
                if goes_on:
                    self._waiting.append(lane)


class Lane:
    """What one browser has set off and is not done yet.

    Args:
        crew: that serves it.
    """

    def __init__(self, crew: Crew) -> None:
        self._crew = crew
        self._mutex = threading.Lock()
        self._jobs: dict[Hashable, Job] = {}
        self._served = False
        """Whether a job is being done or its turn will come."""
        self._closed = False

    def put(self, kind: Hashable, job: Job) -> None:
        """Have a job done after those that wait already, in place of one of its kind among them."""
        with self._mutex:
            if self._closed:
                return
            self._jobs.pop(kind, None)
            if len(self._jobs) < MAX_JOBS:
                self._jobs[kind] = job
            self._be_served()

    def close(self, last: Job) -> None:
        """Forget all that waits, take nothing more, and do one last job once the one at work has ended."""
        with self._mutex:
            if self._closed:
                return
            self._closed = True
            self._jobs = {None: last}
            self._be_served()

    def step(self) -> bool:
        """Do the next job; return whether another one waits. Only for the crew."""
        with self._mutex:
            job = self._jobs.pop(next(iter(self._jobs)))
        try:
            job()
        except Exception:  # a fault of ours must not end the thread
            log.exception("what a browser set off failed")
        with self._mutex:
            self._served = bool(self._jobs)
            return self._served

    def _be_served(self) -> None:
        if not self._served:
            self._served = True
            self._crew.serve(self)


@dataclasses.dataclass(frozen=True, slots=True)
class Lanes:
    """The lanes of one browser.

    Attributes:
        quick: for what a user waits for.
        slow: for what takes long and may not keep the browser's clicks waiting.
        simulating: for replays.
    """

    quick: Lane
    slow: Lane
    simulating: Lane

    def close(self, last: Job) -> None:
        """Forget all that waits, and do one last job once the quick one at work has ended."""
        self.slow.close(lambda: None)
        self.simulating.close(lambda: None)
        self.quick.close(last)


class Service:
    """The crews of a server."""

    def __init__(self) -> None:
        self._crews = (Crew(), Crew(), Crew())

    def lanes(self) -> Lanes:
        """Return the lanes of one more browser."""
        return Lanes(*map(Lane, self._crews))

    def close(self, patience: float) -> None:
        """Do what is waiting and end all threads, as ``Crew.close`` does."""
        for crew in self._crews:
            crew.close(patience)
