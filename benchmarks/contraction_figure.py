"""Picture contraction against stiffness: ``python -m benchmarks.contraction_figure OUT.png``."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

import plotly.graph_objects as go
from playwright.sync_api import sync_playwright
from plotly.colors import sample_colorscale

from benchmarks import reference, static_fidelity
from engine.simulation.physics import Physics

SIZE = (900, 560)


def figure() -> go.Figure:
    """Return distances of faces 1 and 5 of one module without gravity against stiffness."""
    records = reference.load(reference.STATIC)["single_module"]
    stiffness = [r["stiffness"] for r in records]
    distance = static_fidelity.contraction(Physics())[0][:, :, 0]
    states = [s["state"] for s in records[0]["zero_gravity"]]
    drawn = [k for k, state in enumerate(states) if state not in states[:k]]
    result = go.Figure()
    for k, colour in zip(drawn, sample_colorscale("Viridis", len(drawn), high=0.9), strict=True):
        name = states[k].replace("cycle_", "") + ("°" if "cycle" in states[k] else "")
        result.add_scatter(
            x=stiffness, y=distance[:, k, 0], mode="lines", name=name, line={"color": colour, "width": 2.5}
        )
        result.add_scatter(
            x=stiffness,
            y=distance[:, k, 1],
            mode="markers",
            showlegend=False,
            marker={"color": colour, "size": 9, "symbol": "circle-open", "line": {"width": 2}},
        )
    result.update_layout(
        template="simple_white",
        title="One module without gravity: lines TensAtlas, circles the published simulator",
        xaxis={"title": "relative stiffness of the passive cables", "dtick": 0.1},
        yaxis={"title": "distance of the actuated faces, cm"},
        legend={"title": "servo command", "traceorder": "normal"},
        font={"size": 15},
        margin={"t": 60, "b": 60, "l": 70, "r": 20},
    )
    return result


def draw(picture: go.Figure, out: Path, size: tuple[int, int]) -> None:
    """Draw a figure in a browser and keep the picture; ``size`` is its width and height in px."""
    found = next(filter(None, map(shutil.which, ("chromium", "chromium-browser"))), None)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=found, args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": size[0], "height": size[1]}, device_scale_factor=2)
        page.set_content(
            picture.to_html(config={"displayModeBar": False}, default_height=f"{size[1] - 16}px")
        )
        page.locator(".legend").wait_for()
        page.screenshot(path=out)
        browser.close()


if __name__ == "__main__":
    draw(figure(), Path(sys.argv[1]), SIZE)
