"""Files that browsers send, with real sockets."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator

import pytest
import viser

from app.gui import viser_private
from app.gui.lanes import Lanes
from app.gui.viser_private import MAX_COMING, Gate, within
from app.server.server import serve_sessions
from benchmarks.synthetic_browser import SyntheticBrowser

PATIENCE = 30.0
LARGE = MAX_COMING * 2 // 3


class Session:
    """Takes files."""

    refused: tuple[str, ...] = ()
    taken: tuple[tuple[str, bytes], ...] = ()

    def __init__(self, client: viser.ClientHandle, gate: Gate, _lanes: Lanes) -> None:
        button = client.gui.add_upload_button("Upload")

        def refuse(reason: str) -> None:
            Session.refused += (reason,)

        def take(_event: viser.GuiEvent) -> None:
            Session.taken += (gate.taken(button),)

        button.on_upload(take)
        gate.open(button, ".tsmr", MAX_COMING, refuse)

    def cancel(self) -> None:
        """Nothing to give up."""

    def close(self) -> None:
        """Nothing to end."""


@contextlib.contextmanager
def serving() -> Iterator[str]:
    Session.refused = Session.taken = ()
    with serve_sessions(Session, host="127.0.0.1", port=0, uploads=True) as server:
        yield f"http://127.0.0.1:{server.get_port()}"


def announce(browser: SyntheticBrowser, size: int, parts: int = 1, name: str = "x.tsmr") -> None:
    browser.send(
        {
            "type": "FileTransferStartUpload",
            "source_component_uuid": browser.uuid("Upload"),
            "transfer_uuid": "t",
            "filename": name,
            "mime_type": "",
            "part_count": parts,
            "size_bytes": size,
        }
    )


def send(browser: SyntheticBrowser, content: bytes) -> None:
    browser.send(
        {
            "type": "FileTransferPart",
            "source_component_uuid": browser.uuid("Upload"),
            "transfer_uuid": "t",
            "part_index": 0,
            "content": content,
        }
    )


def wait(condition: Callable[[], object]) -> None:
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline, "waited in vain"
        time.sleep(0.01)


def test_a_file_arrives_and_no_more_of_it_than_was_announced() -> None:
    with serving() as address, SyntheticBrowser(address, PATIENCE) as browser:
        announce(browser, 3)
        send(browser, b"abcd")
        announce(browser, 3)
        send(browser, b"abc")
        wait(lambda: Session.taken)
        assert Session.taken == (("x.tsmr", b"abc"),)
        assert Session.refused == ()


def test_a_file_of_another_kind_is_refused_before_it_comes() -> None:
    with serving() as address, SyntheticBrowser(address, PATIENCE) as browser:
        announce(browser, 3, name="pic.csv")
        browser.wait(lambda m: m["type"] == "FileTransferPartAck", 0)  # its button waits for that
        assert Session.refused == ("pic.csv is no file of the kind *.tsmr",)
        send(browser, b"abc")
        announce(browser, 2, name="OK.TSMR")
        send(browser, b"ok")
        wait(lambda: Session.taken)
        assert Session.taken == (("OK.TSMR", b"ok"),)


def test_large_files_of_several_browsers_come_one_after_the_other() -> None:
    acknowledged: list[int] = []

    def hear(message: dict) -> None:
        if message["type"] == "FileTransferPartAck":
            acknowledged.append(message["transferred_bytes"])

    with serving() as address, SyntheticBrowser(address, PATIENCE, hear) as second:
        with SyntheticBrowser(address, PATIENCE) as first:
            announce(first, LARGE, parts=2)
            send(first, b"x")
            first.wait(lambda m: m["type"] == "FileTransferPartAck", 0)
            announce(second, LARGE)
            wait(lambda: Session.refused)
            assert "try again" in Session.refused[0]
            wait(lambda: acknowledged == [LARGE])  # its button waits for that
        while acknowledged[-1] == LARGE:  # until it is noticed that the first one has left
            n = len(acknowledged)
            announce(second, LARGE, parts=2)
            send(second, b"x")
            wait(lambda n=n: len(acknowledged) > n)  # type: ignore[misc]
        assert acknowledged[-1] == 1


def test_a_file_that_does_not_come_makes_room(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(viser_private, "STALLED", 0.0)
    with serving() as address, SyntheticBrowser(address, PATIENCE) as first:
        announce(first, LARGE, parts=2)
        send(first, b"x")
        first.wait(lambda m: m["type"] == "FileTransferPartAck", 0)
        with SyntheticBrowser(address, PATIENCE) as second:
            announce(second, LARGE, parts=2)
            send(second, b"x")
            second.wait(lambda m: m["type"] == "FileTransferPartAck", 0)
        assert Session.refused == ()


def test_what_is_beyond_a_slider_becomes_its_end() -> None:
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    try:
        slider = server.gui.add_slider("Time", min=-3.0, max=40.0, step=0.1, initial_value=0.0)
        number = server.gui.add_number("No.", 1.0, min=1.0, max=9.0)
        props = slider._impl.props
        assert [within(props, v) for v in (99.0, -4, 12.5)] == [40.0, -3.0, 12.5]
        assert [within(props, v) for v in (True, "99", None)] == [True, "99", None]
        # typing 12 passes through 1: what lies beyond is the reader's business
        assert within(number._impl.props, 99.0) == 99.0
    finally:
        server.stop()
