"""A map is enlarged and saved, the same robot is found on the other map and in the list of elites."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import pytest
from PIL import Image
from playwright.sync_api import Page, expect

from engine.storage.reader import RunReader
from tests.support.widgets import field_of, press

pytestmark = pytest.mark.browser
Visit = Callable[[str], Page]


def test_maps_are_enlarged_saved_lit_filtered_and_listed(
    address: str, visit: Visit, small_reader: RunReader
) -> None:
    page = visit(address)
    last = small_reader.last_generation()
    assert last is not None
    bodies, heads = (small_reader.placements(a, last) for a in ("morphology", "controller"))
    shared = next(n for n in bodies.values() if n in heads.values())
    here = page.locator(f'svg[data-map=morphology] g[data-n="{shared}"]')
    here.wait_for()

    # the same robot lights up on the other map
    other = page.locator("svg[data-map=controller] .ta-near")
    expect(other).to_have_attribute("visibility", "hidden")
    here.hover(force=True)
    expect(other).to_have_attribute("visibility", "visible")
    cell = page.locator(f'svg[data-map=controller] g[data-n="{shared}"] rect')
    assert other.get_attribute("x") == cell.get_attribute("x")
    page.mouse.move(640, 400)
    expect(other).to_have_attribute("visibility", "hidden")

    # any map fills the window, and is saved
    page.get_by_role("button", name="Enlarge").last.click()
    dialog = page.locator("dialog.ta-dialog")
    drawn = dialog.locator("svg").bounding_box()
    assert drawn is not None
    assert drawn["height"] > 500
    with page.expect_download() as waiting:
        dialog.get_by_role("button", name="Save as SVG").click()
    assert waiting.value.suggested_filename == "small-controller.svg"
    text = Path(waiting.value.path()).read_text(encoding="utf-8")
    svg = ElementTree.fromstring(text)
    assert len([e for e in svg.iter() if e.tag.endswith("rect")]) > len(heads)
    assert "onpointerdown" not in text
    with page.expect_download() as waiting:
        dialog.get_by_role("button", name="Save as PNG").click()
    with Image.open(waiting.value.path()) as picture:
        assert picture.width > 1200
        assert len(picture.getcolors(maxcolors=1 << 20) or ()) > 10
    page.keyboard.press("Escape")
    expect(dialog).to_have_count(0)

    # the list: sorted, searched, filtered; what is left out is pale on the maps
    press(page, "Elites")
    rows = page.locator(".ta-elites button")
    everybody = {*bodies.values(), *heads.values()}
    expect(rows).to_have_count(len(everybody))
    known = {n: 100 * (0.45 - e.fitness) for n, e in small_reader.summaries(everybody).items()}
    shown = [float(t) for t in re.findall(r"(-?[\d.]+) cm", " ".join(rows.all_inner_texts()))]
    assert shown == [round(f_s, 2) + 0.0 for f_s in sorted(known.values(), reverse=True)]
    field = field_of(page, "f_s from, cm")
    least = 0.5 * round(2 * shown[len(shown) // 2])
    field.fill(str(least))
    field.press("Enter")
    wanted = sum(f_s >= least for f_s in known.values())
    expect(page.locator(".ta-elites")).to_contain_text(f"{wanted} of {len(everybody)} elites")
    pale = sum(known[n] < least for n in bodies.values())
    expect(page.locator("svg[data-map=morphology] rect[fill-opacity='0.13']")).to_have_count(pale)
    best = max(known, key=lambda n: known[n])
    field_of(page, "Search").fill(f"robot {best} ")
    page.locator(f'.ta-elites [data-c="elite:{best // 1000},{best % 1000}"]').click()
    expect(page.locator(".ta-card")).to_contain_text(f"Robot {best} ")
