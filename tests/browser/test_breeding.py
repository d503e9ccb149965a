"""A designer breeds a robot, likes a child of it, and breeds again from that."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from app.server.server import serve
from engine.storage.reader import RunReader
from engine.storage.writer import is_being_written
from tests.support.processes import free_port
from tests.support.software_chromium import eventually
from tests.support.widgets import field_of

pytestmark = pytest.mark.browser


def test_children_are_seen_kept_and_bred_again(
    workplace: Path, visit: Callable[[str], Page], small_run: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).resolve().parents[2]))
    port, runs = free_port(), workplace / "runs"
    with serve([small_run], host="127.0.0.1", port=port):
        page = visit(f"http://127.0.0.1:{port}/")
        page.locator('svg.ta-map[data-map=morphology] g[data-filled="1"]').first.click(
            force=True, no_wait_after=True
        )
        card = page.locator(".ta-card")
        expect(card).to_contain_text("Robot")
        page.locator(".ta-bar").get_by_role("button", name="Breed").click()
        parents, children = page.locator(".ta-parents"), page.locator(".ta-children")
        expect(parents).to_contain_text("Breed from the robot that you see")
        page.get_by_role("button", name="This robot", exact=True).press("Enter")
        expect(parents).to_contain_text("small ")
        in_the_bar = page.locator(".ta-bar").get_by_role("button", name="Breed")
        expect(in_the_bar).to_contain_text("1 marked")
        found = re.search(r"small (\d+)", parents.text_content() or "")
        assert found is not None
        number = found[1]
        # either the bodies or the networks change
        bodies, networks = (page.get_by_label(f"Same {what}", exact=True) for what in ("bodies", "networks"))
        networks.check(force=True)
        bodies.check(force=True)
        expect(networks).not_to_be_checked()
        field_of(page, "Generations").fill("2")
        press_breed = page.get_by_role("button", name="Breed", exact=True).and_(
            page.locator(":not(.ta-bar *)")
        )
        press_breed.press("Enter")
        expect(page.locator(".ta-run b")).to_have_text("breed-1")
        expect(in_the_bar).to_have_text("Breed")
        expect(children).to_contain_text("breed-1: 16 of 16 children")
        eventually(page, lambda: not is_being_written(runs / "breed-1.tsmr"))
        with RunReader(runs / "breed-1.tsmr") as reader:
            assert [g.origin for g in reader.given()] == [f"small.tsmr robot {number}"]
            assert len({e.solution.morphology for e in reader.all_evaluations()}) == 1
            assert len({e.solution.controller for e in reader.all_evaluations()}) > 8

        # a click replays a child, and its lineage leads to the run that its parent is from
        tile = children.locator(".ta-tile").nth(1)
        child = tile.get_attribute("data-number")
        tile.locator(".ta-play").press("Enter")
        expect(card).to_contain_text(f"Robot {child} ")
        expect(children.locator(f'[data-number="{child}"]')).to_have_attribute("data-shown", "1")
        page.get_by_role("tab", name="Lineage").click()
        expect(page.locator(".ta-lineage")).to_contain_text(f"small.tsmr robot {number}")

        # keep one, drop one, breed again
        dropped = children.locator(".ta-tile").nth(2).get_attribute("data-number")
        page.get_by_role("button", name=f"Drop robot {dropped}", exact=True).press("Enter")
        expect(children.locator(f'[data-number="{dropped}"]')).to_have_count(0)
        page.get_by_role("button", name=f"Breed from robot {child}", exact=True).press("Enter")
        expect(parents).to_contain_text(f"breed-1 {child}")
        page.get_by_role("button", name="Breed again", exact=True).press("Enter")
        expect(page.locator(".ta-run b")).to_have_text("breed-2")
        expect(children).to_contain_text(re.compile(r"breed-2: 16 of 16 children"))
        with RunReader(runs / "breed-2.tsmr") as reader:
            assert [g.origin for g in reader.given()] == [f"breed-1.tsmr robot {child}"]
        # the page finds them again
        page.reload()
        page.locator(".ta-bar").get_by_role("button", name="Breed").click()
        expect(children).to_contain_text("breed-2: 16 of 16 children")
        eventually(page, lambda: not is_being_written(runs / "breed-2.tsmr"))
