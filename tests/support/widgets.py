"""Finds viser's widgets on a page."""

from __future__ import annotations

import re

from playwright.sync_api import Locator, Page


def field_of(page: Page, label: str) -> Locator:
    """Return the text or number field that viser shows beside a label."""
    flex = "xpath=ancestor::div[contains(@class, 'Flex-root')][1]//input[not(@type='hidden')]"
    return page.locator("label", has_text=re.compile(f"^{label}$")).locator(flex).last


def choose(page: Page, label: str, option: str) -> None:
    """Choose from the list that viser shows beside a label."""
    field_of(page, label).click()
    page.get_by_role("option", name=option, exact=True).click()
