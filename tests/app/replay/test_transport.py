"""Where the controls of a replay are, without a browser."""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable
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
    (style,) = (content for content in gui.html if 'data-ta-mark="transport"' in content)
    rules = re.sub(r"/\*.*?\*/", "", style, flags=re.DOTALL)
    assert len(gui.controls) == 14
    for control in gui.controls:
        places = re.findall(rf'{control}"\] {{ grid-column: span (\d+)', rules)
        assert len(places) == 2, control  # on a desk and on a phone
    assert not re.findall(r"#[a-z]+", rules)  # a name that stands for no control
    assert ("@media all" in rules) == is_narrow


class Slider:
    """Sends what it is set to, as viser's do: not what it believes to be shown."""

    def __init__(self) -> None:
        self.sent: list[float] = []
        self.min, self.max, self._value = 0.0, 2.0, 0.0
        self._impl = SimpleNamespace(uuid="slider")

    @property
    def value(self) -> float:
        return self._value

    @value.setter
    def value(self, value: float) -> None:
        if value != self._value:
            self.sent.append(value)
        self._value = value

    def on_update(self, callback: Callable[[Any], None]) -> None:
        self._callback = callback

    def type(self, value: float) -> None:
        self._value = value
        self._callback(SimpleNamespace(client=object(), target=self))


@pytest.fixture
def strip(monkeypatch: pytest.MonkeyPatch) -> tuple[TransportPanel, MagicMock, Slider]:
    """The strip of a replay at 0.5 s, its player, and its slider."""
    gui, player, slider = Gui(), MagicMock(), Slider()
    gui.add_slider = lambda *_args, **_options: slider  # type: ignore[attr-defined]
    player.replay = SimpleNamespace(start_time=0.0, morphology=None, frames=[])
    player.until, player.time = 2.0, 0.5
    client: Any = SimpleNamespace(gui=gui)
    monkeypatch.setattr("app.replay.transport.describe", lambda _player: "")
    monkeypatch.setattr("app.replay.transport.full_tension", lambda _morphology: 1.0)
    monkeypatch.setattr("app.replay.transport.tension_legend.render", lambda _tension: "")
    return TransportPanel(client, player, MagicMock(), TransportEvents(), room=840), player, slider


def test_a_moment_that_crosses_with_another_on_its_way_is_shown(
    strip: tuple[TransportPanel, MagicMock, Slider],
) -> None:
    """The strip tells 0.5 s while the user types 2 s: the browser shows 0.5 unless it is told again."""
    panel, player, slider = strip
    panel.refresh()
    assert slider.sent == [0.5]
    slider.type(2.0)
    player.time = 2.0
    panel.refresh()
    assert slider.sent[-1] == 2.0
    told = len(slider.sent)
    panel.refresh()
    assert len(slider.sent) == told


def test_a_replay_that_is_held_says_every_moment_that_it_goes_to(
    strip: tuple[TransportPanel, MagicMock, Slider],
) -> None:
    """However fast it would play: at eight times the speed a step of 0.2 s is less than between two lines."""
    panel, player, slider = strip
    player.speed = 8.0
    player.playing = True
    panel.tick()
    player.time = 0.7
    panel.tick()
    assert slider.sent == [0.5]
    player.playing = False
    panel.tick()
    assert slider.sent == [0.5, 0.7]
