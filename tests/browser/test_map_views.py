"""What a user does with the maps of a 4-D archive, done in a real Chromium."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Locator, Page, expect

from app.server.server import serve
from engine.search.axes import project
from engine.storage.reader import RunReader
from tests.support.widgets import best_distance, choose
from viz.maps.nested import Geometry

pytestmark = pytest.mark.browser


@pytest.fixture
def address(workplace: Path, grid_run: Path, small_run: Path) -> Iterator[str]:
    """The app, showing a 4-D archive and offering another run."""
    with serve([grid_run, small_run], host="127.0.0.1", port=0) as server:
        yield f"http://127.0.0.1:{server.get_port()}"


def point_in(svg: Locator, x: float, y: float) -> tuple[float, float]:
    """Return where on the screen a point of a picture is."""
    return svg.evaluate(
        "(s, p) => { const q = new DOMPoint(...p).matrixTransform(s.getScreenCTM()); return [q.x, q.y]; }",
        [x, y],
    )


def wait_for_end(page: Page) -> None:
    """Wait until the replay has ended: drawing it leaves the browser little time for anything else."""
    expect(page.get_by_role("button", name="Play")).to_be_visible()


def test_a_4d_archive_is_seen_projected_nested_and_body_by_body(
    address: str, visit: Callable[[str], Page], grid_reader: RunReader
) -> None:
    page = visit(address)
    last = grid_reader.last_generation()
    assert last is not None
    placed = grid_reader.placements("grid", last)
    fitness = {n: s.fitness for n, s in grid_reader.summaries(set(placed.values())).items()}
    card, tip = page.locator(".ta-card"), page.locator("#ta-tip")
    expect(page.locator(".ta-changes")).to_contain_text("replays may differ: mujoco 3.0.0 →")

    # projected: both maps show the best of each of their cells, and a click replays that robot
    shown = project({c: (fitness[n], n) for c, n in placed.items()}, (2, 3), lambda elite: elite)
    tiles = page.locator('svg[data-map="grid-23"] g[data-filled="1"]')
    expect(tiles).to_have_count(len(shown))
    tile = page.locator('svg[data-map="grid-23"] g[data-c="grid-23:1,8"]')
    source = shown[1, 8]
    tile.hover(force=True)
    expect(tip).to_contain_text(f"robot {placed[source]},")
    tile.click(force=True, no_wait_after=True)
    expect(card).to_contain_text(f"Robot {placed[source]} · grid cell {','.join(map(str, source))}")
    expect(page.locator(".ta-replay")).to_contain_text("exactly as evaluated")
    _, distance = best_distance(grid_reader.evaluation(placed[source]))
    expect(page.locator(".ta-replay")).to_contain_text(f"{distance:.2f} cm at 2 s")
    wait_for_end(page)

    # body by body: what else there is of this body
    choose(page, "View", "body by body")
    inner = [c for c in placed if c[:2] == source[:2]]
    expect(page.locator('svg[data-map="grid-section"] g[data-filled="1"]')).to_have_count(len(inner))
    expect(page.locator('svg[data-map="grid-section"] > rect[stroke-width="2.5"]')).to_have_count(1)

    # nested: the nearest filled cell is the one that is meant, here a little off its middle
    choose(page, "View", "nested")
    svg = page.locator('svg[data-map="grid-nested"]').first
    g = Geometry.of((9, 10, 9, 10))
    other = max(c for c in placed if c[:2] != source[:2])
    x, y = g.corner(other)
    place = point_in(svg, x + 0.8 * g.cell[0], y + 1.2 * g.cell[1])
    page.mouse.move(*place)
    expect(tip).to_contain_text(f"robot {placed[other]},")
    page.mouse.down()
    page.mouse.up()
    expect(card).to_contain_text(f"Robot {placed[other]} · grid cell {','.join(map(str, other))}")
    wait_for_end(page)
    ring = svg.locator(".ta-ring").evaluate("r => [getComputedStyle(r).visibility, r.style.cssText]")
    assert ring == ["visible", ""]
    page.mouse.move(*point_in(svg, 1, 1))  # nobody is near there
    expect(tip).to_be_hidden()
    assert svg.get_attribute("data-c") is None

    # as large as the window: another robot there, and back
    page.get_by_role("button", name="Enlarge").first.click()
    large = page.locator("dialog svg")
    expect(large).to_be_visible()
    x, y = g.corner(source)
    page.mouse.click(*point_in(large, x + 1, y + 1))
    expect(card).to_contain_text(f"Robot {placed[source]} ·")
    expect(page.locator("dialog")).to_have_count(0)
    wait_for_end(page)

    # other colours, the same robots
    choose(page, "Colour", "age")
    expect(svg).to_contain_text("gen.")
    expect(card).to_contain_text(f"Robot {placed[source]} ·")

    # the list of runs says what each is, and opens one by keyboard as well
    page.locator("button.ta-run").click()
    rows = page.get_by_role("option")
    expect(rows).to_have_count(2)
    expect(rows.nth(1)).to_have_text(
        re.compile(
            r"small.*-?\d+\.\d\d cm.*goal-reaching · dm-me · 18 evaluations · \d{4}-\d\d-\d\d · finished"
        )
    )
    rows.nth(1).press("Enter")
    expect(page.locator("button.ta-run")).to_contain_text("small")
    expect(page.locator('svg[data-map="controller"]')).to_be_visible()
    expect(page.locator(".ta-changes")).to_have_count(0)
    expect(rows).to_have_count(0)
    expect(page.locator("label", has_text=re.compile("^View$"))).to_have_count(0)
