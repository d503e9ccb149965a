"""What computes: threads or processes of this machine, a Dask cluster, SLURM jobs; as flags of commands."""

from __future__ import annotations

import contextlib
import dataclasses
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Literal

from engine.errors import InvalidData
from engine.workers.dask_workers import DaskWorkers
from engine.workers.pool import Workers
from engine.workers.processes import TIMEOUT, ProcessWorkers
from engine.workers.slurm import slurm_cluster

MAX_WORKERS = 1024


@dataclasses.dataclass(frozen=True, kw_only=True)
class WorkerFlags:
    """Who computes the evaluations; the result does not depend on it."""

    workers: int = os.cpu_count() or 1
    """Processes or threads of this machine that simulate."""
    pool: Literal["processes", "threads"] = "processes"
    """What the workers of this machine are; one worker is a thread of the command itself."""
    timeout: float = TIMEOUT
    """Seconds after which an evaluation in a worker process counts as hanging: it is tried once more."""
    scheduler: str | None = None
    """Address of a Dask scheduler, tcp://HOST:PORT, whose workers simulate instead of this machine."""
    slurm: Path | None = None
    """TOML file that describes SLURM jobs, which simulate instead; docs/clusters.md has one."""


def check_workers(workers: int) -> None:
    """Check a number of workers.

    Raises:
        InvalidData: it is out of range.
    """
    if not 1 <= workers <= MAX_WORKERS:
        raise InvalidData(f"workers must be from 1 to {MAX_WORKERS}, not {workers}")


def check(flags: WorkerFlags) -> None:
    """Check flags before anything is started.

    Raises:
        InvalidData: one is out of range or contradicts another.
    """
    check_workers(flags.workers)
    if flags.scheduler is not None and flags.slurm is not None:
        raise InvalidData("choose one of --scheduler and --slurm")
    if flags.scheduler is not None and "://" not in flags.scheduler:
        raise InvalidData(f"a scheduler's address is written tcp://HOST:PORT, not {flags.scheduler!r}")


@contextlib.contextmanager
def opened(flags: WorkerFlags) -> Iterator[Workers | None]:
    """Start or reach the workers for a ``with`` block; None where threads of this process do.

    Raises:
        InvalidData: a flag is out of range or contradicts another.
        ClusterError: they cannot be started or reached.
    """
    check(flags)
    if flags.scheduler is not None:
        with DaskWorkers(flags.scheduler) as dask:
            yield dask
    elif flags.slurm is not None:
        cluster, keep_up = slurm_cluster(flags.slurm)
        with DaskWorkers(cluster, keep_up=keep_up) as dask:
            yield dask
    elif flags.workers > 1 and flags.pool == "processes":
        with ProcessWorkers(flags.workers, timeout=flags.timeout) as processes:
            yield processes
    else:
        yield None
