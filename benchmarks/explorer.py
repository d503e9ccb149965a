"""How quick the explorer is: ``python -m benchmarks.explorer``.

Starts the app as a process of its own and plays the browsers: clients that speak viser's protocol and
draw nothing, so that all figures are the server's alone. Prints, of the first shipped run:

- how long and how much of a processor it takes until the robot that greets has moved;
- how long after Breed is pressed the first children of a robot of 4 modules are there;

and for robots of 10 modules:

- the time from a click to the first frame, of the first click after the app's start, of robots seen for the
  first time and of those seen before, and to the end of the replay if one scrubs there at once;
- what replays for ten browsers at once cost, in frames and bytes and in the share of one core;
- how the server's memory grows over many selections;
- how long a run of 45,000 evaluations takes to open, and what keeping its maps up to date costs.

The runs are made up by ``benchmarks.synthetic_run``. Exits with 1 if a figure falls short.
"""

from __future__ import annotations

import contextlib
import dataclasses
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Final, Literal

import numpy as np
import tyro
from rich.console import Console

from app.runs.library import PROJECT_ARCHIVES
from benchmarks.clicking import SIMULATED, Place, opened, places, select, show_generation, whole
from benchmarks.rows import Row, show
from benchmarks.server_process import ServerProcess, cpu_of, explorer
from benchmarks.synthetic_browser import SyntheticBrowser, html_with, moves_robot
from benchmarks.synthetic_run import SyntheticRun, write_run
from benchmarks.timing import machine
from engine.body.module import MAX_MODULES, MIN_MODULES
from engine.config import preset, replaced

SHIPPED: Final = PROJECT_ARCHIVES / "goal-reaching-dm-me.tsmr"
GREETING: Final = 3.0
"""Seconds from a page's connection until the robot that greets has moved."""
GREETING_CPU: Final = 1.0
"""CPU seconds of the server for that."""
CHILDREN: Final = 3.0
"""Seconds from a press on Breed to the first children."""
PARENT: Final = "morphology:2,1"
"""Cell of a robot of four modules in the first shipped run."""
FIRST_FRAME: Final = 0.08
"""Seconds from a click to the first frame that 95 of 100 clicks must not exceed, nor the first one of all."""
WHOLE: Final = 0.3
"""Seconds from a click until any time of the replay can be scrubbed to."""
FRAME_RATE: Final = 30.0
"""Frames a second that a player shows; one less in the mean is taken for the same."""
CORE_SHARE: Final = 0.6
"""Of one core, for all the replays together."""
FRAME_BYTES: Final = 16_000
GROWTH: Final = 20.0
"""MB that the server's memory may grow by over the selections, once it is warm."""
OPENING: Final = 1.0
"""Seconds to open the long run."""
UPDATE: Final = 0.1
"""CPU seconds of the server to bring a browser's maps up to date."""
NEWS: Final = 1.0
"""Seconds from a generation's end to its maps."""
PATIENCE: Final = 600.0
"""Seconds that all browsers' replays may take to be simulated at once."""
WARM: Final = 100
"""Selections before memory is first looked at."""


Part = Literal["all", "greeting", "breeding", "starts", "clicks", "replays", "memory", "opening", "updating"]


@dataclasses.dataclass(frozen=True, kw_only=True)
class Arguments:
    """Measure the explorer."""

    part: Part = "all"
    """What to measure."""

    starts: int = 5
    """Times to start the app and click."""
    clicks: int = 40
    """Robots to click, once for the first time and once again."""
    clients: int = 10
    """Browsers that replay at once."""
    seconds: float = 10.0
    """Of replays to measure."""
    selections: int = 500
    """To watch the memory over."""
    evaluations: int = 45_000
    """Of the run to open."""
    updates: int = 10
    """Generations to add to a run that is watched."""
    quick: bool = False
    """Few of everything and small robots: shows that the benchmark works, not what the explorer can do."""


def main(arguments: Arguments) -> int:
    """Run and return the exit status."""
    a = arguments
    if a.quick:
        a = dataclasses.replace(
            a,
            starts=1,
            clicks=2,
            clients=2,
            seconds=1.0,
            selections=4,
            evaluations=600,
            updates=1,
            quick=True,
        )
    console = Console()
    console.print(machine())
    rows: list[Row] = []

    def wanted(*parts: str) -> bool:
        return a.part == "all" or a.part in parts

    with tempfile.TemporaryDirectory(prefix="tensatlas-benchmark-") as name:
        folder = Path(name)
        clicked = folder / "clicked.tsmr"
        runs = [clicked]
        n_robots = a.selections if wanted("memory") else a.clicks
        modules = MIN_MODULES if a.quick else MAX_MODULES
        if wanted("starts", "clicks", "replays", "memory", "opening"):
            write_run(clicked, evaluations=2 * n_robots + 200, initial=200, modules=modules)
        robots = places(clicked) if clicked.exists() else []
        if wanted("greeting"):
            rows += greeting(folder, a.starts)
        if wanted("breeding") and not a.quick:  # an evolution is not quick
            rows += breeding(folder)
        if wanted("starts"):
            rows += first_clicks(clicked, folder, robots, a.starts)
        if wanted("opening"):
            long = folder / "long.tsmr"
            write_run(long, evaluations=a.evaluations)
            runs.append(long)
        if wanted("opening", "clicks", "replays", "memory"):
            with explorer(runs, folder) as server:
                if wanted("opening"):
                    rows += opening(server, a.evaluations)
                if wanted("clicks"):
                    rows += first_frames(server, robots, a.clicks)
                if wanted("replays"):
                    rows += replays(server, robots, a.clients, a.seconds)
                if wanted("memory"):
                    rows += memory(server, robots, a.selections)
        if wanted("updating"):
            rows += updating(folder, a.evaluations, a.updates)
    show("The explorer, seen from its browsers", rows, console)
    passed = all(row.passed is not False for row in rows)
    console.print("every figure is met" if passed else "a figure falls short")
    return int(not passed)


