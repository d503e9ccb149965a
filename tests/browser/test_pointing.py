"""What a user points at and clicks on a robot, in a real Chromium."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Page, expect
from scipy.spatial.transform import Rotation

from app.pointing.picking import RobotPart
from app.replay.stage import FIELD_OF_VIEW
from app.server.server import serve
from engine.body import module as t
from engine.replay.replay import Replay
from engine.storage.reader import RunReader
from tests.support.software_chromium import eventually
from tests.support.widgets import best_distance, click_cell, field_of, press

pytestmark = pytest.mark.browser


def place_on_screen(page: Page, camera: Any, point: np.ndarray) -> tuple[float, float]:
    eye = np.array(camera.position)
    ahead = np.array(camera.look_at) - eye
    ahead /= np.linalg.norm(ahead)
    right = np.cross(ahead, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    way = point - eye
    edge = np.tan(FIELD_OF_VIEW / 2) * (way @ ahead)
    x = way @ right / edge * camera.image_height / camera.image_width
    y = way @ np.cross(right, ahead) / edge
    box = page.locator("canvas[data-engine]").bounding_box()
    assert box is not None
    return box["x"] + box["width"] * (1 + x) / 2, box["y"] + box["height"] * (1 - y) / 2


def point(
    page: Page,
    camera: Any,
    where: Callable[[], np.ndarray],
    act: Callable[[float, float], None],
    done: Callable[[], object],
) -> None:
    """Point at or click a place again and again, for a slow browser says late where its camera is."""
    nudges = itertools.cycle((0.0, 1.0))  # a pointer that stays where it is says nothing new

    def acted() -> bool:
        x, y = place_on_screen(page, camera, where())
        act(x + next(nudges), y)
        page.wait_for_timeout(600)
        return bool(done())

    eventually(page, acted)


def test_a_module_lights_up_everywhere_and_a_cable_tells_its_tension(
    workplace: Path, small_run: Path, small_reader: RunReader, visit: Callable[[str], Page]
) -> None:
    last = small_reader.last_generation()
    assert last is not None
    cell, number = next(iter(small_reader.placements("morphology", last).items()))
    evaluation = small_reader.evaluation(number)
    replay = Replay(small_reader.config, evaluation, target=best_distance(evaluation)[0])
    replay.advance(replay.trial_time)
    body = evaluation.solution.morphology
    with serve([small_run], host="127.0.0.1", port=0) as server:
        page = visit(f"http://127.0.0.1:{server.get_port()}")
        click_cell(page, page.locator(f'g[data-c="morphology:{",".join(map(str, cell))}"]'))
        expect(page.locator(".ta-replay")).to_contain_text("exactly as evaluated")
        expect(page.get_by_role("button", name="Pause")).to_have_count(0)  # it has ended
        expect(page.locator(".ta-replay")).to_contain_text(f"{replay.trial_time:.1f} s")
        expect(page.get_by_text("be built")).to_be_visible()  # nothing moves any more
        page.wait_for_timeout(500)
        (client,) = server.get_clients().values()
        nodes = client.scene._handle_from_node_name
        lit = page.locator("style.ta-lit")

        # pointed at in the network, it lights up in the scene and in both plots
        page.locator('svg.ta-network [data-m="1"] > .ta-back').hover(force=True)
        page.wait_for_function("document.querySelector('style.ta-lit')?.textContent.includes('data-m=\"1\"')")
        rods = np.array(nodes["/robot/rods"].batched_positions)[len(t.RODS) : 2 * len(t.RODS)]
        eventually(page, lambda: "/pointed/lit" in nodes and nodes["/pointed/lit"].visible)
        assert nodes["/pointed/lit"].batched_positions == pytest.approx(rods)
        page.get_by_role("tab", name="Servos").click()
        page.locator('svg.ta-servos [data-m="0"] > .ta-back').hover(force=True)
        page.wait_for_function("document.querySelector('style.ta-lit')?.textContent.includes('data-m=\"0\"')")
        page.mouse.move(640, 12)
        expect(lit).to_have_count(0)
        eventually(page, lambda: not nodes["/pointed/lit"].visible)

        # clicked in the scene, a cable says its name and how it pulls, also at another moment
        page.get_by_role("button", name="Top", exact=True).click()
        page.wait_for_timeout(1500)
        wanted = RobotPart(
            "cable", 0, int(np.argmax(np.array(nodes["/robot/cables"].points)[: t.N_CABLES, :, 2].sum(1)))
        )
        middle = np.array(nodes["/robot/cables"].points)[wanted.index].mean(axis=0)
        page.mouse.click(*place_on_screen(page, client.camera, middle))
        expect(lit).to_be_attached()
        eventually(page, lambda: "/pointed/label" in nodes)
        label = nodes["/pointed/label"]
        assert label.text == f"{wanted.name}: {wanted.force(replay.frames[-1], body)}"
        field = field_of(page, "Time")
        field.fill("0.5")
        field.press("Enter")
        expect(page.locator(".ta-replay")).to_contain_text("0.5 s")
        said = {f"{wanted.name}: {wanted.force(f, body)}" for f in replay.frames if abs(f.time - 0.5) < 0.06}
        eventually(page, lambda: label.text in said)
        page.mouse.move(640, 12)
        page.locator("body").press("Escape")
        expect(lit).to_have_count(0)
        eventually(page, lambda: "/pointed/label" not in nodes)

        # in its lane, too: there it lies elsewhere in the scene, and the network is still its own
        page.get_by_role("button", name="Pin", exact=True).click()
        press(page, "Side by side")
        page.get_by_role("button", name="Replay in lanes").click()
        eventually(page, lambda: "/lanes/0/robot/rods" in nodes)
        expect(page.locator(".ta-replay")).to_contain_text(f"{replay.trial_time:.1f} s")  # it has ended
        lane = nodes["/lanes/0"]

        def rods_in_lane() -> np.ndarray:
            rods = np.array(nodes["/lanes/0/robot/rods"].batched_positions)[: len(t.RODS)]
            return Rotation.from_quat(lane.wxyz, scalar_first=True).apply(rods) + lane.position

        point(page, client.camera, lambda: rods_in_lane().mean(axis=0), page.mouse.move, lambda: lit.count())
        assert 'data-m="0"' in (lit.text_content() or "")
        assert nodes["/pointed/lit"].visible
        assert nodes["/pointed/lit"].batched_positions == pytest.approx(rods_in_lane(), abs=1e-5)
