"""Makes one file at a time for one browser, beside all else, with progress and cancelling."""

from __future__ import annotations

import threading
from collections.abc import Callable

import viser

from app.gui.actions import Actions
from app.gui.widgets import ignoring_event, put
from engine.errors import Cancelled, InvalidData

MadeFile = tuple[str, bytes]
"""Name and content."""
ProgressCallback = Callable[[str, int, int], None]
"""Receives what is being done and how much of how much is done; what it raises ends the work."""


class FileMaker:
    """Shows how far the work is and sends the file to the browser when it is done.

    Args:
        client: the browser; the widgets go where the panel is being built.
        actions: of the browser.
    """

    def __init__(self, client: viser.ClientHandle, actions: Actions) -> None:
        self._client, self._actions = client, actions
        self._busy = threading.Lock()
        self._cancelled = threading.Event()
        gui = client.gui
        self._text = gui.add_markdown("", visible=False)
        self._bar = gui.add_progress_bar(0.0, visible=False, animated=True)
        self._cancel = gui.add_button(
            "Cancel", color="gray", icon=viser.Icon.X, visible=False, hint="Make no file"
        )
        self._cancel.on_click(ignoring_event(self.cancel))

    def start(self, what: str, make: Callable[[ProgressCallback], MadeFile]) -> None:
        """Make a file, unless another is being made.

        Args:
            what: name of the file, as shown.
            make: returns the file; calls what it is given to say how far it is.

        Raises:
            InvalidData: another file is being made.
        """
        if not self._busy.acquire(blocking=False):
            raise InvalidData("Another file is being made; wait for it or cancel it.")
        self._cancelled.clear()
        # the bar may be out of sight
        self._notice = self._client.add_notification(
            "A file is being made", f"{what}: it is downloaded as soon as it is done.", loading=True
        )
        self._actions.slow(lambda: self._work(what, make))()

    def cancel(self) -> None:
        """Give up what is being made, soon."""
        self._cancelled.set()
        if self._busy.locked():
            self._text.content = "giving up …"

    def _work(self, what: str, make: Callable[[ProgressCallback], MadeFile]) -> None:
        try:
            self._show(what, "beginning", 0.0)
            name, content = make(lambda doing, n, total: self._report(what, doing, n, total))
            if not self._cancelled.is_set():
                self._client.send_file_download(name, content, save_immediately=True)
        except Cancelled:
            self._actions.notify("Cancelled", f"No file was made of {what}.")
        finally:
            for widget in (self._text, self._bar, self._cancel):
                widget.visible = False
            self._notice.remove()
            self._busy.release()

    def _report(self, what: str, doing: str, n: int, total: int) -> None:
        if self._cancelled.is_set() or self._actions.closed:
            raise Cancelled
        share = 100.0 * n / max(total, 1)
        # a message for every per cent is enough
        if int(share) != int(self._bar.value) or n == total or doing not in self._text.content:
            self._show(what, doing, share)

    def _show(self, what: str, doing: str, share: float) -> None:
        self._text.content = f"{what}: {doing}"
        put(self._bar, share)
        for widget in (self._text, self._bar, self._cancel):
            if not widget.visible:
                widget.visible = True
