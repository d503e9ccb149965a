"""A real Chromium against a real server."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect, sync_playwright

from app.server.server import serve
from tests.support.software_chromium import PATIENCE, launch, open_context

expect.set_options(timeout=PATIENCE)


@pytest.fixture(scope="package")
def chromium() -> Iterator[Browser]:
    """A browser that ends with these tests, and with it an event loop that others would find running."""
    with sync_playwright() as playwright:
        browser = launch(playwright)
        yield browser
        browser.close()


@pytest.fixture
def workplace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty current folder, where runs/ appears."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def address(workplace: Path, small_run: Path) -> Iterator[str]:
    """The app, showing the small run."""
    with serve([small_run], host="127.0.0.1", port=0) as server:
        yield f"http://127.0.0.1:{server.get_port()}"


@pytest.fixture
def visit(chromium: Browser) -> Iterator[Callable[..., Page]]:
    """Open pages, each in a browser session of its own."""
    contexts = []

    def open_page(url: str, *, sharp: bool = False) -> Page:
        context = open_context(chromium, sharp=sharp, accept_downloads=True)
        contexts.append(context)
        page = context.new_page()
        page.set_default_timeout(PATIENCE)
        page.goto(url)
        return page

    yield open_page
    for context in contexts:
        context.close()
