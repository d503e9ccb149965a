"""A session as a browser sees it that draws nothing."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest

from app.server.server import serve
from benchmarks.synthetic_browser import Message, SyntheticBrowser, html_with

PATIENCE = 60.0


def test_a_visitor_never_learns_where_the_files_lie(
    tmp_path: Path, small_run: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    place = tmp_path / "a secret place"
    place.mkdir()
    shutil.copy(small_run, place / "good.tsmr")
    os.truncate(shutil.copy(small_run, place / "broken.tsmr"), 9000)
    heard: list[Message] = []
    with (
        serve([place], host="127.0.0.1", port=0, read_only=True) as server,
        SyntheticBrowser(f"http://127.0.0.1:{server.get_port()}", PATIENCE, heard.append) as browser,
    ):
        browser.arrive()
        browser.wait(html_with("ta-trend"), 0)
        browser.click("runs:0", "run clicks")
        browser.wait(html_with('role="listbox"'), 0)
        mark = browser.mark()
        browser.click("run:0", "run clicks")  # the broken one
        browser.wait(lambda m: m["type"] == "NotificationShowMessage", mark)
    everything = repr(heard)
    assert "broken.tsmr is cut short" in everything
    assert "secret" not in everything
    assert str(tmp_path) not in everything
    assert "ta-replay" in everything
    assert "ta-parents" not in everything  # nor is breeding offered
