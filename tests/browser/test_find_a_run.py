"""A run is found: by its address, in the list, or brought along; and everybody keeps their place."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from playwright.sync_api import FilePayload, Page, expect

from app.runs import upload
from app.server.server import serve
from engine.search.archive import cell_name
from engine.storage.reader import RunReader
from tests.support.processes import free_port
from tests.support.widgets import best_distance

Visit = Callable[[str], Page]
LOSE_WHAT_IS_SENT_FIRST = """
const post = Worker.prototype.postMessage;
window.lost = 0;
Worker.prototype.postMessage = function(data, ...rest) {
    if (data?.message?.type === 'GuiUpdateMessage' && window.lost < 4) { window.lost += 1; return; }
    return post.call(this, data, ...rest);
};
"""
"""What viser's client does with inputs that are set within 50 ms, all but the last."""


def test_an_address_leads_to_a_robot_follows_the_selection_and_outlives_a_restart(
    workplace: Path, visit: Visit, small_run: Path, grid_run: Path
) -> None:
    with RunReader(small_run) as reader:
        generation = reader.finished_generation()
        held = reader.placements("morphology", generation.number)
        early = reader.placements("morphology", 0)
    cell, number = next((c, n) for c, n in held.items() if held[c] != early.get(c))
    other, other_number = next((c, n) for c, n in held.items() if c != cell)
    with RunReader(small_run) as reader:
        target, _ = best_distance(reader.evaluation(other_number))
    old_cell, old_number = next((c, n) for c, n in early.items() if c != cell)
    port = free_port()
    base = f"http://127.0.0.1:{port}/"
    with serve([grid_run, small_run], host="127.0.0.1", port=port):
        # an address that leads to nothing says so
        page = visit(f"{base}?run=nobody")
        expect(page.get_by_text("There is no run 'nobody' here")).to_be_visible()
        expect(page.locator(".ta-run b")).to_have_text("grid")
        page.goto(f"{base}?run=small&archive=morphology&cell={cell_name(cell)}&target=2")
        expect(page.locator(".ta-run b")).to_have_text("small")
        expect(page.get_by_text(f"morphology cell {cell_name(cell)}")).to_be_visible()
        here = f"{base}?run=small&archive=morphology&cell={cell_name(cell)}&robot={number}"
        expect(page).to_have_url(f"{here}&target=2")
        # the address says where a click led
        # without the mouse: it waits for frames, of which a busy machine draws few
        tile = page.locator(f'[data-c="morphology:{cell_name(other)}"]')
        tile.dispatch_event("pointerdown", {"button": 0})
        there = f"{base}?run=small&archive=morphology&cell={cell_name(other)}&robot={other_number}"
        if target:  # a click leads to the target that the robot reaches best
            there += f"&target={target + 1}"
        expect(page).to_have_url(there)
    with serve([grid_run, small_run], host="127.0.0.1", port=port):
        # the page connects to the new server by itself, and keeps its place in it
        expect(page.get_by_text(f"morphology cell {cell_name(other)}")).to_be_visible()
        expect(page.locator(".ta-run b")).to_have_text("small")
        expect(page).to_have_url(there)
        page.goto(f"{base}?run=small&archive=morphology&cell={cell_name(old_cell)}&generation=0")
        expect(page).to_have_url(re.compile(rf"robot={old_number}&generation=0$"))
        page.reload()
        expect(page.get_by_text(f"morphology cell {cell_name(old_cell)}")).to_be_visible()
        expect(page).to_have_url(re.compile(rf"robot={old_number}&generation=0$"))


def test_an_address_that_is_lost_on_its_way_is_sent_again(
    workplace: Path, visit: Visit, small_run: Path, grid_run: Path
) -> None:
    with serve([grid_run, small_run], host="127.0.0.1", port=0) as server:
        page = visit("about:blank")
        page.add_init_script(LOSE_WHAT_IS_SENT_FIRST)
        page.goto(f"http://127.0.0.1:{server.get_port()}/?run=small")
        expect(page.locator(".ta-run b")).to_have_text("small")
        assert page.evaluate("window.lost") == 4


def test_a_run_is_uploaded_checked_and_shown(
    workplace: Path, address: str, visit: Visit, grid_run: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(upload, "MAX_BYTES", 500_000)
    page = visit(address)
    page.locator(".ta-run").click()
    rows = page.locator(".ta-runs [role=option]")
    expect(rows).to_have_text(
        re.compile(r"small-?\d.*cm.*goal-reaching · dm-me · 18 evaluations · 20\d\d-\d\d-\d\d · finished")
    )
    button = page.get_by_role("button", name="Upload a run")

    def bring(name: str, content: bytes) -> None:
        with page.expect_file_chooser() as chooser:
            button.click()
        chooser.value.set_files(FilePayload(name=name, mimeType="application/octet-stream", buffer=content))

    # one that is too large is refused before it is sent
    bring("a.tsmr", b"x" * 600_000)
    expect(page.get_by_text("from 0 to 0.5 MB are taken")).to_be_visible()
    expect(button).to_be_enabled()
    assert not (workplace / "runs").exists()
    bring("evil.tsmr", b"#!/bin/sh\n")
    expect(page.get_by_text("evil.tsmr is not a TensAtlas run file")).to_be_visible()
    expect(page.get_by_text("uploaded successfully").filter(visible=True)).to_have_count(0)
    bring("my grid.tsmr", grid_run.read_bytes())
    expect(page.locator(".ta-run b")).to_have_text("my-grid")
    expect(page).to_have_url(re.compile("run=my-grid$"))
    assert [p.name for p in (workplace / "runs" / "uploads").iterdir()] == ["my-grid.tsmr"]
    shutil.rmtree(workplace / "runs")
