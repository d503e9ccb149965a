"""Replays as files: the command ``record``, and what the app's downloads share with it."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from typing import TYPE_CHECKING, Final

from rich.console import Console

from app.cli import commands as c
from app.cli.progress import counting
from engine.errors import ExportError, InvalidData
from engine.replay.replay import Replay
from engine.replay.trial import Aim, TrialChoice
from engine.storage.reader import RunReader
from viz.recording.primitives import Look
from viz.recording.render import Renderer
from viz.recording.standalone_replay import standalone_replay
from viz.recording.video import video

if TYPE_CHECKING:  # viser, which takes long to import, is of no use to a command
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
    look: Look | None = None,
    progress: ProgressCallback | None = None,
) -> bytes:
    """Return a replay as a file; what of it is not simulated yet is.

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


def check(command: c.Record) -> None:
    """Refuse what cannot be written before anything is simulated.

    Raises:
        ExportError: the file's name ends in something else, or its folder cannot be made.
        InvalidData: the speed is out of range.
    """
    if command.out.suffix.lower()[1:] not in KINDS:
        raise ExportError(f"{command.out}: a recording's name ends in .mp4, .png or .html")
    if not SPEEDS[0] <= command.speed <= SPEEDS[1]:
        raise InvalidData(f"speed must be from {SPEEDS[0]:g} to {SPEEDS[1]:g}, not {command.speed:g}")
    try:
        command.out.parent.mkdir(parents=True, exist_ok=True)
    except OSError as e:
        raise ExportError(f"{command.out} cannot be written: {e.strerror}") from None


def record_elite(command: c.Record, reader: RunReader, number: int, console: Console) -> None:
    """Write a recording of an evaluation.

    Raises:
        InvalidData: there is no such target, repeat, noise or moment.
        ExportError: it cannot be simulated again, or the file cannot be written.
    """
    trial = TrialChoice(
        target=command.target,
        repeat=command.repeat,
        fresh=command.fresh,
        aim=Aim.parse(command.aim) if command.aim else None,
    )
    replay = Replay.of(reader.config, reader.evaluation(number), trial)
    if command.at is not None and not replay.start_time <= command.at <= replay.end_time:
        raise InvalidData(
            f"at must be from {replay.start_time:g} to {replay.end_time:g} s, not {command.at:g}"
        )
    with contextlib.ExitStack() as stack:
        bars: dict[str, Callable[[int, int], None]] = {}

        def progress(what: str, n: int, total: int) -> None:
            if what not in bars:
                stack.close()
                bars[what] = stack.enter_context(counting(console, what))
            bars[what](n, total)

        content = recording(
            replay,
            command.out.suffix.lower()[1:],
            run=reader.path.stem,
            where=f"{command.archive} cell {command.cell}",
            entered=reader.generation_of(number),
            at=command.at,
            speed=command.speed,
            look=Look(light=command.light),
            progress=progress,
        )
    try:
        command.out.write_bytes(content)
    except OSError as e:
        raise ExportError(f"{command.out} cannot be written: {e.strerror}") from None
