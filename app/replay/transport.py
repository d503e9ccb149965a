"""The strip over the scene of one browser: play, time, target, speed; folded: noise, what is drawn."""

from __future__ import annotations

import dataclasses
import math
import re
import secrets
from collections.abc import Callable, Mapping, Sequence

import viser

from app.gui.page_channel import page_file
from app.gui.viser_private import selector
from app.gui.widgets import ignoring_event, put, put_html
from app.replay.overlays import Overlays
from app.replay.player import Player
from app.replay.replay_line import describe
from app.replay.scene import Scene
from engine.replay.recording import Playable
from engine.replay.replay import MAX_FRESH
from engine.replay.trial import FIRST_TRIAL, TrialChoice
from viz.robot import tension_legend
from viz.robot.geometry import full_tension

SPEEDS = {"⅒ ×": 0.1, "¼ ×": 0.25, "½ ×": 0.5, "1 ×": 1.0, "2 ×": 2.0, "4 ×": 4.0, "8 ×": 8.0}
WIDTH = 760
MIN_WIDTH = 420
NARROW = 560
MARGIN = 20
"""Pixels of the panel, and beside it."""
EXTENSION = 20.0
FRESH = "fresh"
ELSEWHERE = "elsewhere…"
DRAWN_FROM = 9999
"""Fresh noise that is drawn has a number up to this; any other can be typed."""
NOTHING = "Click a filled cell of a map to watch its robot."
OWN = {"layout": "transport", "show": "show", "fold": "folding"}
"""Names in ``transport.css`` of what is no control of viser's, and their classes after ``ta-``."""
UPDATE_INTERVAL = 0.2
"""Seconds of playing between two updates of the slider."""
OVERLAY_HINTS = {
    "tension": "Colour every cable by its tension; the legend below says how many newtons",
    "numbers": "The number of each module, the head's in its colour",
    "contacts": "A ring wherever the robot touches the ground or a wall; an arrow is the friction with which"
    " the ground pushes it there, 1 cm for 0.02 N",
    "trail": "Where the head has been since the target was placed",
}
"""Names of ``Overlays`` and what their checkboxes say."""
FOLD = (
    '<button type="button" class="ta-fold" title="Noise, what is drawn, and more" aria-label="More controls"'
    " onclick=\"document.documentElement.toggleAttribute('data-ta-unfolded')\">⋯</button>"
)
"""A button that folds what is needed seldom away, or unfolds it."""


@dataclasses.dataclass(frozen=True, slots=True)
class TransportEvents:
    """What the panel reports; nothing where there is only one trial to play."""

    trial_chosen: Callable[[TrialChoice], None] = lambda _trial: None
    elsewhere: Callable[[], None] = lambda: None
    """Called when the user wants to place the target."""


