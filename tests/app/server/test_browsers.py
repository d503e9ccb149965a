"""Browsers that are in nobody's way, with real sockets."""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Callable, Iterator

import viser

from app.gui.lanes import Lanes
from app.gui.viser_private import Gate
from app.server.server import serve_sessions
from benchmarks.synthetic_browser import SyntheticBrowser, html_with

PATIENCE = 30.0


class Session:
    """Has a field that holds whoever sets it to "hold", and notes what else comes.

    Args:
        client: the browser.
    """

    all: tuple[Session, ...] = ()

    def __init__(self, client: viser.ClientHandle, _gate: Gate, _lanes: Lanes) -> None:
        self.seen: list[str] = []
        self.held, self.go, self.cancelled, self.closed = (threading.Event() for _ in range(4))
        field = client.gui.add_text("field", "")
        answer = client.gui.add_html("")
        Session.all += (self,)

        @field.on_update
        def _(event: viser.GuiEvent) -> None:
            self.seen.append(event.target.value)
            if event.target.value == "hold":
                self.held.set()
                assert self.go.wait(PATIENCE)
            answer.content = f"answer to {event.target.value}"

    def cancel(self) -> None:
        """Give up."""
        self.cancelled.set()

    def close(self) -> None:
        """End."""
        self.closed.set()


@contextlib.contextmanager
def serving() -> Iterator[str]:
    Session.all = ()
    with serve_sessions(Session, host="127.0.0.1", port=0) as server:
        yield f"http://127.0.0.1:{server.get_port()}"
        for session in Session.all:
            session.go.set()


def wait(condition: Callable[[], object]) -> None:
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline, "waited in vain"
        time.sleep(0.01)


def test_of_a_flood_only_the_newest_is_done_and_others_are_answered_meanwhile() -> None:
    with serving() as address, SyntheticBrowser(address, PATIENCE) as busy:
        busy.set("field", "hold")
        wait(lambda: Session.all and Session.all[0].held.is_set())
        for k in range(150):  # fewer than a server reads at once
            busy.set("field", str(k))
        with SyntheticBrowser(address, PATIENCE) as other:  # comes while it lasts
            other.set("field", "hello")
            other.wait(html_with("answer to hello"), 0)
        assert Session.all[0].seen == ["hold"]
        Session.all[0].go.set()
        busy.wait(html_with("answer to 149"), 0)
        # the flood may have been on its way when the first one ended
        assert len(Session.all[0].seen) < 20
        assert Session.all[0].seen[-1] == "149"


def test_a_browser_that_leaves_is_seen_off_at_once_and_what_it_left_is_forgotten() -> None:
    with serving() as address:
        with SyntheticBrowser(address, PATIENCE) as browser:
            browser.set("field", "hold")
            wait(lambda: Session.all and Session.all[0].held.is_set())
            browser.set("field", "more")
            session = Session.all[0]
            time.sleep(0.1)
        assert session.cancelled.wait(PATIENCE)  # while the click is still at work
        assert not session.closed.is_set()
        session.go.set()
        assert session.closed.wait(PATIENCE)
        assert session.seen == ["hold"]
