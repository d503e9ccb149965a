"""The actions of one browser's user: one at a time, and a notice when one fails."""

from __future__ import annotations

import contextlib
import logging
import threading
from collections.abc import Callable, Hashable
from typing import ParamSpec

import viser

from app.gui.lanes import Lanes
from engine.errors import Cancelled, TensAtlasError

log = logging.getLogger(__name__)

P = ParamSpec("P")


class Actions:
    """Guards the actions of a browser.

    Args:
        client: the browser, which gets the notices.
        lanes: of the browser.
        told: returns what the user is told of a text: visitors need not know all.
    """

    def __init__(
        self, client: viser.ClientHandle, lanes: Lanes, told: Callable[[str], str] = lambda text: text
    ) -> None:
        self._client, self._lanes, self._told = client, lanes, told
        self.mutex = threading.RLock()
        """Held by an action that excludes the others."""
        self.closed = False
        """Whether the browser has gone: no action begins any more."""

    def notify(self, title: str, body: str, *, stays: bool = False, bad: bool = False) -> None:
        """Show a notice for a few seconds, or until the user closes it; in red if something is bad."""
        seconds = None if stays else 12.0 if bad else 6.0
        self._client.add_notification(
            title, self._told(body), auto_close_seconds=seconds, color="red" if bad else None
        )

    def put(self, kind: Hashable, action: Callable[[], None]) -> None:
        """Have a guarded action done after those that wait, in place of one of its kind among them."""
        self._lanes.quick.put(kind, self.guarded(action))

    def slow(self, action: Callable[[], None]) -> Callable[..., None]:
        """Return a guarded action that is done beside the browser's others: it takes long.

        Whatever it is called with is dropped.
        """
        run = self.guarded(action, alone=False)
        return lambda *_: self._lanes.slow.put(action, run)

    def guarded(self, action: Callable[P, None], *, alone: bool = True) -> Callable[P, None]:
        """Return an action that reports what goes wrong as a notice.

        Args:
            action: what to do.
            alone: whether it excludes the browser's other actions; one that takes long must not.
        """

        def run(*args: P.args, **kwargs: P.kwargs) -> None:
            with self.mutex if alone else contextlib.nullcontext():
                if self.closed:
                    return
                try:
                    action(*args, **kwargs)
                except Cancelled:  # the user no longer wants the result, nor a notice
                    return
                except TensAtlasError as e:
                    self.notify("That did not work", str(e), bad=True)
                except Exception:  # a fault of ours: say so, keep the app going
                    log.exception("an action failed")
                    self.notify("Something went wrong", "The terminal that runs TensAtlas has the details.")

        return run
