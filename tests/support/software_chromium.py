"""Debian's Chromium, drawing on the processor."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from typing import Any, Final

from playwright.sync_api import Browser, BrowserContext, Page, Playwright

FLAGS: Final = (
    "--no-sandbox",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    # the page itself is drawn faster without the emulated graphics card
    "--disable-gpu-rasterization",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
)

PATIENCE: Final = 60_000
"""Milliseconds: software rendering on a busy machine takes its time."""
COARSE: Final = 0.5
"""Pixels of the screen per pixel of a page, along each side: a quarter has to be drawn."""
TEN_HERTZ: Final = """{
  const draw = requestAnimationFrame.bind(window);
  let waiting = new Map(), asked = 0, timer = 0;
  const frame = time => {
    const now = waiting;
    [waiting, timer] = [new Map(), 0];
    for (const step of now.values()) step(time);
  };
  window.requestAnimationFrame = step => {
    waiting.set(++asked, step);
    timer ||= setTimeout(() => draw(frame), 80);
    return asked;
  };
  window.cancelAnimationFrame = number => waiting.delete(number);
}"""
"""Lets a page draw its animations ten times a second, as a slow screen does."""


def launch(playwright: Playwright) -> Browser:
    """Start the first that is installed."""
    found = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    return playwright.chromium.launch(executable_path=found, args=list(FLAGS))


def open_context(
    browser: Browser,
    width: int = 1280,
    height: int = 720,
    *,
    moving: bool = False,
    sharp: bool = False,
    **options: Any,
) -> BrowserContext:
    """Open a browser session whose pages are drawn with little work, coarsely and seldom.

    Args:
        browser: that opens it.
        width, height: of its pages, in their pixels.
        moving: whether pages may move by themselves.
        sharp: whether every pixel is drawn: for tests that look at some.
        options: others of Playwright's.
    """
    context = browser.new_context(
        viewport={"width": width, "height": height},
        device_scale_factor=1.0 if sharp else COARSE,
        reduced_motion="no-preference" if moving else "reduce",
        **options,
    )
    context.add_init_script(TEN_HERTZ)
    return context


def eventually(page: Page, condition: Callable[[], object]) -> None:
    """Wait until something is true, of the page or of its server, which follows the page a moment later.

    Raises:
        AssertionError: If it is still false after `PATIENCE`.
    """
    for _ in range(PATIENCE // 100):
        if condition():
            return
        page.wait_for_timeout(100)
    raise AssertionError("waited in vain")
