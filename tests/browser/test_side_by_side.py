"""Robots side by side, and robots that might have been, in a real Chromium."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest
from playwright.sync_api import Page, expect

from engine.storage.reader import RunReader
from tests.support.software_chromium import eventually
from tests.support.widgets import best_distance, field_of, press

pytestmark = pytest.mark.browser
Visit = Callable[[str], Page]

FILLED = 'svg.ta-map[data-map=morphology] g[data-filled="1"]'


def choose_robot(page: Page, nth: int) -> int:
    """Click a filled cell and return the number of its robot."""
    tile = page.locator(FILLED).nth(nth)
    cell = (tile.get_attribute("data-c") or "").split(":")[1]
    tile.click(force=True, no_wait_after=True)
    card = page.locator(".ta-card", has_text=f"cell {cell}")
    card.wait_for()
    return int(re.search(r"Robot (\d+)", card.inner_text())[1])


def button(page: Page, name: str) -> None:
    page.get_by_role("button", name=name, exact=True).last.click(force=True, no_wait_after=True)


def test_pinned_robots_crawl_side_by_side(address: str, visit: Visit, small_reader: RunReader) -> None:
    page = visit(address)
    page.locator(FILLED).first.wait_for()
    press(page, "Side by side")
    numbers = []
    for nth in range(3):
        numbers.append(choose_robot(page, nth))
        button(page, "Pin")
        expect(page.get_by_role("button", name=f"Unpin {'ABC'[nth]}")).to_be_visible()
    table = page.locator(".ta-differences")
    robots = table.locator("tr", has=page.locator("td", has_text=re.compile("^robot$")))
    expect(robots.locator("td").nth(3)).to_have_text(str(numbers[2]))
    expect(robots).to_have_class("differs")
    expect(table.locator("tr", has_text=re.compile("^run"))).to_have_class("same")
    button(page, "Replay in lanes")
    best, _ = best_distance(small_reader.evaluation(numbers[2]))  # of the robot that was chosen last
    # the distances to go end where each was evaluated
    now = page.locator(".ta-lanes")
    expect(now).to_contain_text(re.compile(r"A \d+\.\d.*B \d+\.\d.*C \d+\.\d"))
    expect(page.locator(".ta-replay")).to_contain_text("2.0 s")
    for letter, number in zip("ABC", numbers, strict=True):
        distance = 100 * small_reader.evaluation(number).distances[best, 0]
        # the last frame follows what the transport says
        shown = re.compile(rf"{letter}\s+(-?[\d.]+)")
        way = pytest.approx(distance, abs=0.3)
        eventually(page, lambda shown=shown, way=way: float(shown.search(now.inner_text())[1]) == way)
    # they are there after a reload, and they are seen
    page.reload()
    press(page, "Side by side", "3")
    expect(now).to_contain_text(re.compile(r"A \d+\.\d.*B \d+\.\d.*C \d+\.\d"))
    # one less, then one robot again
    page.get_by_role("button", name="Unpin B").click(force=True, no_wait_after=True)
    expect(table.locator("thead th")).to_have_count(3)
    expect(now).not_to_contain_text("C")
    button(page, "Back to one robot")
    expect(now).to_have_count(0)
    expect(page.locator(".ta-replay")).to_contain_text("exactly as evaluated")


def test_a_changed_body_is_simulated_beside_the_original(
    address: str, visit: Visit, small_reader: RunReader
) -> None:
    page = visit(address)
    page.locator(FILLED).first.wait_for()
    number = choose_robot(page, 0)
    evaluation = small_reader.evaluation(number)
    body = evaluation.solution.morphology
    before = small_reader.n_evaluations()
    page.get_by_role("tab", name="What if").click(force=True, no_wait_after=True)
    face = next(f for f in range(1, 9) if f != body.faces[0])
    page.locator(f'.ta-genes [data-c="face:0,{face}"]').click(force=True, no_wait_after=True)
    result = page.locator(".ta-what-if")
    expect(result).to_contain_text("at the end")
    ahead = result.locator("tr", has_text="90° left").locator("td")
    assert float(ahead.nth(1).inner_text()) == pytest.approx(100 * evaluation.distances[0, 0], abs=0.06)
    change = float(ahead.nth(2).inner_text()) - float(ahead.nth(1).inner_text())
    assert float(ahead.nth(3).inner_text()) == pytest.approx(change, abs=0.11)
    expect(page.locator(".ta-replay")).to_contain_text("what if")
    # another change supersedes it, one out of range is refused
    modules = field_of(page, "Modules")
    modules.fill(str(body.n_modules + 1))
    modules.press("Enter")
    expect(page.locator(".ta-genes [data-c^='face:'][data-c$=',1']")).to_have_count(body.n_modules + 1)
    expect(result).to_contain_text("at the end")
    button(page, "Watch the original")
    expect(page.locator(".ta-replay")).to_contain_text("exactly as evaluated")
    button(page, "As it was")
    expect(result).to_have_count(0)
    expect(page.locator(".ta-genes [data-c^='face:'][data-c$=',1']")).to_have_count(body.n_modules)
    assert small_reader.n_evaluations() == before
