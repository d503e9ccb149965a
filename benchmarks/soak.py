"""An evolution with the explorer open and several browsers clicking, for an hour.

``python -m benchmarks.soak`` prints how the memory of both processes and the write-ahead log develop and
how soon every browser learns of every generation; it exits with 1 if memory or log grow or an update is
lost. The browsers are web-socket clients that speak viser's protocol; they draw nothing.
"""

from __future__ import annotations

import contextlib
import dataclasses
import os
import random
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import Any, Final

import numpy as np
import tyro
from rich.console import Console
from websockets.exceptions import ConnectionClosed

from benchmarks.rows import Row, show
from benchmarks.server_process import ROOT, ServerProcess, explorer
from benchmarks.synthetic_browser import Message, SyntheticBrowser
from benchmarks.timing import machine
from engine.errors import RunFileError
from engine.storage.lock import is_being_written
from engine.storage.reader import RunReader
from engine.storage.writer import LOG_LIMIT

SAMPLE: Final = 2.0
"""Seconds between two looks at memory and log."""
LATE: Final = 15.0
"""Seconds after which an update that a browser has not got counts as lost."""
GROWTH: Final = 0.10
"""Share by which memory may grow in the second half of the time."""
_CELL = re.compile(r'data-c="([a-z-]+:\d+(?:,\d+)+)" data-filled="1"')


@dataclasses.dataclass(frozen=True)
class Arguments:
    """Let an evolution and the explorer run side by side."""

    minutes: float = 60.0
    """How long."""
    clients: int = 5
    """Browsers."""
    pause: float = 20.0
    """Mean seconds between two clicks of a browser."""
    batch: int = 6
    """Evaluations per generation."""
    seed: int = 0
    """Seed of what is clicked."""


class Client:
    """A browser that follows a run and clicks on robots.

    Args:
        address: that the explorer printed.
        seed: of what it clicks.
        pause: mean seconds between two clicks.
    """

    def __init__(self, address: str, *, seed: int, pause: float) -> None:
        self._rng = random.Random(seed)
        self._pause = pause
        self._maps: dict[str, str] = {}
        self._slider = ""
        self.seen: list[tuple[float, int]] = []
        """When it learnt of which newest generation."""
        self.n_messages = self.n_clicks = self.n_notices = 0
        self._stop = threading.Event()
        self._browser = SyntheticBrowser(address, heard=self._take)
        self._clicking = threading.Thread(target=self._click, daemon=True)
        self._clicking.start()

    @property
    def broken(self) -> str:
        """Why the connection ended, if it was not closed here."""
        return self._browser.broken

    def close(self) -> None:
        """Go."""
        self._stop.set()
        self._browser.close()
        self._clicking.join()

    def _take(self, message: Message) -> None:
        self.n_messages += 1
        kind = message["type"]
        if kind == "GuiSliderMessage":
            if message["props"]["label"] == "Generation":
                self._slider = message["uuid"]
                self._newest(message["props"]["max"])
        elif kind == "GuiHtmlMessage":
            self._maps[message["uuid"]] = message["props"]["content"]
        elif kind == "NotificationShowMessage":
            self.n_notices += 1
        elif kind == "GuiUpdateMessage":
            updates = message["updates"]
            if "content" in updates:
                self._maps[message["uuid"]] = updates["content"]
            if message["uuid"] == self._slider and "max" in updates:
                self._newest(updates["max"])

    def _newest(self, generation: float) -> None:
        self.seen.append((time.monotonic(), int(generation)))

    def _click(self) -> None:
        while not self._stop.wait(self._rng.expovariate(1.0 / self._pause)):
            cells = [c for content in list(self._maps.values()) for c in _CELL.findall(content)]
            if cells:
                self.n_clicks += 1
                with contextlib.suppress(ConnectionClosed):
                    self._browser.click(self._rng.choice(cells))


@dataclasses.dataclass
class Samples:
    """What was seen over the time: seconds, memory of evolution and explorer in MB, log in MB."""

    seconds: list[float] = dataclasses.field(default_factory=list)
    evolution: list[float] = dataclasses.field(default_factory=list)
    explorer: list[float] = dataclasses.field(default_factory=list)
    log: list[float] = dataclasses.field(default_factory=list)


def soak(arguments: Arguments, folder: Path) -> list[Row]:
    """Run it; return the figures."""
    path = folder / "soak.tsmr"
    evolution = _evolve(
        *(path, "--preset", "smoke", "--evaluations", 2_000_000, "--initial", 12, "--workers", 1),
        *("--batch-size", arguments.batch, "--seed", arguments.seed, "--trials.repeats", 1),
        *("--trials.settle-time", 0.2, "--trials.open-loop-time", 0.2),
    )
    try:
        _wait(lambda: path.exists() and is_being_written(path) and _generation(path) >= 0)
        with explorer([path], folder) as server:
            clients = [
                Client(server.address, seed=arguments.seed + k, pause=arguments.pause)
                for k in range(arguments.clients)
            ]
            samples, closed_at = _watch(path, evolution, server, 60.0 * arguments.minutes)
            alive = evolution.poll() is None and server.alive
            for c in clients:
                c.close()
        return _rows(samples, closed_at, clients, alive=alive)
    finally:
        if evolution.poll() is None:
            evolution.send_signal(signal.SIGTERM)
            evolution.wait()


