"""Pictures of the app's main screens, at three sizes, dark and light: see ``screenshot``."""

from __future__ import annotations

import contextlib
import dataclasses
import io
import itertools
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final, Literal

from PIL import Image
from playwright.sync_api import Browser, Page
from playwright.sync_api import TimeoutError as PlaywrightTimeoutError

from tests.support.widgets import field_of, press

WAIT: Final = 240_000
"""Milliseconds: without a graphics card, on a busy machine."""
QUALITY: Final = 62
"""Of the pictures, as WebP counts it."""
SIZES: Final = {"1600": (1600, 900), "1280": (1280, 720), "390": (390, 844)}
Theme = Literal["dark", "light"]


@dataclasses.dataclass(frozen=True, slots=True)
class Screen:
    """A picture to take.

    Attributes:
        name: of its file, and what it shows.
        about: a sentence about it, for the list of pictures.
        arrange: brings a page to show it.
        query: what the page's address ends with.
        top: of what the sheet of a phone shows first, as a selector.
    """

    name: str
    about: str
    arrange: Callable[[Page], None]
    query: str = ""
    top: str = ""


def _greeting(page: Page) -> None:
    if page.locator(".ta-views").bounding_box()["x"] > 300:  # type: ignore[index]
        hold(page, 24.0)
        return
    # what is typed would scroll the sheet of a phone
    page.wait_for_function("parseFloat(document.querySelector('.ta-replay')?.textContent) >= 20")
    pause = page.get_by_role("button", name="Pause", exact=True)
    with contextlib.suppress(PlaywrightTimeoutError):  # it may have come to its end
        pause.click(force=True, timeout=5_000)
    page.mouse.move(*_nowhere(page))
    page.wait_for_timeout(2500)


def _robot(page: Page) -> None:
    page.locator('g[data-c="morphology:2,0"]').click(force=True, no_wait_after=True)
    page.locator(".ta-card", has_text="cell 2,0").wait_for()
    hold(page, 12.0)
    page.get_by_role("tab", name="Servos").click()
    servos = page.locator("svg.ta-servos")
    servos.scroll_into_view_if_needed()
    page.locator('svg.ta-servos [data-m="3"] > .ta-back').hover(force=True)
    page.locator("style.ta-lit").wait_for(state="attached")


def _what_if(page: Page) -> None:
    _robot(page)
    page.get_by_role("tab", name="What if").click()
    page.locator('.ta-genes [data-c="face:2,7"]').scroll_into_view_if_needed()
    page.locator('.ta-genes [data-c="face:2,7"]').click(force=True)
    page.locator(".ta-what-if", has_text="at the end").wait_for()
    page.locator(".ta-what-if").scroll_into_view_if_needed()
    hold(page, 30.0)


def _breed(page: Page) -> None:
    press(page, "Breed")
    page.locator(".ta-children .ta-tile").nth(10).wait_for()
    best = page.locator(".ta-children .ta-tile").first
    number = best.get_attribute("data-number")
    best.locator(".ta-play").press("Enter")
    page.locator(f'.ta-children [data-number="{number}"][data-shown="1"]').wait_for()
    page.locator(".ta-card", has_text=f"Robot {number} ").wait_for()
    page.locator(".ta-children .ta-tile").nth(2).locator(".ta-keep").press("Enter")
    hold(page, 12.0)


def _window(label: str) -> Callable[[Page], None]:
    def arrange(page: Page) -> None:
        hold(page, 24.0)
        press(page, label)
        page.wait_for_timeout(1500)

    return arrange


def _enlarged(page: Page) -> None:
    hold(page, 24.0)
    page.locator('[title^="Enlarge"], [aria-label^="Enlarge"]').first.click(force=True)
    page.wait_for_timeout(1000)


def _side_by_side(page: Page) -> None:
    for cell in ("0,0", "2,0", "5,0"):
        page.locator(f'g[data-c="morphology:{cell}"]').click(force=True, no_wait_after=True)
        page.locator(".ta-card", has_text=f"cell {cell}").wait_for()
        page.get_by_role("button", name="Pin", exact=True).click(force=True)
        page.wait_for_timeout(500)
    press(page, "Side by side")
    page.get_by_role("button", name="Replay in lanes").click(force=True)
    page.locator(".ta-lanes", has_text=re.compile(r"C\s+\d")).wait_for()
    hold(page, 30.0)


def _compare(page: Page) -> None:
    press(page, "Compare")
    page.wait_for_timeout(1000)  # viser's client drops what follows within 50 ms
    page.get_by_role("button", name="Compare these runs", exact=True).press("Enter")
    page.get_by_role("dialog").locator(".js-plotly-plot svg.main-svg").first.wait_for()
    page.wait_for_timeout(6000)


def _through(page: Page) -> None:
    page.locator('g[data-c="morphology:2,2"]').click(force=True, no_wait_after=True)
    page.locator(".ta-card", has_text="cell 2,2").wait_for()
    field_of(page, "Target").click()
    page.get_by_role("option", name="2:").click()
    hold(page, 190.0)


