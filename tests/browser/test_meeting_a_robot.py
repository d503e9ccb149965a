"""What a user learns about a robot, done in a real Chromium."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from app.server.server import serve
from engine.config import task_of
from engine.replay.replay import Replay
from engine.replay.trial import Aim
from engine.storage.reader import RunReader
from tests.support.software_chromium import eventually
from tests.support.widgets import best_distance, choose, field_of, unfold
from viz.robot.network_diagram import NetworkDiagram
from viz.robot.servo_plot import WIDTH, page_of, position

pytestmark = pytest.mark.browser


def live(page: Page, what: str) -> str:
    """Return the style that moves something now: the neurons or the cursor of the servos."""
    styles = page.locator("style").evaluate_all("l => l.map(s => s.textContent)")
    return next((s for s in styles if what in s), "")


def cursor(page: Page) -> float:
    """Return where the cursor of the servos is, in the plot's units."""
    return float(re.findall(r"translateX\(([\d.]+)px", live(page, ".ta-cursor{"))[0])


def test_a_robot_is_met_from_the_inside_with_its_ancestors_and_under_other_noise(
    workplace: Path, small_run: Path, small_reader: RunReader, visit: Callable[[str], Page]
) -> None:
    last = small_reader.last_generation()
    assert last is not None
    cell, number = next(
        (cell, n)
        for cell, n in small_reader.placements("morphology", last).items()
        if small_reader.evaluation(n).solution.parent is not None
    )
    line = small_reader.lineage(number)
    evaluation = small_reader.evaluation(number)
    best, _ = best_distance(evaluation)
    replay = Replay(small_reader.config, evaluation, target=best)
    replay.advance(replay.trial_time)
    body, controller = evaluation.solution.morphology, evaluation.solution.controller
    unit = task_of(small_reader.config).units[0]
    diagram = NetworkDiagram(controller, body.n_modules, ("", ""), head_is_end=evaluation.head_is_end)
    with serve([small_run], host="127.0.0.1", port=0) as server:
        page = visit(f"http://127.0.0.1:{server.get_port()}")
        name = f"morphology:{','.join(map(str, cell))}"
        page.locator(f'g[data-c="{name}"]').click(force=True, no_wait_after=True)
        card, said = page.locator(".ta-card"), page.locator(".ta-replay")
        expect(card).to_contain_text(f"Robot {number}")
        expect(said).to_contain_text("exactly as evaluated")
        (client,) = server.get_clients().values()

        # the network at work: what is drawn once stays, the style of the neurons follows the replay
        expect(page.locator("svg.ta-network .bar")).to_have_count(2 * body.n_modules)
        picture = page.locator("svg.ta-network").inner_html()
        seen = []
        for moment in (0.5, 1.5):
            seek(page, moment)
            expect(page.locator(".ta-sensed")).to_contain_text(senses(replay, unit, moment))
            styles = {diagram.style(diagram.network.neurons(f)) for f in sensed_near(replay, moment)}
            eventually(page, lambda styles=styles: live(page, ".ta-network .b0{") in styles)
            seen.append(page.locator(".ta-sensed").text_content())
        assert seen[0] != seen[1]
        assert page.locator("svg.ta-network").inner_html() == picture
        seek(page, -0.3)
        expect(page.locator(".ta-sensed")).to_contain_text("settles")
        eventually(page, lambda: not live(page, ".ta-network .b0{"))

        # the servos: a cursor that follows
        page.get_by_role("tab", name="Servos").click()
        servos = page.locator("svg.ta-servos")
        servos.scroll_into_view_if_needed()
        box = servos.bounding_box()
        assert box is not None
        # where the plot is pressed, there is the robot
        at = position(1.5, page_of(1.5, replay.start_time, replay.end_time))
        page.mouse.click(box["x"] + box["width"] * at / WIDTH, box["y"] + 20)
        expect(said).to_contain_text("1.5 s")
        expect(page.locator("svg.ta-servos")).to_be_visible()
        for moment in (0.3, 1.0):
            seek(page, moment)
            x = pytest.approx(position(moment, page_of(moment, replay.start_time, replay.end_time)), abs=2.0)
            eventually(page, lambda x=x: cursor(page) == x)  # it moves a few times a second

        # marks: what is switched off is no longer in the scene, and comes back
        nodes = client.scene._handle_from_node_name
        unfold(page)
        for mark, node in (("Numbers", "/robot/numbers"), ("Trail", "/trail")):
            assert nodes[node].visible
            toggle(page, mark)
            eventually(page, lambda node=node: not nodes[node].visible)
        expect(page.locator(".ta-tension")).to_contain_text("N")
        plain = nodes["/robot/cables"].colors.copy()
        toggle(page, "Tension")
        expect(page.locator(".ta-tension")).to_have_count(0)
        eventually(page, lambda: (nodes["/robot/cables"].colors != plain).any())
        toggle(page, "Numbers")
        eventually(page, lambda: nodes["/robot/numbers"].visible)

        # fresh noise ends elsewhere; the evaluated noise is there again
        page.get_by_role("button", name="Draw").click(force=True)
        expect(said).to_contain_text(re.compile(r"fresh noise \d+"))
        expect(said).to_contain_text("with the evaluated noise")
        assert "exactly" not in (said.text_content() or "")
        assert int(field_of(page, "No.").input_value()) >= 1
        expect(page).to_have_url(re.compile("fresh="))
        choose(page, "Noise", "exact 1")
        expect(said).to_contain_text("exactly as evaluated")

        # a target of one's own: where the ground is clicked
        choose(page, "Target", "elsewhere…")
        expect(page.get_by_text("Click on the ground where the target is to be.")).to_be_visible()
        # the scene takes clicks once its cursor says so
        expect(page.locator("canvas[data-engine]")).to_have_css("cursor", "pointer")
        page.mouse.click(700, 300)
        expect(said).to_contain_text(re.compile(r"a target of your own .* cm at 2 s, never evaluated"))
        expect(page).to_have_url(re.compile(r"aim=-?\d+,\d+"))
        bearing, distance = map(int, re.findall(r"aim=(-?\d+),(\d+)", page.url)[0])
        aim = Aim(bearing, distance)
        expect(field_of(page, "Target")).to_have_value(aim.name)
        own = Replay(small_reader.config, evaluation, target=best, aim=aim)
        own.advance(own.trial_time)
        assert own.score is not None
        expect(said).to_contain_text(f"{100 * own.score:.2f} cm at 2 s")
        # a click that nobody asked for does nothing, and the task's targets are there again
        page.mouse.click(640, 250)
        choose(page, "Target", "1: 90° left")
        expect(said).to_contain_text("exactly as evaluated")
        expect(page).not_to_have_url(re.compile("aim="))

        # an ancestor, elite or not, takes the stage; the line stays to step through
        page.get_by_role("tab", name="Lineage").click()
        rows = page.locator(".ta-lineage button")
        expect(rows).to_have_count(len(line))
        rows.last.click()
        expect(card).to_contain_text(f"Robot {line[-1].number}")
        expect(card).to_contain_text(f"ancestor of robot {number}")
        expect(card).to_contain_text("nobody (random)")
        expect(rows.last).to_have_attribute("aria-current", "true")
        # towards the target that was chosen last
        distance = 100 * small_reader.evaluation(line[-1].number).distances[0, 0]
        expect(said).to_contain_text(f"{distance:.2f} cm at 2 s, exactly as evaluated")
        rows.first.click()
        expect(card).to_contain_text(f"Robot {number}")


def sensed_near(replay: Replay, moment: float) -> list[np.ndarray]:
    """Return what was sensed in the frames that a page may show for a moment."""
    near = [f.sensed for f in replay.frames if abs(f.time - moment) < 0.9 * replay.frame_period]
    return [s for s in near if s is not None]


def senses(replay: Replay, unit: float, moment: float) -> re.Pattern[str]:
    """Return the distances that a page may show for a moment; the network gets them times a unit's factor."""
    return re.compile("|".join(re.escape(f"{100 * s[0] / unit:.1f} cm") for s in sensed_near(replay, moment)))


def seek(page: Page, seconds: float) -> None:
    """Hold the replay at a moment."""
    # a trial of two seconds ends before its button could be clicked reliably
    expect(page.get_by_role("button", name="Pause")).to_have_count(0)
    field = field_of(page, "Time")
    field.fill(str(seconds))
    field.press("Enter")
    expect(page.locator(".ta-replay")).to_contain_text(f"{seconds:.1f} s")


def toggle(page: Page, mark: str) -> None:
    page.locator("label", has_text=re.compile(f"^{mark}$")).locator(
        "xpath=ancestor::div[contains(@class, 'Flex-root')][1]//input"
    ).last.dispatch_event("click")
