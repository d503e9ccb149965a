"""Playback of one replay for one browser: shows frames on a thread of its own, and has them simulated ahead.

What is simulated for several browsers is simulated in turn, a few seconds of each.
"""

from __future__ import annotations

import dataclasses
import logging
import threading
import time
from collections.abc import Callable
from typing import Protocol

from app.gui.lanes import Crew, Lane
from engine.replay.recording import Playable, ReplayFrame, frame_at, nearest_index

log = logging.getLogger(__name__)

SHOW_INTERVAL = 1 / 30
"""Seconds between two frames on the screen, whatever lies between two that are recorded."""

FIRST_INTERVAL = 0.005
"""Seconds between two looks whether a replay's first frame has been simulated."""
CLOSING_TIME = 2.0
"""Seconds that closing waits for the threads to end."""
SLICE = 5.0
"""Seconds of a robot's time that are simulated before other browsers have their turn."""
LAG = 0.4
"""Seconds after an end that was reached in which a browser may still offer to pause."""
_drawing = threading.Lock()
"""Held by the one player that computes a frame. Python runs one thread at a time anyway, and the more threads
want to be that one, the longer waits the thread that answers all browsers."""


@dataclasses.dataclass(frozen=True, slots=True)
class ReplayMoment:
    """What is due on the screen.

    Attributes:
        replay: that is played.
        index: of its recorded frame that is nearest.
        time: to draw, in s of the replay's clock; it may lie between two frames, but beyond none.
        playing: whether another moment follows at once.
    """

    replay: Playable
    index: int
    time: float
    playing: bool


class Controls(Protocol):
    """What shows where a player is and lets a user change that."""

    def refresh(self) -> None:
        """Show where the player is: something was loaded, or playing has begun or stopped."""
        ...

    def tick(self) -> None:
        """Show it if it is time to: another moment is on the screen."""
        ...


