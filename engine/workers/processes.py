"""Workers that are processes of this machine."""

from __future__ import annotations

import contextlib
import faulthandler
import multiprocessing
import os
import signal
import threading
import time
import traceback
from collections import deque
from multiprocessing.connection import Connection, wait
from typing import Any, Final, Self

from engine.errors import ClusterError, InvalidData, TensAtlasError
from engine.simulation.evaluation import Solution
from engine.workers.job import Result, World, compute
from engine.workers.malloc import keep_memory_compact
from engine.workers.pool import Died

TIMEOUT: Final = 3600.0
"""Seconds after which an evaluation counts as hanging; with real inertia the longest take minutes."""
_PARENT_POLL: Final = 1.0
_READY: Final = "ready"
_CONTEXT: Final = multiprocessing.get_context("spawn")
"""A fork of a process with threads, MuJoCo's among them, may hang."""


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
        self._queue: deque[tuple[World, Solution]] = deque()
        self._n_workers = n_workers
        self._workers: list[_Worker] = []

    @property
    def n_workers(self) -> int:
        """Number of processes once there are jobs."""
        return self._n_workers

    def start(self) -> None:
        """Start the missing ones; the first job does so too, so that a refused run starts none."""
        self._workers += [_Worker(self._timeout) for _ in range(self._n_workers - len(self._workers))]

    @property
    def pids(self) -> list[int]:
        """Their process identifiers."""
        return [w.process.pid or 0 for w in self._workers]

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        for worker in self._workers:
            worker.kill()  # its job will be computed again
        self._workers = []
        self._queue.clear()

    def submit(self, world: World, solution: Solution) -> None:
        """Submit a solution; jobs are begun in the order of submission."""
        self.start()
        self._queue.append((world, solution))
        self._begin()

    def wait(self) -> list[tuple[Solution, Result | Died]]:
        """Return the jobs finished since the last call; wait for at least one.

        Raises:
            TensAtlasError: a job fails by an error that the user can mend.
        """
        busy = {w.connection: w for w in self._workers if w.solution is not None}
        found: list[tuple[Solution, Result | Died]] = []
        for connection in wait(list(busy)):
            worker = busy[connection]  # type: ignore[index]  # these are the connections put in
            assert worker.solution is not None
            solution = worker.solution
            outcome = worker.take()
            if outcome is None:
                continue
            if isinstance(outcome, Exception):
                raise outcome
            if isinstance(outcome, Died):
                worker.kill()
                self._workers[self._workers.index(worker)] = _Worker(self._timeout)
            found.append((solution, outcome))
        self._begin()
        return found

    def _begin(self) -> None:
        for worker in self._workers:
            if self._queue and worker.solution is None:
                worker.give(*self._queue.popleft())


class _Worker:
    """One process and the job that it has, if any."""

    def __init__(self, timeout: float) -> None:
        self._timeout = timeout
        self.connection, other = _CONTEXT.Pipe()
        self.process = _CONTEXT.Process(
            target=_serve, args=(other, timeout, os.getpid()), daemon=True, name="tensatlas-worker"
        )
        self.process.start()
        other.close()  # so that the death of the process is the end of the pipe
        self.solution: Solution | None = None
        self._ready = False

    def give(self, world: World, solution: Solution) -> None:
        """Give it a job."""
        self.solution = solution
        with contextlib.suppress(OSError):  # if it has died, that is found out by ``take``
            self.connection.send((world, solution))

    def take(self) -> Result | Died | Exception | None:
        """Return the outcome of its job, or None if the process has only reported that it is ready."""
        try:
            outcome: Result | Exception | str = self.connection.recv()
        except (EOFError, OSError):
            self.process.join()
            code = self.process.exitcode or 0
            if not self._ready:
                return ClusterError(f"a worker process ended (status {code}) before it could work")
            self.solution = None
            return Died(f"signal {-code}" if code < 0 else f"not finished in {self._timeout:g} s")
        if outcome == _READY:
            self._ready = True
            return None
        self.solution = None
        assert not isinstance(outcome, str)
        return outcome

    def kill(self) -> None:
        """End it."""
        self.process.kill()
        self.process.join()
        self.connection.close()


def _serve(connection: Connection, timeout: float, parent: int) -> None:
    """Compute jobs until the other end of the pipe is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the parent
    keep_memory_compact()

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(_PARENT_POLL)
        os._exit(1)  # a parent that was killed cannot end its children

    threading.Thread(target=watch, daemon=True).start()
    with open(os.devnull, "w") as nowhere, contextlib.suppress(EOFError, OSError):
        connection.send(_READY)
        while True:
            job: Any = connection.recv()
            # ends the process even while it is inside MuJoCo, or in a task's endless loop
            faulthandler.dump_traceback_later(timeout, exit=True, file=nowhere)
            outcome: Result | Exception
            try:
                outcome = compute(*job)
            except TensAtlasError as e:
                outcome = e
            except Exception:
                outcome = RuntimeError(traceback.format_exc())
            finally:
                faulthandler.cancel_dump_traceback_later()
            connection.send(outcome)
