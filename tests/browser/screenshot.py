"""Take the README's picture of the real app: ``python -m tests.browser.screenshot OUT [RUN]``."""

from __future__ import annotations

import sys
from pathlib import Path

from playwright.sync_api import sync_playwright

from app.runs.library import PROJECT_ARCHIVES, Library
from app.server.server import serve
from tests.support.software_chromium import launch

WAIT = 90_000


def take(out: Path, run: Path, seconds: float, size: tuple[int, int] = (1600, 900)) -> None:
    """Open a run, and wait until the replay of the robot that greets has reached a time."""
    with serve([run], host="127.0.0.1", port=0) as server, sync_playwright() as playwright:
        browser = launch(playwright)
        # the camera does not circle then, so that the picture is always the same
        page = browser.new_page(viewport={"width": size[0], "height": size[1]}, reduced_motion="reduce")
        page.set_default_timeout(WAIT)
        page.goto(f"http://127.0.0.1:{server.get_port()}")
        page.locator(".ta-line", has_text="Click any square.").wait_for()
        page.wait_for_function(
            "s => parseFloat(document.querySelector('.ta-replay').textContent) >= s", arg=seconds
        )
        page.get_by_role("button", name="Pause").click()
        page.mouse.move(size[0] / 2, 5)
        page.wait_for_timeout(2500)
        out.parent.mkdir(parents=True, exist_ok=True)
        page.screenshot(path=out)
        browser.close()


if __name__ == "__main__":
    library = Library([PROJECT_ARCHIVES])
    chosen = Path(sys.argv[2]) if len(sys.argv) > 2 else library.runs()[0]
    library.close()
    take(Path(sys.argv[1]), chosen, seconds=30.0)
