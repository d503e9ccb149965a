"""The lock of a run: a file beside it that names the process that writes it.

On one machine the operating system decides (``flock``): when a process has ended, in whatever way, its lock
is free. On a file system that several machines share without passing such locks on, the lock file's time
stamp decides: its holder renews it every ``BEAT`` seconds, and after ``SILENCE`` seconds without renewal the
holder counts as gone.
"""

from __future__ import annotations

import contextlib
import dataclasses
import fcntl
import json
import os
import secrets
import shlex
import socket
import sys
import threading
import time
from datetime import UTC, datetime
from pathlib import Path
from typing import Final, Self

from engine.errors import RunFileError, as_typed
from engine.files import open_file

BEAT: Final = 20.0
"""Seconds between two signs of life of a process that writes a run."""
SILENCE: Final = 180.0
"""Seconds without a sign of life after which another machine's process counts as gone."""
_MOST: Final = 8000


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Holder:
    """The process that holds, or held, the lock of a run.

    Attributes:
        pid: its number on its machine.
        host: the machine's name.
        boot: of the machine since its last start; empty where systems do not say.
        since: UTC date and time at which it began to write.
        command: that started it.
        key: tells two holders apart.
    """

    pid: int
    host: str
    boot: str
    since: str
    command: str
    key: str

    @property
    def is_here(self) -> bool:
        """Whether it runs, or ran, on this machine, before a restart or after."""
        return self.host == socket.gethostname() or self.is_of_this_boot

    @property
    def is_of_this_boot(self) -> bool:
        """Whether it began on this machine since its last start, so that ``flock`` tells if it lives.

        A container has another name than its machine, but the same boot.
        """
        boot = boot_id()
        return self.boot == boot if boot and self.boot else self.host == socket.gethostname()

    def __str__(self) -> str:
        return f"{self.pid} on {self.host} since {self.since}: {self.command}"


def lock_path(path: Path) -> Path:
    """Return the path of a run's lock file."""
    return path.with_name(path.name + ".lock")


def is_being_written(path: Path) -> bool:
    """Tell whether a living process is writing a run."""
    try:
        with open_file(lock_path(path)) as f:
            try:
                fcntl.flock(f, fcntl.LOCK_SH | fcntl.LOCK_NB)
            except BlockingIOError:
                return True
            holder = _parse(f.read(_MOST))
            if holder is None or holder.is_here:
                return False
            return time.time() - os.fstat(f.fileno()).st_mtime < SILENCE
    except OSError:
        return False


def holder_of(path: Path) -> Holder | None:
    """Return the process that a run's lock file names, alive or not; None without a file or a name in it."""
    try:
        with open_file(lock_path(path)) as f:
            return _parse(f.read(_MOST))
    except OSError:
        return None


def boot_id() -> str:
    """Return the identifier of this machine's last start; empty where the system has none."""
    try:
        return Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii").strip()
    except (OSError, ValueError):
        return ""


