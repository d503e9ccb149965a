"""The command ``tensatlas``: the list of its commands, and how a command line becomes a command."""

from __future__ import annotations

import argparse
import functools
import io
import operator
import signal
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Final, Protocol

import tyro
from rich.console import Console

from app.cli.campaign import Campaign
from app.cli.compare import Compare
from app.cli.doctor import Doctor
from app.cli.evolve import CONFIG_FLAGS, Evolve, Resume
from app.cli.explore import Explore, ReplayDump, ReplayLog
from app.cli.export import Export
from app.cli.info import Info
from app.cli.record import Page, Record
from app.cli.reevaluate import Reevaluate
from app.cli.repair import Migrate, Recover, Slim
from app.cli.tables import Project, Table
from app.cli.verify import Verify
from app.drive.command import Drive
from engine.config import DEFAULT_PRESET, preset
from engine.errors import TensAtlasError
from engine.runs.described import read_described
from engine.tasks import load_task

USAGE_ERROR = 2
INTERRUPTED = 130


class Command(Protocol):
    """A command's arguments, as a frozen dataclass that tyro reads from a command line."""

    def run(self, console: Console) -> int | None:
        """Run the command; return the exit status, unless it is 0.

        Args:
            console: standard error, for everything but the command's output.
        """
        ...


COMMANDS: Final[tuple[type[Command], ...]] = (
    Explore,
    Evolve,
    Resume,
    Campaign,
    Info,
    Export,
    Drive,
    Record,
    Page,
    ReplayDump,
    ReplayLog,
    Verify,
    Reevaluate,
    Compare,
    Table,
    Project,
    Doctor,
    Recover,
    Migrate,
    Slim,
)
"""Every command, in the order of the help; its class names it: ``ReplayDump`` is ``replay-dump``."""


def main(argv: Sequence[str] | None = None) -> None:
    """Run a command; exit with 2 after an error that the user can mend, with 130 after Ctrl-C."""
    arguments = list(sys.argv[1:] if argv is None else argv)
    console = Console(stderr=True, highlight=False, soft_wrap=True)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")  # a locale may lack characters; a name may be no text
    # a terminal that closes or a supervisor that stops us ends as cleanly as Ctrl-C
    for sign in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(sign, _interrupt)
    try:
        if status := _parse(arguments or ["--help"]).run(console):
            sys.exit(status)
    except TensAtlasError as e:
        console.print(f"tensatlas: {e}", markup=False)
        sys.exit(USAGE_ERROR)
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)
    except BrokenPipeError:
        sys.stderr.close()
        sys.exit(1)


def _parse(arguments: list[str]) -> Command:
    """Parse a command line; the defaults of ``evolve`` are those of the file and the preset it names.

    Raises:
        InvalidData: there is no such preset, or the file is no description of a run.
        TaskError: the task file that it names has an error.
    """
    config, chosen = preset(DEFAULT_PRESET), DEFAULT_PRESET
    if arguments[0] == "evolve":
        arguments = _with_task_loaded(arguments)
        chosen = _named(arguments, "--preset", "")
        file = _named(arguments, "--config", "")
        config = read_described(Path(file), chosen or None) if file else preset(chosen or DEFAULT_PRESET)
    evolve = Evolve(path=tyro.MISSING, preset=chosen or DEFAULT_PRESET, config=config)
    kinds: list[Any] = [
        Annotated[kind, tyro.conf.subcommand(default=evolve)] if kind is Evolve else kind for kind in COMMANDS
    ]
    return tyro.cli(
        functools.reduce(operator.or_, kinds),
        prog="tensatlas",
        description="An interactive atlas of tensegrity soft modular robots.",
        args=arguments,
        registry=CONFIG_FLAGS,
    )


def _named(arguments: list[str], flag: str, default: str) -> str:
    """Return the value of a flag, found before anything else is parsed."""
    finder = argparse.ArgumentParser(add_help=False, allow_abbrev=False)
    finder.add_argument(flag, dest="value", nargs="?", default=default, const=default)
    return str(finder.parse_known_args(arguments)[0].value)


def _with_task_loaded(arguments: list[str]) -> list[str]:
    """Load the task file that a command line names, and return the line with the task's name instead."""
    file = _named(arguments, "--task", "")
    if not file.endswith(".py"):
        return arguments
    name = load_task(Path(file)).name
    return [{file: name, f"--task={file}": f"--task={name}"}.get(a, a) for a in arguments]


def _interrupt(*_: object) -> None:
    raise KeyboardInterrupt
