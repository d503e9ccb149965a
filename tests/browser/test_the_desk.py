"""Everything in its place: the bar, its windows, the slim replay, at three sizes; nothing is cut off."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from PIL import Image
from playwright.sync_api import Browser, Page, expect

from tests.support.software_chromium import PATIENCE, open_context
from tests.support.widgets import click_cell, field_of, press, unfold

pytestmark = pytest.mark.browser
Visit = Callable[..., Page]
FILLED = 'svg.ta-map[data-map=morphology] g[data-filled="1"]'
CUT = """() => {
  const shown = e => e.checkVisibility() && e.getBoundingClientRect().width > 0;
  const cut = e => { const r = e.getBoundingClientRect(); return r.left < -1 || r.right > innerWidth + 1 };
  return [...document.querySelectorAll('button, input, .ta-bar *, svg.ta-map, .ta-card')]
    .filter(e => shown(e) && cut(e)).map(e => e.outerHTML.slice(0, 90));
}"""
"""What is on the page and reaches beyond its left or right edge."""


def test_the_bar_the_replay_and_what_is_remembered(address: str, visit: Visit) -> None:
    page = visit(address)
    number, card = click_cell(page, page.locator(FILLED).first), page.locator(".ta-card")
    expect(page).to_have_title(f"TensAtlas · robot {number} of small")

    # the scene has half of the window, and what is needed seldom is folded away
    scene = page.locator("canvas[data-engine]").bounding_box()
    assert scene is not None
    assert scene["width"] >= 640
    expect(page.get_by_role("button", name="Draw")).to_be_hidden()
    unfold(page)
    expect(page.get_by_role("button", name="Draw")).to_be_visible()
    unfold(page)
    expect(page.get_by_role("button", name="Draw")).to_be_hidden()
    expect(page.locator(".tabler-icon-adjustments")).to_be_hidden()  # viser's own settings

    # a moment beyond the end is the end, also in the field
    expect(page.locator(".ta-replay")).to_contain_text("exactly as evaluated")
    time = field_of(page, "Time")
    time.fill("99")
    time.press("Tab")
    expect(time).to_have_value("2")

    # one window at a time
    expect(page.get_by_role("button", name="Start", exact=True)).to_have_count(0)
    press(page, "New run")
    expect(page.get_by_role("button", name="Start", exact=True)).to_be_visible()
    # however long it is, it leaves the replay's controls free
    page.wait_for_function(
        "() => { const edges = s => document.querySelector(s).closest('.mantine-Paper-root')"
        ".getBoundingClientRect();"
        " return edges('[data-ta-mark=window]').bottom <= edges('.ta-replay').top + 1 }"
    )
    press(page, "Take along")
    expect(page.get_by_role("button", name="Add to basket")).to_be_visible()
    expect(page.get_by_role("button", name="Start", exact=True)).to_have_count(0)
    press(page, "Take along")
    expect(page.get_by_role("button", name="Add to basket")).to_have_count(0)

    # a picture of the scene that is not empty
    with page.expect_download() as waiting:
        page.get_by_role("button", name="Save a picture of the scene").click()
    assert waiting.value.suggested_filename == f"TensAtlas-robot-{number}-of-small.png"
    with Image.open(waiting.value.path()) as picture:
        # a slow browser draws fewer points
        assert picture.width / picture.height == pytest.approx(scene["width"] / scene["height"], rel=0.02)
        assert picture.width > scene["width"] / 3
        assert len(picture.getcolors(maxcolors=1 << 20) or ()) > 100
    page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    page.get_by_role("button", name="Copy the address of what you see").click()
    expect(page.locator(".ta-done")).to_be_visible()
    assert page.evaluate("navigator.clipboard.readText()") == page.url

    # light stays light
    page.get_by_role("button", name="Light or dark").click()
    light = page.locator('html[data-mantine-color-scheme="light"]')
    expect(light).to_be_attached()
    page.wait_for_function("localStorage.getItem('tensatlas-theme') === 'light'")
    page.reload()
    expect(card).to_be_visible()
    expect(light).to_be_attached()


def check_nothing_is_cut(page: Page) -> None:
    """Check that nothing reaches beyond the edges of the page, whichever window is open."""
    assert page.evaluate(CUT) == []
    for window in ("Elites", "Run", "New run", "Breed", "Compare", "Side by side", "Take along"):
        press(page, window)
        page.wait_for_timeout(300)
        assert page.evaluate(CUT) == [], window


def test_nothing_reaches_beyond_a_window_of_either_size(address: str, visit: Visit) -> None:
    page = visit(address)
    page.set_viewport_size({"width": 1600, "height": 900})
    click_cell(page, page.locator(FILLED).first)
    unfold(page)
    check_nothing_is_cut(page)
    page.set_viewport_size({"width": 1280, "height": 720})
    check_nothing_is_cut(page)


def test_a_phone_begins_with_the_maps_and_shows_all_of_them(address: str, chromium: Browser) -> None:
    context = open_context(chromium, 390, 844)
    page = context.new_page()
    page.set_default_timeout(PATIENCE)
    page.goto(address)
    map_, robot = page.locator("svg.ta-map").first, page.locator(".ta-card")
    expect(map_).to_be_visible()
    expect(robot).to_be_attached()
    # the sheet is still growing when its map is there
    page.wait_for_function("document.querySelector('svg.ta-map').getBoundingClientRect().y < 844 - 200")
    above, below = page.evaluate(
        """() => ['svg.ta-map', '.ta-card'].map(name => {
            const box = document.querySelector(name).getBoundingClientRect();
            return [box.top, box.bottom];
        })"""
    )
    assert below[0] > above[1]
    # the line of the greeting lies above the sheet, not behind it
    line = page.locator(".ta-line")
    expect(line).to_contain_text("Click any square.")
    box = line.bounding_box()
    assert box is not None
    page.wait_for_function(
        "([x, y]) => document.elementFromPoint(x, y)?.matches('canvas')", arg=[195, box["y"] + box["height"]]
    )
    page.locator(FILLED).first.click(force=True, no_wait_after=True)
    expect(robot).to_be_visible()
    unfold(page)
    check_nothing_is_cut(page)
    context.close()
