"""The page of a run in a real Chromium, from a file and offline: it opens, plays and asks for nothing."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Browser, Page, expect

from engine.replay.every_target import replay_every_target
from engine.storage.reader import RunReader
from tests.browser.test_taking_along import picture, watch
from tests.support.evaluated_again import evaluated_again
from tests.support.software_chromium import eventually, open_context
from viz.atlas.elites import updates_per_frame
from viz.atlas.page import atlas_page
from viz.robot.skeleton import posed


@pytest.fixture(scope="module")
def again(small_run: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, int]:
    """A run whose elites were evaluated again, and the most reliable one."""
    return evaluated_again(small_run, tmp_path_factory.mktemp("again"))


@pytest.fixture(scope="module")
def file(again: tuple[Path, int], tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("atlas") / "atlas.html"
    with RunReader(again[0]) as reader:
        path.write_bytes(atlas_page(reader, link="https://example.org/run"))
    return path


@pytest.fixture
def opened(chromium: Browser, file: Path, request: pytest.FixtureRequest) -> Iterator[tuple[Page, list[str]]]:
    """The page, and what went wrong with it."""
    width, height, scheme = request.param
    context = open_context(chromium, width, height, moving=True, color_scheme=scheme, offline=True)
    page = context.new_page()
    problems = watch(page)
    page.goto(file.as_uri())
    expect(page.locator("html")).to_have_attribute("data-ready", "1")
    yield page, problems
    assert problems == []
    context.close()


def others(page: Page, archive: str) -> list[str]:
    """Return the cells of a map that hold another robot than the shown one."""
    return page.evaluate(
        """(archive) => {
            const { maps } = JSON.parse(document.getElementById("atlas").textContent);
            const shown = Number(document.getElementById("name").textContent.split(" ")[1]);
            return Object.keys(maps[archive]).filter((cell) => maps[archive][cell] !== shown);
        }""",
        archive,
    )


@pytest.mark.parametrize("opened", [(1280, 720, "light")], indirect=True)
def test_a_robot_is_pointed_at_clicked_and_crawls(
    opened: tuple[Page, list[str]], small_reader: RunReader, again: tuple[Path, int]
) -> None:
    page, _ = opened
    placed = small_reader.placements("morphology", small_reader.finished_generation().number)
    # it opens with the most reliable robot, and says first what to expect of it
    best = again[1]
    expect(page.locator("#name")).to_have_text(f"Robot {best}")
    recorded = f"{45 - 100 * (small_reader.evaluation(best).fitness or 0.0):.2f}"
    expect(page.locator("#gain")).to_have_text(
        re.compile(rf"35\.0 cm closer ± 2\.8mean of 2 trials under fresh noise; recorded fs\s{recorded}\scm")
    )
    expect(page.locator("#play")).to_have_text("Pause")

    # pointed at: the card says it in words and shows the robot
    cell = others(page, "morphology")[0]
    number = placed[tuple(map(int, cell.split(",")))]  # type: ignore[index]
    tile = page.locator(f'[data-c="morphology:{cell}"]')
    tile.hover()
    card = page.locator("#ta-tip")
    expect(card).to_be_visible()
    expect(card).to_contain_text(re.compile(r"(\d+\.\d cm (closer|farther)|lies still) · f_s"))
    expect(card).to_contain_text(f"robot {number}")
    drawn = "c => c.toDataURL().length > 3000"  # an empty one has 500 characters
    # the page's policy lets nobody wait inside it
    eventually(page, lambda: card.locator("canvas").evaluate(drawn))

    # clicked: it is shown, ringed, named by the address, and moves
    tile.click()
    expect(page.locator("#name")).to_have_text(f"Robot {number}")
    expect(page.locator('[data-map="morphology"] .ta-chosen')).to_have_count(1)
    expect(page).to_have_url(re.compile(f"#robot={number}&"))
    page.mouse.move(0, 0)
    page.locator("#speed").select_option("0.25")
    first = picture(page)
    eventually(page, lambda: (np.abs(picture(page) - first).max(axis=-1) > 20).mean() > 0.002)
    page.locator("#play").click()
    expect(page.locator("#play")).to_have_text("Play")
    still = picture(page)
    page.wait_for_timeout(300)
    np.testing.assert_array_equal(picture(page), still)

    # another target, by its row and by the strip; the card counts what the run file says
    said = 45 - 100 * small_reader.evaluation(number).distances[3].mean()
    row = page.locator("#targets label").nth(3)
    expect(row).to_contain_text(f"{said:+.1f}".replace("-", "−").replace("+0.0", "0.0"))
    row.click()
    expect(page).to_have_url(re.compile(f"#robot={number}&target=4$"))
    page.locator("#aim").select_option("1")
    expect(page.locator("#targets input").nth(1)).to_be_checked()
    # the maps in other colours: the chosen robot stays ringed, and cells can be clicked
    ringed = page.locator('[data-map="morphology"] .ta-chosen')
    expect(page.locator("#coloring")).to_have_value("robust fitness")
    expect(page.locator("#maps")).to_contain_text("robust")
    color = tile.locator("rect:not(.ta-chosen)").first.get_attribute("fill")
    page.locator("#coloring").select_option("fitness f_s")
    expect(page.locator("#maps")).not_to_contain_text("robust fs")
    assert tile.locator("rect").first.get_attribute("fill") != color
    expect(ringed).to_have_count(1)
    expect(page.locator("#network svg")).to_be_visible()
    expect(page.locator("#lineage li").first).to_contain_text(f"{number} · generation")


@pytest.mark.parametrize("opened", [(390, 844, "dark")], indirect=True)
def test_it_works_by_keyboard_and_fits_a_phone(opened: tuple[Page, list[str]]) -> None:
    page, _ = opened
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    shown = page.locator("#name").inner_text()
    page.locator('svg[data-map="controller"]').focus()
    for key in ("ArrowDown", "ArrowUp", "ArrowLeft", "ArrowRight"):
        page.keyboard.press(key)
    page.keyboard.press("Enter")
    page.wait_for_timeout(300)
    if page.locator("#name").inner_text() == shown:  # all keys led back to it
        page.keyboard.press("ArrowDown")
        page.keyboard.press("Enter")
    expect(page.locator("#name")).not_to_have_text(shown)
    playing = page.locator("#play").inner_text()
    page.keyboard.press("Space")
    expect(page.locator("#play")).not_to_have_text(playing)


@pytest.mark.parametrize("opened", [(1600, 900, "dark")], indirect=True)
def test_a_browser_reads_what_was_simulated(opened: tuple[Page, list[str]], small_reader: RunReader) -> None:
    page, _ = opened
    number = int(page.locator("#name").inner_text().split()[1])
    config = small_reader.config
    ((_, trials),) = replay_every_target(
        config,
        [small_reader.evaluation(number)],
        updates_per_frame=updates_per_frame(config.physics.control_period),
    )
    read = page.evaluate(
        """async (number) => {
            const bytes = taReplay.decoded(document.getElementById(`r${number}`).textContent);
            const end = 4 + new DataView(bytes.buffer).getUint32(0, true);
            const text = new TextDecoder().decode(await taReplay.inflated(bytes.subarray(4, end)));
            const scene = JSON.parse(text).scene;
            const robot = taReplay.motion(scene, await taReplay.inflated(bytes.subarray(end)));
            return robot.trials.map((trial) => {
                const point = new Float32Array(3 * robot.nPoints);
                trial.place(4 * scene.period, point, null);
                return [...point];
            });
        }""",
        number,
    )
    for ours, theirs in zip(read, trials, strict=True):
        points = posed(theirs.poses[4:5])[0].reshape(-1, 3)
        off = np.linalg.norm(np.array(ours).reshape(-1, 3) - points, axis=-1)
        assert off.max() < 2e-4
