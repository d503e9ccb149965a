"""A replay as a file, for the app's downloads and for the command ``record``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from engine.errors import ExportError
from engine.replay.replay import Replay
from viz.recording.primitives import ReplayLook
from viz.recording.render import Renderer
from viz.recording.standalone_replay import standalone_replay
from viz.recording.video import video

if TYPE_CHECKING:  # viser takes long to import, and commands do not need it
    from app.gui.file_maker import ProgressCallback

KINDS: Final = ("html", "png", "mp4")
SPEEDS: Final = (0.1, 20.0)
"""Slowest and fastest video."""


def simulate(replay: Replay, progress: ProgressCallback | None = None) -> None:
    """Simulate a replay to the end of its trial, unless it has been.

    Raises:
        ExportError: the simulation fails, or was cancelled.
    """
    total = round(replay.end_time - replay.start_time)
    for second in range(1, total + 1):
        before = len(replay.frames)
        until = min(replay.start_time + second, replay.end_time)
        replay.advance(replay.end_time if second == total else until)
        if replay.failure is not None:
            raise ExportError(f"the simulation failed: {replay.failure}")
        if len(replay.frames) == before and (not replay.frames or replay.frames[-1].time < until - 0.1):
            raise ExportError("the simulation was cancelled")
        if progress:
            progress("simulating", second, total)


def recording(
    replay: Replay,
    kind: str,
    *,
    run: str,
    where: str = "",
    entered: int | None = None,
    at: float | None = None,
    speed: float = 1.0,
    look: ReplayLook | None = None,
    progress: ProgressCallback | None = None,
) -> bytes:
    """Return a replay as a file; simulate the rest of it first.

    Args:
        replay: the trial.
        kind: one of ``KINDS``.
        run: name of its run.
        where: the map and cell that the robot was picked from.
        entered: the generation that it was evaluated in, if known.
        at: moment of a picture, in s of the trial's clock; None for the end.
        speed: seconds of the trial in a second of a video.
        look: of a picture or a video.
        progress: told how far the work is; what it raises ends it.

    Raises:
        ExportError: the simulation fails, or a video cannot be made here.
    """
    simulate(replay, progress)
    if kind == "html":
        return standalone_replay(replay, run=run, where=where, entered=entered)
    if kind == "png":
        return Renderer(replay, look, run=run).png(replay.end_time if at is None else at)

    def frame_done(n: int, total: int) -> None:
        if progress:
            progress("drawing", n, total)

    return video(replay, look=look, run=run, speed=speed, progress=frame_done)
