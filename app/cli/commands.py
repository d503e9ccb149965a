"""The commands' arguments, as dataclasses that tyro turns into a command line."""

from __future__ import annotations

import dataclasses
import os
from pathlib import Path
from typing import Annotated, Literal

import tyro

from app.worker_flags import WorkerFlags
from engine.config import RunConfig


@dataclasses.dataclass(frozen=True, kw_only=True)
class Explore:
    """Open the app in a browser: archives, live runs, replays.

    Without RUN it offers every run in saved_archives/ and runs/.
    """

    run: tyro.conf.Positional[tuple[Path, ...]] = ()
    """Run files or folders to offer, the first one opened."""
    host: str = "127.0.0.1"
    """Address to listen on. Any other than this machine's own needs a token."""
    port: int = 8080
    """Port to listen on."""
    token: str | None = None
    """Secret that the address must carry; also TENSATLAS_TOKEN. Made up if others can reach the app."""
    origin: tuple[str, ...] = ()
    """Addresses that a reverse proxy shows the app under, such as https://atlas.example.org."""
    read_only: bool = False
    """Let visitors look: no runs, no uploads, few simulations for each."""
    browser: bool = True
    """Open a browser window, where there is a screen."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Evolve:
    """Start an evolution, written to a new run file as it goes.

    Every field of the configuration is a flag; what is not given comes from the preset.
    """

    run: tyro.conf.Positional[Path]
    """Run file to create, *.tsmr."""
    preset: str = "quick"
    """paper (the published experiment), quick (half an hour on two cores) or smoke (seconds)."""
    computing: Annotated[WorkerFlags, tyro.conf.arg(name="")] = WorkerFlags()
    """Who computes the evaluations; the result does not depend on it."""
    config: Annotated[RunConfig, tyro.conf.arg(name="")]
    """What decides the outcome of a run."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Resume:
    """Go on with an interrupted evolution, exactly as if it had never stopped."""

    run: tyro.conf.Positional[Path]
    """Run file."""
    computing: Annotated[WorkerFlags, tyro.conf.arg(name="")] = WorkerFlags()
    """Who computes the evaluations; the result does not depend on it."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Campaign:
    """Run an experiment of many runs: a grid of tasks, algorithms and seeds, and their comparison.

    What is finished is left alone, what is unfinished is gone on with: after an interruption give the same
    command again.
    """

    file: tyro.conf.Positional[Path]
    """TOML file that describes it; docs/campaigns/paper.toml is the published experiment."""
    out: Path
    """Folder of the run files, their logs and the report."""
    jobs: int = 1
    """Runs at a time, each with workers of its own."""
    images: Literal["svg", "png", "none"] = "svg"
    """Kind of the report's figures as files; needs a Chromium."""
    dry_run: bool = False
    """Only say which runs there are and which are finished."""
    computing: Annotated[WorkerFlags, tyro.conf.arg(name="")] = WorkerFlags()
    """Who computes the evaluations; the result does not depend on it."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Info:
    """Say what a run file holds."""

    run: tyro.conf.Positional[Path]
    """Run file."""
    json: bool = False
    """Print JSON, with the hash that equal runs share."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Export:
    """Write a robot as a folder: build sheet, parts to make, firmware, MJCF, genotypes, replay.

    With --all-elites a folder for every robot that holds a cell.
    """

    run: tyro.conf.Positional[Path]
    """Run file."""
    archive: str | None = None
    """Map to take the elite from: morphology, which is the default, or controller, or of MAP-Elites grid.
    For --all-elites the only map to take."""
    cell: str | None = None
    """Cell of the map, such as 3,7 or 3,7,0,4; all count from 0."""
    all_elites: bool = False
    """Export every elite, each once, into folders of its own, with a table of the cells."""
    out: Path
    """Folder to create."""
    materials: str = "tpu-85a"
    """What it is built from: tpu-85a, silicone-cord, latex-cord, or a TOML file of yours."""
    paper: Literal["a4", "letter"] = "a4"
    """Paper that the build sheet is printed on."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Record:
    """Write a replay of one robot as a video, a picture or a page that plays without a server."""

    run: tyro.conf.Positional[Path]
    """Run file."""
    archive: str = "morphology"
    """Map to take the elite from: morphology or controller, or of MAP-Elites grid."""
    cell: str
    """Cell of the map, such as 3,7 or 3,7,0,4; all count from 0."""
    out: Path
    """File to write: *.mp4, *.png or *.html."""
    target: int = 0
    """Target of the trial, from 0."""
    repeat: int = 0
    """Noise seed of the trial, from 0, among those the robot was evaluated with."""
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


@dataclasses.dataclass(frozen=True, kw_only=True)
class Verify:
    """Simulate an elite again, with fresh noise and, if asked for, another physics.

    Prints its fitness as recorded and as simulated again, and how the robot moves. Without another
    physics only the noise is new.
    """

    run: tyro.conf.Positional[Path]
    """Run file."""
    archive: str = "morphology"
    """Map to take the elite from: morphology or controller, or of MAP-Elites grid."""
    cell: str
    """Cell of the map, such as 3,7 or 3,7,0,4; all count from 0."""
    inertia_scale: float | None = None
    """Factor on every inertia; 1 is the real one. The time step follows it to stay stable."""
    timestep_factor: float | None = None
    """Factor on the time step, such as 0.25."""
    seeds: int = 5
    """Evaluations with fresh noise, each of all targets and repeats."""
    workers: int = os.cpu_count() or 1
    """Threads that simulate; the result does not depend on it."""
    json: bool = False
    """Print JSON, with every single evaluation."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class ReplayDump:
    """Look at a simulation that failed, in a browser: its last moments and the reason."""

    file: tyro.conf.Positional[Path]
    """Failure dump, *.tsdump; a run keeps its own in the folder NAME.failures beside it."""
    host: str = "127.0.0.1"
    """Address to listen on. Any other than this machine's own needs a token."""
    port: int = 8080
    """Port to listen on."""
    token: str | None = None
    """Secret that the address must carry; also TENSATLAS_TOKEN. Made up if others can reach the app."""
    origin: tuple[str, ...] = ()
    """Addresses that a reverse proxy shows the app under, such as https://atlas.example.org."""
    browser: bool = True
    """Open a browser window, where there is a screen."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Table:
    """Write a run's elites as a table, with pyribs' column names."""

    run: tyro.conf.Positional[Path]
    """Run file."""
    archive: str | None = None
    """The only archive to take; without it all, told apart by the column ``archive``."""
    out: Path
    """File to write, *.csv or *.parquet."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Project:
    """Write a 4-D archive as its two 2-D maps, or two 2-D archives as one 4-D map: a run file again."""

    run: tyro.conf.Positional[Path]
    """Run file of MAP-Elites or DM-ME."""
    out: Path
    """Run file to create, *.tsmr."""
    workers: int = os.cpu_count() or 1
    """Threads that simulate elites without a trajectory; the result does not depend on it."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Compare:
    """Compare runs: tables, tests and figures by task and algorithm, beside the paper's.

    Writes one page that works offline, report.html, the tables as CSV and each figure as a file.
    """

    run: tyro.conf.Positional[tuple[Path, ...]]
    """Run files, or folders of them."""
    out: Path = Path("comparison")
    """Folder to write into."""
    at: int | None = None
    """Evaluations to compare at; later generations do not count. Without it, the ends of the runs."""
    images: Literal["svg", "png", "none"] = "svg"
    """Kind of the figures' files; needs a Chromium."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Reevaluate:
    """Simulate elites again under fresh noise and say how much of their map's fitness was luck.

    Keeps the results beside the run, in NAME.robust.json, and goes on with those that are there.
    """

    run: tyro.conf.Positional[Path]
    """Run file."""
    repeats: int = 5
    """Evaluations of each elite, each of all targets and the run's repeats."""
    archive: str | None = None
    """The only archive whose elites to take; without it all."""
    workers: int = os.cpu_count() or 1
    """Threads that simulate; the result does not depend on it."""
    json: bool = False
    """Print JSON."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Doctor:
    """Check this installation, and run files: a line for each thing, with what to do about it.

    Ends with 1 if there is a problem.
    """

    run: tyro.conf.Positional[tuple[Path, ...]] = ()
    """Run files; they are only read."""
    port: int = 8080
    """Port that the app would listen on."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Recover:
    """Save every whole generation of a damaged run, and the evaluations after them, into a new file."""

    run: tyro.conf.Positional[Path]
    """Run file; it is only read."""
    out: Path
    """Run file to create, *.tsmr."""
    like: Path | None = None
    """A run of the same configuration, for a file that has lost its own."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Migrate:
    """Write a copy of a run in the present format; the file of the older format stays as it is."""

    run: tyro.conf.Positional[Path]
    """Run file; it is only read."""
    out: Path
    """Run file to create, *.tsmr."""


Command = (
    Explore
    | Evolve
    | Resume
    | Info
    | Export
    | Record
    | Verify
    | ReplayDump
    | Table
    | Project
    | Compare
    | Reevaluate
    | Doctor
    | Recover
    | Migrate
)
