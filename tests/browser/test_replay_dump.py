"""What a user does with a failure dump, done in a real Chromium."""

from __future__ import annotations

import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from engine.replay.dump import Dump, read_dump
from tests.support.exploded import evolve
from tests.support.processes import environment, free_port
from tests.support.widgets import field_of

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def dump_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What an evolution of robots that fly apart left behind."""
    return min(evolve(tmp_path_factory.mktemp("exploded") / "boom.tsmr"))


@pytest.fixture
def address(dump_file: Path) -> Iterator[str]:
    port = free_port()
    command = ["replay-dump", str(dump_file), "--port", str(port), "--no-browser"]
    app = subprocess.Popen(
        [sys.executable, "-m", "app", *command],
        env=environment(),
        stdout=subprocess.DEVNULL,
        # a test run in the background of a script ignores Ctrl-C, and so would the app
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    try:
        deadline = time.monotonic() + 60
        while not _answers(port):
            assert time.monotonic() < deadline, "it never listened"
            time.sleep(0.1)
        yield f"http://127.0.0.1:{port}"
        app.send_signal(signal.SIGINT)
        app.wait(timeout=30)
    finally:
        app.kill()


@pytest.fixture
def dump(dump_file: Path) -> Dump:
    return read_dump(dump_file)


def test_a_dump_shows_its_reason_and_its_last_moments(
    address: str, dump: Dump, visit: Callable[[str], Page]
) -> None:
    page = visit(address)
    card, line = page.locator(".ta-card"), page.locator(".ta-replay")
    expect(card).to_contain_text(f"Robot {dump.failed.solution.number}")
    expect(card).to_contain_text(dump.failed.failure.reason)
    # it plays by itself, up to the failure
    expect(line).to_have_text("0.00 s before the simulation was stopped")
    expect(page.get_by_role("button", name="Play")).to_be_visible()
    # scrubbing
    field = field_of(page, "Time")
    field.fill("-0.5")
    field.press("Enter")
    expect(line).to_have_text("0.50 s before the simulation was stopped")
    page.get_by_role("button", name="Play").click()
    expect(line).to_have_text(re.compile(r"0\.[0-4]\d s before the simulation was stopped"))
    page.get_by_role("button", name="Pause").click()
    expect(page.get_by_role("button", name="Play")).to_be_visible()
    page.wait_for_timeout(500)
    held = line.text_content() or ""
    page.wait_for_timeout(1500)
    assert line.text_content() == held
    assert 0.0 < float(held.split()[0]) < 0.5
    # to the end, then from the start again
    page.get_by_role("button", name="Play").click()
    expect(line).to_have_text("0.00 s before the simulation was stopped")
    expect(page.get_by_role("button", name="Play")).to_be_visible()
    # right after the end a click is taken for a pause that came late
    page.wait_for_timeout(500)
    page.get_by_role("button", name="Play").click()
    expect(line).not_to_have_text(re.compile(r"^0\.0"))


def _answers(port: int) -> bool:
    with socket.socket() as s:
        return s.connect_ex(("127.0.0.1", port)) == 0
