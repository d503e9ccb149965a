"""A value that lives in a browser's page: its address, what its tab remembers, what draws it."""

from __future__ import annotations

from collections.abc import Callable

import viser

from app.gui.click_channel import script, sender
from app.gui.viser_private import uuid_of
from app.gui.widgets import add_channel, put_html


class PageValue:
    """Reads the value once, when the page is there, and changes it from then on.

    Args:
        gui: of one client, at a place that is always on the page.
        label: of the channel that the value comes through.
        expression: JavaScript of the value, a text.
        arrived: called with the value.
    """

    def __init__(
        self, gui: viser.GuiApi, label: str, expression: str, arrived: Callable[[str], None]
    ) -> None:
        self._known = False
        channel = add_channel(gui, label)
        self._writer = gui.add_html("")
        arrivals, key = "window.taArrived", f"'{uuid_of(channel)}'"
        self._tell = f"({arrivals}={arrivals}||{{}})[{key}]=1;"

        @channel.on_update
        def _(event: viser.GuiEvent) -> None:
            if event.client is not None and not self._known:
                self._known = True
                self.change("")
                arrived(str(event.target.value).rpartition("|")[0])

        # last: a browser may answer at once
        value, known = f"{expression}+'|'+Date.now()", f"({arrivals}||{{}})[{key}]"
        gui.add_html(script(sender(uuid_of(channel), value, until=known)))

    def change(self, code: str) -> None:
        """Run JavaScript that changes the value, unless that would be gone before it was read."""
        if self._known:
            put_html(self._writer, script(self._tell + code))
