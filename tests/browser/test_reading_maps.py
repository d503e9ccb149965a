"""Reading the maps and watching them grow, in a real Chromium."""

from __future__ import annotations

import dataclasses
import re
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from app.server.server import serve
from engine.config import RunConfig, create_algorithm
from engine.storage.reader import RunReader
from engine.storage.rows import statistics
from engine.storage.writer import RunWriter
from engine.workers.evaluator import create_evaluator
from tests.support.widgets import choose, field_of

pytestmark = pytest.mark.browser
Visit = Callable[[str], Page]


def cells_of(reader: RunReader, archive: str) -> dict[tuple[int, ...], int]:
    last = reader.last_generation()
    assert last is not None
    return reader.placements(archive, last)


def test_a_map_is_read_by_keyboard_and_on_a_scale_of_ones_own(
    address: str, visit: Visit, small_reader: RunReader
) -> None:
    page = visit(address)
    bodies = cells_of(small_reader, "morphology")
    fitness = {n: s.fitness for n, s in small_reader.summaries(set(bodies.values())).items()}
    map_, card = page.locator('svg.ta-map[data-map="morphology"]'), page.locator(".ta-card")
    tip, replay = page.locator("#ta-tip"), page.locator(".ta-replay")

    # from the best robot, which greets, a key finds the nearest that there is on the way
    best = min(bodies, key=lambda c: (fitness[bodies[c]], c))
    expect(card).to_contain_text(f"Robot {bodies[best]} · morphology cell {best[0]},{best[1]}")
    map_.focus()

    def nearest(way: tuple[int, int]) -> tuple[int, ...] | None:
        def cost(cell: tuple[int, ...]) -> float:
            x, y = cell[0] - best[0], cell[1] - best[1]
            return x * way[0] + y * way[1] + 3 * (abs(x * way[1]) + abs(y * way[0]))

        ahead = [c for c in bodies if (c[0] - best[0]) * way[0] + (c[1] - best[1]) * way[1] > 0]
        return min(ahead, key=cost, default=None)

    ways = {"ArrowLeft": (-1, 0), "ArrowRight": (1, 0), "ArrowUp": (0, 1), "ArrowDown": (0, -1)}
    key, there = next((k, c) for k, w in ways.items() if (c := nearest(w)) is not None)
    page.keyboard.press(key)
    expect(tip).to_contain_text(f"robot {bodies[there]},")
    expect(card).to_contain_text(f"Robot {bodies[there]} · morphology cell {there[0]},{there[1]}")
    expect(map_).to_be_focused()  # though choosing has drawn it anew
    # where it sits in the other map is marked too, if it does
    other = bodies[there] in cells_of(small_reader, "controller").values()
    expect(page.locator('svg.ta-map[data-map="controller"] .ta-ring')).to_have_count(int(other))

    # Enter replays from the start, Space pauses and goes on
    expect(replay).to_contain_text("exactly as evaluated")
    expect(page.get_by_role("button", name="Play")).to_be_visible()
    choose(page, "Speed", "⅒ ×")
    map_.focus()
    page.keyboard.press("Enter")
    expect(page.get_by_role("button", name="Pause")).to_be_visible()
    page.keyboard.press(" ")
    expect(page.get_by_role("button", name="Play")).to_be_visible()

    # a scale of one's own begins as what is seen; another palette; keys belong to the fields meanwhile
    bar = map_.locator("text")
    choose(page, "Scale", "fixed")
    high = field_of(page, "to, cm")
    high.fill("30")
    high.press("ArrowLeft")
    high.press(" ")
    high.press("Enter")
    expect(bar.filter(has_text=re.compile("^30$"))).to_have_count(1)
    expect(
        page.locator('svg.ta-map[data-map="controller"] text', has_text=re.compile("^30$"))
    ).to_be_attached()
    assert f"Robot {bodies[there]} ·" in card.inner_text()
    high.fill("-90")
    high.press("Enter")
    expect(page.get_by_text("the colour scale must begin below its end")).to_be_visible()
    expect(high).to_have_value("30")
    expect(bar.filter(has_text=re.compile("^30$"))).to_have_count(1)
    choose(page, "Colours", "cividis")
    expect(map_.locator("stop").last).to_have_attribute("stop-color", "#fee838")


