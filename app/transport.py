"""The bottom panel of one browser: play, pause, scrub, speed, which trial."""

from __future__ import annotations

import dataclasses
import html
import math
from collections.abc import Callable, Sequence

import numpy as np
import viser

from app.player import Player, current_frame
from app.widgets import put
from engine.dump_replay import DumpReplay
from engine.replay import Replay
from engine.tasks import get_task, remaining_distance

SPEEDS = {"⅒ ×": 0.1, "¼ ×": 0.25, "½ ×": 0.5, "1 ×": 1.0, "2 ×": 2.0, "4 ×": 4.0, "8 ×": 8.0}
WIDTH = 760
MIN_WIDTH = 420
MARGIN = 20
EXTENSION = 20.0
NOTHING = "Click a filled cell of a map to watch its robot."
UPDATE_INTERVAL = 0.2
"""Seconds of playing between two updates of the slider."""


@dataclasses.dataclass(frozen=True, slots=True)
class Events:
    """What the panel reports."""

    trial_chosen: Callable[[int, int], None]
    follow_changed: Callable[[bool], None]


class TransportPanel:
    """Controls a player and shows where it is.

    Args:
        client: the browser.
        player: what it controls.
        events: whom it reports to.
        taken: width in pixels that docked panels take.
        step: of the slider, in s.
    """

    def __init__(
        self, client: viser.ClientHandle, player: Player, events: Events, *, taken: int, step: float = 0.1
    ) -> None:
        gui = client.gui
        self._player = player
        self._shown_time = -1e9
        self._step = step
        self._targets: tuple[str, ...] = ()
        width = min(WIDTH, max(MIN_WIDTH, client.camera.image_width - taken - 2 * MARGIN))
        panel = gui.add_panel()
        with panel.add_tab("Replay", viser.Icon.PLAYER_PLAY):
            gui.add_html(_layout(width))
            self._play = gui.add_button("Play", icon=viser.Icon.PLAYER_PLAY, hint="Play or pause")
            self._slider = gui.add_slider(
                "Time",
                min=-3.0,
                max=40.0,
                step=step,
                initial_value=-3.0,
                hint="Seconds since the target was placed; before 0 the robot settles",
            )
            self._more = gui.add_button(
                f"+{EXTENSION:.0f} s", color="gray", hint="Go on past the end of the evaluated time"
            )
            self._target = gui.add_dropdown("Target", ("-",), hint="Which target it crawls to")
            self._seed = gui.add_dropdown("Seed", ("1",), hint="Which noise it was evaluated with")
            self._speed = gui.add_dropdown("Speed", tuple(SPEEDS), initial_value="1 ×")
            self._loop = gui.add_checkbox("Loop", False, hint="Start over at the end")
            self._follow = gui.add_checkbox("Follow", True, hint="The camera follows the robot")
            self._text = gui.add_html(_text(NOTHING))
        panel.float(x=MARGIN, y=-15, width=width)

        @self._play.on_click
        def _(_event: viser.GuiEvent) -> None:
            player.pause() if player.playing else player.play()
            self.refresh()

        @self._slider.on_update
        def _(event: viser.GuiEvent) -> None:
            value = event.target.value
            if event.client is not None and isinstance(value, int | float) and math.isfinite(value):
                player.seek(float(value))

        @self._more.on_click
        def _(_event: viser.GuiEvent) -> None:
            player.extend(EXTENSION)
            self.refresh()

        @self._speed.on_update
        def _(event: viser.GuiEvent) -> None:
            player.speed = SPEEDS.get(str(event.target.value), 1.0)

        @self._loop.on_update
        def _(event: viser.GuiEvent) -> None:
            player.loop = event.target.value is True

        @self._follow.on_update
        def _(event: viser.GuiEvent) -> None:
            events.follow_changed(event.target.value is True)

        @self._target.on_update
        @self._seed.on_update
        def _(event: viser.GuiEvent) -> None:
            if event.client is None or self._target.value not in self._targets:
                return
            seed = str(self._seed.value)
            if seed in self._seed.options and seed.isdecimal():
                events.trial_chosen(self._targets.index(self._target.value), int(seed) - 1)

    def set_trials(self, targets: Sequence[str], repeats: int) -> None:
        """Offer the trials of a run, towards targets with names."""
        self._targets = tuple(f"{k + 1}: {name}" for k, name in enumerate(targets))
        if tuple(self._target.options) != self._targets:
            self._target.options = self._targets
        seeds = tuple(str(k + 1) for k in range(repeats))
        if tuple(self._seed.options) != seeds:
            self._seed.options = seeds

    def show_only(self, speed: str) -> None:
        """Offer no other trial and nothing past the end.

        Args:
            speed: to begin with, one of ``SPEEDS``.
        """
        for widget in (self._more, self._target, self._seed):
            widget.disabled = True
        put(self._speed, speed)
        self._player.speed = SPEEDS[speed]

    def select_trial(self, target: int, repeat: int) -> None:
        """Show which trial is played."""
        put(self._target, self._targets[target])
        put(self._seed, str(repeat + 1))

    def refresh(self) -> None:
        """Show where the player is."""
        player, replay = self._player, self._player.replay
        if replay is None:
            self._text.content = _text(NOTHING)
            return
        label = "Pause" if player.playing else "Play"
        if self._play.label != label:
            self._play.label = label
            self._play.icon = viser.Icon.PLAYER_PAUSE if player.playing else viser.Icon.PLAYER_PLAY
        if self._slider.min != replay.start_time:
            self._slider.min = replay.start_time
        if self._slider.max != player.until:
            self._slider.max = player.until
        moment = self._step * round(player.time / self._step)
        put(self._slider, round(min(max(moment, self._slider.min), self._slider.max), 3))
        self._shown_time = player.time
        self._text.content = _text(describe(player))

    def tick(self) -> None:
        """Refresh now and then while playing."""
        interval = min(UPDATE_INTERVAL, 2 * self._step) * max(self._player.speed, 1)
        if abs(self._player.time - self._shown_time) >= interval:
            self.refresh()


