"""A program that ends its parent process when one call there takes too long.

No signal interrupts a call into a library that does not return to Python, so a second, small process watches.
``watchdog`` starts it and shares 1024 bytes of memory with it: first a counter of 8 bytes, which grows when a
call begins and when it ends, so that an odd value means that a call is running; then the message to print
about that call.

It runs without the project's packages, so that it starts in milliseconds and cannot fail with them::

    python -I -S onlooker.py DESCRIPTOR PID LIMIT TICK
"""

from __future__ import annotations

import mmap
import os
import select
import signal
import struct
import sys
from pathlib import Path

SIZE = 1024
"""Bytes of the shared memory."""
TEXT = slice(8, SIZE)
"""Where they hold the message about the running call; zero bytes end it."""


def main() -> None:
    """Watch until the standard input is closed or a call has taken too long."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is meant for the watched process
    descriptor, pid, limit, tick = int(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3]), float(sys.argv[4])
    shared = mmap.mmap(descriptor, SIZE)
    before, waited = 0, 0.0
    while not select.select([sys.stdin], [], [], tick)[0]:
        count = struct.unpack_from("q", shared)[0]
        under_way = count % 2 == 1 and count == before
        # the time for which Ctrl-Z stops the process does not count
        waited = waited + tick if under_way and not _is_stopped(pid) else 0.0
        before = count
        if waited >= limit:
            text = shared[TEXT].split(b"\0")[0].decode(errors="replace")
            print(f"tensatlas: {text} and cannot be interrupted. What was finished is saved", file=sys.stderr)
            os.kill(pid, signal.SIGKILL)
            return


def _is_stopped(pid: int) -> bool:
    try:
        stat = Path(f"/proc/{pid}/stat").read_text()
    except OSError:
        return False
    return stat.rpartition(")")[2].split()[0] in "Tt"


if __name__ == "__main__":
    main()
