"""The bar at the top of one browser's page: opens windows over the scene, and holds what is always in reach.

The bar is a panel of viser's that ``top_bar.css`` lays over the upper edge of the page; a window is another
one, shown while its button in the bar is down.
"""

from __future__ import annotations

import dataclasses
import html
import json
from collections.abc import Callable
from typing import Final

import viser
from viser import IconName

from app.gui.click_channel import ClickChannel
from app.gui.page_channel import page_file, run_script
from app.gui.widgets import put_html

WINDOWS: Final = ("Elites", "Run", "New run", "Breed", "Compare", "Side by side", "Take along")
"""All windows, in the order of their buttons."""
WINDOW_LEFT: Final = 12
WINDOW_WIDTH: Final = 370
"""Pixels, from the left edge of the scene."""
_ICONS: Final = {
    "theme": "M8 2a6 6 0 100 12zM8 2a6 6 0 010 12",
    "picture": "M2 5h3l1-2h4l1 2h3v8H2zM8 7a2 2 0 100 4 2 2 0 000-4",
    "link": "M7 9a3 3 0 004 0l2-2a3 3 0 00-4-4l-1 1M9 7a3 3 0 00-4 0L3 9a3 3 0 004 4l1-1",
}
"""Lines of the icons, in a square of 16."""
_COPY_LINK: Final = page_file("copy_link.js", __package__)
_SAVE_PICTURE: Final = page_file("save_picture.js", __package__)
_REVEAL: Final = (
    "setTimeout(()=>document.querySelector('[data-ta-mark=window]')"
    "?.parentElement.scrollIntoView({block:'start'}),400)"
)
"""On a phone a window is a part of a sheet, which may have been scrolled."""


@dataclasses.dataclass(slots=True)
class _Window:
    """A window, its panel, and what its button says beside the label."""

    label: str
    hint: str
    panel: viser.PanelHandle
    opened: Callable[[], None]
    badge: str = ""


class TopBar:
    """Makes the bar, and windows as they are asked for.

    Args:
        client: the browser.
        theme_wanted: called when the user wants the other theme.
    """

    def __init__(self, client: viser.ClientHandle, theme_wanted: Callable[[], None]) -> None:
        self._gui = gui = client.gui
        self._theme_wanted = theme_wanted
        self._windows: list[_Window] = []
        self._open: _Window | None = None
        self._covers: Callable[[int], None] = lambda _pixels: None
        panel = gui.add_panel(order=-2.0)
        with panel.add_tab("TensAtlas"):
            self._bar = gui.add_html("")
            self._handler = ClickChannel(gui, self._clicked, label="top bar").handler
            gui.add_html(f"<style>{page_file('top_bar.css', __package__)}</style>")
            self._title = gui.add_html("")
            self._reveal = gui.add_html("")
            self._n_opened = 0
        panel.float(x=0, y=0, width=320)
        panel.expand()  # on a phone, too

    def window(
        self, label: str, icon: IconName, hint: str, opened: Callable[[], None] = lambda: None
    ) -> viser.GuiTabHandle:
        """Return a new window, closed, to be filled within ``with``.

        Args:
            label: of its button, one of ``WINDOWS``.
            icon: of the window.
            hint: what the button says about it.
            opened: called whenever it has been opened.
        """
        panel = self._gui.add_panel(order=-1.0, visible=False)
        tab = panel.add_tab(label, icon)
        with tab:
            self._gui.add_html('<style data-ta-mark="window"></style>')
        panel.float(x=WINDOW_LEFT, y=10, width=WINDOW_WIDTH)
        self._windows.append(_Window(label, hint, panel, opened))
        self._windows.sort(key=lambda window: WINDOWS.index(window.label))
        self._draw()
        return tab

    def open(self, label: str) -> None:
        """Open a window, in place of the one that is open."""
        found = next(w for w in self._windows if w.label == label)
        if self._open is not None and self._open is not found:
            self._open.panel.visible = False
        self._open = found
        found.panel.visible = True
        found.panel.expand()
        self._n_opened += 1
        put_html(self._reveal, run_script(f"{_REVEAL}/*{self._n_opened}*/"))
        self._draw()
        self._covers(WINDOW_LEFT + WINDOW_WIDTH)
        found.opened()

    def close(self) -> None:
        """Close the window that is open."""
        if self._open is not None:
            self._open.panel.visible = False
        self._open = None
        self._draw()
        self._covers(0)

    def shows(self, label: str) -> bool:
        """Tell whether a window is open."""
        return self._open is not None and self._open.label == label

    def on_covering(self, covers: Callable[[int], None]) -> None:
        """Call a function with how many pixels of the scene a window covers at its left edge, 0 for none."""
        self._covers = covers

    def tell(self, label: str, badge: str) -> None:
        """Say something beside the label of a window: how many things it holds, or what goes on there."""
        found = next(w for w in self._windows if w.label == label)
        if found.badge != badge:
            found.badge = badge
            self._draw()

    def name_page(self, name: str) -> None:
        """Name the browser's tab after what it shows."""
        title = " · ".join(("TensAtlas", *filter(None, (name,))))
        put_html(self._title, run_script(f"document.title={json.dumps(title)}"))

    def _clicked(self, name: str, index: tuple[int, ...]) -> None:
        if name == "window" and index[0] < len(self._windows):
            chosen = self._windows[index[0]]
            if chosen is self._open:
                self.close()
            else:
                self.open(chosen.label)
        elif name == "theme":
            self._theme_wanted()

    def _draw(self) -> None:
        windows = "".join(
            f'<button type="button" data-c="window:{k}" onclick="{self._handler}"'
            f' title="{html.escape(w.hint)}" aria-pressed="{str(w is self._open).lower()}">{w.label}'
            + (f"<i>{html.escape(w.badge)}</i>" if w.badge else "")
            + "</button>"
            for k, w in enumerate(self._windows)
        )
        tools = "".join(
            (
                _tool("theme", "Light or dark", self._handler),
                _tool("picture", "Save a picture of the scene", html.escape(_SAVE_PICTURE)),
                _tool("link", "Copy the address of what you see", html.escape(_COPY_LINK)),
            )
        )
        put_html(
            self._bar,
            f'<nav class="ta-bar" data-ta-mark="bar"><b>TensAtlas</b>{windows}<span></span>{tools}</nav>',
        )


def _tool(name: str, hint: str, on_click: str) -> str:
    return (
        f'<button type="button" class="ta-tool" data-c="{name}:0" onclick="{on_click}" title="{hint}"'
        f' aria-label="{hint}"><svg width="16" height="16" viewBox="0 0 16 16" fill="none"'
        f' stroke="currentColor" stroke-width="1.4" stroke-linejoin="round" stroke-linecap="round">'
        f'<path d="{_ICONS[name]}"/></svg></button>'
    )