def describe(player: Player) -> str:
    """Return one line about the moment that a player shows."""
    replay = player.replay
    if replay is None:
        return ""
    moment = player.time
    if isinstance(replay, DumpReplay):
        return _describe_dump(replay, moment)
    if replay.failure:
        return f"The simulation failed: {replay.failure}"
    if moment < 0:
        return f"{moment:.1f} s · the robot settles, its servos off"
    parts = [f"{moment:.1f} s"]
    frame = current_frame(player)
    if replay.target is not None and frame is not None:
        gap = float(np.linalg.norm(frame.head - replay.target))
        parts.append(f"head {100 * gap:.1f} cm from the target")
    if not isinstance(replay, Replay):
        return " · ".join(parts)
    if replay.score is not None:
        stored = float(replay.evaluation.distances[replay.target_index, replay.repeat])
        same = (
            "exactly as evaluated"
            if replay.score == stored
            else (f"evaluated elsewhere as {100 * stored:.2f} cm")
        )
        what = "" if get_task(replay.config.task).score is remaining_distance else "scores "
        parts.append(f"{what}{100 * replay.score:.2f} cm at {replay.trial_time:.0f} s, {same}")
    elif replay.frames and replay.frames[-1].time < replay.trial_time - 0.1:
        parts.append(f"simulated to {max(replay.frames[-1].time, 0):.0f} s")
    return " · ".join(parts)


def _describe_dump(replay: DumpReplay, moment: float) -> str:
    parts = [f"{abs(min(moment, 0.0)):.2f} s before the simulation was stopped"]
    if replay.reproduced is False:
        simulated = replay.dump.versions.get("mujoco", "?")
        parts.append(f"it does not fail here; what failed was simulated with MuJoCo {html.escape(simulated)}")
    return " · ".join(parts)


def _text(line: str) -> str:
    return f'<div class="ta-replay" style="font-size:12.5px;opacity:.85;padding:4px 10px 6px">{line}</div>'


_WIDE = (3, 14, 3, 6, 4, 4, 3, 3)
_NARROW = (5, 11, 4, 11, 9, 8, 6, 6)
"""Twentieths of the panel's width that the widgets take, in their order."""


def _layout(width: int) -> str:
    """Return a style that puts the widgets in rows; a phone keeps viser's single column."""
    panel = "div:has(> div > .ta-transport)"
    spans = _WIDE if width >= WIDTH else _NARROW
    rules = "".join(
        f"{panel} > :nth-child({k}) {{ grid-column: span {span}; }}" for k, span in enumerate(spans, start=2)
    )
    return (
        '<style class="ta-transport">@media (min-width: 701px) {'
        f"{panel} {{ display: grid; grid-template-columns: repeat(20, 1fr); align-items: center;"
        " row-gap: 2px; padding: 8px 4px 2px; }"
        f"{panel} > * {{ grid-column: span 20; padding-bottom: 0 !important; }}"
        f"{panel} > :nth-child(1) {{ display: none; }}{rules}"
        f"{panel} > :nth-child(3) {{ padding-top: 6px; }}"
        f"{panel} > * > div > div:has(label) {{ width: auto !important; }} }}</style>"
    )
