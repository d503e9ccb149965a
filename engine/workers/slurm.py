"""Workers as jobs of a SLURM cluster, by dask-jobqueue."""

from __future__ import annotations

import re
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

from engine.children import shell_lines
from engine.errors import ClusterError, InvalidData
from engine.files import read_toml
from engine.workers.dask_workers import EXTRA, report_deaths

_FIELDS: Final[dict[str, type]] = {
    "jobs": int,
    "cores": int,
    "memory": str,
    "walltime": str,
    "queue": str,
    "account": str,
    "interface": str,
    "python": str,
    "local_directory": str,
    "log_directory": str,
    "directives": list,
    "prologue": list,
}
_REQUIRED: Final = ("jobs", "cores", "memory", "walltime")
MAX_JOBS: Final = 10_000
MARGIN: Final = 180
"""Seconds before the walltime at which a worker begins to leave."""
LOOK: Final = 15.0
"""Seconds between two checks of the jobs."""
STAGGER: Final = 120
"""Workers that began together leave spread over this many seconds."""


def read_settings(path: Path) -> dict[str, Any]:
    """Read a TOML file that describes the jobs.

    Raises:
        InvalidData: it cannot be read, or a value is missing, unknown or out of range.
    """
    settings = read_toml(path)
    for name, value in settings.items():
        if name not in _FIELDS:
            raise InvalidData(f"{path}: unknown {name!r}; known are {', '.join(_FIELDS)}")
        if type(value) is not _FIELDS[name] or (
            isinstance(value, list) and not all(isinstance(line, str) for line in value)
        ):
            kind = {int: "a whole number", str: "a text", list: "a list of texts"}[_FIELDS[name]]
            raise InvalidData(f"{path}: {name} must be {kind}, not {value!r}")
    for name in _REQUIRED:
        if name not in settings:
            raise InvalidData(f"{path}: {name} is missing")
    for name, most in (("jobs", MAX_JOBS), ("cores", 4096)):
        if not 1 <= settings[name] <= most:
            raise InvalidData(f"{path}: {name} must be from 1 to {most}, not {settings[name]}")
    lifetime(settings["walltime"], str(path))
    return settings


def lifetime(walltime: str, where: str = "walltime") -> int:
    """Return the seconds after which a worker should leave, so that its job is not killed while it computes.

    Raises:
        InvalidData: the walltime is not written ``HH:MM:SS`` or ``D-HH:MM:SS``, or shorter than 10 minutes.
    """
    found = re.fullmatch(r"(?:(\d+)-)?(\d{1,3}):(\d\d):(\d\d)", walltime)
    if not found:
        raise InvalidData(f"{where}: walltime must be written like 08:00:00 or 1-08:00:00, not {walltime!r}")
    days, hours, minutes, seconds = (int(part or 0) for part in found.groups())
    total = ((24 * days + hours) * 60 + minutes) * 60 + seconds
    if total < 600:
        raise InvalidData(f"{where}: walltime must be at least 00:10:00, not {walltime}")
    return total - MARGIN


def slurm_cluster(path: Path) -> tuple[Any, Callable[[], None]]:
    """Return a Dask cluster of the SLURM jobs that a file describes, and a function that keeps them up.

    The function must be called every few seconds; it replaces jobs that have ended, at their walltime or
    otherwise.

    Raises:
        InvalidData: the file is invalid.
        ClusterError: dask-jobqueue is not installed, or SLURM's commands are not there.
    """
    settings = read_settings(path)
    try:
        from dask_jobqueue import SLURMCluster
    except ImportError:
        raise ClusterError(EXTRA) from None
    report_deaths()
    leave = lifetime(settings["walltime"])
    optional = {
        "queue": "queue",
        "account": "account",
        "interface": "interface",
        "python": "python",
        "local_directory": "local_directory",
        "log_directory": "log_directory",
        "directives": "job_extra_directives",
    }
    try:
        cluster = SLURMCluster(
            cores=settings["cores"],
            processes=settings["cores"],  # an evaluation takes one thread
            memory=settings["memory"],
            walltime=settings["walltime"],
            worker_extra_args=["--lifetime", f"{leave}s", "--lifetime-stagger", f"{STAGGER}s"],
            scheduler_options={"dashboard_address": None},
            job_script_prologue=[
                *settings.get("prologue", []),
                *shell_lines(same_python="python" not in settings),
            ],
            **{theirs: settings[ours] for ours, theirs in optional.items() if ours in settings},
        )
        cluster.scale(jobs=settings["jobs"])
    except (OSError, ValueError, RuntimeError) as e:
        raise ClusterError(f"{path}: SLURM workers cannot be started: {e}") from None
    return cluster, _Replacement(cluster, settings["jobs"])


class _Replacement:
    """Replaces jobs that have ended; dask-jobqueue's own adaptive scaling forgets those that were killed.

    Args:
        cluster: a ``SLURMCluster``.
        jobs: how many to keep up.
    """

    def __init__(self, cluster: Any, jobs: int) -> None:
        self._cluster = cluster
        self._jobs = jobs
        self._looked_at = time.monotonic()

    def __call__(self) -> None:
        """Replace jobs that have ended, unless the last check was a moment ago."""
        now = time.monotonic()
        if now - self._looked_at < LOOK:
            return
        self._looked_at = now
        queued = queued_jobs()
        if queued is None:
            return
        known = {name: getattr(job, "job_id", None) for name, job in dict(self._cluster.workers).items()}
        ended = [name for name, number in known.items() if number is not None and str(number) not in queued]
        for name in ended:
            self._cluster.worker_spec.pop(name, None)
        if ended:
            # Dask gives a new job the name of the old one, and begins it only once that is forgotten
            self._cluster.scale(jobs=len(self._cluster.worker_spec))
        elif len(self._cluster.worker_spec) < self._jobs:
            self._cluster.scale(jobs=self._jobs)


def queued_jobs() -> set[str] | None:
    """Return the numbers of all jobs that wait or run, None if SLURM does not say."""
    try:
        said = subprocess.run(
            ["squeue", "--noheader", "--format=%i"], capture_output=True, text=True, timeout=30, check=True
        )
    except (OSError, subprocess.SubprocessError):
        return None
    return set(said.stdout.split())
