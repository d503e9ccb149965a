"""The reverse proxies of docs/serving.md, as they stand there, before a server; where one is installed."""

from __future__ import annotations

import contextlib
import http.cookiejar
import re
import shutil
import socket
import subprocess
import time
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import viser
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from app.gui.access import access_to
from app.gui.lanes import Lanes
from app.gui.viser_private import Gate
from app.server.server import serve_sessions

PATIENCE = 30.0
PAGE = Path(__file__).resolve().parents[3] / "docs" / "serving.md"
TOKEN = "the-token-of-a-test"


class Session:
    """Sees nothing."""

    def __init__(self, client: viser.ClientHandle, _gate: Gate, _lanes: Lanes) -> None:
        """Begin nothing."""

    def cancel(self) -> None:
        """Give up nothing."""

    def close(self) -> None:
        """End nothing."""


def blocks(language: str) -> list[str]:
    """Return what docs/serving.md says to write for the root of a host, and below a path."""
    return re.findall(rf"^```{language}\n(.*?)^```", PAGE.read_text(), flags=re.DOTALL | re.MULTILINE)


def nginx(folder: Path, port: int, app: int, *, below: bool) -> list[str]:
    root, path = blocks("nginx")
    server = re.sub(r" *(ssl_\w+|server_name) .*\n", "", root).replace("443 ssl", f"127.0.0.1:{port}")
    if below:
        server = re.sub(r" *location / .*\n", lambda _: path, server)
    server = server.replace("127.0.0.1:8080", f"127.0.0.1:{app}")
    temporary = "".join(
        f"{kind}_temp_path {folder};\n" for kind in ("client_body", "proxy", "fastcgi", "uwsgi", "scgi")
    )
    (folder / "nginx.conf").write_text(
        f"daemon off; pid {folder}/pid; error_log stderr;\nevents {{}}\n"
        f"http {{\naccess_log off;\n{temporary}{server}\n}}\n"
    )
    return ["nginx", "-p", str(folder), "-e", "stderr", "-c", str(folder / "nginx.conf")]


def caddy(folder: Path, port: int, app: int, *, below: bool) -> list[str]:
    text = blocks("caddy")[below].replace("127.0.0.1:8080", f"127.0.0.1:{app}")
    text = re.sub(r"^\S+ {", f"http://127.0.0.1:{port} {{", text)
    (folder / "Caddyfile").write_text(f"{{\nadmin off\nauto_https off\n}}\n{text}")
    return ["caddy", "run", "--config", str(folder / "Caddyfile"), "--adapter", "caddyfile"]


MakeCommand = Callable[..., list[str]]
proxies = pytest.mark.parametrize(
    "make",
    [
        pytest.param(
            make,
            marks=pytest.mark.skipif(shutil.which(make.__name__) is None, reason="it is not installed"),
        )
        for make in (nginx, caddy)
    ],
)


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@contextlib.contextmanager
def proxied(
    make: MakeCommand, folder: Path, monkeypatch: pytest.MonkeyPatch, *, below: bool, token: str | None
) -> Iterator[str]:
    """Yield the address of a server behind a proxy."""
    monkeypatch.setenv("HOME", str(folder))
    access = access_to("127.0.0.1", token, ["https://www.example.org"])
    with serve_sessions(Session, host="127.0.0.1", port=0, access=access) as server:
        port = free_port()
        with subprocess.Popen(make(folder, port, server.get_port(), below=below)) as process:
            try:
                deadline = time.monotonic() + PATIENCE
                while True:
                    assert process.poll() is None
                    assert time.monotonic() < deadline
                    with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port), 1.0):
                        break
                    time.sleep(0.05)
                yield f"127.0.0.1:{port}{'/atlas' if below else ''}"
            finally:
                process.terminate()


def opens_socket(place: str, *, origin: str, cookie: str = "") -> bool:
    """Tell whether a page's web-socket opens; it does so at the page's address without the last slash."""
    try:
        with connect(
            f"ws://{place}" if "/" in place else f"ws://{place}/",
            origin=origin,  # type: ignore[arg-type]
            subprotocols=[f"viser-v{viser.__version__}"],  # type: ignore[list-item]
            additional_headers={"Cookie": cookie} if cookie else {},
            compression=None,
            max_size=None,
        ) as opened:
            return bool(opened.recv(timeout=PATIENCE))
    except InvalidStatus:
        return False


@proxies
@pytest.mark.parametrize("below", [False, True], ids=["root", "path"])
def test_page_and_web_socket_pass_and_another_origin_does_not(
    make: MakeCommand, below: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with proxied(make, tmp_path, monkeypatch, below=below, token=None) as place:
        for end in ("/", "/?run=a") if not below else ("", "/", "/?run=a"):
            with urllib.request.urlopen(f"http://{place}{end}", timeout=PATIENCE) as page:
                assert "<html" in page.read().decode()
                assert page.headers["X-Frame-Options"] == "SAMEORIGIN"
        assert opens_socket(place, origin=f"http://{place.partition('/')[0]}")
        assert opens_socket(place, origin="https://www.example.org")
        assert not opens_socket(place, origin="https://evil.example")


@proxies
@pytest.mark.parametrize("below", [False, True], ids=["root", "path"])
def test_the_token_becomes_a_cookie_and_the_address_keeps_its_path(
    make: MakeCommand, below: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with proxied(make, tmp_path, monkeypatch, below=below, token=TOKEN) as place:
        jar = http.cookiejar.CookieJar()
        browser = urllib.request.build_opener(urllib.request.HTTPCookieProcessor(jar))
        with pytest.raises(urllib.error.HTTPError, match="403"):
            browser.open(f"http://{place}/", timeout=PATIENCE)
        with browser.open(f"http://{place}/?run=a&token={TOKEN}", timeout=PATIENCE) as page:
            assert page.url == f"http://{place}/?run=a"
            assert "<html" in page.read().decode()
        cookie = "; ".join(f"{c.name}={c.value}" for c in jar)
        origin = f"http://{place.partition('/')[0]}"
        assert opens_socket(place, origin=origin, cookie=cookie)
        assert not opens_socket(place, origin=origin)
