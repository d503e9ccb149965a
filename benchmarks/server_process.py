"""The explorer as a process of its own, watched from outside: what it costs and how much it holds."""

from __future__ import annotations

import contextlib
import os
import re
import subprocess
import sys
import threading
from collections.abc import Iterator, Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


class ServerProcess:
    """A running explorer.

    Args:
        process: that runs it.
        address: that it printed.
    """

    def __init__(self, process: subprocess.Popen[str], address: str) -> None:
        self.address = address
        self.pid = process.pid
        self.log: list[str] = []
        """The lines that it has printed since."""
        self._process = process
        self._folder = Path("/proc") / str(process.pid)

    @property
    def alive(self) -> bool:
        """Whether it runs."""
        return self._process.poll() is None

    def end(self) -> None:
        """End it as a supervisor does, and wait until it has ended."""
        self._process.terminate()
        self._process.wait(60)

    def cpu(self) -> float:
        """Return the CPU seconds that it has used, of all its threads."""
        fields = (self._folder / "stat").read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def memory(self) -> float:
        """Return its resident memory, in MB."""
        return self._status("VmRSS")

    def peak(self) -> float:
        """Return the most resident memory that it has had, in MB."""
        return self._status("VmHWM")

    def _status(self, name: str) -> float:
        status = (self._folder / "status").read_text()
        found = re.search(rf"{name}:\s*(\d+) kB", status)
        assert found is not None
        return int(found[1]) / 1024


def cpu_of(argument: str) -> float:
    """Return the CPU seconds used so far by all processes that have a text in their command line."""
    total = 0
    for place in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):  # it has ended
            if argument in (place / "cmdline").read_text():
                fields = (place / "stat").read_text().rpartition(")")[2].split()
                total += int(fields[11]) + int(fields[12])
    return total / os.sysconf("SC_CLK_TCK")


@contextlib.contextmanager
def explorer(runs: Sequence[Path], folder: Path, *flags: str) -> Iterator[ServerProcess]:
    """Serve runs within a ``with`` block, from a folder whose ``runs/`` is on offer as well."""
    command = [sys.executable, "-m", "app", "explore", *map(str, runs), "--port", "0", "--no-browser", *flags]
    with subprocess.Popen(
        command,
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    ) as process:
        try:
            lines: list[str] = []
            assert process.stdout is not None
            for line in process.stdout:
                lines.append(line)
                if found := re.search(r"TensAtlas is at (http://\S+)", line):
                    server = ServerProcess(process, found[1])
                    # a full pipe would stop the server
                    threading.Thread(target=server.log.extend, args=(process.stdout,), daemon=True).start()
                    yield server
                    break
            else:
                raise RuntimeError("the explorer does not start: " + "".join(lines))
        finally:
            process.terminate()
            process.wait(30)
