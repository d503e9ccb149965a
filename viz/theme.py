"""The colours that everything is drawn with."""

from __future__ import annotations

from typing import Final

import numpy as np
from plotly.colors import sample_colorscale, unlabel_rgb

MAPS: Final = {"viridis": "Viridis", "cividis": "Cividis"}
"""Perceptually uniform colour maps on offer; cividis also reads the same to the colour-blind."""
STILL: Final = "#747c87"
ABOUT_ZERO: Final = {
    "viridis": ("#7a3fb5", "#8e7bb0", STILL, "#35b779", "#a0d93a", "#fde725"),
    "cividis": ("#2f62c4", "#7d93bb", STILL, "#a69d75", "#d3c164", "#fee838"),
}
"""The same about 0: colours far below it and half as far below, that of 0, and three above it."""
_PLACES: Final = (0.0, 0.25, 0.5, 0.62, 0.81, 1.0)
"""Parts of the scale at which these lie."""

ACCENT: Final = (54, 179, 160)
SELECTED: Final = "#ff5d8f"
LINKED: Final = "#ffb454"
ROD: Final = (196, 201, 209)
SERVO_ROD: Final = (240, 138, 60)
HEAD_ROD: Final = (54, 199, 178)
NODE: Final = (228, 232, 238)
FOOT: Final = (236, 92, 160)
"""A foot that grips one way."""
CABLE_SLACK: Final = (66, 82, 108)
CABLE_TAUT: Final = (64, 160, 255)
CABLE: Final = (84, 116, 156)
"""A passive cable whose tension is not shown."""
SERVO_SLACK: Final = (112, 74, 48)
SERVO_TAUT: Final = (255, 172, 64)
SERVO_CABLE: Final = (196, 124, 60)
"""An internal cable whose tension is not shown."""
LIT: Final = (255, 224, 120)
"""The module that is pointed at."""
PICKED: Final = (255, 93, 143)
"""The rod or cable that was clicked, as what is selected on a map."""
CONTACT: Final = (176, 232, 84)
NUMBER: Final = (240, 244, 250)
CHIP: Final = (26, 31, 38)
"""What a number stands on."""
TARGET: Final = (46, 204, 224)
TRAIL: Final = (255, 93, 143)
WALL: Final = (150, 178, 214)
WALL_EDGE: Final = (190, 210, 236)
LANES: Final = ((255, 93, 143), (255, 180, 84), (122, 162, 247), (158, 206, 106))
"""Colours of robots side by side, in their order."""
LANE_LINE: Final = (110, 118, 132)
GOOD_TEXT: Final = "var(--ta-good,#36b3a0)"
WARNING_TEXT: Final = "var(--ta-warning,#e0a458)"
BAD_TEXT: Final = "var(--ta-bad,#ff7b72)"
"""CSS colours of words that stand out; darker where the app is light."""
TEXT_STYLE: Final = (
    '<style>[data-mantine-color-scheme="light"]{--ta-good:#0f766e;--ta-warning:#955900;--ta-bad:#c0362c;'
    "--ta-first:#0f766e;--ta-second:#955900}"
    '[data-mantine-color-scheme="light"] [role="tab"][aria-selected="true"]'
    "{color:var(--ta-good)!important}</style>"
)
"""HTML that makes them so; a page needs it once."""


def color_at(part: float, name: str = "viridis", *, about_zero: bool = False) -> str:
    """Return the ``#rrggbb`` colour at a part, 0 to 1, of a colour map, or of the one that is grey at 0.5."""
    part = min(max(part, 0.0), 1.0)
    if about_zero:
        channels = np.array([[int(c[k : k + 2], 16) for k in (1, 3, 5)] for c in ABOUT_ZERO[name]])
        rgb = [float(np.interp(part, _PLACES, channel)) for channel in channels.T]
    else:
        rgb = list(unlabel_rgb(sample_colorscale(MAPS[name], [part])[0]))
    return "#" + "".join(f"{round(c):02x}" for c in rgb)


def css(color: tuple[int, int, int]) -> str:
    """Return a colour as CSS has it."""
    return f"rgb({color[0]},{color[1]},{color[2]})"


def linear(colors: np.ndarray) -> np.ndarray:
    """Return sRGB colours as linear ones, both (..., 3) uint8: batches of meshes and of lines take these."""
    return _LINEAR[colors]


def _linear_table() -> np.ndarray:
    part = np.arange(256) / 255.0
    curve = np.where(part <= 0.04045, part / 12.92, ((part + 0.055) / 1.055) ** 2.4)
    return np.round(255.0 * curve).astype(np.uint8)


_LINEAR: Final = _linear_table()
