"""The log of a drive beside its simulation, in a real Chromium."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from app.server.drive_log import log_sessions
from app.server.server import serve_sessions
from engine.body import module as t
from engine.storage.reader import RunReader
from tests.browser.test_pointing import point
from tests.support.software_chromium import eventually
from tests.support.widgets import field_of

pytestmark = pytest.mark.browser


@pytest.fixture
def log(small_run: Path, tmp_path: Path) -> Path:
    """A robot of the small run that goes 1 cm/s towards a target on its left."""
    with RunReader(small_run) as reader:
        number = min(reader.placements("morphology", reader.last_closed().number).values())
        modules = reader.evaluation(number).solution.morphology.n_modules
        rest = reader.config.trials.settle_time
    first = {"format": "tensatlas-drive", "version": 1, "robot": number, "modules": modules}
    lines = [first | {"task": "goal-reaching", "run": "small", "simulated": False}]
    for k in range(100):
        y = 0.01 * max(0.04 * k - rest, 0.0)
        lines.append({"time": 0.04 * k, "head": [0.0, y, 0.0], "target": [0.0, 0.4]})
    path = tmp_path / "drive.jsonl"
    path.write_text("\n".join(map(json.dumps, lines)))
    return path


def test_a_log_is_played_beside_its_simulation(
    log: Path, small_run: Path, visit: Callable[[str], Page]
) -> None:
    with serve_sessions(log_sessions(log, small_run, "latex-sheet"), host="127.0.0.1", port=0) as server:
        page = visit(f"http://127.0.0.1:{server.get_port()}")
        card, line = page.locator(".ta-card"), page.locator(".ta-replay")
        with RunReader(small_run) as reader:
            end = 0.04 * 99 - reader.config.trials.settle_time
        expect(card).to_contain_text("a robot that was built")
        expect(card).to_contain_text("90° left, 40 cm")
        expect(card).to_contain_text(f"from 40.0 to {40.0 - end:.1f} cm from the target")
        # it plays by itself to its end, towards the measured target, and can be scrubbed
        expect(line).to_contain_text("a target of your own")
        expect(page.get_by_role("button", name="Play")).to_be_visible()
        field = field_of(page, "Time")
        field.fill("0.5")
        field.press("Enter")
        expect(line).to_contain_text("0.5 s")
        # what is clicked on the simulated robot says its name and its force
        (client,) = server.get_clients().values()
        nodes = client.scene._handle_from_node_name
        page.get_by_role("button", name="Top", exact=True).click()
        page.wait_for_timeout(1500)

        def highest() -> np.ndarray:
            cables = np.array(nodes["/robot/cables"].points).mean(axis=1)[: t.N_CABLES]
            return cables[cables[:, 2].argmax()]

        point(page, client.camera, highest, page.mouse.click, lambda: "/pointed/label" in nodes)
        assert re.fullmatch(r".+ of module 1: (.*\d\.\d\d N|slack)", nodes["/pointed/label"].text)
        eventually(page, lambda: "/pointed/lit" in nodes and nodes["/pointed/lit"].visible)
        page.close()
