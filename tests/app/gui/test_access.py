from __future__ import annotations

import http
from collections.abc import Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.gui.access import TOKEN_VARIABLE, Access, Admission, Refusal, access_to, is_loopback
from engine.errors import InvalidData

TOKEN = "0123456789abcdef-öß"
PORT = 8080


def decide(access: Access, target: str = "/", **headers: str | Sequence[str]) -> object:
    """Decide on a web-socket's request, or, with ``Upgrade=()``, on a page's."""
    sent = {"Upgrade": "websocket", "Host": "127.0.0.1:8080"} | {
        k.replace("_", "-"): v for k, v in headers.items()
    }
    return access.decide(
        target,
        lambda name: [v] if isinstance(v := sent.get(name, ()), str) else list(v),
        port=PORT,
    )


@pytest.mark.parametrize(
    ("host", "origin", "accepted"),
    [
        ("127.0.0.1:8080", "http://127.0.0.1:8080", True),
        ("localhost:8080", "http://localhost:8080", True),
        ("[::1]:8080", "http://[::1]:8080", True),
        ("localhost", "http://localhost", True),
        ("localhost:443", "https://localhost", True),
        ("127.0.0.1:8080", (), True),  # no browser
        ("127.0.0.1:8080", "http://127.0.0.1:8081", False),
        ("127.0.0.1:8080", "https://evil.example", False),
        ("127.0.0.1:8080", "http://127.0.0.1:8080.evil.example", False),
        ("127.0.0.1:8080", "http://127.0.0.1:8080@evil.example", False),
        ("127.0.0.1:8080", "null", False),
        ("127.0.0.1:8080", "", False),
        ("127.0.0.1:8080", "http://[", False),
        ("127.0.0.1:8080", ("http://127.0.0.1:8080", "http://evil.example"), False),
        ("evil.example:8080", "http://evil.example:8080", False),  # DNS rebinding
        ("evil@localhost:8080", (), False),
        ("localhost:8080@evil.example", (), False),
        ("localhost#evil.example", (), False),
        ("localhost/evil.example", (), False),
        ("localhost?evil.example", (), False),
        ("localhost:0x50", (), False),
        ("localhost:99999", (), False),
        ("local host", (), False),
        ("", (), False),
        ((), (), False),
    ],
)
def test_only_the_own_pages_open_a_web_socket(
    host: str | tuple[str, ...], origin: str | tuple[str, ...], accepted: bool
) -> None:
    assert (decide(Access(), Host=host, Origin=origin) is None) is accepted


@given(st.text(max_size=20))
def test_a_host_is_a_name_and_a_port_and_nothing_more_whoever_asks(junk: str) -> None:
    for access in (Access(), Access(token="t" * 16)):
        for host in (f"{junk}@localhost", f"localhost#{junk}", f"localhost/{junk}", f"localhost?{junk}"):
            refused = decide(access, f"/?token={'t' * 16}", Host=host, Upgrade=())
            assert isinstance(refused, Refusal)
            assert refused.status is http.HTTPStatus.BAD_REQUEST


def test_a_proxy_shows_the_app_under_the_addresses_that_were_named() -> None:
    access = access_to("127.0.0.1", None, ["https://atlas.example.org", "http://lab:81/"])
    for host in ("127.0.0.1:8080", "atlas.example.org"):
        assert decide(access, Host=host, Origin="https://atlas.example.org") is None
        assert isinstance(decide(access, Host=host, Origin="http://atlas.example.org:82"), Refusal)
    assert decide(access, Host="lab:81", Origin="http://lab:81") is None


def test_a_token_opens_the_page_and_a_cookie_keeps_it_open() -> None:
    access = Access(token=TOKEN)
    for target in ("/", "/?token=", "/?token=wrong", "/?tokens=" + TOKEN):
        for upgrade in ("websocket", ()):
            refused = decide(access, target, Upgrade=upgrade)
            assert isinstance(refused, Refusal)
            assert refused.status is http.HTTPStatus.FORBIDDEN
    asked = "/?run=my%20run&token=0123456789abcdef-%C3%B6%C3%9F&archive=morphology&cell=3,7"
    admitted = decide(access, asked, Upgrade=(), Host="atlas.example.org")
    assert isinstance(admitted, Admission)
    assert admitted.location == "?run=my+run&archive=morphology&cell=3,7"
    assert "HttpOnly" in admitted.cookie
    assert "SameSite=Lax" in admitted.cookie
    assert TOKEN not in admitted.cookie
    cookie = admitted.cookie.partition(";")[0]
    assert decide(access, Cookie=f"other=1; {cookie}", Origin="http://127.0.0.1:8080") is None
    assert isinstance(decide(access, Cookie=f"other=1; {cookie}", Origin="http://evil.example"), Refusal)
    assert isinstance(decide(access, Cookie=cookie.replace("=", "=0")), Refusal)
    assert decide(access, asked) is None  # a program's web-socket has no cookies


@given(st.text(max_size=30))
def test_a_redirect_never_leaves_the_server(path: str) -> None:
    admitted = decide(Access(token="t" * 16), f"//evil.example/{path}?token={'t' * 16}", Upgrade=())
    if "?" in path or "#" in path:  # the token is then part of something else
        assert isinstance(admitted, Admission | Refusal)
    else:
        assert isinstance(admitted, Admission)
    if isinstance(admitted, Admission):
        assert admitted.location.startswith("?")


def test_other_hosts_get_a_token_of_their_own(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(TOKEN_VARIABLE, raising=False)
    assert access_to("localhost", None, ()).token is None
    made = {access_to("0.0.0.0", None, ()).token for _ in range(2)}
    assert len(made) == 2
    assert all(token and len(token) >= 32 for token in made)
    assert access_to("0.0.0.0", TOKEN, ()).token == TOKEN
    monkeypatch.setenv(TOKEN_VARIABLE, "e" * 16)
    assert access_to("127.0.0.1", None, ()).token == "e" * 16


@pytest.mark.parametrize(
    ("token", "origin"),
    [
        ("", None),
        ("short", None),
        (None, "atlas"),
        (None, "ftp://a"),
        (None, "http://a/b"),
        (None, "http://a#b"),
    ],
)
def test_a_token_or_origin_that_cannot_be_used_is_named(token: str | None, origin: str | None) -> None:
    with pytest.raises(InvalidData, match="16 characters" if origin is None else origin):
        access_to("127.0.0.1", token, [] if origin is None else [origin])


@pytest.mark.parametrize(
    ("host", "own"),
    [
        ("127.0.0.1", True),
        ("127.8.0.1", True),
        ("::1", True),
        ("LOCALHOST", True),
        ("0.0.0.0", False),
        ("pc", False),
    ],
)
def test_loopback(host: str, own: bool) -> None:
    assert is_loopback(host) is own
