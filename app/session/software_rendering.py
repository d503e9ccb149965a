"""Tells users of browsers without a graphics card why the scene is slow."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import viser

from app.gui.browser_value import BrowserValue
from app.gui.page_channel import page_file

SOFTWARE: Final = ("swiftshader", "llvmpipe", "softpipe", "software", "basic render")
"""In the names of renderers that draw on the processor."""
CHIP: Final = "no graphics card: drawn slowly"
MAX_LENGTH: Final = 500
"""Characters of the longest name that is read."""


def draws_in_software(renderer: str) -> bool:
    """Tell whether a renderer, by its WebGL name, is known to use no graphics card."""
    return len(renderer) <= MAX_LENGTH and any(name in renderer.lower() for name in SOFTWARE)


def tell_of_software_rendering(client: viser.ClientHandle, tell: Callable[[str], None]) -> None:
    """Ask a browser once what draws its scene, and have it told where that is its processor."""

    def arrived(renderer: str) -> None:
        if draws_in_software(renderer):
            tell(CHIP)

    expression = page_file("software_rendering.js", __package__)
    BrowserValue(client.gui, "graphics", expression, arrived)
