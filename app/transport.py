"""The bottom panel of one browser: play, pause, scrub, speed, which trial."""

from __future__ import annotations

import dataclasses
import html
import math
import secrets
from collections.abc import Callable, Sequence

import numpy as np
import viser

from app.marks import Marks
from app.player import Player, current_frame
from app.widgets import put
from engine.dump_replay import DumpReplay
from engine.replay import MAX_FRESH, Replay
from engine.tasks import get_task, remaining_distance
from engine.what_if import WhatIfReplay
from viz import tension_legend
from viz.robot_geometry import full_tension

SPEEDS = {"⅒ ×": 0.1, "¼ ×": 0.25, "½ ×": 0.5, "1 ×": 1.0, "2 ×": 2.0, "4 ×": 4.0, "8 ×": 8.0}
WIDTH = 760
MIN_WIDTH = 420
MARGIN = 20
EXTENSION = 20.0
FRESH = "fresh"
DRAWN_FROM = 9999
"""Fresh noise that is drawn has a number up to this; any other can be typed."""
NOTHING = "Click a filled cell of a map to watch its robot."
UPDATE_INTERVAL = 0.2
"""Seconds of playing between two updates of the slider."""
MARK_HINTS = {
    "tension": "Colour every cable by its tension; the legend below says how many newtons",
    "numbers": "The number of each module, the head's in its colour",
    "contacts": "A dot wherever the robot touches the ground or a wall",
    "trail": "Where the head has been since the target was placed",
}
"""Names of ``Marks`` and what their checkboxes say."""


@dataclasses.dataclass(frozen=True, slots=True)
class Events:
    """What the panel reports."""

    trial_chosen: Callable[[int, int, int], None]
    """Called with the target, the repeat whose noise it is, and the number of fresh noise or 0."""
    follow_changed: Callable[[bool], None]
    marks_changed: Callable[[Marks], None]


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
        self._events = events
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
            self._noise = gui.add_dropdown(
                "Noise",
                ("exact 1", FRESH),
                hint="exact: the very noise it was evaluated with. fresh: noise that it never felt",
            )
            self._fresh = gui.add_number(
                "No.",
                1,
                min=1,
                max=MAX_FRESH,
                step=1,
                disabled=True,
                hint="Which fresh noise; the same number is the same noise again",
            )
            self._draw = gui.add_button(
                "Draw", icon=viser.Icon.DICE_5, color="gray", hint="Replay under fresh noise, drawn at random"
            )
            self._speed = gui.add_dropdown(
                "Speed", tuple(SPEEDS), initial_value="1 ×", hint="Slow motion or fast forward"
            )
            gui.add_html('<div style="font-size:12px;opacity:.65;padding:0 10px">Show</div>')
            shown = Marks()
            self._marks = {
                name: gui.add_checkbox(name.capitalize(), getattr(shown, name), hint=hint)
                for name, hint in MARK_HINTS.items()
            }
            self._follow = gui.add_checkbox("Follow", True, hint="The camera follows the robot")
            self._loop = gui.add_checkbox("Loop", False, hint="Start over at the end")
            self._text = gui.add_html(_text(NOTHING))
        panel.float(x=MARGIN, y=-15, width=width)
        panel.expand()  # on a phone, too

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
        @self._noise.on_update
        def _(event: viser.GuiEvent) -> None:
            if event.client is not None:
                self._choose(draw=event.target is self._noise)

        @self._fresh.on_update
        def _(event: viser.GuiEvent) -> None:
            if event.client is not None and self._noise.value == FRESH:
                self._choose()

        @self._draw.on_click
        def _(_event: viser.GuiEvent) -> None:
            self._choose(fresh=True, draw=True)

        for checkbox in self._marks.values():

            @checkbox.on_update
            def _(event: viser.GuiEvent) -> None:
                if event.client is not None:
                    events.marks_changed(
                        Marks(**{name: box.value is True for name, box in self._marks.items()})
                    )
                    self.refresh()

    def set_trials(self, targets: Sequence[str], repeats: int) -> None:
        """Offer the trials of a run, towards targets with names."""
        self._targets = tuple(f"{k + 1}: {name}" for k, name in enumerate(targets))
        if tuple(self._target.options) != self._targets:
            self._target.options = self._targets
        noises = (*(_exact(k) for k in range(repeats)), FRESH)
        if tuple(self._noise.options) != noises:
            self._noise.options = noises

    def show_only(self, speed: str) -> None:
        """Offer no other trial and nothing past the end.

        Args:
            speed: to begin with, one of ``SPEEDS``.
        """
        for widget in (self._more, self._target, self._noise, self._fresh, self._draw):
            widget.disabled = True
        put(self._speed, speed)
        self._player.speed = SPEEDS[speed]

    def select_trial(self, target: int, repeat: int, fresh: int = 0) -> None:
        """Show which trial is played; ``fresh`` is the number of its noise, 0 for the evaluated one."""
        put(self._target, self._targets[target])
        put(self._noise, FRESH if fresh else _exact(repeat))
        if fresh:
            put(self._fresh, fresh)
        self._fresh.disabled = not fresh

    def _choose(self, *, fresh: bool = False, draw: bool = False) -> None:
        """Report the trial that the widgets say; what is no choice on offer is dropped."""
        noises = tuple(self._noise.options)
        if self._target.value not in self._targets or self._noise.value not in noises:
            return
        target, repeat = self._targets.index(self._target.value), noises.index(self._noise.value)
        number = 0
        if fresh or self._noise.value == FRESH:
            repeat = 0
            typed = self._fresh.value
            number = 1 + secrets.randbelow(DRAWN_FROM) if draw else typed
            if not isinstance(number, int | float) or not math.isfinite(number):
                return
            number = int(min(max(number, 1), MAX_FRESH))
        self._events.trial_chosen(target, repeat, number)

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
        self._text.content = _text(
            describe(player),
            tension_legend.render(full_tension(replay.morphology)) if self._marks["tension"].value else "",
        )

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
    if isinstance(replay, WhatIfReplay):
        parts.insert(0, "what if, a robot of no archive")
    if not isinstance(replay, Replay):
        return " · ".join(parts)
    if replay.fresh:
        parts.insert(1, f"fresh noise {replay.fresh}")
    if replay.score is not None:
        stored = float(replay.evaluation.distances[replay.target_index, replay.repeat])
        if replay.fresh:
            same = f"with the evaluated noise {100 * stored:.2f} cm"
        elif replay.score == stored:
            same = "exactly as evaluated"
        else:
            same = f"evaluated elsewhere as {100 * stored:.2f} cm"
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


