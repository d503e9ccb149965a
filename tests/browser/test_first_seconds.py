"""What a stranger sees in the first seconds, and ways to look, in a real Chromium that may move by itself."""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Browser, Page, expect

from app.replay.stage import FIELD_OF_VIEW
from app.server.server import serve
from app.session.greeting import best_target
from app.session.software_rendering import CHIP
from engine.body import module as t
from engine.storage.reader import RunReader
from engine.tasks import get_task
from tests.support.software_chromium import PATIENCE, eventually, open_context
from tests.support.widgets import field_of
from viz import words

pytestmark = pytest.mark.browser
WATCH = """
window.seen = [];
new MutationObserver(() => {
    const still = document.querySelector('.ta-still');
    if (still && still.querySelector('svg')) seen.push(still.classList.contains('ta-seen'));
}).observe(document, {childList: true, subtree: true, attributes: true});
"""
"""Notes whether the still is shown, whenever anything changes."""


@pytest.fixture
def moving(chromium: Browser) -> Iterator[Callable[[str], Page]]:
    """Open pages that may move by themselves."""
    context = open_context(chromium, moving=True, sharp=True)
    context.add_init_script(WATCH)

    def visit(url: str) -> Page:
        page = context.new_page()
        page.set_default_timeout(PATIENCE)
        page.goto(url)
        return page

    yield visit
    context.close()


def eye(client: Any) -> np.ndarray:
    return np.array(client.camera.position) - np.array(client.camera.look_at)


def bearing(client: Any) -> float:
    x, y, _ = eye(client)
    return float(np.degrees(np.arctan2(y, x)))


def picture(page: Page) -> np.ndarray:
    clip = {"x": 450, "y": 60, "width": 480, "height": 420}
    return np.asarray(Image.open(io.BytesIO(page.screenshot(clip=clip))).convert("RGB")).astype(int)  # type: ignore[arg-type]


