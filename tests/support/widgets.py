"""Finds viser's widgets on a page."""

from __future__ import annotations

import re

from playwright.sync_api import Locator, Page

from engine.simulation.evaluation import Evaluation


def field_of(page: Page, label: str) -> Locator:
    """Return the text or number field that viser shows beside a label."""
    flex = "xpath=ancestor::div[contains(@class, 'Flex-root')][1]//input[not(@type='hidden')]"
    return page.locator("label", has_text=re.compile(f"^{label}$")).locator(flex).last


def press(page: Page, name: str, badge: str = "") -> None:
    """Press the button of a window in the bar at the top, which opens it or closes it.

    After a reload the buttons move as what they count is found again: then only with its badge.
    """
    page.locator(".ta-bar button", has_text=re.compile(f"^{name}.*{badge}")).click()


def click_cell(page: Page, cell: Locator) -> int:
    """Click a cell of a map and return its robot's number, once the card is its own, not the greeter's."""
    name = (cell.get_attribute("data-c") or "").partition(":")[2]
    chosen = re.compile(rf"cell={name}&robot=(\d+)")
    cell.click(force=True, no_wait_after=True)
    page.wait_for_url(chosen)
    found = chosen.search(page.url)
    assert found is not None
    page.locator(".ta-card", has_text=f"Robot {found[1]} ").wait_for()
    return int(found[1])


def unfold(page: Page) -> None:
    """Show the controls of the replay that are folded away."""
    page.locator(".ta-fold").click()


def choose(page: Page, label: str, option: str) -> None:
    """Choose from the list that viser shows beside a label."""
    field_of(page, label).click()
    page.get_by_role("option", name=option, exact=True).click()


def best_distance(evaluation: Evaluation) -> tuple[int, float]:
    """Return the target that a clicked robot is replayed towards, and how far from it it ends, in cm."""
    means = evaluation.distances.mean(axis=1)
    return int(means.argmin()), 100 * float(evaluation.distances[means.argmin(), 0])
