"""Taking robots along, in a real Chromium: basket, downloads, and a page that plays by itself."""

from __future__ import annotations

import io
import re
import zipfile
from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Browser, Page, Request, expect

from engine.fabrication.dimensions.cable_problems import makeable
from engine.fabrication.materials import load_materials, preset_text
from engine.storage.reader import RunReader
from tests.support.software_chromium import eventually, open_context
from tests.support.widgets import best_distance, click_cell, press

pytestmark = pytest.mark.browser
REMEMBERED = "JSON.parse(sessionStorage.getItem('tensatlas-basket') || '[]').length"
"""How many robots the tab remembers to be in the basket."""


def download(page: Page, button: str) -> tuple[str, bytes]:
    """Click a button; return name and content of the file that arrives."""
    with page.expect_download(timeout=180_000) as waiting:
        page.get_by_role("button", name=re.compile(f"^{button}")).click()
    return waiting.value.suggested_filename, Path(waiting.value.path()).read_bytes()


def test_files_and_basket(
    address: str, visit: Callable[[str], Page], chromium: Browser, tmp_path: Path, small_reader: RunReader
) -> None:
    page = visit(address)
    page.set_default_timeout(180_000)
    filled = page.locator('svg.ta-map[data-map=morphology] g[data-filled="1"]')
    line, listed = page.locator(".ta-replay"), page.locator(".ta-basket")
    filled.first.wait_for()
    press(page, "Take along")
    expect(page.get_by_role("button", name="Add to basket")).to_be_enabled()  # the robot that greets
    expect(listed).to_contain_text("The basket is empty")
    numbers = []
    for k in (0, 1):
        numbers.append(number := click_cell(page, filled.nth(k)))
        expect(line).to_contain_text("exactly as evaluated")
        page.get_by_role("button", name="Add to basket").click()
        expect(listed).to_contain_text(f"{number} · small")
        eventually(page, lambda n=k + 1: page.evaluate(REMEMBERED) == n)  # the tab is told a moment later
    # a reload of the page changes nothing, but that the window is closed again
    page.reload()
    press(page, "Take along", "2")
    for number in numbers:
        expect(listed).to_contain_text(f"{number} · small")
    expect(line).to_contain_text("exactly as evaluated")
    # the same robot again is refused, and another one is taken out again
    page.get_by_role("button", name="Add to basket").click()
    expect(page.get_by_text("is in the basket already")).to_be_visible()

    page.get_by_label("Paper", exact=True).click()
    page.get_by_role("option", name="Letter").click()
    page.get_by_label("Material", exact=True).click()
    page.get_by_role("option", name="silicone-sheet").click()
    name, content = download(page, "Download basket")
    assert name == "tensatlas_basket.zip"
    with zipfile.ZipFile(io.BytesIO(content)) as packed:
        folders = {n.split("/")[1] for n in packed.namelist()}
        chosen_materials = [packed.read(n) for n in packed.namelist() if n.endswith("/materials.toml")]
    assert folders == {f"small_robot_{n}" for n in numbers}
    # a robot whose cables cannot be made of that is of what they can be made of
    silicone = load_materials("silicone-sheet")
    bodies = [small_reader.evaluation(n).solution.morphology for n in sorted(numbers)]
    wanted = sorted(preset_text(makeable(body, silicone).file).encode() for body in bodies)
    assert sorted(chosen_materials) == wanted
    listed.get_by_role("button", name=f"Take robot {numbers[0]} of small out").click()
    expect(page.get_by_role("button", name="Download basket (1)")).to_be_visible()
    page.get_by_role("button", name="Clear basket").click()
    expect(listed).to_contain_text("The basket is empty")

    best, _ = best_distance(small_reader.evaluation(numbers[1]))
    chosen = f"small_robot_{numbers[1]}_target_{best + 1}"
    name, content = download(page, "Picture")
    assert name == f"{chosen}.png"
    assert Image.open(io.BytesIO(content)).size == (1280, 720)
    name, content = download(page, "Video")
    assert (name, content[4:8]) == (f"{chosen}.mp4", b"ftyp")
    (tmp_path / name).write_bytes(content)
    assert played(chromium, tmp_path / name) == (2.0, 1280, 720)
    name, content = download(page, "Export")
    with zipfile.ZipFile(io.BytesIO(content)) as packed:
        names = {Path(n).name: n for n in packed.namelist()}
        assert {"robot.xml", "genotype.json", "bill_of_materials.csv", "README.md"} <= set(names)
        model = mujoco.MjModel.from_xml_string(packed.read(names["robot.xml"]).decode())
    assert model.nbody % 6 == 1
    name, content = download(page, "Table of this run")
    assert (name, content.split(b",")[0]) == ("small.csv", b"archive")
    name, content = download(page, "Page")
    assert name == f"{chosen}.html"
    file = tmp_path / name
    file.write_bytes(content)
    plays_by_itself(chromium, file, numbers[1])


