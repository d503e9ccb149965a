"""What a page tells its app arrives, however closely one message follows another."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import pytest
import viser
from playwright.sync_api import Browser

from app.gui.click_channel import ClickChannel, Clicked
from tests.support.software_chromium import eventually, open_context

pytestmark = pytest.mark.browser
Told = list[tuple[int, str, tuple[int, ...]]]
N_CHANNELS = 4


@pytest.fixture
def server() -> Iterator[viser.ViserServer]:
    """viser alone, without the app."""
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    yield server
    server.stop()


def hearing(told: Told, channel: int) -> Clicked:
    """Return what a channel calls: it adds what it hears to what has been told."""
    return lambda name, cell: told.append((channel, name, cell))


def test_no_click_is_lost_and_a_slider_sends_its_last_place(
    server: viser.ViserServer, chromium: Browser
) -> None:
    told: Told = []
    channels: list[ClickChannel] = []

    @server.on_client_connect
    def _(client: viser.ClientHandle) -> None:
        for k in range(N_CHANNELS):
            channels.append(ClickChannel(client.gui, hearing(told, k), label=f"c{k}"))

    context = open_context(chromium)
    page = context.new_page()
    page.goto(f"http://127.0.0.1:{server.get_port()}")
    eventually(page, lambda: len(channels) == N_CHANNELS)
    page.wait_for_function(
        "ids => window.taSend && ids.every(id => document.querySelector(`label[for='${id}']`))",
        arg=[channel._id for channel in channels],
    )
    # three rounds of clicks on all, at once, with a slider being dragged between them
    page.evaluate(
        """ids => {
            for (let k = 0; k < 3; k++)
                for (const id of ids) {
                    taSend(id, () => `click:${k}`);
                    taSend(ids[0], () => `slide:${k}`, null, true);
                }
            const until = performance.now() + 300;
            while (performance.now() < until);  // a page that is busy
        }""",
        [channel._id for channel in channels],
    )
    clicks = {(k, "click", (n,)) for k, n in itertools.product(range(N_CHANNELS), range(3))}
    eventually(page, lambda: clicks <= set(told))
    eventually(page, lambda: (0, "slide", (2,)) in told)
    assert [t for t in told if t[1] == "click"] == sorted(clicks, key=lambda t: (t[2], t[0]))
    assert sum(t[1] == "slide" for t in told) == 1
    context.close()
