"""The bytes of a file that may be an open database, read by a process of its own.

POSIX locks belong to a process, not to an open file. To open and close a database by any other way than
SQLite drops the locks of every connection that this process has to it, without a word: a writer that ends
then deletes the log under them, and they see old rows or "database disk image is malformed"
(https://www.sqlite.org/howtocorrupt.html, section 2.2). So no process opens a run file itself.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import IO, Final

_READ: Final = """
import os, shutil, sys
n = int(sys.argv[2])
try:
    with open(os.fsencode(sys.argv[1]), "rb") as f:
        if n < 0:
            shutil.copyfileobj(f, sys.stdout.buffer)
        else:
            sys.stdout.buffer.write(f.read(n))
except OSError as e:
    sys.exit(e.errno)
"""
COMMAND: Final = (sys.executable, "-I", "-S", "-c", _READ)
"""What the process is started with, before the file's path and the number of bytes."""


def raw_bytes(path: Path, n: int = -1) -> bytes:
    """Return the first bytes of a file, by default all, without opening it here.

    Raises:
        OSError: it cannot be read.
    """
    return _read(path, n, subprocess.PIPE)


def raw_copy(path: Path, target: Path) -> None:
    """Copy a file to a new one without opening it here.

    Raises:
        OSError: it cannot be read, or the copy cannot be written.
    """
    with open(target, "xb") as f:
        _read(path, -1, f)


def _read(path: Path, n: int, output: int | IO[bytes]) -> bytes:
    done = subprocess.run(
        [*COMMAND, str(path), str(n)],
        stdin=subprocess.DEVNULL,
        stdout=output,
        stderr=subprocess.PIPE,
        start_new_session=True,  # Ctrl-C is meant for this process, which then ends that one
    )
    if done.returncode:
        code = max(done.returncode, 0)
        raise OSError(code, os.strerror(code) if code else "the process that reads it was ended", str(path))
    return done.stdout or b""
