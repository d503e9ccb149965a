"""Icons of buttons and tabs: the same as viser's, without a search through all of its icons for each."""

import zipfile

import pytest
import viser
from viser import _icons

from app.gui.access import Access
from app.gui.viser_private import start_server


@pytest.fixture
def server():
    started = start_server("127.0.0.1", 0, Access(), lambda _client, _kind, job: job(), uploads=False)
    yield started
    started.stop()


def test_icons_are_read_from_one_list(server, monkeypatch):
    button = server.gui.add_button("Play", icon=viser.Icon.PLAYER_PLAY)
    opened = []
    monkeypatch.setattr(zipfile.ZipFile, "_RealGetContents", lambda self: opened.append(self))
    other = server.gui.add_button("Heart", icon=viser.Icon.HEART)
    other.icon = viser.Icon.HEART_BROKEN
    tabs = server.gui.add_tab_group()
    tabs.add_tab("Breed", viser.Icon.HEART)
    assert opened == []
    monkeypatch.undo()
    assert button._impl.props._icon_html == _icons.svg_from_icon(viser.Icon.PLAYER_PLAY)
    assert other._impl.props._icon_html == _icons.svg_from_icon(viser.Icon.HEART_BROKEN)
    assert tabs._impl.props._tab_icons_html == (_icons.svg_from_icon(viser.Icon.HEART),)
