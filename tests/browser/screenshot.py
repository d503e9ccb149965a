"""Pictures of the real app: ``python -m tests.browser.screenshot [PART ...]``, as ``make screenshot`` does.

The parts are ``still`` and ``animation``, which the README shows, and ``screens``, the main screens of the
app for ``docs/screens``; a screen's name or a part of it, such as ``breed-390``, takes only those. All show
the shipped runs, drawn by Chromium without a graphics card.
"""

from __future__ import annotations

import contextlib
import shutil
import sys
import tempfile
from pathlib import Path
from typing import Final

from playwright.sync_api import Browser, sync_playwright

from app.runs.library import PROJECT_ARCHIVES, Library
from app.server.server import serve
from tests.browser import animation, screens
from tests.support.software_chromium import launch

DOCS: Final = Path(__file__).resolve().parents[2] / "docs"


def main(parts: list[str]) -> None:
    """Take the pictures, all or those of some parts."""
    library = Library([PROJECT_ARCHIVES])
    runs = [path.resolve() for path in library.runs()]
    library.close()
    named = [p for p in parts if p not in ("still", "animation", "screens")]
    # what is evolved for a picture goes into a folder that is gone afterwards
    with tempfile.TemporaryDirectory() as name, contextlib.chdir(name), sync_playwright() as playwright:
        folder = Path(name) / "atlas"
        folder.mkdir()
        copies = [Path(shutil.copy(run, folder)) for run in runs]
        for path in runs[0].parent.glob("*.robust.json"):
            shutil.copy(path, folder)
        browser = launch(playwright)
        with serve(copies, host="127.0.0.1", port=0) as server:
            address = f"http://127.0.0.1:{server.get_port()}"
            if not parts or "still" in parts:
                still(browser, address, DOCS / "explorer.png")
            if not parts or "animation" in parts:
                animation.take(browser, address, DOCS / "explorer.webp")
            if not parts or "screens" in parts or named:
                if not named or any("breed" in n for n in named):
                    screens.breed(browser, address)
                screens.take(browser, address, DOCS / "screens", named)
        browser.close()


def still(browser: Browser, address: str, out: Path) -> None:
    """Take the picture of the robot that greets."""
    page = screens.opened(browser, address, screens.SIZES["1600"], "dark")
    page.locator(".ta-line", has_text="Click any square.").wait_for()
    screens.hold(page, 30.0)
    page.wait_for_timeout(2500)
    page.screenshot(path=out)
    page.context.close()


if __name__ == "__main__":
    main(sys.argv[1:])
