"""What a server answers to whom, with real sockets and without a browser."""

from __future__ import annotations

import contextlib
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor

import msgspec
import pytest
import viser
import zstandard
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect

from app.gui import web_socket
from app.gui.access import Access
from app.gui.lanes import Lanes
from app.gui.viser_private import Gate
from app.server.server import serve_sessions
from benchmarks.synthetic_browser import CAMERA

TOKEN = "a-token-of-the-test"
N_CLIENTS = 20
PROTOCOL = f"viser-v{viser.__version__}"


class Session:
    """Says hello."""

    def __init__(self, client: viser.ClientHandle, _gate: Gate, _lanes: Lanes) -> None:
        client.gui.add_markdown(f"hello {client.client_id}")

    def cancel(self) -> None:
        """Nothing to give up."""

    def close(self) -> None:
        """Nothing to end."""


@contextlib.contextmanager
def serving(access: Access) -> Iterator[int]:
    with serve_sessions(Session, host="127.0.0.1", port=0, access=access) as server:
        yield server.get_port()


def open_socket(port: int, *, origin: str | None, query: str = "", cookie: str = "") -> ClientConnection:
    return connect(
        f"ws://127.0.0.1:{port}/{query}",
        origin=origin,  # type: ignore[arg-type]
        subprotocols=[PROTOCOL],  # type: ignore[list-item]
        additional_headers={"Cookie": cookie} if cookie else {},
        compression=None,
        max_size=None,
    )


def get(url: str, cookie: str = "") -> tuple[int, dict[str, str], str]:
    request = urllib.request.Request(url, headers={"Cookie": cookie} if cookie else {})

    class Stay(urllib.request.HTTPRedirectHandler):
        def redirect_request(self, *_: object) -> None:  # type: ignore[override]
            return None

    try:
        answer = urllib.request.build_opener(Stay).open(request, timeout=20)
    except urllib.error.HTTPError as e:
        answer = e
    with answer:
        return answer.status, dict(answer.headers), answer.read().decode(errors="replace")


def test_another_origin_is_refused_and_the_own_one_accepted() -> None:
    with serving(Access()) as port:
        for origin in ("http://evil.example", f"https://127.0.0.1:{port}.evil.example", "null"):
            with pytest.raises(InvalidStatus) as refused:
                open_socket(port, origin=origin)
            assert refused.value.response.status_code == 403
        for own in (f"http://127.0.0.1:{port}", None):
            open_socket(port, origin=own).close()
        status, headers, _ = get(f"http://127.0.0.1:{port}/")
        assert status == 200
        assert headers["X-Frame-Options"] == "SAMEORIGIN"


def test_without_the_token_neither_page_nor_socket_is_answered() -> None:
    with serving(Access(token=TOKEN)) as port:
        own = f"http://127.0.0.1:{port}"
        for query, cookie in (("", ""), ("?token=wrong", ""), ("", f"tensatlas_{port}=0")):
            status, _, text = get(f"{own}/{query}", cookie)
            assert status == 403
            assert "wants its token" in text
            with pytest.raises(InvalidStatus):
                open_socket(port, origin=own, query=query, cookie=cookie)
        status, headers, _ = get(f"{own}/?run=x&token={TOKEN}")
        assert (status, headers["Location"]) == (303, "?run=x")
        cookie = headers["Set-Cookie"].partition(";")[0]
        assert get(f"{own}/", cookie)[0] == 200
        open_socket(port, origin=own, cookie=cookie).close()
        open_socket(port, origin=None, query=f"?token={TOKEN}").close()
        with pytest.raises(InvalidStatus):
            open_socket(port, origin="http://evil.example", cookie=cookie)


def test_twenty_clients_at_once_each_get_a_session_of_their_own() -> None:
    with serving(Access()) as port:

        def greeted(_: int) -> str:
            with open_socket(port, origin=f"http://127.0.0.1:{port}") as socket:
                say_camera(socket)
                while True:
                    for message in received(socket):
                        if message["type"] == "GuiMarkdownMessage":
                            return str(message["props"]["_markdown"])

        with ThreadPoolExecutor(N_CLIENTS) as pool:
            assert len(set(pool.map(greeted, range(N_CLIENTS)))) == N_CLIENTS


