"""What strangers can do to a server, and what an innocent browser notices: ``python -m benchmarks.attack``.

Starts the app as a process of its own, as ``benchmarks.explorer`` does, and attacks it:

- ``clicks``: one browser sends hundreds of clicks at once, then goes on for half a minute, 200 a second;
- ``crowd``: 20 browsers, then 50, each click another robot at the same moment;
- ``messages``: what takes much more memory than bytes, and what has the wrong types;
- ``files``: pipes among the runs and beside one;
- ``networks``: robots with the largest networks that a file may hold;
- ``leaving``: pages that click and are closed at once.

Meanwhile an innocent browser clicks. Prints how long its answers take, and the CPU time that the server
needed for a crowd: on a machine that is busy otherwise only that says much. Exits with 1 if a figure falls
short.
"""

from __future__ import annotations

import contextlib
import dataclasses
import os
import random
import shutil
import sys
import tempfile
import threading
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final, Literal

import numpy as np
import tyro
from rich.console import Console
from websockets.exceptions import ConnectionClosed

from app.gui.incoming import LOOKING
from benchmarks.clicking import opened
from benchmarks.rows import Row, show
from benchmarks.server_process import ServerProcess, explorer
from benchmarks.synthetic_browser import SyntheticBrowser, brings_robot, html_with
from benchmarks.synthetic_run import write_run
from benchmarks.timing import machine
from engine.body.module import MAX_MODULES, MIN_MODULES
from engine.control.genome import (
    MAX_CONNECTIONS,
    MAX_DEPTH,
    MAX_NODES,
    N_OUTPUTS,
    ConnectionGene,
    Controller,
    NodeGene,
)
from engine.search.archive import cell_name
from engine.simulation.compile_kernel import compile_kernel
from engine.storage.reader import RunReader

ANSWER: Final = 1.0
"""Seconds in which an innocent browser's click is answered, whatever others do."""
CROWDS: Final = {20: 1.5, 50: 4.0}
"""By the number of browsers that click at once: seconds in which 95 of 100 see their robots."""
FLOODS: Final = (100, 400)
"""Clicks that one browser sends at once."""
RATE: Final = 200
"""Clicks a second of a browser that goes on."""
PATIENCE: Final = 10.0
"""Seconds in which a server shows its first page, and ends."""
GROWTH: Final = 50.0
"""MB that messages may take."""
IDLE: Final = 0.1
"""Share of a core that a server without browsers may take."""
PAUSE: Final = 0.5
"""Seconds between two clicks of the innocent browser."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Arguments:
    """Attack the explorer."""

    part: Literal["all", "clicks", "crowd", "messages", "files", "networks", "leaving"] = "all"
    """Which attack."""
    seconds: float = 30.0
    """How long the clicks go on."""
    quick: bool = False
    """Little of everything and small robots: shows that the attacks work, not what the app withstands."""


def main(arguments: Arguments) -> int:
    """Run and return the exit status."""
    quick = arguments.quick
    console = Console()
    console.print(machine())
    compile_kernel()  # no browser is to wait for that
    rows: list[Row] = []

    def wanted(*parts: str) -> bool:
        return arguments.part in ("all", *parts)

    with tempfile.TemporaryDirectory(prefix="tensatlas-attack-") as name:
        folder = Path(name)
        run = folder / "clicked.tsmr"
        modules = MIN_MODULES if quick else MAX_MODULES
        write_run(run, evaluations=120 if quick else 600, initial=60 if quick else 200, modules=modules)
        cells = filled_cells(run)
        if wanted("clicks", "crowd", "leaving"):
            with explorer([run], folder) as server:
                if wanted("crowd"):
                    for n, goal in ({3: 60.0} if quick else CROWDS).items():
                        rows.append(crowd(server, cells, n, goal))
                if wanted("leaving"):
                    rows.append(leaving(server, cells, 2 if quick else 20))
                if wanted("clicks"):
                    floods, seconds = ((20,), 1.0) if quick else (FLOODS, arguments.seconds)
                    rows += clicks(server, cells, floods, seconds)
        if wanted("messages"):
            with explorer([run], folder, "--read-only") as server:
                rows += messages(server, cells, 20 if quick else 2000)
        if wanted("files"):
            rows += files(run, folder)
        if wanted("networks"):
            large = folder / "large.tsmr"
            write_run(
                large, evaluations=30, initial=20, modules=modules, controllers=[largest_network(quick)]
            )
            with explorer([large], folder) as server:
                rows += networks(server, filled_cells(large))
    show("The explorer under attack", rows, console)
    passed = all(row.passed is not False for row in rows)
    console.print("every figure is met" if passed else "a figure falls short")
    return int(not passed)


def filled_cells(path: Path) -> list[str]:
    """Return the filled cells of a run's last controller map, as a click names them."""
    with RunReader(path) as reader:
        elites = reader.elites(reader.generations()[-1])["controller"]
    return [f"controller:{cell_name(cell)}" for cell in elites]