class Player:
    """Plays a replay while it is still being simulated.

    Args:
        may_simulate: asked before so many seconds of a robot's time are simulated.
        lane: of the browser, where they are; None for threads of its own.
    """

    def __init__(
        self, may_simulate: Callable[[float], bool] = lambda _seconds: True, lane: Lane | None = None
    ) -> None:
        self._crew: Crew | None = None
        if lane is None:
            self._crew = Crew()
            lane = Lane(self._crew)
        self._lane = lane
        self._show: Callable[[ReplayMoment], None] = lambda _moment: None
        self._controls: Controls | None = None
        self._may_simulate = may_simulate
        self._mutex = threading.Lock()
        self._wake = threading.Event()
        self._closed = False
        self._replay: Playable | None = None
        self._ended = -LAG
        self._shown: tuple[Playable, float] | None = None
        """What is on the screen: of which replay, and the moment."""
        self.time = 0.0
        self.playing = False
        self.speed = 1.0
        self.loop = False
        self.until = 0.0
        self._thread = threading.Thread(target=self._run, name="player", daemon=True)
        self._thread.start()

    @property
    def replay(self) -> Playable | None:
        """What is being played."""
        return self._replay

    def show_with(self, show: Callable[[ReplayMoment], None]) -> None:
        """Call a function with every moment that is due, on the player's own thread."""
        self._show = show

    def attach(self, controls: Controls) -> None:
        """Tell controls from now on where the player is."""
        self._controls = controls

    def load(self, replay: Playable) -> None:
        """Play another replay from its first frame."""
        if not self._may_simulate(replay.end_time - replay.start_time):
            return
        with self._mutex:
            if self._closed:
                return
            if self._replay is not None:
                self._replay.cancel()
            self._replay = replay
            self._shown = None
            self.time = replay.start_time
            self.until = replay.end_time
            self.playing = True
        self._simulate(replay, replay.end_time)
        self._wake.set()
        self._refresh_controls()

    def unload(self) -> None:
        """Play nothing."""
        with self._mutex:
            if self._replay is not None:
                self._replay.cancel()
            self._replay = self._shown = None
            self.playing = False
        self._refresh_controls()

    def play(self) -> None:
        """Go on, from the start if the end was reached."""
        with self._mutex:
            replay = self._replay
            if replay is not None:
                end = replay.frames[-1].time if replay.failure and replay.frames else self.until
                if self.time >= end - replay.frame_period:
                    self.time = replay.start_time
            self.playing = self._replay is not None
        self._wake.set()
        self._refresh_controls()

    def toggle(self) -> None:
        """Play or pause; a pause that was meant just before the end does not start all over."""
        if self.playing:
            self.pause()
        elif time.monotonic() - self._ended >= LAG:
            self.play()

    def pause(self) -> None:
        """Hold the frame that is shown."""
        self.playing = False
        self._refresh_controls()

    def seek(self, moment: float) -> None:
        """Go to a time of the trial's clock, in s."""
        with self._mutex:
            self._ended = -LAG  # who has seen the end and gone elsewhere means to play
            if self._replay is not None:
                self.time = min(max(moment, self._replay.start_time), self.until)
        self._wake.set()

    def redraw(self) -> None:
        """Show the present frame again: how it is drawn has changed."""
        with self._mutex:
            self._shown = None
        self._wake.set()

    def extend(self, seconds: float) -> None:
        """Simulate and play past the evaluated end."""
        if not self._may_simulate(seconds):
            return
        with self._mutex:
            replay = self._replay
            if replay is None:
                return
            self.until += seconds
            self.playing = True
        self._simulate(replay, self.until)
        self._wake.set()
        self._refresh_controls()

    def cancel(self) -> None:
        """Play and simulate no more."""
        with self._mutex:
            self._closed = True
            if self._replay is not None:
                self._replay.cancel()
        self._wake.set()

    def close(self) -> None:
        """End all threads and wait for them a little: Python may not end while one is at work."""
        self.cancel()
        if self._thread is not threading.current_thread():
            self._thread.join(CLOSING_TIME)
        if self._crew is not None:
            self._crew.close(CLOSING_TIME)

    def _simulate(self, replay: Playable, until: float) -> None:
        """Simulate until a time of the replay's clock, in s, as its browser's turns come."""
        reached = 0.0  # what comes before shows nothing of the trial

        def advance() -> None:
            nonlocal reached
            replay.advance(min(reached, until))
            if reached < until and replay is self._replay and not self._closed:
                reached += SLICE
                self._lane.put("simulate", advance)

        self._lane.put("simulate", advance)

    def _run(self) -> None:
        last = due = time.monotonic()
        while not self._closed:
            if not self.playing:
                self._wake.wait(0.2)
            self._wake.clear()
            now = time.monotonic()
            try:
                self._advance(now - last)
                with _drawing:
                    self._show_current()
            except Exception:  # one bad frame must not end all playback
                log.exception("a frame could not be shown")
                self.playing = False
            last = now
            # a little lateness is made up for; after more of it, or a pause, the beat starts anew
            interval = SHOW_INTERVAL if self._shown or not self._replay else FIRST_INTERVAL
            due = (due if now - due < interval else now) + interval
            time.sleep(max(0.0, due - time.monotonic()))

    def _advance(self, elapsed: float) -> None:
        ended = False
        with self._mutex:
            replay = self._replay
            if replay is None or not self.playing:
                return
            frames = replay.frames
            # never run ahead of the simulation, nor go on before anything has been seen
            frontier = frames[-1].time if frames else replay.start_time
            step = elapsed * self.speed if self._shown else 0.0
            self.time = min(self.time + step, max(frontier, self.time))
            # the last frame may lie just before the end
            at_end = frontier > self.until - replay.frame_period + 1e-6
            if self.time >= frontier - 1e-6 and (at_end or replay.failure):
                if self.loop and not replay.failure:
                    self.time = replay.start_time
                else:
                    self.playing = False
                    self._ended = time.monotonic()
                    ended = True
        if ended:
            self._refresh_controls()

    def _show_current(self) -> None:
        with self._mutex:
            replay = self._replay
            if replay is None or not replay.frames:
                return
            moment = min(max(self.time, replay.frames[0].time), replay.frames[-1].time)
            if self._shown == (replay, moment):
                return
            self._shown = (replay, moment)
        due = ReplayMoment(replay, nearest_index(replay, moment), moment, self.playing)
        if replay is self._replay:
            self._show(due)
            if self._controls is not None:
                self._controls.tick()

    def _refresh_controls(self) -> None:
        if self._controls is not None:
            self._controls.refresh()


def current_frame(player: Player) -> ReplayFrame | None:
    """Return the frame that is due, which may lie between two recorded ones, or None before the first one."""
    replay = player.replay
    if replay is None or not replay.frames:
        return None
    return frame_at(replay, player.time)
