"""The browser app: one viser server, one session per browser."""

from __future__ import annotations

import contextlib
import dataclasses
import gc
import os
import socket
import sys
import threading
import time
import urllib.parse
import warnings
import webbrowser
from collections.abc import Callable, Hashable, Iterator, Sequence
from pathlib import Path
from typing import Protocol

import viser

from app.gui.access import TOKEN_VARIABLE, Access, access_to, is_loopback
from app.gui.lanes import Lanes, Service
from app.gui.page_channel import mark_page
from app.gui.viser_private import Gate, start_server
from app.runs.library import Library
from app.server.log import limit_log
from app.session.dump_session import DumpSession
from app.session.preferences import configure_theme
from app.session.session import Session
from engine.errors import TensAtlasError
from engine.replay.dump import read_dump
from engine.storage.reader import RunReader
from engine.workers.malloc import keep_memory_compact

EVERY_ADDRESS = ("0.0.0.0", "::", "")
"""Hosts that stand for all addresses of the machine."""
CLOSING_TIME = 5.0
"""Seconds that the end of a server waits for what its browsers do."""


class ServerError(TensAtlasError):
    """The app cannot listen on the given address."""


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Listening:
    """Where a server listens, and whom it answers.

    Attributes:
        host, port: address to listen on.
        token: that every request must carry; None for no token on this machine, and a new one elsewhere.
        origins: of pages that a reverse proxy shows the app under.
        open_browser: show the app in the user's browser if there is a screen.
    """

    host: str = "127.0.0.1"
    port: int = 8080
    token: str | None = None
    origins: tuple[str, ...] = ()
    open_browser: bool = False

    @property
    def access(self) -> Access:
        """The rules of the server.

        Raises:
            InvalidData: the token or an origin cannot be used.
        """
        return access_to(self.host, self.token, self.origins)


def explore(places: Sequence[Path], listening: Listening, *, read_only: bool = False) -> None:
    """Serve the app until interrupted.

    Args:
        places: run files and folders to offer; empty for the default ones.
        listening: where, and whom to answer.
        read_only: let visitors look at the runs only.

    Raises:
        InvalidData: the token or an origin cannot be used.
        RunFileError: a run file named is missing or damaged.
        ServerError: the address cannot be listened on.
    """
    for place in places:
        if not place.is_dir():
            RunReader(place).close()
    access = listening.access
    limit_log()
    # Numba takes half a second to import; a failure dump is shown without
    from app.server.warm_up import WarmUp

    keep_memory_compact()
    with (
        contextlib.closing(WarmUp()) as warm_up,
        serve(places, host=listening.host, port=listening.port, access=access, read_only=read_only) as server,
    ):
        gc.freeze()  # imported modules stay: garbage collection need not look at them again
        warm_up.start()
        server.on_client_connect(warm_up.tell)
        announce(server, listening, access)
        wait_for_interrupt()


def replay_dump(path: Path, listening: Listening) -> None:
    """Serve a failure dump until interrupted.

    Args:
        path: the dump.
        listening: where, and whom to answer.

    Raises:
        DumpError: the file cannot be read as a dump.
        ServerError: the address cannot be listened on.
    """
    dump = read_dump(path)
    serve_until_interrupted(
        lambda client, _gate, lanes: DumpSession(client, dump, lanes.simulating), listening
    )


def serve_until_interrupted(start: Start, listening: Listening) -> None:
    """Serve sessions of what is no run until interrupted.

    Args:
        start: starts the session of a browser.
        listening: where, and whom to answer.

    Raises:
        InvalidData: the token or an origin cannot be used.
        ServerError: the address cannot be listened on.
    """
    access = listening.access
    limit_log()
    with serve_sessions(start, host=listening.host, port=listening.port, access=access) as server:
        announce(server, listening, access)
        wait_for_interrupt()


def announce(server: viser.ViserServer, listening: Listening, access: Access) -> None:
    """Say where the app is, and show it in the user's browser if wanted and if there is a screen."""
    port = server.get_port()
    address = page_address(listening.host, port, access.token)
    print(f"TensAtlas is at {address} (Ctrl-C ends it)", flush=True)
    if not is_loopback(listening.host):
        if listening.host in EVERY_ADDRESS:
            elsewhere = page_address(socket.gethostname(), port, access.token)
            print(f"From other machines: {elsewhere}", flush=True)
        print(
            "Anyone with this address can use it, and it is not encrypted; docs/serving.md says more."
            f" To set your own token: --token, or {TOKEN_VARIABLE}",
            flush=True,
        )
    if listening.open_browser and has_screen():
        webbrowser.open(address)


def page_address(host: str, port: int, token: str | None) -> str:
    """Return the address of the app on a host, with the token if there is one."""
    host = "127.0.0.1" if host in EVERY_ADDRESS else host
    shown = f"[{host}]" if ":" in host else host
    query = "" if token is None else f"/?{urllib.parse.urlencode({'token': token})}"
    return f"http://{shown}:{port}{query}"


