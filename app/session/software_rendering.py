"""Spares browsers without a graphics card what costs them most."""

from __future__ import annotations

from typing import Final

import viser

from app.gui.browser_value import BrowserValue
from app.gui.page_channel import page_file

SOFTWARE: Final = ("swiftshader", "llvmpipe", "softpipe", "software", "basic render")
"""In the names of renderers that draw on the processor."""
MAX_LENGTH: Final = 500
"""Characters of the longest name that is read."""


def draws_in_software(renderer: str) -> bool:
    """Tell whether a renderer, by its WebGL name, is known to use no graphics card."""
    return len(renderer) <= MAX_LENGTH and any(name in renderer.lower() for name in SOFTWARE)


def spare_software_rendering(client: viser.ClientHandle) -> None:
    """Ask a browser once what draws its scene, and leave out shadows where that is its processor.

    Each of three shadow maps draws the whole robot once more, which takes two fifths of a frame then.
    """

    def arrived(renderer: str) -> None:
        if draws_in_software(renderer):
            client.scene.configure_default_lights(cast_shadow=False)

    expression = page_file("software_rendering.js", __package__)
    BrowserValue(client.gui, "graphics", expression, arrived)