class RunLock:
    """The right to write a run. Use ``acquire``."""

    def __init__(self, path: Path, descriptor: int, text: bytes) -> None:
        self._path = path
        self._descriptor = descriptor
        self._text = text
        self._released = threading.Event()
        self._thread = threading.Thread(target=self._beat, name="run lock", daemon=True)
        self._thread.start()

    @classmethod
    def acquire(cls, path: Path) -> Self:
        """Lock a run.

        Raises:
            RunFileError: another process is writing it, or may be.
            OSError: the lock file cannot be made.
        """
        lock = _open(path)
        try:
            _wait(path, lock)
            # its last holder may have removed the file between our open and our lock
            while not _is_at(lock, lock_path(path)):
                os.close(lock)
                lock = _open(path)
                _wait(path, lock)
            _refuse_another_machine(path, lock)
        except BaseException:
            os.close(lock)
            raise
        try:
            text = _own_text()
            os.ftruncate(lock, 0)
            os.pwrite(lock, text, 0)
            return cls(path, lock, text)
        except BaseException:  # an empty file, where there is no room for a text, would be there for ever
            with contextlib.suppress(OSError):
                lock_path(path).unlink()
            os.close(lock)
            raise

    def check(self) -> None:
        """Make sure, before writing, that no other process has taken over the lock.

        Raises:
            RunFileError: another process has, or the lock file is gone.
        """
        file = lock_path(self._path)
        with contextlib.suppress(OSError):
            if _is_at(self._descriptor, file) and os.pread(self._descriptor, _MOST, 0) == self._text:
                return
        other = holder_of(self._path)
        who = f"another process writes the run now ({other})" if other else "its lock file was removed"
        raise RunFileError(
            f"{self._path}: this process has stopped writing it: {who}. What was finished is saved; make sure"
            f" that one process at a time writes it, then 'tensatlas resume {as_typed(self._path)}'"
        )

    def release(self) -> None:
        """Release the lock and remove its file, if it is still ours."""
        if self._released.is_set():
            return
        self._released.set()
        self._thread.join()
        with contextlib.suppress(OSError):
            if _is_at(self._descriptor, lock_path(self._path)):
                lock_path(self._path).unlink()
        os.close(self._descriptor)

    def _beat(self) -> None:
        while not self._released.wait(BEAT):
            with contextlib.suppress(OSError):
                # the time of the file system's own clock
                os.utime(self._descriptor)


def _open(path: Path) -> int:
    return os.open(lock_path(path), os.O_RDWR | os.O_CREAT, 0o644)


def _wait(path: Path, lock: int) -> None:
    deadline = time.monotonic() + 1.0
    while True:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return
        except BlockingIOError:
            if time.monotonic() < deadline:  # a reader may be asking whether the run is live
                time.sleep(0.02)
                continue
            content = os.pread(lock, _MOST, 0)
            who = _parse(content) or content[:20].decode(errors="replace").strip() or "unknown"
            raise RunFileError(f"{path} is being written by another process ({who})") from None


def _refuse_another_machine(path: Path, lock: int) -> None:
    """Make sure that a lock that is free here is not held on another machine."""
    holder = _parse(os.pread(lock, _MOST, 0))
    if holder is None or holder.is_here:
        return
    before = os.fstat(lock).st_mtime
    os.utime(lock)  # so that both times are of the file system's clock, not of two machines
    silent = os.fstat(lock).st_mtime - before
    if silent < SILENCE:
        os.utime(lock, (before, before))
        raise RunFileError(
            f"{path} is being written on another machine, or was {max(silent, 0.0):.0f} s ago ({holder})."
            f" From here it cannot be seen whether that process lives: if it does not, wait until"
            f" {SILENCE:.0f} s have passed or delete {lock_path(path)}"
        )


def _own_text() -> bytes:
    arguments = ["tensatlas" if Path(sys.argv[0]).name == "tensatlas.py" else sys.argv[0], *sys.argv[1:]]
    holder = Holder(
        pid=os.getpid(),
        host=socket.gethostname(),
        boot=boot_id(),
        since=datetime.now(UTC).isoformat(timespec="seconds"),
        command=_line(shlex.join(arguments)),
        key=secrets.token_hex(8),
    )
    return json.dumps(dataclasses.asdict(holder)).encode()


def _parse(content: bytes) -> Holder | None:
    """Read a lock file from any source; one of an earlier version names only the process."""
    try:
        data = json.loads(content)
        texts = {k: _line(str(data[k])) for k in ("host", "boot", "since", "command", "key")}
        pid = data["pid"]
    except (ValueError, TypeError, LookupError, RecursionError):
        return None
    return Holder(pid=pid, **texts) if type(pid) is int and 0 < pid < 2**31 else None


def _line(text: str) -> str:
    return "".join(c if c.isprintable() else "?" for c in text[:200])


def _is_at(descriptor: int, path: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(descriptor), path.stat())
    except FileNotFoundError:
        return False
