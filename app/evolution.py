"""Runs started from the app: each is a process of its own that outlives the browser and the app."""

from __future__ import annotations

import contextlib
import dataclasses
import os
import re
import signal
import socket
import subprocess
import sys
import tempfile
import time
import typing
from pathlib import Path

from app.library import NEW_RUNS
from engine import config
from engine.errors import InvalidData, RunFileError
from engine.lock import holder_of, is_being_written
from engine.store import SUFFIX
from engine.tasks import BUILT_IN

START_TIMEOUT = 30.0
"""Seconds within which a new run must have created its file."""
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,60}")


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class NewRun:
    """What a user asks for: the name of the run, the fields of its configuration, the threads."""

    name: str
    task: str
    algorithm: str
    preset: str
    evaluations: int
    seed: int
    workers: int


def choices(field: str) -> tuple[str, ...]:
    """Return the values that a field of the configuration may have, as its type has them.

    Of the tasks these are the built-in ones: any other is a file of code, which only the command line names.
    """
    if field == "task":
        return tuple(BUILT_IN)
    hint = typing.get_type_hints(config.RunConfig)[field]
    return tuple(map(str, typing.get_args(hint)))


def start(new: NewRun) -> Path:
    """Start an evolution and wait until its run file exists.

    Raises:
        InvalidData: the name is none for a file, or a choice is none of those on offer.
        RunFileError: the run did not start; the message is the command line's.
    """
    name = new.name.removesuffix(SUFFIX)
    if not _NAME.fullmatch(name):
        raise InvalidData("a run's name has letters, digits, dots, dashes and underscores only")
    # a browser may send anything, and a task may be a file of code
    for what, chosen, offered in (
        ("task", new.task, choices("task")),
        ("algorithm", new.algorithm, choices("algorithm")),
        ("preset", new.preset, tuple(config.PRESETS)),
    ):
        if chosen not in offered:
            raise InvalidData(f"there is no {what} {chosen!r}; choose from {', '.join(offered)}")
    path = (NEW_RUNS / f"{name}{SUFFIX}").resolve()
    flags = {
        "preset": new.preset,
        "task": new.task,
        "algorithm": new.algorithm,
        "evaluations": new.evaluations,
        "initial": min(config.preset(new.preset).initial, new.evaluations),
        "seed": new.seed,
        "workers": new.workers,
    }
    arguments = [part for flag, value in flags.items() for part in (f"--{flag}", str(value))]
    return _launch(path, ["evolve", str(path), *arguments], must_be_new=True)


def resume(path: Path, *, workers: int) -> Path:
    """Go on with an interrupted run in a process of its own.

    Raises:
        RunFileError: it did not start.
    """
    return _launch(path, ["resume", str(path), "--workers", str(workers)], must_be_new=False)


def stop(path: Path) -> None:
    """Ask the process that writes a run to stop; it saves first.

    Raises:
        RunFileError: no process is writing the run.
    """
    if not is_being_written(path):
        raise RunFileError(f"{path.name} is not running")
    holder = holder_of(path)
    if holder is None or not holder.is_of_this_boot or holder.host != socket.gethostname():
        who = f": it is written by {holder}" if holder else ""
        raise RunFileError(f"{path.name} could not be stopped from here{who}")
    try:
        os.kill(holder.pid, signal.SIGTERM)
    except OSError:
        raise RunFileError(f"{path.name} could not be stopped from here") from None


def _launch(path: Path, arguments: list[str], *, must_be_new: bool) -> Path:
    if must_be_new and path.exists():
        raise RunFileError(f"{path.name} exists already; choose another name")
    with tempfile.TemporaryFile() as errors:
        process = subprocess.Popen(
            [sys.executable, "-m", "app", *arguments],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=errors,
            start_new_session=True,
        )
        deadline = time.monotonic() + START_TIMEOUT
        while time.monotonic() < deadline:
            if process.poll() is not None and process.returncode != 0:
                errors.seek(0)
                lines = errors.read().decode(errors="replace").strip().splitlines()
                reason = lines[-1].removeprefix("tensatlas: ") if lines else "it ended at once"
                raise RunFileError(reason)
            if path.exists() and (process.poll() is not None or is_being_written(path)):
                return path
            time.sleep(0.05)
    with contextlib.suppress(OSError):
        process.terminate()
    raise RunFileError(f"{path.name} did not start within {START_TIMEOUT:.0f} s")
