"""Replays as files: ``record`` one robot's, ``page`` those of all elites of a run."""

from __future__ import annotations

import contextlib
import dataclasses
import os
from collections.abc import Callable
from pathlib import Path
from typing import Final

import tyro
from rich.console import Console

from app.cli.progress import counting
from app.worker_flags import check_workers
from engine.errors import ExportError, InvalidData, as_typed, printable
from engine.files import write_files
from engine.search.archive import parse_cell
from engine.storage.reader import RunReader

SPEEDS: Final = (0.1, 20.0)
"""Slowest and fastest video, in s of the trial per second."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Record:
    """Write a replay of one robot as a video, a picture or a page that plays without a server."""

    path: tyro.conf.Positional[Path]
    """Run file."""
    archive: str = "morphology"
    """Map to take the elite from: morphology or controller, or of MAP-Elites grid."""
    cell: str
    """Cell of the map, such as 3,7 or 3,7,0,4; all count from 0."""
    out: Path
    """File to write: *.mp4, *.png or *.html."""
    target: int = 1
    """Target of the trial, from 1."""
    repeat: int = 1
    """Noise seed of the trial, from 1, among those the robot was evaluated with."""
    fresh: int = 0
    """Number of fresh noise, from 1, instead of noise that the robot was evaluated with."""
    aim: str = ""
    """Target of your own instead, seen from where the head begins: bearing in degrees, positive to the
    left, and distance in cm, such as 30,62."""
    at: float | None = None
    """Moment of the picture, in s of the trial; without it the end."""
    speed: float = 1.0
    """Seconds of the trial in a second of the video."""
    light: bool = False
    """Picture or video on a bright ground."""

    def run(self, console: Console) -> None:
        """Simulate the trial again and write the file.

        Raises:
            RunFileError: the run cannot be read or has no such archive.
            InvalidData: there is no such cell, target, repeat, noise or moment, or the speed is off limits.
            ExportError: the trial cannot be simulated again, or the file cannot be written.
        """
        self._check()
        with RunReader(self.path) as reader:
            number = reader.elite_at(self.archive, parse_cell(self.cell))
            content = self._recording(reader, number, console)
        _write(self.out, content)
        console.print(f"Wrote robot {number} to {as_typed(self.out)}", markup=False)

    @property
    def _kind(self) -> str:
        return self.out.suffix.lower()[1:]

    def _check(self) -> None:
        """Refuse what cannot be written before anything is simulated.

        Raises:
            ExportError: the file's name ends in something else, or its folder cannot be made.
            InvalidData: the speed is out of range.
        """
        from app.downloads.recording import KINDS

        if self._kind not in KINDS:
            raise ExportError(f"{self.out}: a recording's name ends in .mp4, .png or .html")
        if not SPEEDS[0] <= self.speed <= SPEEDS[1]:
            raise InvalidData(f"speed must be from {SPEEDS[0]:g} to {SPEEDS[1]:g}, not {self.speed:g}")
        try:
            self.out.parent.mkdir(parents=True, exist_ok=True)
        except OSError as e:
            raise ExportError(f"{self.out} cannot be written: {e.strerror}") from None

    def _recording(self, reader: RunReader, number: int, console: Console) -> bytes:
        """Make the file's content, with a bar on the screen."""
        # what simulates and draws a replay takes a while to import; other commands do not need it
        from app.downloads.recording import recording
        from engine.replay.replay import Replay
        from engine.replay.trial import Aim, TrialChoice
        from viz.recording.primitives import ReplayLook

        trial = TrialChoice(
            target=self.target - 1,
            repeat=self.repeat - 1,
            fresh=self.fresh,
            aim=Aim.parse(self.aim) if self.aim else None,
        )
        replay = Replay.of(reader.config, reader.evaluation(number), trial)
        if self.at is not None and not replay.start_time <= self.at <= replay.end_time:
            raise InvalidData(
                f"at must be from {replay.start_time:g} to {replay.end_time:g} s, not {self.at:g}"
            )
        with contextlib.ExitStack() as stack:
            bars: dict[str, Callable[[int, int], None]] = {}

            def progress(what: str, n: int, total: int) -> None:
                if what not in bars:
                    stack.close()
                    bars[what] = stack.enter_context(counting(console, what))
                bars[what](n, total)

            return recording(
                replay,
                self._kind,
                run=printable(reader.path.stem),
                where=f"{self.archive} cell {self.cell}",
                entered=reader.generation_of(number),
                at=self.at,
                speed=self.speed,
                look=ReplayLook(light=self.light),
                progress=progress,
            )


@dataclasses.dataclass(frozen=True, kw_only=True)
class Page:
    """Write a run as one HTML file that opens without a server: its maps, and every elite that crawls."""

    path: tyro.conf.Positional[Path]
    """Run file."""
    out: Path
    """File to write, *.html, in a folder that exists."""
    link: str = ""
    """Address of a web page where the run can be had, such as its DOI."""
    workers: int = os.cpu_count() or 1
    """Threads that simulate; the result does not depend on it."""

    def run(self, console: Console) -> None:
        """Simulate every elite again, towards every target, and write the file.

        Raises:
            RunFileError: the run cannot be read or has no finished generation.
            InvalidData: the link is no address, or there are no such workers.
            ExportError: the run has no elites, or the file cannot be written.
        """
        # what draws takes a while to import; other commands do not need it
        from viz.atlas.page import atlas_page, checked_link

        check_workers(self.workers)
        checked_link(self.link)
        if self.out.suffix.lower() != ".html":
            raise ExportError(f"{self.out}: a page's name ends in .html")
        if not self.out.parent.is_dir():
            raise ExportError(f"there is no folder {self.out.parent}; make it first")
        with RunReader(self.path) as reader, counting(console, "robots simulated") as progress:
            content = atlas_page(reader, link=self.link, n_threads=self.workers, progress=progress)
        _write(self.out, content)
        console.print(f"Wrote {as_typed(self.out)}, {len(content) / 1e6:.1f} MB", markup=False)


def _write(path: Path, content: bytes) -> None:
    try:
        write_files({path: content})
    except OSError as e:
        raise ExportError(f"{path} cannot be written: {e.strerror}") from None