def _watch(
    path: Path, evolution: subprocess.Popen[bytes], server: ServerProcess, seconds: float
) -> tuple[Samples, dict[int, float]]:
    samples, closed_at = Samples(), {}
    log = path.with_name(path.name + "-wal")
    started = time.monotonic()
    next_sample = 0.0
    with RunReader(path) as reader:
        newest = reader.last_generation() or 0
        while (now := time.monotonic() - started) < seconds:
            generation = reader.last_generation() or 0
            for g in range(newest + 1, generation + 1):
                closed_at[g] = time.monotonic()
            newest = max(newest, generation)
            if now >= next_sample and evolution.poll() is None and server.alive:
                next_sample = now + SAMPLE
                samples.seconds.append(now)
                samples.evolution.append(_memory(evolution.pid))
                samples.explorer.append(_memory(server.pid))
                samples.log.append(log.stat().st_size / 1e6 if log.exists() else 0.0)
            time.sleep(0.1)
    return samples, closed_at


def _rows(s: Samples, closed_at: dict[int, float], clients: list[Client], *, alive: bool) -> list[Row]:
    rows = [Row("both processes alive at the end", str(alive), "True", alive)]
    for name, values in (("evolution", s.evolution), ("explorer", s.explorer)):
        half = len(values) // 2
        t, v = np.array(s.seconds[half:]), np.array(values[half:])
        slope = float(np.polyfit(t, v, 1)[0]) if len(t) > 2 else 0.0
        growth = slope * float(np.ptp(t)) / float(v[0])
        rows.append(
            Row(
                f"memory of the {name}, second half",
                f"{v[0]:.0f} to {v[-1]:.0f} MB, {3600 * slope:+.1f} MB/h",
                f"grows by less than {GROWTH:.0%}",
                growth < GROWTH,
            )
        )
    rows.append(
        Row(
            "write-ahead log",
            f"{max(s.log):.1f} MB at most, {s.log[-1]:.1f} MB at the end",
            f"{LOG_LIMIT / 1e6:.1f} MB",
            max(s.log) <= 1.05 * LOG_LIMIT / 1e6,
        )
    )
    for name, values in (("evolution", s.evolution), ("explorer", s.explorer)):
        at = [values[min(k * len(values) // 6, len(values) - 1)] for k in range(7)]
        rows.append(Row(f"memory of the {name}, by sixths of the time", " ".join(f"{v:.0f}" for v in at), ""))
    now = time.monotonic()
    delays, lost = [], 0
    for c in clients:
        for g, at in closed_at.items():
            told = next((t for t, newest in c.seen if newest >= g), None)
            if told is not None:
                delays.append(max(0.0, told - at))
            lost += told - at > LATE if told is not None else now - at > LATE
    figures = np.percentile(delays, (50, 99, 100)) if delays else (0.0, 0.0, 0.0)
    rows += [
        Row("generations closed", str(len(closed_at)), ""),
        Row(
            "a browser learns of one after",
            "{:.1f} s (median), {:.1f} s (99 %), {:.1f} s (at most)".format(*figures),
            f"{LATE:.0f} s",
        ),
        Row("updates lost", f"{lost} of {len(closed_at) * len(clients)}", "0", lost == 0),
        Row("clicks", str(sum(c.n_clicks for c in clients)), ""),
        Row("messages to browsers", str(sum(c.n_messages for c in clients)), ""),
        Row("notices to browsers", str(sum(c.n_notices for c in clients)), ""),
        Row(
            "connections that broke",
            str(sum(bool(c.broken) for c in clients)),
            "0",
            not any(c.broken for c in clients),
        ),
    ]
    return rows


def _evolve(*arguments: object) -> subprocess.Popen[bytes]:
    return subprocess.Popen(
        [sys.executable, "-m", "app", "evolve", *map(str, arguments)],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )


def _wait(condition: Any, seconds: float = 600.0) -> None:
    deadline = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > deadline:
            raise TimeoutError("it did not start")
        time.sleep(0.1)


def _generation(path: Path) -> int:
    try:
        with RunReader(path) as reader:
            last = reader.last_generation()
    except RunFileError:
        return -1
    return -1 if last is None else last


def _memory(pid: int) -> float:
    """Return the memory in MB that a process has to itself."""
    text = Path(f"/proc/{pid}/smaps_rollup").read_text(encoding="ascii")
    return sum(int(n) for n in re.findall(r"^Private_\w+:\s+(\d+) kB", text, re.MULTILINE)) / 1000.0


def main(arguments: Arguments) -> int:
    """Run it, print the figures, return the exit status."""
    console = Console()
    console.print(machine(), markup=False)
    with tempfile.TemporaryDirectory() as folder:
        rows = soak(arguments, Path(folder))
    show(f"{arguments.minutes:g} minutes, {arguments.clients} browsers", rows, console)
    return int(any(r.passed is False for r in rows))


if __name__ == "__main__":
    sys.exit(main(tyro.cli(Arguments)))
