"""The command ``tensatlas``."""

from __future__ import annotations

import argparse
import dataclasses
import json
import shlex
import signal
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import tyro
from rich.console import Console

from app.cli import commands as c
from app.cli.config_flags import REGISTRY
from app.cli.doctor import doctor
from app.cli.evolve import compute_run
from app.cli.reevaluate import reevaluate_run
from app.cli.repair import migrate_run, recover_run
from app.cli.tables import project, write_elites
from app.cli.verify import print_verification
from app.worker_flags import WorkerFlags, check_workers
from engine.analysis.verify import changed_physics, verify
from engine.config import preset, to_json
from engine.errors import TensAtlasError
from engine.search.archive import parse_cell
from engine.simulation.provenance import differing
from engine.storage.reader import RunReader
from engine.storage.rows import Generation
from engine.tasks import TASKS_VARIABLE, get_task, load_task

USAGE_ERROR = 2
INTERRUPTED = 130


def main(argv: Sequence[str] | None = None) -> None:
    """Run a command; exit with 2 after an error of the user's, with 130 after Ctrl-C."""
    arguments = list(sys.argv[1:] if argv is None else argv)
    console = Console(stderr=True, highlight=False, soft_wrap=True)
    # a terminal that closes or a supervisor that stops us ends as cleanly as Ctrl-C
    for sign in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(sign, _interrupt)
    try:
        _dispatch(_parse(arguments or ["--help"]), console)
    except TensAtlasError as e:
        console.print(f"tensatlas: {e}", markup=False)
        sys.exit(USAGE_ERROR)
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)
    except BrokenPipeError:
        sys.stderr.close()
        sys.exit(1)