class TransportPanel:
    """Controls a player and the scene that it plays in, and shows where it is.

    Args:
        client: the browser.
        player: what it controls.
        scene: that shows what is played.
        events: whom it reports to.
        room: between the panels at the sides, in pixels.
        step: of the slider, in s.
    """

    def __init__(
        self,
        client: viser.ClientHandle,
        player: Player,
        scene: Scene,
        events: TransportEvents,
        *,
        room: int,
        step: float = 0.1,
    ) -> None:
        gui = client.gui
        self._player = player
        self._shown_time = -1e9
        self._sought = False
        """Whether the browser has named a moment; what was on its way to it then may stand in its field."""
        self._step = step
        self._events = events
        self._targets: tuple[str, ...] = ()
        self._trial = FIRST_TRIAL
        self._panel = panel = gui.add_panel()
        with panel.add_tab("Replay", viser.Icon.PLAYER_PLAY):
            self._play = gui.add_button("Play", icon=viser.Icon.PLAYER_PLAY, hint="Play or pause")
            self._slider = gui.add_slider(
                "Time",
                min=-3.0,
                max=40.0,
                step=step,
                initial_value=-3.0,
                hint="Seconds since the target was placed; before 0 the robot settles",
            )
            self._target = gui.add_dropdown(
                "Target",
                ("-",),
                hint="Which target it crawls to; elsewhere: click on the ground where it is to be",
            )
            self._speed = gui.add_dropdown(
                "Speed", tuple(SPEEDS), initial_value="1 ×", hint="Slow motion or fast forward"
            )
            gui.add_html(f'<div data-ta-mark="folding">{FOLD}</div>')
            self._more = gui.add_button(
                f"+{EXTENSION:.0f} s", color="gray", hint="Go on past the end of the evaluated time"
            )
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
            gui.add_html(
                '<div data-ta-mark="show" style="font-size:12px;opacity:.65;padding:0 10px">Show</div>'
            )
            shown = Overlays()
            self._overlays = {
                name: gui.add_checkbox(name.capitalize(), getattr(shown, name), hint=hint)
                for name, hint in OVERLAY_HINTS.items()
            }
            self._follow = gui.add_checkbox("Follow", True, hint="The camera follows the robot")
            self._loop = gui.add_checkbox("Loop", False, hint="Start over at the end")
            self._text = gui.add_html(_text(NOTHING))
            named = {"play": self._play, "time": self._slider, "more": self._more}
            named |= {"target": self._target, "noise": self._noise, "fresh": self._fresh, "draw": self._draw}
            named |= {"speed": self._speed, **self._overlays, "follow": self._follow, "loop": self._loop}
            self._named, self._width = named, _width(room)
            self._style = gui.add_html(_layout(named, narrow=self._width < NARROW))
        panel.float(x=MARGIN, y=-15, width=self._width)
        panel.expand()  # on a phone, too

        self._play.on_click(ignoring_event(player.toggle))
        self._more.on_click(ignoring_event(lambda: player.extend(EXTENSION)))
        self._draw.on_click(ignoring_event(lambda: self._choose(fresh=True, draw=True)))

        @self._slider.on_update
        def _(event: viser.GuiEvent) -> None:
            value = event.target.value
            if event.client is not None and isinstance(value, int | float) and math.isfinite(value):
                self._sought = True
                player.seek(float(value))

        @self._speed.on_update
        def _(event: viser.GuiEvent) -> None:
            player.speed = SPEEDS.get(str(event.target.value), 1.0)

        @self._loop.on_update
        def _(event: viser.GuiEvent) -> None:
            player.loop = event.target.value is True

        @self._follow.on_update
        def _(event: viser.GuiEvent) -> None:
            scene.follow = event.target.value is True

        @self._target.on_update
        @self._noise.on_update
        def _(event: viser.GuiEvent) -> None:
            if event.client is not None:
                self._choose(draw=event.target is self._noise)

        @self._fresh.on_update
        def _(event: viser.GuiEvent) -> None:
            if event.client is not None and self._noise.value == FRESH:
                self._choose()

        for checkbox in self._overlays.values():

            @checkbox.on_update
            def _(event: viser.GuiEvent) -> None:
                if event.client is not None:
                    shown = {name: box.value is True for name, box in self._overlays.items()}
                    scene.overlays = Overlays(**shown)
                    player.redraw()
                    self.refresh()

        player.attach(self)

    def fit(self, room: int) -> None:
        """Be as wide as the panels at the sides let it, which leave so many pixels between them."""
        if (width := _width(room)) != self._width:
            self._width = width
            put_html(self._style, _layout(self._named, narrow=width < NARROW))
            self._panel.float(x=MARGIN, y=-15, width=width)

    def set_trials(self, targets: Sequence[str], repeats: int) -> None:
        """Offer the trials of a run, towards targets with names."""
        self._targets = tuple(f"{k + 1}: {name}" for k, name in enumerate(targets))
        self._offer_targets()
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
        self.play_at(speed)

    def play_at(self, speed: str, *, loop: bool = False) -> None:
        """Play at one of ``SPEEDS``, over and over or once."""
        put(self._speed, speed)
        put(self._loop, loop)
        self._player.speed, self._player.loop = SPEEDS[speed], loop

    def select_trial(self, trial: TrialChoice) -> None:
        """Show which trial is played."""
        self._trial = trial
        self._offer_targets()
        self._select_target()
        put(self._noise, FRESH if trial.fresh else _exact(trial.repeat))
        if trial.fresh:
            put(self._fresh, trial.fresh)
        self._fresh.disabled = not trial.fresh

    def _offer_targets(self) -> None:
        """Offer the targets of the task, the one that was placed, if any, and to place one."""
        aim = self._trial.aim
        offered = (*self._targets, *(() if aim is None else (aim.name,)), ELSEWHERE)
        if tuple(self._target.options) != offered:
            self._target.options = offered

    def _select_target(self) -> None:
        trial = self._trial
        put(self._target, self._targets[trial.target] if trial.aim is None else trial.aim.name)

    def _choose(self, *, fresh: bool = False, draw: bool = False) -> None:
        """Report the trial that the widgets say; what is no choice on offer is dropped."""
        noises, name, trial = tuple(self._noise.options), self._target.value, self._trial
        if name == ELSEWHERE:
            self._select_target()
            self._events.elsewhere()
            return
        if name in self._targets:
            trial = TrialChoice(target=self._targets.index(name))
        elif trial.aim is None or name != trial.aim.name:
            return
        if self._noise.value not in noises:
            return
        repeat = noises.index(self._noise.value)
        number = 0
        if fresh or self._noise.value == FRESH:
            repeat = 0
            typed = self._fresh.value
            number = 1 + secrets.randbelow(DRAWN_FROM) if draw else typed
            if not isinstance(number, int | float) or not math.isfinite(number):
                return
            number = int(min(max(number, 1), MAX_FRESH))
        self._events.trial_chosen(dataclasses.replace(trial, repeat=repeat, fresh=number))

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
        shown = round(min(max(moment, self._slider.min), self._slider.max), 3)
        if self._sought:  # viser sends no value that it believes to be shown
            self._sought = False
            put(self._slider, shown + self._step / 100)
        put(self._slider, shown)
        self._shown_time = player.time
        self._text.content = _text(describe(player), self._legend(replay))

    def _legend(self, replay: Playable) -> str:
        shown = {name for name, box in self._overlays.items() if box.value}
        legend = tension_legend.render(full_tension(replay.morphology)) if "tension" in shown else ""
        known = bool(replay.frames) and replay.frames[-1].forces is not None
        return legend + (tension_legend.friction() if known and "contacts" in shown else "")

    def tick(self) -> None:
        """Refresh now and then while playing, and whenever a replay that is held goes to another moment."""
        interval = min(UPDATE_INTERVAL, 2 * self._step) * max(self._player.speed, 1)
        if not self._player.playing or abs(self._player.time - self._shown_time) >= interval:
            self.refresh()


def _width(room: int) -> int:
    return min(WIDTH, max(MIN_WIDTH, room - 2 * MARGIN))


def _layout(controls: Mapping[str, object], *, narrow: bool) -> str:
    """Return a style that puts the controls in rows: ``transport.css`` with selectors in place of names."""
    panel = '[data-ta-in~="transport-2"]'
    parts = {name: f'[data-ta-in~="{kind}-1"]' for name, kind in OWN.items()}
    parts |= {name: selector(control) for name, control in controls.items()}
    style = page_file("transport.css", __package__).replace("#panel", panel)
    for name, part in parts.items():
        style = re.sub(rf"#{name}\b", f"{panel} > {part}", style)
    if narrow:
        style = style.replace("@media (max-width: 700px)", "@media all")
    return f'<style data-ta-mark="transport">{style}</style>'


def _exact(repeat: int) -> str:
    return f"exact {repeat + 1}"


def _text(line: str, legend: str = "") -> str:
    return (
        '<div style="font-size:12.5px;opacity:.85;padding:4px 10px 6px;display:flex;flex-wrap:wrap;'
        f'justify-content:space-between;gap:0 12px"><span class="ta-replay">{line}</span>{legend}</div>'
    )
