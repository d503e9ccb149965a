"""Many runs are searched, sorted, read, noted, renamed, repeated and deleted."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from app.server.server import serve
from tests.support.widgets import choose, field_of, press

pytestmark = pytest.mark.browser
Visit = Callable[[str], Page]


def test_runs_are_found_noted_renamed_repeated_and_deleted(
    workplace: Path, small_run: Path, grid_run: Path, visit: Visit
) -> None:
    folder = workplace / "many"
    folder.mkdir()
    for k in range(12):
        shutil.copy(small_run, folder / f"run-{k:02}.tsmr")
    shutil.copy(grid_run, folder / "grid.tsmr")
    with serve([folder], host="127.0.0.1", port=0) as server:
        page = visit(f"http://127.0.0.1:{server.get_port()}/?run=run-03")
        shown, rows = page.locator(".ta-run b"), page.locator(".ta-runs [role=option]")
        expect(shown).to_have_text("run-03")

        # its configuration, a note, another name
        press(page, "Run")
        page.get_by_text("Configuration", exact=True).click()
        expect(page.locator(".ta-configuration pre")).to_contain_text("seed = 7")
        field_of(page, "Note")
        note = page.locator("textarea:not([aria-hidden])")
        note.fill("wins by luck")
        page.get_by_role("button", name="Keep note").click()
        expect(page.get_by_text("The note lies beside")).to_be_visible()
        field_of(page, "Name").fill("lucky")
        page.get_by_role("button", name="Rename").click()
        expect(shown).to_have_text("lucky")
        assert (folder / "lucky.tsmr.note.txt").read_text() == "wins by luck"
        assert not (folder / "run-03.tsmr").exists()

        # found by its note, and by its name among those sorted
        page.locator(".ta-run").click()
        expect(rows).to_have_count(13)
        choose(page, "Sort by", "best f_s")
        field_of(page, "Search").fill("luck")
        expect(rows).to_have_count(1)
        field_of(page, "Search").fill("grid")
        expect(rows).to_have_count(1)
        expect(rows).to_contain_text("grid")
        field_of(page, "Search").fill("")
        expect(rows).to_have_count(13)
        page.locator(".ta-run").click()

        # another like it
        page.get_by_role("button", name="Start another like this").click()
        expect(field_of(page, "Seed")).to_have_value("8")
        expect(page.locator("input[value='lucky-seed-8']")).to_be_visible()

        # deleted, but only when asked twice
        press(page, "Run")
        page.get_by_role("button", name="Delete").click()
        really = page.get_by_role("button", name="Really delete lucky?")
        expect(really).to_be_visible()
        assert (folder / "lucky.tsmr").exists()
        really.click()
        expect(shown).not_to_have_text("lucky")
        assert not (folder / "lucky.tsmr").exists()
        (kept,) = (folder / "bin").iterdir()
        assert {p.name for p in kept.iterdir()} >= {"lucky.tsmr", "lucky.tsmr.note.txt"}
