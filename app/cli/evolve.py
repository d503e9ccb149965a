"""The commands ``evolve`` and ``resume``: one run computed until it is finished."""

from __future__ import annotations

import dataclasses
import functools
import shlex
import typing
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated, Any, Final

import tyro
from rich.console import Console
from tyro.constructors import ConstructorRegistry, StructConstructorSpec, StructFieldSpec, StructTypeInfo

from app.cli.progress import ProgressDisplay
from app.gui.field_docs import field_docs
from app.worker_flags import WorkerFlags, opened
from engine.analysis.given_robots import read_robots
from engine.config import DEFAULT_PRESET, RunConfig, inline_tables, replaced
from engine.errors import InvalidData, as_typed
from engine.runs import evolve
from engine.search.variation import GivenRobot
from engine.simulation.compile_kernel import NOTICE, compile_kernel, is_compiled
from engine.simulation.physics import AS_BUILT, Physics
from engine.storage.reader import RunReader, changed_versions
from engine.tasks import TASKS_VARIABLE, get_task
from engine.workers.malloc import keep_memory_compact


@dataclasses.dataclass(frozen=True, kw_only=True)
class Evolve:
    """Start an evolution, written to a new run file as it goes.

    Every field of the configuration is a flag; what is not given comes from the file, then from the preset.
    """

    path: tyro.conf.Positional[Path]
    """Run file to create, *.tsmr."""
    preset: str = DEFAULT_PRESET
    """atlas (ours), paper (the published experiment), quick (a short atlas) or smoke (seconds)."""
    file: Annotated[Path | None, tyro.conf.arg(name="config")] = None
    """TOML file that describes the run; it may name the preset, and other flags win over it."""
    given: Annotated[tuple[str, ...], tyro.conf.arg(name="from")] = ()
    """Robots to evaluate first: RUN.tsmr (its elites), RUN.tsmr:3,4:5,7 (cells), genotype.json, table.csv."""
    as_built: str | None = None
    """Evolve robots as they would be built of latex-sheet, tpu-85a, silicone-sheet or a materials file."""
    spread: bool = False
    """With --as-built, give every repeat of an evaluation another robot of the design."""
    computing: Annotated[WorkerFlags, tyro.conf.arg(name="")] = WorkerFlags()
    """Who computes the evaluations; the result does not depend on it."""
    config: Annotated[RunConfig, tyro.conf.arg(name="")]
    """What decides the outcome of a run."""

    def run(self, console: Console) -> None:
        """Compute the run.

        Raises:
            RunFileError: the file exists or cannot be written, or one to start from cannot be read.
            InvalidData: a flag or the physics is out of range, or a robot to start from does not fit.
            ClusterError: the workers cannot be started or reached.
        """
        # a user's task is found again only if its file is named
        task = get_task(self.config.task)
        prefix = f"{TASKS_VARIABLE}={shlex.quote(task.file)} " if task.file else ""
        given = read_robots(self.given, task)
        _compute(self.path, self._config(), self.computing, console, prefix=prefix, given=given)

    def _config(self) -> RunConfig:
        """Return the configuration with the robots that are asked for."""
        if self.as_built is None:
            if self.spread:
                raise InvalidData("--spread needs --as-built, which says of what material")
            return self.config
        from engine.fabrication.as_built import search_physics
        from engine.fabrication.materials import load_materials

        physics = search_physics(
            self.config.physics,
            load_materials(self.as_built),
            spread=self.spread,
            footed=self.config.body.feet != "none",
        )
        return dataclasses.replace(self.config, physics=physics)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Resume:
    """Resume an interrupted evolution, exactly as if it had never stopped."""

    path: tyro.conf.Positional[Path]
    """Run file."""
    computing: Annotated[WorkerFlags, tyro.conf.arg(name="")] = WorkerFlags()
    """Who computes the evaluations; the result does not depend on it."""

    def run(self, console: Console) -> None:
        """Compute the rest of the run.

        Raises:
            RunFileError: the run cannot be resumed, or its file cannot be written.
            InvalidData: a flag is out of range.
            ClusterError: the workers cannot be started or reached.
        """
        _compute(self.path, None, self.computing, console, prefix="")


