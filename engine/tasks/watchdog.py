"""A limit on the time that a function of a user's own task takes: one that hangs must not hang a run.

A timer interrupts Python code in the main thread. A call into a library may not come back to Python at
all; then a small process of its own, which looks on from outside, says so and ends this one. A run file
bears that at any moment. In other threads, where replays in the app are computed, there is no limit.
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

TIMEOUT_VARIABLE: Final = "TENSATLAS_TASK_TIMEOUT"
"""Environment variable with the limit in seconds; 0 for none."""
DEFAULT_TIMEOUT: Final = 60.0
TICK: Final = 0.5
"""Seconds between two looks from outside."""
_TEXT: Final = slice(8, 1024)

_LOOK_ON = """
import mmap, os, select, signal, struct, sys
signal.signal(signal.SIGINT, signal.SIG_IGN)
descriptor, pid, limit, tick = int(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3]), float(sys.argv[4])
shared = mmap.mmap(descriptor, 1024)
def is_stopped():
    try:
        with open(f"/proc/{pid}/stat") as f:
            return f.read().rpartition(")")[2].split()[0] in "Tt"
    except OSError:
        return False
before, waited = 0, 0.0
while not select.select([sys.stdin], [], [], tick)[0]:
    call = struct.unpack_from("q", shared)[0]
    # an odd number is a call under way; what is stopped with Ctrl-Z has all the time
    waited = waited + tick if call % 2 and call == before and not is_stopped() else 0.0
    before = call
    if waited >= limit:
        text = shared[8:1024].split(b"\\0")[0].decode(errors="replace")
        print(f"tensatlas: {text} and cannot be interrupted. What was finished is saved", file=sys.stderr)
        os.kill(pid, signal.SIGKILL)
        break
"""


class TooLong(BaseException):
    """A function has not returned in time; no ``except Exception`` of a user's stops it."""


class _Onlooker:
    """The process that looks on from outside."""

    def __init__(self, limit: float) -> None:
        self.pid, self.limit = os.getpid(), limit
        with tempfile.TemporaryFile() as f:
            f.truncate(1024)
            self._shared = mmap.mmap(f.fileno(), 1024)
            arguments = [str(f.fileno()), str(self.pid), str(limit), str(TICK)]
            # its standard input ends with this process
            self._process = subprocess.Popen(
                [sys.executable, "-I", "-S", "-c", _LOOK_ON, *arguments],
                stdin=subprocess.PIPE,
                stdout=subprocess.DEVNULL,
                pass_fds=[f.fileno()],
            )
        self._n = 0

    def begin(self, text: bytes) -> None:
        self._shared[_TEXT] = text[:1000].ljust(1016, b"\0")
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
        where: what to call the block if it is never heard of again.

    Raises:
        TooLong: it takes longer.
    """
    limit = timeout()
    if (
        math.isinf(limit)
        or threading.current_thread() is not threading.main_thread()
        or signal.getitimer(signal.ITIMER_REAL)[0] > 0.0  # somebody else's timer, or a block within a block
    ):
        yield
        return
    onlooker = _get_onlooker(1.5 * limit + 5.0)
    before = signal.signal(signal.SIGALRM, _interrupt)
    onlooker.begin(f"{where} has not returned after {onlooker.limit:.0f} s".encode())
    # again and again, for code that catches everything
    signal.setitimer(signal.ITIMER_REAL, limit, 1.0)
    try:
        yield
    finally:
        try:
            signal.setitimer(signal.ITIMER_REAL, 0.0)
        finally:  # the timer may strike at this very moment
            onlooker.end()
            signal.signal(signal.SIGALRM, before)


def _get_onlooker(limit: float) -> _Onlooker:
    global _onlooker
    if _onlooker is None or _onlooker.pid != os.getpid() or _onlooker.limit != limit:
        _onlooker = _Onlooker(limit)
    return _onlooker


def _interrupt(*_: Any) -> None:
    raise TooLong
