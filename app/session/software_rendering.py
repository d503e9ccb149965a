"""Spares browsers without a graphics card what costs them most."""

from __future__ import annotations

from typing import Final

import viser

from app.gui.browser_value import PageValue

SOFTWARE: Final = ("swiftshader", "llvmpipe", "softpipe", "software", "basic render")
"""In the names of renderers that draw on the processor."""
MAX_LENGTH: Final = 500
"""Characters of the longest name that is read."""
_RENDERER: Final = (
    "((function(){try{var g=document.createElement('canvas').getContext('webgl2'),"
    "d=g.getExtension('WEBGL_debug_renderer_info'),n=g.getParameter(d.UNMASKED_RENDERER_WEBGL);"
    "g.getExtension('WEBGL_lose_context').loseContext();return n}catch(e){return ''}})())"
)
"""JavaScript of the name of what draws; nothing where a browser keeps it to itself."""


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

    PageValue(client.gui, "graphics", _RENDERER, arrived)
