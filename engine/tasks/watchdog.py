"""A time limit for the functions of a user's task: one that hangs must not hang a run.

A timer interrupts Python code in the main thread. A call into a library may never return to Python; then
``onlooker``, a small process, reports it and ends this one. A run file survives that at any moment. Other
threads, in which the app computes replays, have no limit.
"""

from __future__ import annotations

import contextlib
import math
import mmap
import os
import signal
import struct
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator
from typing import Any, Final

from engine.tasks import onlooker

TIMEOUT_VARIABLE: Final = "TENSATLAS_TASK_TIMEOUT"
"""Environment variable with the limit in seconds; 0 for none."""
DEFAULT_TIMEOUT: Final = 60.0
TICK: Final = 0.5
"""Seconds between two checks by the onlooker."""


class TooLong(BaseException):
    """A function has not returned in time; a user's ``except Exception`` does not catch it."""


class _Onlooker:
    """The process that watches this one from outside."""

    def __init__(self, limit: float) -> None:
        self.pid, self.limit = os.getpid(), limit
        with tempfile.TemporaryFile() as f:
            f.truncate(onlooker.SIZE)
            self._shared = mmap.mmap(f.fileno(), onlooker.SIZE)
            arguments = [str(f.fileno()), str(self.pid), str(limit), str(TICK)]
            # its standard input ends with this process
            self._process = subprocess.Popen(
                [sys.executable, "-I", "-S", onlooker.__file__, *arguments],
                stdin=subprocess.PIPE,
                stdout=subprocess.DEVNULL,
                pass_fds=[f.fileno()],
                start_new_session=True,  # Ctrl-C is not meant for it
            )
        self._n = 0

    def begin(self, text: bytes) -> None:
        size = onlooker.SIZE - onlooker.TEXT.start
        self._shared[onlooker.TEXT] = text[: size - 1].ljust(size, b"\0")
        self._count()

    def end(self) -> None:
        self._count()

    def _count(self) -> None:
        self._n += 1
        struct.pack_into("q", self._shared, 0, self._n)


_onlooker: _Onlooker | None = None


def timeout() -> float:
    """Return the limit in seconds, infinite for none."""
    try:
        seconds = float(os.environ.get(TIMEOUT_VARIABLE, DEFAULT_TIMEOUT))
    except ValueError:
        return DEFAULT_TIMEOUT
    return seconds if 0.0 < seconds < 1e6 else math.inf


@contextlib.contextmanager
def time_limit(where: str) -> Iterator[None]:
    """Bound the time of a block in the main thread.

    Args:
        where: name of the block in the message if it never ends.

    Raises:
        TooLong: it takes longer.
    """
    limit = timeout()
    if (
        math.isinf(limit)
        or threading.current_thread() is not threading.main_thread()
        or signal.getitimer(signal.ITIMER_REAL)[0] > 0.0  # another timer runs, or an outer block
    ):
        yield
        return
    observed = _get_onlooker(1.5 * limit + 5.0)
    before = signal.signal(signal.SIGALRM, _interrupt)
    observed.begin(f"{where} has not returned after {observed.limit:.0f} s".encode())
    # repeated, because code may catch every exception
    signal.setitimer(signal.ITIMER_REAL, limit, 1.0)
    try:
        yield
    finally:
        try:
            signal.setitimer(signal.ITIMER_REAL, 0.0)
        finally:  # the timer may fire at this very moment
            observed.end()
            signal.signal(signal.SIGALRM, before)


def _get_onlooker(limit: float) -> _Onlooker:
    global _onlooker
    if _onlooker is None or _onlooker.pid != os.getpid() or _onlooker.limit != limit:
        _onlooker = _Onlooker(limit)
    return _onlooker


def _interrupt(*_: Any) -> None:
    raise TooLong