def clicks(server: ServerProcess, cells: Sequence[str], floods: Sequence[int], seconds: float) -> list[Row]:
    """Send many clicks from one browser, and single ones from another."""
    rows = []
    with SyntheticBrowser(server.address) as busy, innocent(server, cells) as browser:
        opened(busy)
        for n in floods:
            for k in range(n):
                busy.click(cells[k % len(cells)])
            rows.append(
                answers(f"a click while another browser sends {n} at once", [answer(browser, cells[1])])
            )
            answer(browser, cells[0])
        with clicking(busy, cells):
            waits, k, end = [], 1, time.monotonic() + seconds
            while time.monotonic() < end:
                waits.append(answer(browser, cells[k % len(cells)]))
                k += 1
                time.sleep(PAUSE)
            started = time.perf_counter()
            with SyntheticBrowser(server.address) as late:
                late.arrive()
                opened(late)
            page = time.perf_counter() - started
    rows.append(answers(f"{len(waits)} clicks while another browser sends {RATE} a second", waits))
    rows.append(answers("a new page in the meantime", [page]))
    return rows


@contextlib.contextmanager
def clicking(browser: SyntheticBrowser, cells: Sequence[str]) -> Iterator[None]:
    """Let a browser click without end within a ``with`` block."""
    done = threading.Event()

    def go_on() -> None:
        k = 0
        while not done.wait(1.0 / RATE):
            browser.click(cells[k % len(cells)])
            k += 1

    thread = threading.Thread(target=go_on, daemon=True)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()


def crowd(server: ServerProcess, cells: Sequence[str], n: int, goal: float) -> Row:
    """Let browsers click at the same moment, each another robot."""
    with contextlib.ExitStack() as stack:
        browsers = [stack.enter_context(innocent(server, cells)) for _ in range(n)]
        marks = [browser.mark() for browser in browsers]
        cpu, started = server.cpu(), time.perf_counter()
        for browser, cell in zip(browsers, cells[1:], strict=False):
            browser.click(cell)
        waits = [
            browser.wait(brings_robot, mark) - started for browser, mark in zip(browsers, marks, strict=True)
        ]
        cpu = server.cpu() - cpu
    slow = float(np.percentile(waits, 95))
    return Row(
        f"{n} browsers that each click another robot at once, to the first frame, 95th percentile",
        f"{slow:.2f} s (median {np.median(waits):.2f} s, the last {max(waits):.2f} s;"
        f" server {cpu:.2f} s of CPU until then)",
        f"under {goal:g} s",
        slow < goal,
    )


def messages(server: ServerProcess, cells: Sequence[str], n: int) -> list[Row]:
    """Send what viser would decode into a gigabyte, and n messages that have the wrong types."""
    with innocent(server, cells) as browser:
        before, waits = server.peak(), []
        for k, size in enumerate((LOOKING - 100, 8 * 2**20)):
            hostile = [SyntheticBrowser(server.address) for _ in range(3)]
            for one in hostile:
                with contextlib.suppress(ConnectionClosed):
                    one.send_bytes(b"\x81\xa4type\xdd" + size.to_bytes(4, "big") + b"\x80" * size)
            waits.append(answer(browser, cells[k + 1]))
            for one in hostile:
                one.close()
        with SyntheticBrowser(server.address) as hostile_one:
            for k in range(n):
                hostile_one.send({"type": "GuiUpdateMessage", "uuid": [k], "updates": "\x1b[2J" * 100})
            waits.append(answer(browser, cells[0]))
        grown = server.peak() - before
    return [
        Row(
            "memory for 8 MB of empty maps from three browsers at once",
            f"{grown:+.1f} MB",
            f"at most {GROWTH:+.0f} MB",
            grown <= GROWTH,
        ),
        Row(
            f"lines on the terminal after {n} wrong messages",
            str(len(server.log)),
            "none",
            not server.log,
        ),
        answers("clicks in the meantime", waits),
    ]