def compute_run(
    path: Path,
    config: RunConfig | None,
    flags: WorkerFlags,
    console: Console,
    given: Sequence[GivenRobot] = (),
) -> None:
    """Start a run, or resume one, with its progress on the screen.

    Args:
        path: of the run file.
        config: of a run to start; None for a run to resume.
        flags: what computes.
        console: where progress is shown, and which versions have changed since the run was started.
        given: robots that a new run starts from.

    Raises:
        RunFileError: the file exists, or the run cannot be resumed, or the file cannot be written.
        InvalidData: a flag or the physics is out of range.
        ClusterError: the workers cannot be started or reached.
    """
    keep_memory_compact()
    _compile(path, config, console)
    with opened(flags) as workers, ProgressDisplay(console) as display:
        computing: dict[str, Any] = {
            "n_threads": flags.workers,
            "workers": workers,
            "observer": display.update,
        }
        if config is not None:
            evolve.evolve(path, config, given=given, **computing)
            return
        for change in changed_versions(path):
            console.print(f"tensatlas: note: {change}: results may differ", markup=False)
        evolve.resume(path, **computing)


def _compile(path: Path, config: RunConfig | None, console: Console) -> None:
    """Compile the kernel, if it has not been on this machine, before several processes do."""
    if config is None:
        with RunReader(path) as reader:
            config = reader.config
    if config.physics.simulator == "kernel" and not is_compiled():
        console.print(NOTICE, markup=False)
        compile_kernel()


def _compute(
    path: Path,
    config: RunConfig | None,
    flags: WorkerFlags,
    console: Console,
    *,
    prefix: str,
    given: Sequence[GivenRobot] = (),
) -> None:
    """Start or resume a run, and say what to type next; the prefix is typed before ``tensatlas``."""
    file = as_typed(path)
    try:
        compute_run(path, config, flags, console, given)
    except KeyboardInterrupt:
        then = f"Everything finished is saved; continue with: {prefix}tensatlas resume {file}"
        console.print(f"Stopped. {then if path.exists() else 'Nothing had begun.'}", markup=False)
        raise
    console.print(f"Finished: {file}. Look at it with: {prefix}tensatlas explore {file}", markup=False)


CONFIG_FLAGS: Final = ConstructorRegistry()
"""Tells ``tyro.cli`` the flags of a configuration; fields of ``INLINE`` tables look like the run's own."""


@CONFIG_FLAGS.struct_rule
def _of_config(info: StructTypeInfo) -> StructConstructorSpec | None:
    if info.type is not RunConfig:
        return None
    default = info.default if isinstance(info.default, RunConfig) else RunConfig()
    return StructConstructorSpec(
        instantiate=functools.partial(replaced, default), fields=tuple(_flags(RunConfig, default))
    )


@CONFIG_FLAGS.struct_rule
def _of_physics(info: StructTypeInfo) -> StructConstructorSpec | None:
    """Leave out what robots are like: thirty numbers, which --as-built and files have in one piece."""
    if info.type is not Physics:
        return None
    default = info.default if isinstance(info.default, Physics) else Physics()
    fields = tuple(f for f in _flags(Physics, default) if f.name not in AS_BUILT)
    return StructConstructorSpec(instantiate=functools.partial(dataclasses.replace, default), fields=fields)


def _flags(kind: type, defaults: Any) -> Iterator[StructFieldSpec]:
    hints, docs, inline = typing.get_type_hints(kind), field_docs(kind), inline_tables(kind)
    for name, hint in hints.items():
        default = getattr(defaults, name)
        if name in inline:
            yield from _flags(inline[name], default)
        else:
            yield StructFieldSpec(name=name, type=hint, default=default, helptext=docs.get(name))
