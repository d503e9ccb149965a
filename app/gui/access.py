"""Who may use the app: the checks of a request before any of it is answered.

A web page of another origin can open a web-socket to any server that its visitor's browser reaches, so the
Origin that the browser sends is compared with the Host that it asked for (RFC 6455, section 10.2). A page
whose name was made to point here (DNS rebinding) sends the same name as both: without a token the Host must
therefore be this machine's own name, or one that the user named.
"""

from __future__ import annotations

import dataclasses
import hashlib
import hmac
import http
import ipaddress
import os
import re
import secrets
import urllib.parse
from collections.abc import Callable, Sequence
from typing import Final

from engine.errors import InvalidData

TOKEN_VARIABLE: Final = "TENSATLAS_TOKEN"
"""Environment variable with a token, which unlike a flag no list of processes shows."""
MIN_TOKEN: Final = 16
"""Length of the shortest token, in characters."""
_PORTS: Final = {"http": 80, "https": 443}
_AUTHORITY: Final = re.compile(r"([A-Za-z0-9._-]{1,253}|\[[0-9A-Fa-f:.]{2,60}\])(?::([0-9]{1,5}))?")
_ORIGIN: Final = re.compile(r"(https?)://([^/]*)/?", re.IGNORECASE)


@dataclasses.dataclass(frozen=True, slots=True)
class Refusal:
    """A request that is not answered, and the line that says why.

    Attributes:
        status: of HTTP.
        reason: one line for the user.
    """

    status: http.HTTPStatus
    reason: str


@dataclasses.dataclass(frozen=True, slots=True)
class Admission:
    """A page that was asked for with the token, to be asked for again with a cookie instead.

    Attributes:
        location: the query without the token; the path is the browser's, of which a proxy may hide a part.
        cookie: value of ``Set-Cookie``.
    """

    location: str
    cookie: str


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Access:
    """The rules of one server.

    Attributes:
        token: that every request must carry; None for a server that only its own machine reaches.
        origins: (scheme, host, port) of pages that may come from elsewhere: a reverse proxy's.
    """

    token: str | None = None
    origins: tuple[tuple[str, str, int], ...] = ()

    def decide(
        self, target: str, header: Callable[[str], Sequence[str]], *, port: int
    ) -> Refusal | Admission | None:
        """Return what to do with a request; None is to answer it.

        Args:
            target: path and query.
            header: returns all values of a header.
            port: the server's, which tells its cookies from other servers' on the same machine.
        """
        hosts, found = header("Host"), header("Origin")
        if len(hosts) != 1 or len(found) > 1:
            return Refusal(http.HTTPStatus.BAD_REQUEST, "One Host and at most one Origin is expected.")
        if _host_and_port(hosts[0], 0) is None:
            return Refusal(http.HTTPStatus.BAD_REQUEST, "Host is to be a name or an address, and a port.")
        if self.token is None and not self._is_known(hosts[0]):
            return Refusal(
                http.HTTPStatus.FORBIDDEN,
                "TensAtlas is not known by this name; start it with --origin and the address that you see.",
            )
        is_socket = any("websocket" in value.lower() for value in header("Upgrade"))
        if is_socket and found and not self._is_own(found[0], hosts[0]):
            return Refusal(http.HTTPStatus.FORBIDDEN, "A page of another origin may not use TensAtlas.")
        if self.token is None:
            return None
        name = f"tensatlas_{port}"
        query = target.partition("?")[2]
        pairs = urllib.parse.parse_qsl(query, keep_blank_values=True)
        if any(key == "token" and _equal(value, self.token) for key, value in pairs):
            if is_socket:
                return None
            rest = urllib.parse.urlencode([(k, v) for k, v in pairs if k != "token"], safe=",/")
            secure = "; Secure" if "https" in header("X-Forwarded-Proto") else ""
            return Admission(
                f"?{rest}",
                f"{name}={_ticket(self.token)}; HttpOnly; SameSite=Lax; Path=/{secure}",
            )
        cookies = [part.strip() for line in header("Cookie") for part in line.split(";")]
        if any(_equal(cookie, f"{name}={_ticket(self.token)}") for cookie in cookies):
            return None
        return Refusal(
            http.HTTPStatus.FORBIDDEN,
            "TensAtlas wants its token: open the address that it printed when it was started.",
        )

    def _is_known(self, host: str) -> bool:
        named = _host_and_port(host, 0)
        return named is not None and (
            is_loopback(named[0]) or any(named[0] == known for _, known, _ in self.origins)
        )

    def _is_own(self, origin: str, host: str) -> bool:
        """Tell whether a page is this server's: its origin is that of the address that was asked for."""
        try:
            shown = parse_origin(origin)
        except InvalidData:
            return False
        return shown in self.origins or _host_and_port(host, _PORTS[shown[0]]) == shown[1:]


def access_to(host: str, token: str | None, origins: Sequence[str]) -> Access:
    """Return the rules of a server.

    Args:
        host: it listens on.
        token: that the user gave, None to take the environment's, or a new one if other machines reach it.
        origins: that the user allowed, such as ``https://atlas.example.org``.

    Raises:
        InvalidData: the token is too short or an origin is invalid.
    """
    token = token if token is not None else os.environ.get(TOKEN_VARIABLE)
    if token is None and not is_loopback(host):
        token = secrets.token_urlsafe(24)
    if token is not None and len(token) < MIN_TOKEN:
        raise InvalidData(f"a token needs at least {MIN_TOKEN} characters; leave it out to have one made")
    return Access(token=token, origins=tuple(map(parse_origin, origins)))


def is_loopback(host: str) -> bool:
    """Tell whether a name or address is this machine's own, which no other machine reaches."""
    if host.lower().rstrip(".") == "localhost":
        return True
    try:
        return ipaddress.ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return False


def parse_origin(text: str) -> tuple[str, str, int]:
    """Return the scheme, the host and the port of an origin.

    Raises:
        InvalidData: it is not an origin.
    """
    found = _ORIGIN.fullmatch(text)
    named = None if found is None else _host_and_port(found[2], _PORTS[found[1].lower()])
    if found is None or named is None:
        raise InvalidData(f"{text[:100]!r} is no origin; write it like https://atlas.example.org")
    return found[1].lower(), *named


def _host_and_port(text: str, default: int) -> tuple[str, int] | None:
    """Return the host and the port that a Host header names, None if it is not well formed.

    Nothing but a name or an address and a port may be in it: ``urlsplit`` takes ``evil@localhost`` for
    localhost.
    """
    found = _AUTHORITY.fullmatch(text)
    if found is None or int(found[2] or 0) > 65535:
        return None
    return found[1].strip("[]").lower(), int(found[2] or default)


def _ticket(token: str) -> str:
    """Return what a browser keeps instead of the token; the token's characters may not suit a cookie."""
    return hashlib.sha256(b"tensatlas " + token.encode()).hexdigest()


def _equal(a: str, b: str) -> bool:
    """Compare in a time that does not tell how much of them is equal."""
    return hmac.compare_digest(a.encode(errors="replace"), b.encode(errors="replace"))
