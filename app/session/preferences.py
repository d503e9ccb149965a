"""What one browser remembers for all its pages: whether the app is light or dark."""

from __future__ import annotations

from typing import Final

import viser

from app.gui.browser_value import BrowserValue
from viz import theme

KEY: Final = "tensatlas-theme"
"""Key under which a browser remembers it."""


class ThemeSwitch:
    """Shows the app in the theme that its browser remembers, the dark one at first.

    Args:
        gui: of one client, at a place that is always on the page.
    """

    def __init__(self, gui: viser.GuiApi) -> None:
        self._gui = gui
        self.dark = True
        """Whether the dark theme is shown."""
        remembered = f"(localStorage.getItem('{KEY}')||'')"
        self._memory = BrowserValue(gui, "theme", remembered, self._remembered)

    def toggle(self) -> None:
        """Show the other theme from now on."""
        self._memory.change(f"localStorage.setItem('{KEY}','{'light' if self.dark else 'dark'}')")
        self._show(dark=not self.dark)

    def _remembered(self, text: str) -> None:
        if text == "light":
            self._show(dark=False)

    def _show(self, *, dark: bool) -> None:
        self.dark = dark
        configure_theme(self._gui, dark=dark)


def configure_theme(gui: viser.GuiApi, *, dark: bool) -> None:
    """Give a browser, or all of a server, the looks of the app."""
    gui.configure_theme(dark_mode=dark, show_logo=False, show_share_button=False, brand_color=theme.ACCENT)
