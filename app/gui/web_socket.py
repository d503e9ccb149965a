"""The web-socket library's part of a server: which requests are answered, what a connection lets through."""

from __future__ import annotations

import asyncio
import contextlib
import functools
import http
import time
from collections.abc import Awaitable, Callable, Iterator
from typing import Any, Final

import viser
import websockets.asyncio.server
from websockets import Headers
from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request, Response

from app.gui.access import Access, Admission, Refusal
from app.gui.incoming import LOOKING, UPLOADING, is_message

MAX_BROWSERS: Final = 200
"""Web-sockets that are open at once."""
RATE, BURST = 100.0, 200.0
"""Messages a second that a browser's are slowed down to, and how many may come at once; viser's page sends 20
a second while the camera is moved."""
PAGE_HEADERS: Final = {
    "X-Frame-Options": "SAMEORIGIN",
    "Content-Security-Policy": "frame-ancestors 'self'",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}
"""Sent with every page: another origin may neither frame the app to steal clicks nor learn its address."""
PROTOCOL: Final = f"viser-v{viser.__version__}"
"""That a page names which belongs to this server."""


@contextlib.contextmanager
def guarded_serving(access: Access, *, uploads: bool, ready: Callable[[], bool]) -> Iterator[None]:
    """Return a context in which the library's ``serve`` starts a server that asks the rules first.

    Args:
        access: the rules.
        uploads: whether browsers may send files.
        ready: returns whether requests can be answered yet.
    """
    serve = websockets.asyncio.server.serve

    def guarded(
        handler: Callable[[ServerConnection], Awaitable[None]],
        *args: Any,
        process_request: Callable[..., Any],
        **options: Any,
    ) -> Any:
        def ask(connection: ServerConnection, request: Request) -> Any:
            if not ready():
                return connection.respond(http.HTTPStatus.SERVICE_UNAVAILABLE, "One moment.\n")
            own = connection.local_address[1]
            match access.decide(request.path, request.headers.get_all, port=own):
                case Refusal(status, reason):
                    return connection.respond(status, f"{reason}\n")
                case Admission(location, cookie):
                    headers = Headers({"Location": location, "Set-Cookie": cookie, "Content-Length": "0"})
                    headers.update(PAGE_HEADERS | {"Cache-Control": "no-store"})
                    return Response(http.HTTPStatus.SEE_OTHER, "See Other", headers, b"")
            try:
                answer = process_request(connection, request)
            except (OSError, ValueError):  # a path that no file can have
                answer = connection.respond(http.HTTPStatus.NOT_FOUND, "NOT FOUND")
            if answer is not None:
                answer.headers.update(PAGE_HEADERS)
            return answer

        return serve(
            _Doorkeeper(handler).let_in,
            *args,
            process_request=ask,
            **options
            | {
                "max_size": UPLOADING if uploads else LOOKING,
                "create_connection": functools.partial(_Connection, uploads=uploads),
            },
        )

    # viser looks it up when its thread starts
    websockets.asyncio.server.serve = guarded  # type: ignore[assignment,misc]
    try:
        yield
    finally:
        websockets.asyncio.server.serve = serve  # type: ignore[misc]


class _Doorkeeper:
    """Lets pages of this version in, and no more than there is room for.

    Args:
        handler: of a connection that is let in.
    """

    def __init__(self, handler: Callable[[ServerConnection], Awaitable[None]]) -> None:
        self._handler = handler
        self._n_browsers = 0

    async def let_in(self, connection: ServerConnection) -> None:
        """Handle a connection, or close it with a reason that the page shows."""
        if connection.subprotocol != PROTOCOL:
            client = str(connection.subprotocol).removeprefix("viser-v")[:20]
            reason = f"Version mismatch. Client: {client}, Server: {viser.__version__}"
            await connection.close(1002, reason)
            return
        if self._n_browsers >= MAX_BROWSERS:
            await connection.close(1013, "As many browsers as can be served are connected.")
            return
        self._n_browsers += 1
        try:
            await self._handler(connection)
        finally:
            self._n_browsers -= 1


class _Connection(ServerConnection):
    """Drops what a browser may not send, and reads the rest no faster than ``RATE``."""

    def __init__(self, *args: Any, uploads: bool, **options: Any) -> None:
        super().__init__(*args, **options)
        self._uploads = uploads
        self._left, self._seen = BURST, time.monotonic()

    async def recv(self, decode: bool | None = None) -> Any:
        """Return the next message that the browser may send."""
        while True:
            data = await super().recv(decode)
            await self._slow_down()
            if is_message(data, uploads=self._uploads):
                return data

    async def _slow_down(self) -> None:
        now = time.monotonic()
        self._left, self._seen = min(self._left + RATE * (now - self._seen), BURST), now
        self._left -= 1.0
        if self._left < 0.0:
            await asyncio.sleep(-self._left / RATE)
