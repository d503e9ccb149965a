"""A run is started from the form, paused, found again by another app, resumed, and mourned."""

from __future__ import annotations

import os
import re
import signal
from collections.abc import Callable
from pathlib import Path

import pytest
from playwright.sync_api import Locator, Page, expect

from app.server.server import serve
from engine.storage.lock import holder_of
from engine.storage.reader import RunReader
from engine.storage.writer import is_being_written
from tests.support.processes import free_port
from tests.support.software_chromium import eventually
from tests.support.widgets import choose, field_of, press

Visit = Callable[[str], Page]


def kill(run: Path) -> None:
    holder = holder_of(run)
    assert holder is not None
    os.kill(holder.pid, signal.SIGKILL)


def n_shown(page: Page) -> int:
    """Return the number of evaluations that the page says the run has."""
    found = re.search(r"(\d+) of 400", page.locator(".ta-progress").inner_text())
    assert found is not None
    return int(found[1])


def test_a_run_is_started_paused_found_again_resumed_and_its_end_explained(
    workplace: Path, visit: Visit, small_run: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).resolve().parents[2]))
    run, port = workplace / "runs" / "mine.tsmr", free_port()
    try:
        with serve([small_run], host="127.0.0.1", port=port):
            page = visit(f"http://127.0.0.1:{port}/")
            expect(page.locator(".ta-run b")).to_have_text("small")
            press(page, "New run")
            start = page.get_by_role("button", name="Start", exact=True)
            choose(page, "Preset", "smoke")
            expect(field_of(page, "Evaluations")).to_have_value("40")
            field_of(page, "Name").fill("../mine")
            expect(page.locator(".ta-problem")).to_contain_text("letters, digits")
            expect(start).to_be_disabled()
            field_of(page, "Name").fill("mine")
            field_of(page, "Evaluations").fill("400")
            page.get_by_text("More", exact=True).click()
            field_of(page, "Batch size").fill("3")
            expect(page.locator(".ta-problem").first).to_contain_text("batch_size must be an even number")
            expect(page.locator(".ta-problem")).to_have_count(2)  # by the field and by the button
            field_of(page, "Batch size").fill("2")
            field_of(page, "Initial").fill("4")
            expect(page.locator(".ta-problem")).to_have_count(0)
            # by keyboard: the folder may still be unfolding, and a button that moves away is missed
            start.press("Enter")
            expect(page.locator(".ta-run b")).to_have_text("mine")
            expect(page.locator(".ta-status")).to_contain_text("live")
            with RunReader(run) as reader:
                assert (reader.config.map_search.batch_size, reader.config.map_search.initial) == (2, 4)
                assert reader.config.evaluations == 400
            expect(page.locator(".ta-progress")).to_contain_text(re.compile(r"of 400 .* per .* left"))
            pause_of_run(page).click()
            expect(page.locator(".ta-status")).to_contain_text("paused")
            eventually(page, lambda: not is_being_written(run))
            n = n_shown(page)
            page.get_by_role("button", name="Resume run", exact=True).click()
            expect(page.locator(".ta-status")).to_contain_text("live")
            eventually(page, lambda: n_shown(page) > n + 4)
            pause_of_run(page).click()
            expect(page.locator(".ta-status")).to_contain_text("paused")
            with RunReader(run) as reader:
                eventually(page, lambda: n_shown(page) == reader.n_evaluations())
            press(page, "New run")
            start.press("Enter")
            expect(page.get_by_text("mine.tsmr exists already; choose another name")).to_be_visible()
        with serve([small_run], host="127.0.0.1", port=port):
            # another app, and the same page in it
            expect(page.locator(".ta-run b")).to_have_text("mine")
            expect(page.locator(".ta-status")).to_contain_text("paused")
            press(page, "Run")
            page.get_by_role("button", name="Resume run", exact=True).click()
            expect(page.locator(".ta-status")).to_contain_text("live")
        # the app has ended; the evolution has not
        assert is_being_written(run)
        with serve([small_run], host="127.0.0.1", port=port):
            expect(page.locator(".ta-status")).to_contain_text("live")
            press(page, "Run")
            kill(run)
            expect(page.locator(".ta-status")).to_contain_text("stopped")
            expect(page.locator(".ta-trouble")).to_contain_text(
                "The process ended before the run was complete"
            )
    finally:
        if is_being_written(run):
            kill(run)


def pause_of_run(page: Page) -> Locator:
    """Return the button that pauses the run, not the replay."""
    return page.get_by_role("button", name="Pause run", exact=True)