def wait_for_interrupt() -> None:
    """Return when the user presses Ctrl-C."""
    with contextlib.suppress(KeyboardInterrupt):
        while True:
            time.sleep(1.0)


def has_screen() -> bool:
    """Tell whether a browser window could appear; a text browser would take over the terminal."""
    return sys.platform in ("darwin", "win32") or any(
        os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY")
    )


@contextlib.contextmanager
def serve(
    places: Sequence[Path], *, host: str, port: int, access: Access | None = None, read_only: bool = False
) -> Iterator[viser.ViserServer]:
    """Serve runs within a ``with`` block.

    Args:
        places: run files and folders to offer; empty for the default ones.
        host: address to listen on.
        port: port to listen on.
        access: who may use it; None for this machine.
        read_only: let visitors look at the runs only.

    Raises:
        ServerError: the address cannot be listened on.
    """
    library = Library(places)
    try:
        with serve_sessions(
            lambda client, gate, lanes: Session(client, library, gate, lanes, read_only=read_only),
            host=host,
            port=port,
            access=access,
            uploads=not read_only,
        ) as server:
            yield server
    finally:
        library.close()


class Closable(Protocol):
    """What one browser sees."""

    def cancel(self) -> None:
        """Give up all that is going on, without waiting for anything."""
        ...

    def close(self) -> None:
        """End its threads."""
        ...


Start = Callable[[viser.ClientHandle, Gate, Lanes], Closable]
"""Returns the session of a browser, with a gate that checks what it sends and lanes for what it sets off."""


class Browsers:
    """The sessions of all browsers. Its methods are quick, and any thread may call them.

    Args:
        start: returns the session of a browser.
    """

    def __init__(self, start: Start) -> None:
        self._start = start
        self._service = Service()
        self._mutex = threading.Lock()
        self._lanes: dict[int, Lanes] = {}
        self._sessions: dict[int, Closable] = {}

    def enter(self, client: viser.ClientHandle) -> None:
        """Give a browser a session, when it is its turn."""
        number, gate, lanes = client.client_id, Gate(client), self._service.lanes()

        def begin() -> None:
            session = self._start(client, gate, lanes)
            with self._mutex:
                self._sessions[number] = session

        with self._mutex:
            self._lanes[number] = lanes
        lanes.quick.put("start", begin)

    def dispatch(self, number: int, kind: Hashable, job: Callable[[], None]) -> None:
        """Have something done for a browser when it is its turn; nothing for one that has gone."""
        with self._mutex:
            lanes = self._lanes.get(number)
        if lanes is not None:
            lanes.quick.put(kind, job)

    def leave(self, number: int) -> None:
        """End the session of a browser: what it does at this moment is given up, the rest is forgotten."""

        def end() -> None:
            with self._mutex:
                session = self._sessions.pop(number, None)
            if session is not None:
                session.close()

        with self._mutex:
            lanes, session = self._lanes.pop(number, None), self._sessions.get(number)
        if lanes is not None:
            lanes.close(end)
        if session is not None:
            session.cancel()

    def close(self) -> None:
        """End all sessions and wait for them a little."""
        with self._mutex:
            numbers = list(self._lanes)
        for number in numbers:
            self.leave(number)
        self._service.close(CLOSING_TIME)


@contextlib.contextmanager
def serve_sessions(
    start: Start, *, host: str, port: int, access: Access | None = None, uploads: bool = False
) -> Iterator[viser.ViserServer]:
    """Run a server within a ``with`` block, with a separate session for every browser.

    Args:
        start: returns the session of a browser.
        host: address to listen on.
        port: port to listen on.
        access: who may use it; None for this machine.
        uploads: whether browsers may send files.

    Raises:
        ServerError: the address cannot be listened on.
    """
    check_address(host, port)
    # a browser may go while a frame is on its way to it
    warnings.filterwarnings("ignore", message="Queued a .* on a closed connection")
    browsers = Browsers(start)
    server = start_server(host, port, access or Access(), browsers.dispatch, uploads=uploads)
    configure_theme(server.gui, dark=True)

    # on the server's own thread, which waits for no browser
    @server.on_client_connect
    async def _(client: viser.ClientHandle) -> None:
        mark_page(client)
        browsers.enter(client)

    @server.on_client_disconnect
    async def _(client: viser.ClientHandle) -> None:
        browsers.leave(client.client_id)

    try:
        yield server
    finally:
        browsers.close()
        server.stop()


def check_address(host: str, port: int) -> None:
    """Make sure that an address can be listened on: viser would move on to another port.

    Raises:
        ServerError: it cannot.
    """
    if not 0 <= port <= 65535:
        raise ServerError(f"port must be from 0 to 65535, not {port}")
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(
            host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[0]
        with socket.socket(family, kind, protocol) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind(address)
    except OSError as e:
        raise ServerError(
            f"cannot listen on {host}:{port} ({e.strerror}); choose another with --port or --host"
        ) from None
