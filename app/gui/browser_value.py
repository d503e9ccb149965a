"""A value that lives in a browser's page: its address, what its tab remembers, what draws it, its size."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Final, Literal

import viser

from app.gui.page_channel import SCRIPT, add_channel, page_file, run_script
from app.gui.viser_private import uuid_of
from app.gui.widgets import panel_widths, put_html


class BrowserValue:
    """Reads the value once, when the page is there, or always, and changes it from then on.

    Args:
        gui: of one client, at a place that is always on the page.
        label: of the channel that the value comes through.
        expression: JavaScript of the value, a text.
        arrived: called with the value.
        watched: whether it is read, and ``arrived`` called, whenever it has changed.
    """

    def __init__(
        self,
        gui: viser.GuiApi,
        label: str,
        expression: str,
        arrived: Callable[[str], None],
        *,
        watched: bool = False,
    ) -> None:
        self._known = False
        self._n_read = 0
        channel = add_channel(gui, label)
        self._writer = gui.add_html("")
        self._id = uuid_of(channel)

        @channel.on_update
        def _(event: viser.GuiEvent) -> None:
            if event.client is not None and (watched or not self._known):
                self._known = True
                self._n_read += 1
                self.change(f"/*{self._n_read}*/")
                arrived(str(event.target.value).rpartition("|")[0])

        # last: a browser may answer at once
        report = "taWatch" if watched else "taReport"
        gui.add_html(run_script(f"{SCRIPT}{report}('{self._id}',()=>({expression}))"))

    def change(self, code: str) -> None:
        """Run JavaScript that changes the value; as long as the value has not been read, do nothing."""
        if self._known:
            put_html(self._writer, run_script(f"taArrived('{self._id}');{code}"))


class PageSize:
    """How large a browser's page and its scene are, in the page's own pixels.

    viser tells the scene's size in pixels of the screen. A phone has two or three of them in a pixel of a
    page, and viser takes fewer where it draws slowly.

    Args:
        client: the browser, whose scene still fills the page.
    """

    _FORM: Final = re.compile(r"(\d{1,5}),(\d{1,2}\.\d{3})")

    def __init__(self, client: viser.ClientHandle) -> None:
        self._camera = client.camera
        self.width: int = client.camera.image_width
        """Of the page."""
        self._ratio = 1.0
        self._changed: list[Callable[[], None]] = []
        expression = page_file("page_size.js", __package__)
        BrowserValue(client.gui, "page size", expression, self._arrived, watched=True)

    @property
    def scene(self) -> tuple[float, float]:
        """Width and height of the scene."""
        return self._camera.image_width / self._ratio, self._camera.image_height / self._ratio

    def on_change(self, changed: Callable[[], None]) -> None:
        """Call a function once the page has told its size, and when that has changed."""
        self._changed.append(changed)

    def room(self, *sides: Literal["left", "right"]) -> int:
        """Return how many pixels of the width panels at these sides leave."""
        taken = dict(zip(("left", "right"), panel_widths(self.width), strict=True))
        return self.width - sum(taken[side] for side in sides)

    def fit_panel(
        self, panel: viser.PanelHandle | viser.MainPanelHandle, side: Literal["left", "right"]
    ) -> None:
        """Give a panel at a side of the page the width that suits the page, now and when that changes."""
        fitted = 0

        def fit() -> None:
            nonlocal fitted
            if (width := self.width - self.room(side)) != fitted:  # it may be the user's by now
                fitted = width
                panel.set_width(width)

        fit()
        self.on_change(fit)

    def _arrived(self, value: str) -> None:
        if (found := self._FORM.fullmatch(value)) is None or float(found[2]) <= 0.0:
            return  # a browser may send anything
        told = int(found[1]), float(found[2])
        if told != (self.width, self._ratio):
            self.width, self._ratio = told
            for changed in self._changed:
                changed()
