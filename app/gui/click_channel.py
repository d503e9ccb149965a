"""Clicks on pictures and on lists drawn as HTML, which viser does not report."""

from __future__ import annotations

import html
import re
from collections.abc import Callable

import viser

from app.gui.page_channel import add_channel
from app.gui.viser_private import uuid_of

Clicked = Callable[[str, tuple[int, ...]], None]
_CLICK = re.compile(r"([a-z0-9-]{1,40}):(\d{1,3}(?:,\d{1,3}){0,5})\|\d{1,16}")


class ClickChannel:
    """Receives clicks on elements that carry ``data-c="name:i,j"``.

    Args:
        gui: of one client; create it inside the container that also holds the pictures.
        clicked: called with the name and the cell; None to say later with ``on_click``. Whatever else a
            browser sends is dropped.
        label: of the hidden input.
    """

    def __init__(self, gui: viser.GuiApi, clicked: Clicked | None = None, *, label: str = "clicks") -> None:
        self._clicked = clicked
        channel = add_channel(gui, label)
        self.handler = html.escape(f"taClick(event,'{uuid_of(channel)}')")
        """JavaScript for ``onpointerdown`` of a picture or ``onclick`` of a button, escaped."""

        self._id = uuid_of(channel)

        @channel.on_update
        def _(event: viser.GuiEvent) -> None:
            match = _CLICK.fullmatch(str(event.target.value))
            if match and self._clicked is not None:
                self._clicked(match[1], tuple(int(n) for n in match[2].split(",")))

    def along(self, name: str) -> str:
        """Return JavaScript, escaped, for pointer events of a picture: it reports where along it one presses.

        The picture has its ends in ``data-span``; what arrives is ``name`` and thousandths from one to the
        other.
        """
        return html.escape(f"taAlong(event,'{self._id}','{name}')")

    def on_click(self, clicked: Clicked) -> None:
        """Call a function with the name and the cell of every click."""
        self._clicked = clicked