def greeting(folder: Path, n: int) -> list[Row]:
    """Start the app and open two pages, one after the other, several times."""
    waits: list[list[float]] = [[], []]
    costs: list[list[float]] = [[], []]
    for _ in range(n):
        with explorer([SHIPPED], folder) as server:
            for page in (0, 1):
                cpu, started = server.cpu(), time.perf_counter()
                with SyntheticBrowser(server.address) as browser:
                    browser.arrive()
                    waits[page].append(browser.wait(moves_robot, 0) - started)
                    costs[page].append(server.cpu() - cpu)
    return [
        Row(
            f"opening the {which} page until its robot moves, median of {n} starts",
            f"{np.median(wait):.2f} s (server {np.median(cost):.2f} s of CPU)",
            f"under {GREETING:g} s, {GREETING_CPU:g} s of CPU",
            bool(np.median(wait) < GREETING and np.median(cost) < GREETING_CPU),
        )
        for which, wait, cost in zip(("first", "second"), waits, costs, strict=True)
    ]


def breeding(folder: Path) -> list[Row]:
    """Breed a robot of four modules."""
    with explorer([SHIPPED], folder) as server, SyntheticBrowser(server.address) as browser:
        browser.arrive()
        opened(browser)
        mark = browser.mark()
        browser.click(PARENT)
        browser.wait(html_with("cell 2,1"), mark)
        mark, started = browser.mark(), time.perf_counter()
        browser.set("Breed", True)
        wait = browser.wait(html_with('class="ta-keep"'), mark) - started
        cost = cpu_of(str(folder / "runs"))
        browser.set("Stop breeding", True)
    return [
        Row(
            "from a press on Breed to the first children, robots of 4 modules",
            f"{wait:.2f} s (the run {cost:.2f} s of CPU)",
            f"under {CHILDREN:g} s",
            wait < CHILDREN,
        )
    ]


def first_clicks(run: Path, folder: Path, robots: Sequence[Place], n: int) -> list[Row]:
    """Start the app, open a page and click, several times."""
    waits = []
    for _ in range(n):
        with explorer([run], folder) as server, SyntheticBrowser(server.address) as browser:
            opened(browser)
            show_generation(browser, robots[0])
            waits.append(select(browser, robots[0]))
    return [
        Row(
            f"the first click after the start, median of {n} starts",
            f"{1000 * np.median(waits):.0f} ms (longest {1000 * max(waits):.0f})",
            f"under {1000 * FIRST_FRAME:.0f} ms",
            bool(np.median(waits) < FIRST_FRAME),
        )
    ]


def first_frames(server: ServerProcess, robots: Sequence[Place], n: int) -> list[Row]:
    """Click robots for the first time, then again."""
    rows = []
    with SyntheticBrowser(server.address) as browser:
        opened(browser)
        select(browser, robots[n])  # what the first click of all loads is not the robot's
        for what in ("for the first time", "again"):
            cpu = server.cpu()
            waits = [select(browser, robot) for robot in robots[:n]]
            cpu = (server.cpu() - cpu) / n
            slow = float(np.percentile(waits, 95))
            rows.append(
                Row(
                    f"click to first frame, robots clicked {what}, 95th percentile of {n}",
                    f"{1000 * slow:.0f} ms (median {1000 * np.median(waits):.0f};"
                    f" server {1000 * cpu:.0f} ms of CPU)",
                    f"under {1000 * FIRST_FRAME:.0f} ms",
                    slow < FIRST_FRAME,
                )
            )
        cpu = server.cpu()
        waits = [whole(browser, robot) for robot in robots[:n]]
        cpu = (server.cpu() - cpu) / n
    rows.append(
        Row(
            f"click to the end of the whole replay, scrubbed to, median of {n}",
            f"{1000 * np.median(waits):.0f} ms (95th percentile {1000 * np.percentile(waits, 95):.0f};"
            f" server {1000 * cpu:.0f} ms of CPU)",
            f"under {1000 * WHOLE:.0f} ms",
            bool(np.median(waits) < WHOLE),
        )
    )
    return rows


