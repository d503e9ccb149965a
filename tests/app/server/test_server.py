from __future__ import annotations

from pathlib import Path

import pytest

from app.server import server


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What was opened in a browser; serving ends at once, as with Ctrl-C."""
    addresses: list[str] = []
    monkeypatch.setattr(server.webbrowser, "open", addresses.append)

    monkeypatch.setattr(server, "wait_for_interrupt", lambda: None)
    return addresses


@pytest.mark.parametrize(("display", "wanted", "n"), [(":0", True, 1), (":0", False, 0), (None, True, 0)])
def test_a_browser_opens_only_where_there_is_a_screen(
    small_run: Path,
    opened: list[str],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    display: str | None,
    wanted: bool,
    n: int,
) -> None:
    monkeypatch.setattr(server.sys, "platform", "linux")
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    if display:
        monkeypatch.setenv("DISPLAY", display)
    server.explore([small_run], server.Listening(port=0, open_browser=wanted))
    assert len(opened) == n
    assert all(address in capsys.readouterr().out for address in opened)
