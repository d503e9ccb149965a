"""What ``marks.js`` marks, so that no style has to ask what an element contains."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page

import app
from app.gui.page_channel import page_file

ONE, OTHER = "01234567-89ab-cdef-0123-456789abcdef", "fedcba98-7654-3210-fedc-ba9876543210"


@pytest.fixture
def page(chromium: Browser) -> Iterator[Page]:
    """An empty page with the script, which came twice, as when a browser connects again."""
    page = chromium.new_page()
    page.set_content("<main></main>")
    for _ in range(2):
        page.evaluate(page_file("marks.js", "app.gui"))
    yield page
    page.close()


def add(page: Page, content: str) -> None:
    """Let the page draw some HTML. What happens before it is drawn has happened then."""
    page.evaluate("async content => { document.querySelector('main').innerHTML = content }", content)


def marked(page: Page, selector: str) -> list[str]:
    return page.evaluate("s => [...document.querySelectorAll(s)].map(e => e.title || e.localName)", selector)


def test_widgets_are_found_by_their_ids(page: Page) -> None:
    add(
        page,
        f'<div title="input"><div><div title="label"><p><label for="{ONE}">X</label></p></div>'
        f'<div><input id="{ONE}"></div></div></div><div title="button"><button id="{OTHER}">Y</button></div>'
        '<div title="a part of something else"><div id="panel"></div><label for="name">Z</label></div>',
    )
    assert marked(page, f'[data-ta-box="{ONE}"]') == ["input"]
    assert marked(page, "[data-ta-label]") == ["label"]
    assert marked(page, f'[data-ta-around="{OTHER}"]') == ["button"]
    assert marked(page, "[data-ta-box]") == ["input"]
    # an element that becomes another widget's
    page.evaluate(f"document.querySelector('label').htmlFor = '{OTHER}'")
    assert marked(page, f'[data-ta-box="{OTHER}"]') == ["input"]
    assert not marked(page, f'[data-ta-box="{ONE}"]')


def test_what_is_around_an_element_is_marked_while_it_is_there(page: Page) -> None:
    add(
        page,
        '<div title="panel"><div title="part"><i data-ta-mark="bar"></i></div><b title="beside"></b></div>',
    )
    assert marked(page, '[data-ta-in~="bar"]') == ["html", "body", "main", "panel", "part"]
    assert marked(page, '[data-ta-in~="bar-1"]') == ["part"]
    assert marked(page, '[data-ta-in~="bar-2"]') == ["panel"]
    page.evaluate("document.querySelector('b').innerHTML = '<i data-ta-mark=window></i>'")
    assert marked(page, '[data-ta-in~="window-1"]') == ["beside"]
    assert marked(page, '[data-ta-in~="window"][data-ta-in~="bar"]') == ["html", "body", "main", "panel"]
    page.evaluate("document.querySelector('[title=part]').remove()")
    assert not marked(page, '[data-ta-in~="bar"]')
    assert marked(page, '[data-ta-in~="window-1"]') == ["beside"]
    add(page, "")
    assert not marked(page, "[data-ta-in]")


def test_a_panel_on_a_phone_is_told_from_one_that_floats(page: Page) -> None:
    sheet = '<div title="sheet"><div style="grid-template-rows: 1fr" title="place"><p>{}</p></div></div>'
    add(page, sheet.format('<style data-ta-mark="robot"></style><style data-ta-mark="window"></style>'))
    assert marked(page, '[data-ta-in~="sheet-1"]') == ["sheet"]
    assert not marked(page, '[data-ta-in~="floating"]')
    add(page, '<div class="mantine-Paper-root"><p><style data-ta-mark="window"></style></p></div>')
    assert marked(page, 'html[data-ta-in~="floating"]') == ["html"]


def test_no_style_asks_what_an_element_contains() -> None:
    """Each change of any part of the page would cost as much as drawing it anew: see ``marks.js``."""
    asking = [
        (path.name, rule)
        for path in Path(app.__file__).parent.rglob("*")
        if path.suffix in (".css", ".py", ".js") and path.name != "marks.js"
        for rule in re.findall(r"\S*:has\([^)]*\)", path.read_text(encoding="utf-8"))
    ]
    # the focus changes without a change of the page
    assert set(asking) == {("archives_panel.css", ".ta-picture:has(.ta-map:focus-visible)")}
