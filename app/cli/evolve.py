"""Working on one run until it is finished, with its progress on the screen."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rich.console import Console

from app.cli.progress import ProgressDisplay
from app.worker_flags import WorkerFlags, opened
from engine.config import RunConfig
from engine.runs import evolve as run
from engine.storage.reader import changed_versions
from engine.workers.malloc import keep_memory_compact


def compute_run(path: Path, config: RunConfig | None, flags: WorkerFlags, console: Console) -> None:
    """Start a run, or go on with one.

    Args:
        path: of the run file.
        config: of a run to start; None for one to go on with.
        flags: who computes.
        console: where progress is shown, and what has changed since the run was started.

    Raises:
        RunFileError: the file exists, or cannot be gone on with or written.
        InvalidData: a flag or the physics is out of range.
        ClusterError: the workers cannot be started or reached.
    """
    keep_memory_compact()
    with opened(flags) as workers, ProgressDisplay(console) as display:
        computing: dict[str, Any] = {
            "n_threads": flags.workers,
            "workers": workers,
            "observer": display.update,
        }
        if config is not None:
            run.evolve(path, config, **computing)
            return
        for change in changed_versions(path):
            console.print(f"tensatlas: note: {change}: results may differ", markup=False)
        run.resume(path, **computing)
