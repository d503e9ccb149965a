"""What a browser without a graphics card is told, and what every browser is spared."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from app.server.server import serve
from app.session.software_rendering import CHIP, draws_in_software
from benchmarks.synthetic_browser import Message, SyntheticBrowser, html_with

SWIFTSHADER = (
    "ANGLE (Google, Vulkan 1.3.0 (SwiftShader Device (Subzero) (0x0000C0DE)), SwiftShader driver-5.0.0)"
)


@pytest.mark.parametrize(
    ("renderer", "expected"),
    [
        (SWIFTSHADER, True),
        ("ANGLE (Mesa, llvmpipe (LLVM 19.1.7 256 bits), OpenGL 4.5)", True),
        ("ANGLE (Microsoft, Microsoft Basic Render Driver Direct3D11 vs_5_0 ps_5_0, D3D11)", True),
        ("ANGLE (NVIDIA, NVIDIA GeForce RTX 3060 Direct3D11 vs_5_0 ps_5_0, D3D11)", False),
        ("Apple GPU", False),
        ("", False),
        ("software" * 1000, False),
    ],
)
def test_renderers_without_a_graphics_card_are_known(renderer: str, expected: bool) -> None:
    assert draws_in_software(renderer) == expected


def test_only_a_browser_that_draws_in_software_is_told_so(small_run: Path) -> None:
    with serve([small_run], host="127.0.0.1", port=0) as server:
        address, heard = f"http://127.0.0.1:{server.get_port()}", list[Message]()
        with SyntheticBrowser(address, heard=heard.append) as browser:
            browser.uuid("graphics")
            mark = browser.mark()
            browser.set("graphics", "Apple GPU|1")
            browser.wait(html_with("taArrived"), mark)
            time.sleep(0.5)
        assert heard
        assert not any(html_with(CHIP)(message) for message in heard)
        with SyntheticBrowser(address) as browser:
            browser.set("graphics", f"{SWIFTSHADER}|1")
            browser.wait(html_with(CHIP), 0)


def test_no_browser_has_to_draw_shadows_or_surroundings(small_run: Path) -> None:
    heard = list[Message]()
    with (
        serve([small_run], host="127.0.0.1", port=0) as server,
        SyntheticBrowser(f"http://127.0.0.1:{server.get_port()}", heard=heard.append) as browser,
    ):
        browser.uuid("graphics")
        browser.wait(lambda message: message["type"] == "EnableLightsMessage", 0)
    (lights,) = (m for m in heard if m["type"] == "EnableLightsMessage")
    (surroundings,) = (m for m in heard if m["type"] == "EnvironmentMapMessage")
    assert not lights["enabled"]
    assert surroundings["hdri_data"] is None
    assert not [m for m in heard if m.get("props", {}).get("cast_shadow")]
