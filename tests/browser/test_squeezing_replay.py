"""A squeezing robot among its walls, in a real Chromium."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import viser
from playwright.sync_api import Page, expect
from scipy.spatial.transform import Rotation

from app.server.server import serve
from engine.config import RunConfig, replaced
from engine.runs import evolve as run
from engine.storage.reader import RunReader
from tests.support.software_chromium import eventually
from tests.support.widgets import best_distance, click_cell, field_of

pytestmark = pytest.mark.browser


@pytest.fixture
def squeezing_run(small_config: RunConfig, workplace: Path) -> Path:
    path = workplace / "squeezing.tsmr"
    run.evolve(path, replaced(small_config, task="squeezing", evaluations=6, initial=6), n_threads=2)
    return path


def test_walls_go_up_when_the_robot_has_settled_and_change_with_the_target(
    squeezing_run: Path, visit: Callable[..., Page]
) -> None:
    with serve([squeezing_run], host="127.0.0.1", port=0) as server, RunReader(squeezing_run) as reader:
        page = visit(f"http://127.0.0.1:{server.get_port()}", sharp=True)
        filled = page.locator('svg.ta-map[data-map=morphology] g[data-filled="1"]')
        evaluation = reader.evaluation(click_cell(page, filled.first))
        line, card = page.locator(".ta-replay"), page.locator(".ta-card")
        expect(line).to_contain_text("exactly as evaluated")
        expect(card).to_contain_text("; by final distance, less 4 cm past the gate")
        expect(line).to_contain_text(f"scores {best_distance(evaluation)[1]:.2f} cm at 2 s")

        (client,) = server.get_clients().values()
        seen = []
        for k, target in enumerate(("1: 5° left", "2: 5° right")):
            field = field_of(page, "Target")
            if field.input_value() != target:
                field.click()
                page.get_by_role("option", name=target).click()
                expect(line).to_contain_text(f"scores {100 * evaluation.distances[k, 0]:.2f} cm at 2 s")
            nodes = client.scene._handle_from_node_name
            walls = [nodes[f"/walls/{k}"] for k in range(5)]
            assert "/walls/5" not in nodes
            eventually(page, lambda walls=walls: [tuple(w.position) for w in walls] not in seen)
            seen.append([tuple(w.position) for w in walls])
        # robot and target are seen, however slow the browser is, and not behind the panel below
        scene = page.locator("canvas[data-engine]").bounding_box()
        assert scene is not None
        panel = page.get_by_role("button", name=re.compile("^(Play|Pause)$")).bounding_box()
        assert panel is not None

        def well_in_view() -> bool:
            shown = np.vstack([nodes["/robot/nodes"].batched_positions, nodes["/target/post"].position])
            # of the page; the scene may be drawn with fewer
            x, y = pixels(client.camera, shown).T * scene["height"] / client.camera.image_height
            inside = (x > 0) & (x < scene["width"]) & (y > 0) & (y < panel["y"] - 40)
            return bool(inside.all()) and np.ptp(y) > 100  # large enough, too

        eventually(page, well_in_view)


def pixels(camera: viser.CameraHandle, points: np.ndarray) -> np.ndarray:
    """Return the (n, 2) pixels, from the upper left of the scene, where (n, 3) points are seen."""
    x, y, z = Rotation.from_quat(camera.wxyz, scalar_first=True).inv().apply(points - camera.position).T
    assert (z > 0.0).all()
    scale = camera.image_height / 2 / np.tan(camera.fov / 2)
    return np.stack([camera.image_width / 2 + scale * x / z, camera.image_height / 2 + scale * y / z], axis=1)
