"""Where the controls of a replay are, without a browser."""

from __future__ import annotations

import itertools
import re
from types import SimpleNamespace
from typing import Any
from unittest.mock import MagicMock

import pytest

from app.replay.player import Player
from app.replay.transport import TransportEvents, TransportPanel


class Gui:
    """Makes widgets with ids of their own, and keeps what is added as HTML."""

    def __init__(self) -> None:
        self.html: list[str] = []
        self.controls: list[str] = []
        self._ids = itertools.count()

    def add_panel(self) -> MagicMock:
        return MagicMock()

    def add_html(self, content: str) -> MagicMock:
        self.html.append(content)
        return MagicMock()

    def __getattr__(self, _kind: str) -> Any:
        def add(*_args: object, **_options: object) -> MagicMock:
            self.controls.append(f"control-{next(self._ids)}")
            return MagicMock(_impl=SimpleNamespace(uuid=self.controls[-1]))

        return add


@pytest.mark.parametrize(("room", "is_narrow"), [(840, False), (640, False), (520, True)])
def test_every_control_has_a_place_by_its_name(room: int, is_narrow: bool) -> None:
    gui, player = Gui(), Player()
    client: Any = SimpleNamespace(gui=gui)
    TransportPanel(client, player, MagicMock(), TransportEvents(), room=room)
    player.close()
    (style,) = (content for content in gui.html if "ta-transport" in content)
    rules = re.sub(r"/\*.*?\*/", "", style, flags=re.DOTALL)
    assert len(gui.controls) == 14
    for control in gui.controls:
        places = re.findall(rf'{control}"\]\) {{ grid-column: span (\d+)', rules)
        assert len(places) == 2, control  # on a desk and on a phone
    assert not re.findall(r"#[a-z]+", rules)  # a name that stands for no control
    assert ("@media all" in rules) == is_narrow
