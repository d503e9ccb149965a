"""The browser app: one viser server, one session per browser."""

from __future__ import annotations

import contextlib
import os
import socket
import sys
import threading
import time
import warnings
import webbrowser
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Protocol

import viser
from viser import _messages

from app.dump_session import DumpSession
from app.library import Library
from app.session import Session
from engine.dump import read_dump
from engine.errors import TensAtlasError
from engine.reader import RunReader
from viz import theme


class ServerError(TensAtlasError):
    """The app cannot listen where it was asked to."""


def explore(places: Sequence[Path], *, host: str, port: int, open_browser: bool = False) -> None:
    """Serve the app until interrupted.

    Args:
        places: run files and folders to offer; empty for the default ones.
        host: address to listen on.
        port: port to listen on.
        open_browser: show the app in the user's browser if there is a screen.

    Raises:
        RunFileError: a run file named is missing or damaged.
        ServerError: the address cannot be listened on.
    """
    for place in places:
        if not place.is_dir():
            RunReader(place).close()
    with serve(places, host=host, port=port) as server:
        announce(server, host, open_browser=open_browser)
        wait_for_interrupt()


def replay_dump(path: Path, *, host: str, port: int, open_browser: bool = False) -> None:
    """Serve a failure dump until interrupted.

    Args:
        path: the dump.
        host: address to listen on.
        port: port to listen on.
        open_browser: show it in the user's browser if there is a screen.

    Raises:
        DumpError: the file cannot be read as a dump.
        ServerError: the address cannot be listened on.
    """
    dump = read_dump(path)
    with serve_sessions(lambda client: DumpSession(client, dump), host=host, port=port) as server:
        announce(server, host, open_browser=open_browser)
        wait_for_interrupt()


def announce(server: viser.ViserServer, host: str, *, open_browser: bool) -> None:
    """Say where the app is, and show it in the user's browser if wanted and if there is a screen."""
    shown = f"[{host}]" if ":" in host else host
    address = f"http://{shown}:{server.get_port()}"
    print(f"TensAtlas is at {address} (Ctrl-C ends it)", flush=True)
    if open_browser and has_screen():
        webbrowser.open(address)


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
def serve(places: Sequence[Path], *, host: str, port: int) -> Iterator[viser.ViserServer]:
    """Serve runs within a ``with`` block.

    Raises:
        ServerError: the address cannot be listened on.
    """
    library = Library(places)
    try:
        with serve_sessions(lambda client: Session(client, library), host=host, port=port) as server:
            yield server
    finally:
        library.close()


class Closable(Protocol):
    """What one browser sees."""

    def close(self) -> None:
        """End its threads."""
        ...


@contextlib.contextmanager
def serve_sessions(
    start: Callable[[viser.ClientHandle], Closable], *, host: str, port: int
) -> Iterator[viser.ViserServer]:
    """Run a server within a ``with`` block, with a session of its own for every browser.

    Args:
        start: returns the session of a browser.
        host: address to listen on.
        port: port to listen on.

    Raises:
        ServerError: the address cannot be listened on.
    """
    check_address(host, port)
    # a browser may go while a frame is on its way to it
    warnings.filterwarnings("ignore", message="Queued a .* on a closed connection")
    server = viser.ViserServer(host=host, port=port, label="TensAtlas", verbose=False)
    # any browser could otherwise open a tunnel that shares the server with the world
    server._websock_server.unregister_handler(_messages.ShareUrlRequest)
    server.gui.configure_theme(
        dark_mode=True, show_logo=False, show_share_button=False, brand_color=theme.ACCENT
    )
    sessions: dict[int, Closable] = {}
    mutex = threading.Lock()

    @server.on_client_connect
    def _(client: viser.ClientHandle) -> None:
        session = start(client)
        with mutex:
            sessions[client.client_id] = session
        if client.client_id not in server.get_clients():  # it has gone in the meantime
            leave(client)

    @server.on_client_disconnect
    def leave(client: viser.ClientHandle) -> None:
        with mutex:
            session = sessions.pop(client.client_id, None)
        if session is not None:
            session.close()

    try:
        yield server
    finally:
        with mutex:
            for session in sessions.values():
                session.close()
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