def files(run: Path, folder: Path) -> list[Row]:
    """Offer a folder that has pipes in it, whose opening never ends."""
    place = folder / "pipes"
    place.mkdir()
    shutil.copy(run, place / "a.tsmr")
    for name in ("b.tsmr", "a.tsmr.lock", "a.robust.json"):
        os.mkfifo(place / name)
    with explorer([place], folder) as server:
        started = time.perf_counter()
        with SyntheticBrowser(server.address) as browser:
            browser.arrive()
            opened(browser)
        page = time.perf_counter() - started
        started = time.perf_counter()
        server.end()
        end = time.perf_counter() - started
    return [
        answers("a page with pipes among the runs", [page], PATIENCE),
        answers("the server's end by SIGTERM", [end], PATIENCE),
    ]


def networks(server: ServerProcess, cells: Sequence[str]) -> list[Row]:
    """Click robots whose networks are as large as may be."""
    before = server.peak()
    with innocent(server, cells) as browser:
        waits = []
        for cell in cells[1:4]:
            mark, started = browser.mark(), time.perf_counter()
            browser.click(cell)
            waits.append(browser.wait(brings_robot, mark) - started)
        time.sleep(PAUSE)
        grown = server.peak() - before
    return [
        answers("clicks on robots with the largest networks, to the first frame", waits, PATIENCE),
        Row("memory for them", f"{grown:+.0f} MB", f"at most {4 * GROWTH:+.0f} MB", grown <= 4 * GROWTH),
    ]


def largest_network(quick: bool) -> Controller:
    """Return a network with as many nodes and connections, and as many in a row, as a file may have."""
    n_nodes, n_links, depth = (100, 300, 20) if quick else (MAX_NODES, MAX_CONNECTIONS, MAX_DEPTH - 2)
    hidden = range(N_OUTPUTS, n_nodes)
    level = {k: i * depth // len(hidden) for i, k in enumerate(hidden)}
    rng = random.Random(0)
    pairs = {(-1 - k % 2, node) for k, node in enumerate(hidden)}
    pairs |= {(k, rng.randrange(N_OUTPUTS)) for k in hidden if level[k] == depth - 1}
    while len(pairs) < n_links:
        source, target = rng.sample(hidden, 2)
        if level[source] < level[target]:
            pairs.add((source, target))
    return Controller(
        n_inputs=2,
        nodes=tuple(NodeGene(k, 0.0) for k in range(n_nodes)),
        connections=tuple(
            ConnectionGene(a, b, rng.gauss(0.0, 1.0), True, k) for k, (a, b) in enumerate(sorted(pairs))
        ),
    )


def leaving(server: ServerProcess, cells: Sequence[str], n: int) -> Row:
    """Open pages that click and go."""
    with contextlib.ExitStack() as stack:
        browsers = [stack.enter_context(innocent(server, cells)) for _ in range(n)]
        for browser, cell in zip(browsers, cells[1:], strict=False):
            browser.click(cell)
    time.sleep(1.0)
    cpu, started = server.cpu(), time.perf_counter()
    time.sleep(2.0)
    share = (server.cpu() - cpu) / (time.perf_counter() - started)
    return Row(
        f"share of a core, a second after {n} pages have clicked and been closed",
        f"{share:.0%}",
        f"at most {IDLE:.0%}",
        share <= IDLE,
    )


@contextlib.contextmanager
def innocent(server: ServerProcess, cells: Sequence[str]) -> Iterator[SyntheticBrowser]:
    """Open a browser that has seen a robot already: what its first click loads is not the robot's."""
    with SyntheticBrowser(server.address) as browser:
        browser.arrive()
        opened(browser)
        browser.click(cells[0])
        browser.wait(brings_robot, 0)
        browser.set("Speed", "8 ×")
        yield browser


def answer(browser: SyntheticBrowser, cell: str) -> float:
    """Click a robot and return the seconds until its card is there."""
    mark, started = browser.mark(), time.perf_counter()
    browser.click(cell)
    return browser.wait(html_with("ta-card"), mark) - started


def answers(what: str, waits: Sequence[float], goal: float = ANSWER) -> Row:
    """Return a row about how long the answers took."""
    slow, longest = float(np.percentile(waits, 95)), f"{1000 * max(waits):.0f} ms"
    each = longest
    if len(waits) > 1:
        each = f"{1000 * slow:.0f} ms (median {1000 * np.median(waits):.0f}, longest {longest})"
    return Row(what, each, f"under {1000 * goal:.0f} ms", slow < goal)


if __name__ == "__main__":
    sys.exit(main(tyro.cli(Arguments)))