def test_generations_play_to_the_end_and_a_hand_on_the_slider_stops_them(
    address: str, visit: Visit, small_reader: RunReader
) -> None:
    page = visit(address)
    last = small_reader.last_generation()
    assert last is not None
    shown = field_of(page, "Generation")
    expect(shown).to_have_value(str(last))
    page.get_by_role("button", name="Grow").click()
    button = page.get_by_role("button", name=re.compile("^(Hold|Grow)$"))
    expect(button).to_have_text("Hold")
    expect(button).to_have_text("Grow")
    expect(shown).to_have_value(str(last))
    page.get_by_role("button", name="Grow").click()
    expect(shown).to_have_value("0")
    shown.fill("1")
    shown.press("Enter")
    expect(button).to_have_text("Grow")
    page.wait_for_timeout(1500)
    # what was on its way to the page may still come, but nothing goes on to the end
    expect(shown).to_have_value("1")
    # an earlier generation shows the robots that were elites then
    early = small_reader.placements("controller", 0)
    assert early != small_reader.placements("controller", last)
    shown.fill("0")
    shown.press("Enter")
    drawn = page.locator('svg.ta-map[data-map="controller"]')
    expect(drawn.locator('g[data-filled="1"]')).to_have_count(len(early))
    hints = drawn.locator("[data-h]").evaluate_all("l => l.map(e => e.dataset.h)")
    for number in early.values():
        assert any(f"robot {number}," in hint for hint in hints)
    # the pointer on a diagram reads all four at the nearest generation
    trend = page.locator("svg.ta-trend")
    trend.scroll_into_view_if_needed()
    box = trend.bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + 0.08 * box["width"], box["y"] + 0.2 * box["height"])
    first = small_reader.generations()[0]
    expect(page.locator("#ta-tip")).to_contain_text(f"generation 0, {first.n_evaluations} evaluations")
    expect(page.locator("#ta-tip")).to_contain_text("coverage")


_WATCH = """() => {
    window.seen = {};
    const look = () => {
        const rows = JSON.parse(document.querySelector('svg.ta-trend')?.dataset.points ?? '[]');
        if (!(rows.length in window.seen)) window.seen[rows.length] = Date.now() / 1000;
    };
    new MutationObserver(look).observe(document.body, {childList: true, subtree: true});
    look();
}"""


def test_every_open_browser_shows_a_generation_within_a_second(
    workplace: Path, visit: Visit, small_config: RunConfig
) -> None:
    """A run file that is written beside the app, two browsers that look at it."""
    path = workplace / "live.tsmr"
    config = dataclasses.replace(small_config, evaluations=42)
    algorithm = create_algorithm(config)
    evaluator = create_evaluator(config, 2)
    written: list[float] = []

    def evaluated() -> list:
        return [e for group in evaluator.evaluate(algorithm.ask()) for e in group]

    def close(writer: RunWriter, evaluations: list) -> None:
        writer.add_evaluations(len(written), evaluations)
        algorithm.tell(evaluations)
        figures = statistics(algorithm, 0.45)
        writer.close_generation(algorithm, figures, 1.0)
        written.append(time.time())

    with RunWriter.create(path, config, {}) as writer:
        close(writer, evaluated())
        with serve([path], host="127.0.0.1", port=0) as server:
            pages = [visit(f"http://127.0.0.1:{server.get_port()}") for _ in range(2)]
            for page in pages:
                page.locator("svg.ta-trend[data-points]").wait_for(state="attached")
                page.evaluate(_WATCH)
            # of the later of the two; at another try: the machine may be busy with something else
            waits: list[float] = []
            for n in range(2, 9):
                evaluations = evaluated()
                for page in pages:
                    page.wait_for_timeout(700)
                close(writer, evaluations)
                for page in pages:
                    page.wait_for_function("n => n in window.seen", arg=n)
                seen = [page.evaluate("n => window.seen[n]", n) for page in pages]
                waits.append(max(seen) - written[n - 1])
                if waits[-1] < 1.0:
                    break
            assert min(waits) < 1.0, waits
            won = pages[0].locator(".ta-map .f")
            expect(won.first).to_be_attached()