def replays(server: ServerProcess, robots: Sequence[Place], n: int, seconds: float) -> list[Row]:
    """Replay for several browsers at once what has been simulated."""
    with contextlib.ExitStack() as stack:
        browsers = [stack.enter_context(SyntheticBrowser(server.address, PATIENCE)) for _ in range(n)]
        for browser in browsers:
            opened(browser)
            browser.set("Loop", True)
            select(browser, robots[0])
        for browser in browsers:  # until nothing is left to simulate: then playing is all that costs
            browser.wait(html_with(SIMULATED), 0)
        frames, n_bytes = [b.n_frames for b in browsers], sum(b.n_bytes for b in browsers)
        cpu, started = server.cpu(), time.perf_counter()
        time.sleep(seconds)
        took, cpu = time.perf_counter() - started, server.cpu() - cpu
        shown = [b.n_frames - f for b, f in zip(browsers, frames, strict=True)]
        n_bytes = sum(b.n_bytes for b in browsers) - n_bytes
    slowest, share, each = min(shown) / took, cpu / took, n_bytes / max(sum(shown), 1)
    return [
        Row(
            f"frames a second for {n} browsers, the slowest one's",
            f"{slowest:.1f}",
            f"at least {FRAME_RATE - 1:.0f}",
            slowest >= FRAME_RATE - 1,
        ),
        Row("share of one core for them", f"{share:.0%}", f"at most {CORE_SHARE:.0%}", share <= CORE_SHARE),
        Row("bytes per frame", f"{each:,.0f}", f"at most {FRAME_BYTES:,}", each <= FRAME_BYTES),
    ]


def memory(server: ServerProcess, robots: Sequence[Place], n: int) -> list[Row]:
    """Select robots one after the other and watch what the server holds."""
    warm = min(WARM, n // 2)
    with SyntheticBrowser(server.address) as browser:
        opened(browser)
        for k, robot in enumerate(robots[:n]):
            if k == warm:
                before = server.memory()
            select(browser, robot)
        after = server.memory()
    return [
        Row(
            f"memory after {len(robots[:n])} robots selected, one after the other",
            f"{after:.0f} MB, {after - before:+.1f} MB since {warm}",
            f"no more than {GROWTH:+.0f} MB",
            after - before <= GROWTH,
        )
    ]


def opening(server: ServerProcess, evaluations: int) -> list[Row]:
    """Open the long run from another one."""
    with SyntheticBrowser(server.address) as browser:
        opened(browser)
        waits, costs = [], []
        for number in (1, 0, 1):
            mark = browser.mark()
            browser.click("runs:0", "run clicks")
            browser.wait(html_with("run:1"), mark)
            mark, cpu, started = browser.mark(), server.cpu(), time.perf_counter()
            browser.click(f"run:{number}", "run clicks")
            # the trend is drawn last
            waits.append(browser.wait(html_with("ta-trend"), mark) - started)
            costs.append(server.cpu() - cpu)
    first, again = waits[0], waits[2]
    return [
        Row(
            f"opening a run of {evaluations:,} evaluations",
            f"{1000 * first:.0f} ms, again {1000 * again:.0f} ms (server {1000 * costs[0]:.0f} ms of CPU)",
            f"under {1000 * OPENING:.0f} ms",
            first < OPENING,
        )
    ]


def updating(folder: Path, evaluations: int, n: int) -> list[Row]:
    """Add generations to a run that a browser watches."""
    path = folder / "live.tsmr"
    config = replaced(preset("atlas"), evaluations=evaluations, initial=min(1080, evaluations // 2))
    with SyntheticRun(path, config) as run:
        run.add_generation()
        with explorer([path], folder) as server, SyntheticBrowser(server.address) as browser:
            opened(browser)
            costs, waits, sizes = [], [], []
            for _ in range(n):
                time.sleep(1.0)
                quiet = server.cpu()
                time.sleep(1.0)
                quiet = server.cpu() - quiet
                mark, size, cpu = browser.mark(), browser.n_bytes, server.cpu()
                run.add_generation()
                started = time.perf_counter()
                waits.append(browser.wait(html_with("ta-trend"), mark) - started)
                time.sleep(max(0.0, started + 1.0 - time.perf_counter()))
                costs.append(server.cpu() - cpu - quiet)
                sizes.append(browser.n_bytes - size)
    return [
        Row(
            "CPU time to bring the maps of a live run up to date",
            f"{1000 * float(np.mean(costs)):.0f} ms, {np.mean(sizes):,.0f} bytes"
            f" (watching costs {100 * quiet:.0f} % of a core)",
            f"under {1000 * UPDATE:.0f} ms",
            float(np.mean(costs)) < UPDATE,
        ),
        Row(
            "from the end of a generation to its maps, the longest",
            f"{1000 * max(waits):.0f} ms",
            f"under {1000 * NEWS:.0f} ms",
            max(waits) < NEWS,
        ),
    ]


if __name__ == "__main__":
    sys.exit(main(tyro.cli(Arguments)))
