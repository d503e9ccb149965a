"""What a user does to compare runs in the app, done in a real Chromium, while another one looks on."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from app.server.server import serve
from tests.support.widgets import click_cell, press

pytestmark = pytest.mark.browser


def test_runs_are_compared_in_a_window_and_the_report_is_downloaded(
    workplace: Path, small_run: Path, visit: Callable[[str], Page]
) -> None:
    other, broken = workplace / "other.tsmr", workplace / "broken.tsmr"
    shutil.copy(small_run, other)
    broken.write_text("no run")
    with serve([small_run, other, broken], host="127.0.0.1", port=0) as server:
        address = f"http://127.0.0.1:{server.get_port()}"
        page, bystander = visit(address), visit(address)
        # two browsers have their own selection
        click_cell(page, page.locator('svg.ta-map[data-map=morphology] g[data-filled="1"]').first)
        bystander.locator("svg.ta-map[data-map=morphology]").wait_for()
        expect(bystander.locator(".ta-line")).to_contain_text("Click any square.")
        assert "robot=" not in bystander.url
        press(page, "Compare")
        choices = page.locator(".ta-choices [role=checkbox]")
        chosen = page.locator(".ta-choices [aria-checked=true]")
        expect(chosen).to_have_count(2)
        expect(choices.nth(2)).to_be_disabled()
        # nothing chosen is one clear notice
        page.get_by_role("button", name="none", exact=True).click()
        expect(chosen).to_have_count(0)
        compare = page.get_by_role("button", name="Compare these runs", exact=True)
        compare.press("Enter")
        expect(page.get_by_text("Choose at least one run to compare.")).to_be_visible()
        choices.nth(0).click()
        choices.nth(1).click()
        expect(chosen).to_have_count(2)
        compare.press("Enter")
        window = page.get_by_role("dialog")
        expect(window).to_contain_text("2 runs of goal reaching")
        expect(window).to_contain_text("share the seed 7")
        expect(window.locator("table.ta-table").first).to_contain_text("25.76")
        # ends, best fitness, QD score and coverage, cells, maps, nested maps: all drawn, none too wide
        expect(window.locator(".js-plotly-plot")).to_have_count(6)
        expect(window.locator(".js-plotly-plot svg.main-svg").first).to_be_attached()
        content = page.locator(".mantine-Modal-content")
        assert content.evaluate("e => e.scrollWidth <= e.clientWidth")
        with page.expect_download() as waiting:
            window.get_by_role("button", name="Report").click()
        assert waiting.value.suggested_filename == "report.html"
        report = Path(waiting.value.path()).read_text(encoding="utf-8")
        assert "2 runs of goal reaching" in report
        assert "Plotly.newPlot" in report
        page.keyboard.press("Escape")
        expect(window).to_have_count(0)
        assert bystander.get_by_role("dialog").count() == 0
        # the last comparison is kept; a run that has gone is one clear notice
        expect(page.get_by_role("button", name="Show again")).to_be_visible()
        other.unlink()
        compare.press("Enter")
        expect(page.get_by_text("That did not work").first).to_be_visible()
