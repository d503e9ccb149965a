"""What a synthetic browser's user does in the explorer: opens it, clicks robots, scrubs."""

from __future__ import annotations

import dataclasses
import time
from pathlib import Path
from typing import Final

from benchmarks.synthetic_browser import SyntheticBrowser, brings_robot, html_with, moves_robot
from engine.search.archive import cell_name
from engine.storage.reader import RunReader

SIMULATED: Final = "evaluated"
"""What the line of the transport says as soon as a trial has been simulated to its end."""
END: Final = 40.0
"""Seconds of the trial's clock at its end."""


@dataclasses.dataclass(frozen=True, slots=True)
class Place:
    """Where a robot can be clicked: a generation of the slider and a cell as a click names it."""

    generation: int
    cell: str


def places(path: Path) -> list[Place]:
    """Return where robots can be clicked that were elites of a run's controller map, the newest first.

    Without those of the last generation, which is the one that is shown at first.
    """
    with RunReader(path) as reader:
        changes, last = reader.placement_changes("controller"), reader.last_generation()
    found = {n: Place(g, f"controller:{cell_name(cell)}") for g, cell, n in changes if n and g != last}
    return sorted(found.values(), key=lambda p: -p.generation)


def opened(browser: SyntheticBrowser) -> None:
    """Wait until a browser shows its first run, the trend last."""
    browser.wait(html_with("ta-trend"), 0)


def show_generation(browser: SyntheticBrowser, robot: Place) -> None:
    """Let the maps show the generation in which a robot can be clicked."""
    if browser.generation != robot.generation:
        mark = browser.mark()
        browser.set("Generation", robot.generation)
        browser.wait(html_with("ta-trend"), mark)
        browser.generation = robot.generation


def whole(browser: SyntheticBrowser, robot: Place) -> float:
    """Click a robot, scrub to the end of its trial, and return the seconds until that has been simulated."""
    show_generation(browser, robot)
    mark, started = browser.mark(), time.perf_counter()
    browser.click(robot.cell)
    browser.wait(brings_robot, mark)
    browser.set("Time", END)
    return browser.wait(html_with(SIMULATED), mark) - started


def select(browser: SyntheticBrowser, robot: Place) -> float:
    """Click a robot and return the seconds until it is there."""
    show_generation(browser, robot)
    mark, started = browser.mark(), time.perf_counter()
    browser.click(robot.cell)
    arrived = browser.wait(brings_robot, mark)
    browser.wait(moves_robot, mark)
    return arrived - started