FIRST: Final = Screen(
    "first", "what a stranger sees: the best robot crawls, a square is to be clicked", _greeting
)
ROBOT: Final = Screen("robot", "a robot chosen on a map; a module that is pointed at lights up", _robot)
WHAT_IF: Final = Screen("what-if", "the same controller on a changed body", _what_if)
BREED: Final = Screen(
    "breed", "children of a chosen robot, the best first", _breed, "?run=breed-1", ".ta-parents"
)
RUN: Final = Screen(
    "run", "how far a run is, its configuration and notes", _window("Run"), top=".ta-progress"
)
NEW_RUN: Final = Screen("new-run", "the form of a new run", _window("New run"), top="[data-ta-mark=window]")
ELITES: Final = Screen("elites", "all elites as a list that is searched", _window("Elites"))
TAKE: Final = Screen("take-along", "robots to take along", _window("Take along"))
MAP: Final = Screen("map", "a map that fills the window", _enlarged)
SIDE: Final = Screen("side-by-side", "three robots in lanes", _side_by_side)
COMPARE: Final = Screen("compare", "runs compared", _compare)
APERTURE: Final = Screen(
    "aperture",
    "a robot with feet that has come through the aperture to its target",
    _through,
    "?run=squeezing-feet-200s",
)
ALBUM: Final[Sequence[tuple[str, Theme, Sequence[Screen]]]] = (
    ("1600", "dark", (FIRST, ROBOT, SIDE, COMPARE, APERTURE)),
    ("1600", "light", (FIRST, BREED)),
    ("1280", "dark", (FIRST, WHAT_IF, BREED)),
    ("1280", "light", (ROBOT, ELITES, MAP)),
    ("390", "dark", (FIRST, BREED, NEW_RUN)),
    ("390", "light", (FIRST, ROBOT, RUN)),
)
"""Size, theme and screens of every page."""


def hold(page: Page, seconds: float, settle: int = 1500) -> None:
    """Hold the replay at a moment, and wait so many milliseconds until it is drawn."""
    page.locator(".ta-replay", has_text=re.compile(r"\d\.\d s")).wait_for()
    pause = page.get_by_role("button", name="Pause", exact=True)
    if pause.count():
        pause.click(force=True)
    field, said = field_of(page, "Time"), page.locator(".ta-replay", has_text=f"{seconds:.1f} s")
    for attempt in itertools.count():  # a moment may not be simulated yet; an equal value would not be sent
        field.fill(f"{seconds + 0.01 * (attempt % 2):g}")
        field.press("Enter")
        with contextlib.suppress(PlaywrightTimeoutError):
            said.wait_for(timeout=5_000)
            break
    page.mouse.move(*_nowhere(page))
    page.wait_for_timeout(settle)


def _nowhere(page: Page) -> tuple[float, float]:
    """Return a place where a pointer points at nothing."""
    size = page.viewport_size
    assert size is not None
    return (size["width"] / 2, 3) if size["width"] > 576 else (3, 160)


def breed(browser: Browser, address: str) -> None:
    """Let a run of children be evolved, which the pictures of breeding show."""
    page = opened(browser, address, (1280, 720), "dark")
    page.locator('g[data-c="morphology:2,1"]').click(force=True, no_wait_after=True)
    page.locator(".ta-card", has_text="cell 2,1").wait_for()
    press(page, "Breed")
    page.get_by_role("button", name="Breed", exact=True).and_(page.locator(":not(.ta-bar *)")).press("Enter")
    page.locator(".ta-children", has_text="40 of 40 children").wait_for()
    page.context.close()


def take(browser: Browser, address: str, folder: Path, wanted: Sequence[str] = ()) -> None:
    """Take the pictures of the album, or those with names that are wanted, such as ``breed-390``."""
    folder.mkdir(parents=True, exist_ok=True)
    for size, theme, screens in ALBUM:
        for screen in screens:
            name = f"{screen.name}-{size}-{theme}"
            if wanted and not any(w in name for w in wanted):
                continue
            page = opened(browser, f"{address}/{screen.query}", SIZES[size], theme)
            screen.arrange(page)
            if size == "390" and screen.top:  # what was typed has scrolled viser's sheet
                page.evaluate("document.activeElement.blur()")
                for _ in range(2):
                    page.evaluate(f"document.querySelector('{screen.top}').scrollIntoView()")
                    page.wait_for_timeout(700)
            save(page, folder / f"{name}.webp")
            page.context.close()


def save(page: Page, path: Path) -> None:
    """Save what a page shows as a small file."""
    with Image.open(io.BytesIO(page.screenshot())) as picture:
        picture.convert("RGB").save(path, quality=QUALITY, method=6)


def opened(browser: Browser, address: str, size: tuple[int, int], theme: Theme) -> Page:
    """Return a page of the app in a browser session of its own, in which nothing moves by itself."""
    context = browser.new_context(
        viewport={"width": size[0], "height": size[1]}, reduced_motion="reduce", color_scheme=theme
    )
    context.add_init_script(f"localStorage.setItem('tensatlas-theme', '{theme}')")
    page = context.new_page()
    page.set_default_timeout(WAIT)
    page.goto(address)
    return page
