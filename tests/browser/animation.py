"""A short animation of the real app: maps fill, a square is clicked, its robot crawls; see ``screenshot``.

Every frame is a picture of a page that stands still, so that it does not matter how slowly it is drawn.
"""

from __future__ import annotations

import io
from pathlib import Path
from typing import Final

from PIL import Image, ImageDraw
from playwright.sync_api import Browser, Page

from tests.browser.screens import hold, opened
from tests.support.widgets import field_of

PAGE: Final = (1280, 720)
SIZE: Final = (1000, 562)
"""Of the animation, in pixels."""
QUALITY: Final = 50
MOST: Final = 3_000_000
"""Bytes."""
GENERATIONS: Final = (0, 1, 3, 6, 10, 16, 25, 40, 60, 90, 130, 180, 234)
"""Shown one after the other, while the maps fill."""
SETTLE: Final = 500
"""Milliseconds until a page has drawn what it shows."""
CELL: Final = "2,0"
"""Of the morphology archive, that is clicked."""
POINTER: Final = ((0, 0), (0, 17), (4, 13), (7, 20), (10, 19), (7, 12), (13, 12))
"""Corners of an arrow, in pixels of the page; no screenshot has the pointer."""


class _Film:
    """Frames, and how long each is shown, in ms."""

    def __init__(self, page: Page) -> None:
        self._page = page
        self.frames: list[Image.Image] = []
        self.times: list[int] = []

    def add(self, milliseconds: int, pointer: tuple[float, float] | None = None) -> None:
        """Add what the page shows, with the pointer at a place of it."""
        picture = Image.open(io.BytesIO(self._page.screenshot())).convert("RGB")
        if pointer is not None:
            corners = [(pointer[0] + x, pointer[1] + y) for x, y in POINTER]
            ImageDraw.Draw(picture).polygon(corners, fill="white", outline="black")
        self.frames.append(picture.resize(SIZE, Image.Resampling.LANCZOS))
        self.times.append(milliseconds)

    def save(self, path: Path) -> None:
        """Write the animation."""
        first, *others = self.frames
        first.save(
            path, save_all=True, append_images=others, duration=self.times, loop=0, quality=QUALITY, method=6
        )
        if path.stat().st_size > MOST:
            raise SystemExit(f"{path} has {path.stat().st_size / 1e6:.1f} MB, more than {MOST / 1e6:.1f}")


def take(browser: Browser, address: str, out: Path) -> None:
    """Write the animation."""
    page = opened(browser, address, PAGE, "dark")
    page.locator(".ta-line", has_text="Click any square.").wait_for()
    film = _Film(page)
    for k, generation in enumerate(GENERATIONS):
        field = field_of(page, "Generation")
        field.fill(str(generation))
        field.press("Enter")
        hold(page, 2.0 + 0.8 * k, SETTLE)
        film.add(1200 if generation == GENERATIONS[-1] else 220)
    square = page.locator(f'g[data-c="morphology:{CELL}"]')
    box = square.bounding_box()
    assert box is not None
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    for part in (0.0, 0.4, 0.75, 0.95):
        film.add(90, (x + 320 * (1 - part), y - 120 * (1 - part)))
    page.mouse.move(x - 2, y)
    page.mouse.move(x, y)
    page.locator("#ta-tip svg.ta-body").wait_for()
    page.wait_for_timeout(800)
    film.add(1600, (x, y))
    page.mouse.click(x, y)
    page.locator(".ta-card", has_text=f"cell {CELL}").wait_for()
    hold(page, 0.0)
    for k in range(50):
        hold(page, 0.8 * k, SETTLE)
        film.add(90)
    hold(page, 40.0)
    film.add(2000)
    film.save(out)
    page.context.close()
