"""The page that ``tensatlas compare`` writes, in a real browser."""

from __future__ import annotations

from pathlib import Path

import pytest
from playwright.sync_api import Browser, Request

from engine.analysis.comparison import compare_runs
from viz.report.report import render_page, report_sections

pytestmark = pytest.mark.browser


def test_the_report_draws_itself_without_a_network(
    chromium: Browser, small_run: Path, tmp_path: Path
) -> None:
    comparison = compare_runs([small_run])
    sections = report_sections(comparison)
    path = tmp_path / "report.html"
    path.write_text(render_page(comparison, sections), encoding="utf-8")
    page = chromium.new_page(viewport={"width": 1280, "height": 900})
    problems: list[str] = []

    def note_request(request: Request) -> None:
        if not request.url.startswith(("file:", "data:", "blob:")):
            problems.append(request.url)

    page.on("request", note_request)
    page.on("pageerror", lambda error: problems.append(str(error)))
    page.on("console", lambda message: problems.append(message.text) if message.type == "error" else None)
    page.goto(path.as_uri())
    names = [f.name for s in sections for f in s.figures]
    for name in names:
        page.wait_for_selector(f"#{name} svg.main-svg")
    assert problems == []
    # nothing is wider than the page, and no figure hides its colour bar
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    assert page.evaluate(
        "[...document.querySelectorAll('.ta-scroll')].every(e => e.scrollWidth <= e.clientWidth + 1)"
    )
    assert "cm" in (page.locator("#goal-reaching-maps .cbtitle").first.text_content() or "")
    page.close()