def on_screen(client: Any, points: np.ndarray) -> np.ndarray:
    """Return where (n, 3) points lie, (n, 2): from -1 at an edge of the scene to 1 at the other one."""
    camera = client.camera
    ahead = -eye(client) / np.linalg.norm(eye(client))
    right = np.cross(ahead, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    seen = (points - camera.position) @ np.stack([right, np.cross(right, ahead), ahead]).T
    edge = np.tan(FIELD_OF_VIEW / 2)
    return seen[:, :2] / seen[:, 2:] / [edge * camera.image_width / camera.image_height, edge]


def test_the_best_robot_greets_and_can_be_looked_at_from_all_sides(
    workplace: Path, small_run: Path, small_reader: RunReader, moving: Callable[[str], Page]
) -> None:
    fitness = {n: small_reader.evaluation(n).fitness for n in range(small_reader.n_evaluations())}
    with serve([small_run], host="127.0.0.1", port=0) as server:
        page = moving(f"http://127.0.0.1:{server.get_port()}")
        # a drawn still, until the robot is there
        expect(page.locator(".ta-line")).to_have_text(
            f"Evolved in {small_reader.n_evaluations():,} trials. Click any square."
        )
        page.wait_for_function("seen.length && seen.some(s => s) && !seen.at(-1)")
        (client,) = server.get_clients().values()
        # the best robot, on its way to the target that it reaches best, fast
        number = int(re.findall(r"Robot (\d+)", page.locator(".ta-card").text_content() or "")[0])
        assert fitness[number] == min(f for f in fitness.values() if f is not None)
        target = best_target(small_reader.evaluation(number))
        name = get_task(small_reader.config.task).target_names[target]
        expect(field_of(page, "Target")).to_have_value(f"{target + 1}: {name}")
        expect(field_of(page, "Speed")).to_have_value("4 ×")
        expect(page).to_have_url(re.compile("run=small$"))
        # nothing of viser's lies over the scene; a chip says what there is to say
        expect(page.locator(".ta-chip")).to_have_text(CHIP)
        expect(page.get_by_text("Software WebGL rendering detected")).to_be_hidden()
        # it moves, and the camera circles low, until the scene is touched
        first = picture(page)
        eventually(page, lambda: bool((np.abs(picture(page) - first).max(axis=-1) > 30).mean() > 0.01))
        began = bearing(client)
        eventually(page, lambda: abs(bearing(client) - began) > 5.0)
        assert 0.1 < eye(client)[2] / np.linalg.norm(eye(client)) < 0.5
        canvas = page.locator("canvas[data-engine]")
        canvas.dispatch_event("pointerdown", {"button": 2, "pointerId": 7})
        canvas.dispatch_event("pointerup", {"button": 2, "pointerId": 7})
        page.wait_for_timeout(1500)
        held_at = bearing(client)
        page.wait_for_timeout(1500)
        assert abs(bearing(client) - held_at) < 1.0

        # ways to look: buttons, keys, and viser's own way back
        page.get_by_role("button", name="Top", exact=True).click()
        eventually(page, lambda: bool(eye(client)[2] > 0.98 * np.linalg.norm(eye(client))))
        page.locator("body").press("b")
        eventually(page, lambda: bool(eye(client)[2] < 0.3 * np.linalg.norm(eye(client))))
        page.get_by_role("button", name="Head", exact=True).click()
        eventually(page, lambda: bool(eye(client)[2] > 0.3 * np.linalg.norm(eye(client))))
        page.evaluate(
            "const b = document.createElement('button'); b.textContent = 'Reset View';"
            "document.body.append(b); b.click(); b.remove()"
        )
        nodes = client.scene._handle_from_node_name

        def all_in_view() -> bool:
            post = np.array(nodes["/target/post"].position) * [1.0, 1.0, 0.0]
            robot = np.array(nodes["/robot/rods"].batched_positions)
            x, y = on_screen(client, np.concatenate([robot, post[None]])).T
            # above the panel that lies over the scene
            return bool(np.abs(x).max() < 1.0 and y.max() < 1.0 and y.min() > -1.0 + 2 * 180 / 720)

        eventually(page, all_in_view)

        # a cell that is pointed at draws its robot and says in words what it gains; who lies still is pale
        cells = page.locator('svg.ta-map[data-map=morphology] g[data-filled="1"]')
        tip = page.locator("#ta-tip")
        for nth in (1, 2):
            cells.nth(nth).hover(force=True)
            faces = cells.nth(nth).get_attribute("data-b") or ""
            expect(tip).to_contain_text(f"{len(faces)} modules")
            expect(tip).to_contain_text(re.compile(r"(lies still|closer|farther) · f_s -?\d+\.\d\d cm"))
            expect(tip.locator("svg.ta-body .ta-module")).to_have_count(len(faces))
        for kinds, hint in cells.evaluate_all("l => l.map(e => [e.firstChild.classList.value, e.dataset.h])"):
            assert ("z" in kinds.split()) == ("lies still" in hint)
        expect(page.locator(".ta-card [title]").first).to_have_attribute("title", words.plain(words.F_S))
        expect(page.locator(".ta-figures").first).to_have_attribute(
            "title", re.compile(re.escape(words.plain(words.QD_SCORE)))
        )

        # who chooses a robot sees it at its own speed, and a target that is in view in a slow browser, too
        cell = page.locator('svg.ta-map[data-map=morphology] g[data-filled="1"]').first
        cell.click(force=True, no_wait_after=True)
        expect(page.locator(".ta-line")).to_be_empty()
        expect(field_of(page, "Speed")).to_have_value("1 ×")
        expect(page).to_have_url(re.compile("robot="))
        expect(page.locator(".ta-replay")).to_contain_text("exactly as evaluated")
        eventually(page, all_in_view)

        # a warm key light and a cool rim; the way that is left is written on its line
        (red, _, blue), (red_of_rim, _, blue_of_rim) = (nodes[f"/stage/{n}"].color for n in ("key", "rim"))
        assert red > blue
        assert red_of_rim < blue_of_rim
        expect(page.get_by_role("button", name="Pause")).to_have_count(0)  # it has ended
        expect(page.locator(".ta-replay")).to_contain_text("2.0 s")
        left = re.search(r"head ([\d.]+) cm", page.locator(".ta-replay").inner_text())
        assert left is not None
        way = pytest.approx(float(left[1]), abs=0.6)
        eventually(page, lambda: float(nodes["/target/distance"].text.split()[0]) == way)
        # every module has a soft shadow on the floor, also without a graphics card
        shadows = nodes["/robot/shadows"]
        robot = np.array(nodes["/robot/rods"].batched_positions).reshape(-1, len(t.RODS), 3)
        assert np.array(shadows.batched_positions)[:, :2] == pytest.approx(
            robot.mean(axis=1)[:, :2], abs=0.01
        )
        with_shadows = picture(page).mean(axis=-1)
        shadows.visible = False
        eventually(page, lambda: bool((picture(page).mean(axis=-1) > with_shadows + 4).mean() > 0.003))
