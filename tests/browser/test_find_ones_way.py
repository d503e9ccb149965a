"""A newcomer finds their way: a greeting, hints, the command palette, notices that say what to do."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from playwright.sync_api import Browser, Page, expect

from app.gui.viser_private import inputs_of
from app.server.server import serve

Visit = Callable[[str], Page]
WAIT = 60_000
"""Milliseconds for software rendering on a busy machine."""


def test_a_bare_start_explains_itself_and_every_control_says_what_it_does(
    workplace: Path, visit: Visit, small_run: Path
) -> None:
    with serve([small_run], host="127.0.0.1", port=0) as server:
        page = visit(f"http://127.0.0.1:{server.get_port()}/")
        expect(page.locator(".ta-run b")).to_have_text("small")
        expect(page.locator(".ta-line")).to_contain_text("Click any square.")
        (client,) = server.get_clients().values()
        controls = inputs_of(client.gui)
        assert len(controls) > 40
        silent = [str(c.label) for c in controls if not c.hint]
        assert silent == []
        # the palette has the main actions
        page.keyboard.press("Control+k")
        search = page.get_by_placeholder("Search commands...")
        for label in ("Choose a run", "Play or pause the replay", "Pause this run", "Start the new run"):
            expect(page.get_by_text(label, exact=True)).to_be_visible()
        search.fill("Choose a run")
        page.keyboard.press("Enter")
        expect(page.locator(".ta-runs [role=option]")).to_be_visible()


def test_without_a_run_the_page_says_how_to_get_one(workplace: Path, visit: Visit) -> None:
    with serve([workplace], host="127.0.0.1", port=0) as server:
        page = visit(f"http://127.0.0.1:{server.get_port()}/?run=lost")
        expect(page.get_by_text("There is no run to show yet.")).to_be_visible()
        expect(page.get_by_text("There is no run 'lost' here; choose one from the list.")).to_be_visible()
        for number in ("1", "2", "3"):
            expect(page.locator("p", has_text=f"{number} ·")).to_be_visible()
        # what cannot be done says what to do first
        page.keyboard.press("Control+k")
        page.get_by_placeholder("Search commands...").fill("Export")
        page.get_by_text("Export this robot", exact=True).click()
        expect(page.get_by_text("Click a filled cell of a map first.")).to_be_visible()


def test_a_phone_begins_with_the_maps(address: str, chromium: Browser) -> None:
    context = chromium.new_context(viewport={"width": 390, "height": 844}, reduced_motion="reduce")
    page = context.new_page()
    page.set_default_timeout(WAIT)
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
    context.close()
