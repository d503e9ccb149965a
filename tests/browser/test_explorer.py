"""What a user does in the explorer, done in a real Chromium."""

from __future__ import annotations

import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from app.gui.viser_private import inputs_of
from app.server.server import serve
from engine.storage.reader import RunReader
from tests.support.faulty import wait_until
from tests.support.processes import environment, free_port
from tests.support.widgets import best_distance, press

pytestmark = pytest.mark.browser
Visit = Callable[[str], Page]

MAP = "svg.ta-map[data-map={}]"
SEND = """value => {
    const label = [...document.querySelectorAll('label')].find(l => l.textContent == 'clicks');
    let e = label, input = null;
    while (e && !(input = e.querySelector('input'))) e = e.parentElement;
    Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, 'value').set.call(input, value);
    input.dispatchEvent(new Event('input', {bubbles: true}));
}"""
"""Sends a value through the channel of the clicks."""


def tile(page: Page, archive: str, filled: bool, nth: int = 0):
    return page.locator(f'{MAP.format(archive)} g[data-filled="{int(filled)}"]').nth(nth)


def click(target) -> None:
    # the mouse goes down on a picture that may be redrawn before it comes up again
    target.click(force=True, no_wait_after=True)


def test_maps_are_clicked_and_robots_replay(
    workplace: Path, small_run: Path, small_reader: RunReader, visit: Visit
) -> None:
    with serve([small_run], host="127.0.0.1", port=0) as server:
        page = visit(f"http://127.0.0.1:{server.get_port()}")
        last = small_reader.last_generation()
        assert last is not None
        line, card, replay = (page.locator(f".ta-{name}") for name in ("line", "card", "replay"))
        for archive in ("morphology", "controller"):
            placed = small_reader.placements(archive, last)
            filled = page.locator(f'{MAP.format(archive)} g[data-filled="1"]')
            expect(filled).to_have_count(len(placed))

        # what strangers send through the channel of the clicks is dropped
        (client,) = server.get_clients().values()
        (channel,) = (c for c in inputs_of(client.gui) if c.label == "clicks")
        for garbage in (
            "morphology:99,99|1",
            "controller:-1,2|1",
            "../x:1,1|1",
            "x" * 5000,
            "",
            "morphology:1|2",
        ):
            page.evaluate(SEND, garbage)
            # of values that are set at once, the last one alone is sent
            wait_until(lambda wanted=garbage: channel.value == wanted)
        expect(line).to_contain_text("Click any square.")

        # an empty cell says so
        click(tile(page, "morphology", False))
        expect(page.get_by_text("Empty cell", exact=True).first).to_be_visible()
        expect(page.get_by_text("No robot of the morphology archive")).to_be_visible()
        expect(line).to_contain_text("Click any square.")

        # a filled one replays its robot to the end, which is exactly the one that was evaluated
        chosen = tile(page, "morphology", True)
        cell = tuple(int(i) for i in chosen.get_attribute("data-c").split(":")[1].split(","))
        number = small_reader.placements("morphology", last)[cell]
        click(chosen)
        expect(line).to_be_empty()
        expect(card).to_contain_text(f"Robot {number}")
        expect(replay).to_contain_text("exactly as evaluated")
        _, distance = best_distance(small_reader.evaluation(number))
        expect(replay).to_contain_text(f"{distance:.2f} cm at 2 s")

        # within two seconds of the click, or at another try: the machine may be busy with something else
        waits = []
        for nth in range(8):
            chosen = tile(page, "controller", True, nth)
            name = chosen.get_attribute("data-c").split(":")[1]
            started = time.monotonic()
            click(chosen)
            page.locator(".ta-card", has_text=f"cell {name}").wait_for()
            page.locator(".ta-replay", has_text=re.compile(r"-?\d\.\d s")).wait_for()
            waits.append(time.monotonic() - started)
            if waits[-1] < 2.0:
                break
        assert min(waits) < 2.0, waits


def test_a_live_run_changes_the_maps_without_a_reload(workplace: Path, visit: Visit) -> None:
    """An evolution in a process of its own, a bare app that finds it, one page that is never reloaded."""
    run = workplace / "runs" / "live.tsmr"
    flags = ["--preset", "smoke", "--seed", "3", "--workers", "1", "--evaluations", "20000"]
    evolution = subprocess.Popen(
        [sys.executable, "-m", "app", "evolve", str(run), *flags, "--initial", "4", "--batch-size", "2"],
        env=environment(),
        stderr=subprocess.DEVNULL,
    )
    port = free_port()
    app = None
    try:
        wait_until(lambda: run.exists() and RunReader(run).last_generation() is not None)
        app = subprocess.Popen(
            [sys.executable, "-m", "app", "explore", str(run), "--port", str(port)],
            env=environment(),
            stdout=subprocess.DEVNULL,
        )
        wait_until(lambda: _answers(port))
        page = visit(f"http://127.0.0.1:{port}")
        expect(page.locator(".ta-status")).to_contain_text("live")
        page.evaluate("window.never_reloaded = true")
        before = tile(page, "morphology", True).locator("xpath=ancestor::*[name()='svg']")
        drawn = before.inner_html()
        page.wait_for_function(
            "old => document.querySelector('svg.ta-map[data-map=morphology]')?.innerHTML != old", arg=drawn
        )
        assert page.evaluate("window.never_reloaded") is True
        press(page, "Run")
        page.get_by_role("button", name="Stop run").click()
        assert evolution.wait(timeout=60) == 130
        expect(page.locator(".ta-status")).to_contain_text("stopped")
    finally:
        for process in (evolution, app):
            if process is not None and process.poll() is None:
                process.send_signal(signal.SIGKILL)
                process.wait()


def _answers(port: int) -> bool:
    with socket.socket() as s:
        return s.connect_ex(("127.0.0.1", port)) == 0
