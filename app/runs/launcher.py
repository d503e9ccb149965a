"""Runs started from the app: each is a separate process, which outlives the browser and the app.

To pause is to stop: the process saves what is finished and ends, and ``resume`` continues as if it had never
stopped, to the last bit. A process that is only held (``SIGSTOP``) would keep its memory, would be lost with
the machine, and would look live. A marker beside the run says that its user paused it.
"""

from __future__ import annotations

import contextlib
import dataclasses
import os
import re
import signal
import socket
import subprocess
import time
import typing
from pathlib import Path
from typing import Final

from app.runs.library import NEW_RUNS, PAUSED_SUFFIX
from app.worker_flags import check_workers
from engine import config
from engine.children import command_line
from engine.config import RunConfig
from engine.errors import InvalidData, RunFileError
from engine.files import open_file, write_files
from engine.runs.described import describe
from engine.storage.lock import holder_of, is_being_written
from engine.storage.schema import SUFFIX
from engine.tasks import BUILT_IN

START_TIMEOUT: Final = 30.0
"""Seconds within which a new run must have created its file."""
LOG_LINES: Final = 4
"""Last lines of a log that are shown."""
_CLEAN_ENDS: Final = ("Stopped.", "Finished:")
"""How a log ends if all went well."""
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,60}")


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class NewRun:
    """The run that a user asks for.

    Attributes:
        name: of the run.
        preset: that the command line begins with.
        config: what decides the outcome.
        workers: threads that simulate.
        given: where robots are that it starts from, as ``evolve --from`` takes them.
        in_one_process: whether threads of one process simulate: it begins sooner than several processes.
    """

    name: str
    preset: str
    config: RunConfig
    workers: int
    given: tuple[str, ...] = ()
    in_one_process: bool = False


def choices(field: str) -> tuple[str, ...]:
    """Return the values that a field of the configuration may have, as its type has them.

    Of the tasks these are the built-in ones: any other is a file of code, which only the command line names.
    """
    if field == "task":
        return tuple(BUILT_IN)
    hint = typing.get_type_hints(config.RunConfig)[field]
    return tuple(map(str, typing.get_args(hint)))


def check_name(name: str) -> str:
    """Return the name of a run file without its suffix.

    Raises:
        InvalidData: a file cannot have that name.
    """
    name = name.removesuffix(SUFFIX)
    if not _NAME.fullmatch(name):
        raise InvalidData("a run's name has letters, digits, dots, dashes and underscores only")
    return name


def start(new: NewRun) -> Path:
    """Start an evolution and wait until its run file exists.

    Raises:
        InvalidData: a file cannot have that name, or a choice is not on offer.
        RunFileError: the run did not start; the message is the command line's.
    """
    name = check_name(new.name)
    # a browser may send anything, and a task may be a file of code
    for what, chosen, offered in (
        ("task", new.config.task, choices("task")),
        ("preset", new.preset, tuple(config.PRESETS)),
    ):
        if chosen not in offered:
            raise InvalidData(f"there is no {what} {chosen!r}; choose from {', '.join(offered)}")
    check_workers(new.workers)
    path = (NEW_RUNS / f"{name}{SUFFIX}").resolve()
    if path.exists():
        raise RunFileError(f"{path.name} exists already; choose another name")
    described = path.with_suffix(".toml")
    try:
        described.parent.mkdir(parents=True, exist_ok=True)
        write_files({described: describe(new.config)})
    except OSError as e:
        raise RunFileError(f"{described} cannot be written: {e.strerror}") from None
    try:
        return _launch(path, ["evolve", str(path), *flags(new, described)])
    finally:  # the run file has the configuration
        described.unlink(missing_ok=True)


def flags(new: NewRun, described: Path) -> list[str]:
    """Return the command line's flags of a run whose configuration a TOML file describes."""
    given = ["--from", *new.given] if new.given else []
    pool = ["--pool", "threads"] if new.in_one_process else []
    return ["--config", str(described), "--workers", str(new.workers), *pool, *given]


def resume(path: Path, *, workers: int) -> Path:
    """Resume an interrupted run in a separate process.

    Raises:
        RunFileError: it did not start.
    """
    if is_being_written(path):
        raise RunFileError(f"{path.name} is running already")
    marker = paused_path(path)
    was_paused = marker.exists()
    marker.unlink(missing_ok=True)
    try:
        return _launch(path, ["resume", str(path), "--workers", str(workers)])
    except RunFileError:
        if was_paused:
            _mark(marker)
        raise


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


def pause(path: Path) -> None:
    """Stop a run that is to be resumed later.

    Raises:
        RunFileError: no process is writing the run.
    """
    stop(path)
    _mark(paused_path(path))


def paused_path(path: Path) -> Path:
    """Return the marker of a run that its user has paused."""
    return path.with_name(path.name + PAUSED_SUFFIX)


def log_path(path: Path) -> Path:
    """Return the path of the log of a run that the app started."""
    return path.with_suffix(".log")


def last_words(path: Path) -> tuple[str, ...] | None:
    """Return the last lines of the log of a run that ended other than it should; None if it did not.

    Empty if there is nothing to read: the process was killed, or its run was not started from the app.
    """
    log = log_path(path)
    if is_being_written(path) or paused_path(path).exists() or not log.exists():
        return None
    try:
        with open_file(log) as f:
            f.seek(max(0, log.stat().st_size - 8000))
            text = f.read().decode(errors="replace")
    except OSError:
        return None
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    if lines and lines[-1].startswith(_CLEAN_ENDS):
        return None
    return tuple(lines[-LOG_LINES:])


def _mark(marker: Path) -> None:
    with contextlib.suppress(OSError):  # it only decides what the run is called
        marker.touch()


def _launch(path: Path, arguments: list[str]) -> Path:
    """Start a process that writes a run; its output is added to the log beside it.

    Raises:
        RunFileError: it ended, or did not begin to write in time.
    """
    log = log_path(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        output = open(log, "ab")  # noqa: SIM115
    except OSError as e:
        raise RunFileError(f"{log} cannot be written: {e.strerror}") from None
    with output:
        begin = output.tell()
        process = subprocess.Popen(
            command_line(*arguments),
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=output,
            start_new_session=True,
        )
    deadline = time.monotonic() + START_TIMEOUT
    while time.monotonic() < deadline:
        if process.poll() is not None and process.returncode != 0:
            lines = log.read_bytes()[begin:].decode(errors="replace").strip().splitlines()
            if not path.exists():
                log.unlink(missing_ok=True)
            reason = lines[-1].removeprefix("tensatlas: ") if lines else "it ended at once"
            raise RunFileError(reason)
        if path.exists() and (process.poll() is not None or is_being_written(path)):
            return path
        time.sleep(0.05)
    with contextlib.suppress(OSError):
        process.terminate()
    raise RunFileError(f"{path.name} did not start within {START_TIMEOUT:.0f} s")