def _parse(arguments: list[str]) -> c.Command:
    """Parse a command line; the defaults of ``evolve`` are those of the preset it names.

    Raises:
        InvalidData: there is no such preset.
        TaskError: the task file that it names has an error.
    """
    config = preset(_named(arguments, "--preset", "quick"))
    if arguments[0] == "evolve":
        arguments = _with_task_loaded(arguments)
    evolve = Annotated[
        c.Evolve,
        tyro.conf.subcommand("evolve", default=c.Evolve(run=tyro.MISSING, preset="quick", config=config)),
    ]
    kinds: Any = (
        Annotated[c.Explore, tyro.conf.subcommand("explore")]
        | evolve
        | Annotated[c.Resume, tyro.conf.subcommand("resume")]
        | Annotated[c.Campaign, tyro.conf.subcommand("campaign")]
        | Annotated[c.Info, tyro.conf.subcommand("info")]
        | Annotated[c.Export, tyro.conf.subcommand("export")]
        | Annotated[c.Record, tyro.conf.subcommand("record")]
        | Annotated[c.ReplayDump, tyro.conf.subcommand("replay-dump")]
        | Annotated[c.Verify, tyro.conf.subcommand("verify")]
        | Annotated[c.Reevaluate, tyro.conf.subcommand("reevaluate")]
        | Annotated[c.Compare, tyro.conf.subcommand("compare")]
        | Annotated[c.Table, tyro.conf.subcommand("table")]
        | Annotated[c.Project, tyro.conf.subcommand("project")]
        | Annotated[c.Doctor, tyro.conf.subcommand("doctor")]
        | Annotated[c.Recover, tyro.conf.subcommand("recover")]
        | Annotated[c.Migrate, tyro.conf.subcommand("migrate")]
    )
    return tyro.cli(
        kinds,
        prog="tensatlas",
        description="An interactive atlas of tensegrity soft modular robots.",
        args=arguments,
        registry=REGISTRY,
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


def _dispatch(command: c.Command, console: Console) -> None:
    match command:
        case c.Explore():
            # the app's libraries take a second to import; the other commands do without
            from app.server.server import explore

            explore(command.run, _listening(command), read_only=command.read_only)
        case c.ReplayDump():
            from app.server.server import replay_dump

            replay_dump(command.file, _listening(command))
        case c.Evolve():
            _work(command.run, command.computing, command.config, console)
        case c.Resume():
            _work(command.run, command.computing, None, console)
        case c.Campaign():
            from app.cli.campaign import run_campaign

            if status := run_campaign(command, console):
                sys.exit(status)
        case c.Info():
            _info(command.run, command.json)
        case c.Export():
            # as the app's, the libraries that draw and shape take a while to import
            from app.cli.export import export

            export(command, console)
        case c.Record():
            _record(command, console)
        case c.Verify():
            _verify(command)
        case c.Reevaluate():
            check_workers(command.workers)
            reevaluate_run(command, console)
        case c.Compare():
            # as the app's, the figures' libraries take a while to import
            from app.cli.compare import compare

            compare(command, console)
        case c.Table():
            write_elites(command, console)
        case c.Project():
            check_workers(command.workers)
            project(command, console)
        case c.Doctor():
            out = Console(highlight=False, soft_wrap=True)
            if status := doctor(command.run, port=command.port, console=out):
                sys.exit(status)
        case c.Recover():
            recover_run(command.run, command.out, command.like, console)
        case c.Migrate():
            migrate_run(command.run, command.out, console)


def _listening(command: c.Explore | c.ReplayDump) -> Any:
    from app.server.server import Listening

    return Listening(
        host=command.host,
        port=command.port,
        token=command.token,
        origins=command.origin,
        open_browser=command.browser,
    )


def _work(path: Path, flags: WorkerFlags, config: Any, console: Console) -> None:
    # a task of the user's is found again only if they name its file
    file = "" if config is None else get_task(config.task).file
    prefix = f"{TASKS_VARIABLE}={shlex.quote(file)} " if file else ""
    try:
        compute_run(path, config, flags, console)
    except KeyboardInterrupt:
        console.print(
            f"Stopped. Everything finished is saved; go on with: {prefix}tensatlas resume {path}",
            markup=False,
        )
        raise
    console.print(f"Finished: {path}. Look at it with: {prefix}tensatlas explore {path}", markup=False)


def _info(path: Path, as_json: bool) -> None:
    with RunReader(path) as reader:
        generations = reader.generations()
        last = generations[-1] if generations else None
        computers = reader.computers()
        facts = {
            "path": str(path),
            "task": reader.config.task,
            "algorithm": reader.config.algorithm,
            "evaluations": reader.n_evaluations(),
            "budget": reader.config.evaluations,
            "failed": last.n_failed if last else 0,
            "generations": len(generations),
            "seconds": round(last.seconds, 1) if last else 0.0,
            "created_at": reader.created_at,
            "projection": reader.projection,
            "live": reader.is_live,
            "versions": reader.versions,
            "archives": _archive_facts(last),
            "computed_on": [{"evaluations": n, **dataclasses.asdict(c)} for c, n in computers.items()],
        }
        if as_json:
            facts["config"] = to_json(reader.config)
            facts["hash"] = reader.canonical_hash()
            print(json.dumps(facts, indent=2))
            return
        change = reader.task_change
    console = Console(highlight=False, soft_wrap=True)
    for key in ("task", "algorithm", "generations", "created_at", "live"):
        console.print(f"{key:<12} {facts[key]}", markup=False)
    console.print(f"{'evaluations':<12} {facts['evaluations']} of {facts['budget']}", markup=False)
    if reader.projection is not None:
        kind, source = (reader.projection.get(k, "unknown") for k in ("kind", "source"))
        console.print(f"{'projection':<12} of {source}: {kind}", markup=False)
    console.print(f"{'failed':<12} {facts['failed']}", markup=False)
    if change:
        console.print(f"{'note':<12} {change}: results may differ", markup=False)
    for computer, n in computers.items():
        console.print(f"{'computed on':<12} {computer}: {n} evaluations", markup=False)
    for difference in differing(list(computers)):
        console.print(f"{'note':<12} computers differ in {difference}: the last bits may too", markup=False)
    for name, figures in _archive_facts(last).items():
        console.print(
            f"{name:<12} best f_s {figures['best_cm']:.2f} cm, QD score {figures['qd_score_cm']:.1f}"
            f" cm, coverage {figures['coverage']:.0%}"
            if figures["best_cm"] is not None
            else f"{name:<12} empty",
            markup=False,
        )


def _archive_facts(last: Generation | None) -> dict[str, dict[str, Any]]:
    if last is None:
        return {}
    return {
        name: {
            "best_cm": None if f.best is None else round(100 * f.best, 3),
            "qd_score_cm": round(100 * f.qd_score, 3),
            "coverage": round(f.coverage, 4),
        }
        for name, f in last.archives.items()
    }


def _record(command: c.Record, console: Console) -> None:
    # what draws takes a while to import
    from app.downloads.recording import check, record_elite

    check(command)
    with RunReader(command.run) as reader:
        number = reader.elite_at(command.archive, parse_cell(command.cell))
        record_elite(command, reader, number, console)
    console.print(f"Wrote robot {number} to {command.out}", markup=False)


def _verify(command: c.Verify) -> None:
    check_workers(command.workers)
    with RunReader(command.run) as reader:
        config = reader.config
        evaluation = reader.evaluation(reader.elite_at(command.archive, parse_cell(command.cell)))
    physics = changed_physics(
        config.physics, inertia_scale=command.inertia_scale, timestep_factor=command.timestep_factor
    )
    found = verify(
        config,
        evaluation,
        physics=None if physics == config.physics else physics,
        n_seeds=command.seeds,
        n_threads=command.workers,
    )
    print_verification(command, config, found)


def _interrupt(*_: object) -> None:
    raise KeyboardInterrupt