def test_a_path_that_no_file_can_have_is_not_found() -> None:
    with serving(Access()) as port:
        for path in ("x" * 300, "x" * 5000, "a%00b", "%ff%fe", "../../etc/passwd", "%2e%2e/app"):
            status, headers, _ = get(f"http://127.0.0.1:{port}/{path}")
            assert status == 404
            assert headers["X-Frame-Options"] == "SAMEORIGIN"


def test_a_page_of_another_version_is_told_so_and_nobody_else_notices(
    caplog: pytest.LogCaptureFixture, capfd: pytest.CaptureFixture[str]
) -> None:
    with serving(Access()) as port:
        capfd.readouterr()
        old = connect(f"ws://127.0.0.1:{port}/", subprotocols=["viser-v0.0.1"])  # type: ignore[list-item]
        with old, pytest.raises(ConnectionClosed, match=r"mismatch. Client: 0\.0\.1, Server: [1-9]"):
            old.recv(timeout=30)
        assert capfd.readouterr().out == ""
    assert caplog.records == []


def test_there_is_room_for_so_many_browsers_and_for_another_when_one_has_gone(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(web_socket, "MAX_BROWSERS", 2)
    with serving(Access()) as port, contextlib.ExitStack() as stack:
        first, _ = (stack.enter_context(open_socket(port, origin=None)) for _ in range(2))
        with open_socket(port, origin=None) as third, pytest.raises(ConnectionClosed, match="As many"):
            third.recv(timeout=30)
        first.close()
        deadline = time.monotonic() + 30
        while True:
            with open_socket(port, origin=None) as another, contextlib.suppress(ConnectionClosed):
                say_camera(another)
                if received(another):
                    return
            assert time.monotonic() < deadline


def test_what_no_browser_sends_is_dropped_without_a_word(
    caplog: pytest.LogCaptureFixture, capfd: pytest.CaptureFixture[str]
) -> None:
    n = 90_000
    wrong: list[object] = [
        b"\x81\xa4type\xdd" + n.to_bytes(4, "big") + b"\x80" * n,  # so many empty maps
        b"\x81\xa4type" + b"\x91" * n + b"\x80",
        b"",
        "text",
        {"type": "ShareUrlRequest"},
        {"type": "GuiUpdateMessage", "uuid": [1], "updates": 5},
        {"type": "FileTransferPart", "transfer_uuid": 5, "part_index": "x", "content": None},
    ]
    with serving(Access()) as port, open_socket(port, origin=None) as socket:
        say_camera(socket)
        capfd.readouterr()
        for message in wrong:
            data = message if isinstance(message, bytes | str) else msgspec.msgpack.encode(message)
            socket.send(data)
        while not any(m["type"] == "GuiMarkdownMessage" for m in received(socket)):
            pass
        socket.ping().wait(30)  # it has read all of them and goes on
        assert capfd.readouterr().out == ""
        socket.send(b"\x80" * 200_000)
        with pytest.raises(ConnectionClosed):
            list(iter(lambda: socket.recv(timeout=30), None))
    assert caplog.records == []


def test_messages_are_read_no_faster_than_a_browser_sends_them(monkeypatch: pytest.MonkeyPatch) -> None:
    waited: list[float] = []

    async def sleep(seconds: float) -> None:
        waited.append(seconds)

    monkeypatch.setattr(web_socket.asyncio, "sleep", sleep)
    monkeypatch.setattr(web_socket, "RATE", 1e-9)
    monkeypatch.setattr(web_socket, "BURST", 10.0)
    with serving(Access()) as port, open_socket(port, origin=None) as socket:
        for _ in range(12):
            say_camera(socket)
        socket.ping().wait(30)
        deadline = time.monotonic() + 30
        while len([s for s in waited if s > 1e6]) < 2 and time.monotonic() < deadline:
            time.sleep(0.01)
    assert len([s for s in waited if s > 1e6]) == 2


def say_camera(socket: ClientConnection) -> None:
    """Send what a browser sends first; a client exists from then on."""
    socket.send(msgspec.msgpack.encode(CAMERA))


def received(socket: ClientConnection) -> list[dict]:
    """Return the messages of the next packet."""
    data = socket.recv(timeout=30)
    assert isinstance(data, bytes)
    size = int.from_bytes(data[8:16], "little")
    inner = zstandard.ZstdDecompressor().decompress(data[16 : 16 + size])
    return list(msgspec.msgpack.decode(inner)["messages"])
