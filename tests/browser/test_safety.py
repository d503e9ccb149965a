"""Other origins, strangers without the token, and visitors who may only look."""

from __future__ import annotations

import functools
import threading
from collections.abc import Callable, Iterator
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from app.gui.access import Access
from app.gui.viser_private import inputs_of
from app.server.server import serve
from tests.support.widgets import click_cell, press

Visit = Callable[[str], Page]
TOKEN = "the-token-of-a-test"
CONNECT = """([port, version]) => new Promise(done => {
  const socket = new WebSocket('ws://127.0.0.1:' + port, 'viser-v' + version);
  socket.onopen = () => done('open');
  socket.onerror = () => done('refused');
})"""


@pytest.fixture
def elsewhere(tmp_path: Path) -> Iterator[str]:
    """A page of another origin."""
    (tmp_path / "site").mkdir()
    (tmp_path / "site" / "index.html").write_text("<title>elsewhere</title>")
    handler = functools.partial(SimpleHTTPRequestHandler, directory=tmp_path / "site")
    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}/"
        server.shutdown()


def test_only_the_apps_own_page_with_the_token_gets_in(
    workplace: Path, visit: Visit, small_run: Path, elsewhere: str
) -> None:
    import viser

    access = Access(token=TOKEN)
    with serve([small_run], host="127.0.0.1", port=0, access=access) as server:
        port = server.get_port()
        own = f"http://127.0.0.1:{port}/"
        page = visit(own)
        expect(page.get_by_text("TensAtlas wants its token")).to_be_visible()
        page.goto(f"{own}?token={TOKEN}&run=small")
        expect(page.locator(".ta-run b")).to_have_text("small")
        assert TOKEN not in page.url
        assert page.evaluate("document.cookie") == ""  # no script can read it
        page.reload()
        expect(page.locator(".ta-run b")).to_have_text("small")
        connect = [port, viser.__version__]
        assert page.evaluate(CONNECT, connect) == "open"
        page.goto(elsewhere)  # the same browser, which has the cookie
        assert page.evaluate(CONNECT, connect) == "refused"
        # nor may another page show it in a frame of its own; with the token it would be let in
        with page.expect_event("requestfailed") as refused:
            page.set_content(f'<iframe src="{own}?token={TOKEN}"></iframe>')
        assert refused.value.frame.parent_frame == page.main_frame
        assert "BLOCKED_BY_RESPONSE" in (refused.value.failure or "")


def test_a_visitor_may_look_but_neither_start_nor_bring_anything(
    workplace: Path, visit: Visit, small_run: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("app.session.chosen_robot.VISITOR_SECONDS", 3.0)  # one trial of 2.4 s
    with serve([small_run], host="127.0.0.1", port=0, read_only=True) as server:
        page = visit(f"http://127.0.0.1:{server.get_port()}/")
        page.locator(".ta-run").click()
        expect(page.locator(".ta-runs [role=option]")).to_be_visible()
        page.locator(".ta-run").click()
        for name in ("Upload a run", "Start", "Pause run", "Resume run", "Stop run"):
            expect(page.get_by_role("button", name=name, exact=True)).to_be_hidden()
        expect(page.get_by_text("New run", exact=True)).to_be_hidden()
        press(page, "Run")
        expect(page.get_by_text("Configuration", exact=True)).to_be_visible()
        for name in ("Rename", "Keep note", "Delete", "Start another like this"):
            expect(page.get_by_role("button", name=name)).to_have_count(0)
        press(page, "Run")
        tiles = page.locator('svg.ta-map[data-map="morphology"] g[data-filled="1"]')
        # the map is drawn anew with a mark: what is clicked next is not what was there before
        click_cell(page, tiles.first)
        tiles.last.click(force=True, no_wait_after=True)
        expect(page.get_by_text("enough simulation for a visitor").first).to_be_visible()
        # nor by sending what the page does not offer
        (client,) = server.get_clients().values()
        assert not {"Start", "Name", "Workers"} & {str(c.label) for c in inputs_of(client.gui)}
    assert not (workplace / "runs").exists()