def played(chromium: Browser, file: Path) -> tuple[float, int, int]:
    """Show a video, go to its middle, and return its seconds, width and height."""
    page = chromium.new_page()
    page.goto(file.as_uri())
    video = page.locator("video")
    seconds, width, height = video.evaluate(
        """v => new Promise((done, failed) => {
            v.onerror = () => failed(v.error.message);
            v.onseeked = () => done([v.duration, v.videoWidth, v.videoHeight]);
            v.currentTime = 1;
        })"""
    )
    page.close()
    return round(seconds, 2), width, height


def plays_by_itself(chromium: Browser, file: Path, number: int) -> None:
    """Check that a page plays, draws and asks for nothing, on a desk and on a phone."""
    for size, scheme in (((1280, 720), "dark"), ((390, 844), "light")):
        context = open_context(chromium, *size, moving=True, color_scheme=scheme, offline=True)
        page = context.new_page()
        problems = watch(page)
        plays_and_turns(page, file, number)
        assert problems == []
        context.close()


def plays_and_turns(page: Page, file: Path, number: int) -> None:
    page.goto(file.as_uri())
    expect(page.locator("html")).to_have_attribute("data-ready", "1")
    expect(page.locator("aside")).to_contain_text(f"Robot {number}")
    # it plays to the end
    expect(page.locator("#play")).to_have_text("Play")
    expect(page.locator("#clock")).to_have_text(re.compile(r"^2\.0 of 2 s"))
    expect(page.locator("#away")).to_contain_text("cm from the target")
    before = picture(page)
    assert len(np.unique(before.reshape(-1, 3), axis=0)) > 50
    # scrubbing shows another moment, turning another side
    page.locator("#time").fill("0.5")
    expect(page.locator("#clock")).to_have_text(re.compile(r"^0\.5"))
    box = page.locator("canvas").bounding_box()
    assert box is not None
    middle = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(*middle)
    page.mouse.down()
    page.mouse.move(middle[0] + 90, middle[1] + 20, steps=3)
    page.mouse.up()
    eventually(page, lambda: (np.abs(picture(page) - before).max(axis=-1) > 20).mean() > 0.01)
    page.locator("#shade").click()
    eventually(page, lambda: abs(picture(page).mean() - before.mean()) > 100)
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")


def watch(page: Page) -> list[str]:
    """Return a list that gets what a page asks the network for and every error."""
    problems: list[str] = []

    def note_request(request: Request) -> None:
        if not request.url.startswith("file:"):
            problems.append(request.url)

    page.on("request", note_request)
    page.on("pageerror", lambda error: problems.append(str(error)))
    page.on("console", lambda message: problems.append(message.text))
    return problems


def picture(page: Page) -> np.ndarray:
    """Return what the canvas shows, (height, width, 3)."""
    image = Image.open(io.BytesIO(page.locator("#view").screenshot())).convert("RGB")
    return np.asarray(image).astype(int)
