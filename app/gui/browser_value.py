"""A value that lives in a browser's page: its address, what its tab remembers, what draws it."""

from __future__ import annotations

from collections.abc import Callable

import viser

from app.gui.page_channel import SCRIPT, add_channel, run_script
from app.gui.viser_private import uuid_of
from app.gui.widgets import put_html


class BrowserValue:
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
        self._id = uuid_of(channel)

        @channel.on_update
        def _(event: viser.GuiEvent) -> None:
            if event.client is not None and not self._known:
                self._known = True
                self.change("")
                arrived(str(event.target.value).rpartition("|")[0])

        # last: a browser may answer at once
        gui.add_html(run_script(f"{SCRIPT}taReport('{self._id}',()=>({expression}))"))

    def change(self, code: str) -> None:
        """Run JavaScript that changes the value; as long as the value has not been read, do nothing."""
        if self._known:
            put_html(self._writer, run_script(f"taArrived('{self._id}');{code}"))