def _exact(repeat: int) -> str:
    return f"exact {repeat + 1}"


def _text(line: str, legend: str = "") -> str:
    return (
        '<div style="font-size:12.5px;opacity:.85;padding:4px 10px 6px;display:flex;flex-wrap:wrap;'
        f'justify-content:space-between;gap:0 12px"><span class="ta-replay">{line}</span>{legend}</div>'
    )


_WIDE = (6, 28, 6, 12, 8, 6, 6, 8, 4, 6, 6, 6, 6, 6, 6)
_NARROW = (10, 22, 8, 11, 9, 6, 8, 6, 0, 7, 8, 7, 5, 7, 6)
"""Fortieths of the panel's width that the widgets take, in their order; 0 for what there is no room for."""
_UNLABELLED = range(5, 10)
"""Children of a narrow panel that do without their label: what they show says what it is."""


def _layout(width: int) -> str:
    """Return a style that puts the widgets in rows; on a phone the panel is as wide as the window."""
    panel = "div:has(> div > .ta-transport)"

    def rows(spans: tuple[int, ...]) -> str:
        return "".join(
            f"{panel} > :nth-child({k}) {{ {f'grid-column: span {span}' if span else 'display: none'}; }}"
            for k, span in enumerate(spans, start=2)
        )

    labels = ", ".join(f"{panel} > :nth-child({k}) > div > div:has(label)" for k in _UNLABELLED)
    narrow = (
        f"{rows(_NARROW)} {labels} {{ display: none; }}"
        f"{panel} > * > div, {panel} button"
        " { padding-left: 4px !important; padding-right: 4px !important; }"
        f"{panel} > :nth-child(n+11) label {{ font-size: 12px !important; }}"
    )
    return (
        '<style class="ta-transport">'
        f"{panel} {{ display: grid; grid-template-columns: repeat(40, 1fr); align-items: center;"
        " row-gap: 2px; padding: 8px 4px 2px; }"
        f"{panel} > * {{ grid-column: span 40; padding-bottom: 0 !important; min-width: 0; }}"
        f"{panel} > :nth-child(1) {{ display: none; }}{rows(_WIDE) if width >= WIDTH else narrow}"
        f"{panel} > :nth-child(3) {{ padding-top: 6px; }}"
        f"{panel} > * > div > div:has(label) {{ width: auto !important; }}"
        f"@media (max-width: 700px) {{{narrow}}}</style>"
    )
