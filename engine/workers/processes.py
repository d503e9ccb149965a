"""Workers that are processes of this machine."""

from __future__ import annotations

import contextlib
import dataclasses
import os
import signal
import subprocess
import sys
import threading
from collections import deque
from collections.abc import Iterator, Sequence
from multiprocessing import Pipe
from multiprocessing.connection import wait
from typing import Final, Self

from engine.children import module_line
from engine.errors import ClusterError, InvalidData
from engine.simulation.evaluation import Solution
from engine.workers.job import Result, World
from engine.workers.pool import Died
from engine.workers.serving import READY

TIMEOUT: Final = 3600.0
"""Seconds after which an evaluation counts as hanging; with real inertia the longest take minutes."""
MAX_FAILED_STARTS: Final = 3
"""Times that each worker, on average, may end before it can work, one after the other."""


class ProcessWorkers:
    """Processes of this machine, each computing one job at a time. A context manager.

    Args:
        n_workers: processes.
        timeout: seconds of a job after which its process ends itself.

    Raises:
        InvalidData: a number is out of range.
    """

    def __init__(self, n_workers: int, *, timeout: float = TIMEOUT) -> None:
        if n_workers < 1:
            raise InvalidData(f"workers must be at least 1, not {n_workers}")
        if not 1.0 <= timeout <= threading.TIMEOUT_MAX:
            raise InvalidData(f"timeout must be at least 1 s, not {timeout:g}")
        self._timeout = timeout
        self._queue: deque[tuple[World, Sequence[Solution]]] = deque()
        self._n_workers = n_workers
        self._workers: list[_Worker] = []
        self._failed_starts = 0

    @property
    def n_workers(self) -> int:
        """Number of processes once there are jobs."""
        return self._n_workers

    def start(self) -> None:
        """Start the missing ones; the first job does so too, so that a refused run starts none."""
        while len(self._workers) < self._n_workers:
            self._workers.append(_Worker(self._timeout))

    @property
    def pids(self) -> list[int]:
        """Their process identifiers."""
        return [w.process.pid for w in self._workers]

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        for worker in self._workers:
            worker.kill()  # its job will be computed again
        self._workers = []
        self._queue.clear()

    def submit(self, world: World, solutions: Sequence[Solution]) -> None:
        """Submit a job of some solutions; jobs are begun in the order of submission."""
        self.start()
        self._queue.append((world, solutions))
        self._begin()

    def wait(self) -> list[tuple[Sequence[Solution], list[Result] | Died]]:
        """Return the jobs finished since the last call; wait for at least one.

        Raises:
            ClusterError: the workers end before they can work, again and again.
            TensAtlasError: a job fails by an error that the user can mend.
        """
        busy = {w.connection: w for w in self._workers if w.job is not None}
        found: list[tuple[Sequence[Solution], list[Result] | Died]] = []
        for connection in wait(list(busy)):
            worker = busy[connection]  # type: ignore[index]  # these are the connections put in
            assert worker.job is not None
            job = worker.job
            outcome = worker.take()
            if isinstance(outcome, Exception):
                raise outcome
            if outcome == READY:
                self._failed_starts = 0
            elif isinstance(outcome, Unstarted):
                self._replace(worker)
                self._queue.appendleft(job)  # it has not met the job, which is not to blame
                self._failed_starts += 1
                if self._failed_starts >= MAX_FAILED_STARTS * self._n_workers:
                    raise ClusterError(f"worker processes end before they can work (status {outcome.code})")
            else:
                assert isinstance(outcome, list | Died)
                if isinstance(outcome, Died):
                    self._replace(worker)
                found.append((job[1], outcome))
        self._begin()
        return found

    def _replace(self, worker: _Worker) -> None:
        worker.kill()
        self._workers[self._workers.index(worker)] = _Worker(self._timeout)

    def _begin(self) -> None:
        for worker in self._workers:
            if self._queue and worker.job is None:
                worker.give(*self._queue.popleft())


@dataclasses.dataclass(frozen=True, slots=True)
class Unstarted:
    """A worker has ended before it could work, with this status."""

    code: int


class _Worker:
    """One process and the job that it has, if any."""

    def __init__(self, timeout: float) -> None:
        self._timeout = timeout
        self.connection, other = Pipe()
        # once ``other`` is closed here, the death of the process is the end of the pipe
        with other, _ctrl_c_held_back():
            self.process = subprocess.Popen(
                module_line("engine.workers.serving", str(other.fileno()), repr(timeout), str(os.getpid())),
                stdin=subprocess.DEVNULL,
                pass_fds=[other.fileno()],
            )
        self.job: tuple[World, Sequence[Solution]] | None = None
        self._ready = False
        with contextlib.suppress(OSError):
            self.connection.send(sys.path)

    def give(self, world: World, solutions: Sequence[Solution]) -> None:
        """Give it a job."""
        self.job = world, solutions
        with contextlib.suppress(OSError):  # if it has died, that is found out by ``take``
            self.connection.send((world, solutions))

    def take(self) -> list[Result] | Died | Unstarted | Exception | str:
        """Return the outcome of its job, or ``READY`` if the process has only reported that it is."""
        try:
            outcome: list[Result] | Exception | str = self.connection.recv()
        except (EOFError, OSError):
            code = self.process.wait()
            if not self._ready:
                return Unstarted(code)
            self.job = None
            return Died(f"signal {-code}" if code < 0 else f"not finished in {self._timeout:g} s")
        if outcome == READY:
            self._ready = True
        else:
            self.job = None
        return outcome

    def kill(self) -> None:
        """End it."""
        self.process.kill()
        self.process.wait()
        self.connection.close()


@contextlib.contextmanager
def _ctrl_c_held_back() -> Iterator[None]:
    """Start a process that Ctrl-C does not reach, not even while it imports; it comes here afterwards."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
