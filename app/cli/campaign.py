"""The command ``campaign``: one process per run, several at a time, and the comparison at the end."""

from __future__ import annotations

import contextlib
import dataclasses
import json
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro
from rich.console import Console

from app.cli.compare import Compare
from app.cli.evolve import compute_run
from app.worker_flags import WorkerFlags, check
from engine.children import module_line
from engine.config import from_json, to_json
from engine.errors import InvalidData, RunFileError, TensAtlasError, as_typed
from engine.storage.reader import RunReader

if TYPE_CHECKING:
    from engine.runs.campaign import PlannedRun

POLL = 0.5
ATTEMPTS = 2
"""How often a run is started or resumed before it is given up."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Campaign:
    """Run an experiment of many runs: a grid of tasks, algorithms and seeds, and their comparison.

    Finished runs are left alone, unfinished ones are resumed: after an interruption give the same command
    again.
    """

    file: tyro.conf.Positional[Path]
    """TOML file that describes it; docs/campaigns/paper.toml is the published experiment."""
    out: Path
    """Folder of the run files, their logs and the report."""
    jobs: int = 1
    """Runs at a time, each with its own workers."""
    baseline: str | None = None
    """The group, or one of its runs, that the report tests all others against."""
    images: Literal["svg", "png", "none"] = "svg"
    """Kind of the report's figures as files; needs a Chromium."""
    dry_run: bool = False
    """Only list the runs and say which are finished."""
    computing: Annotated[WorkerFlags, tyro.conf.arg(name="")] = WorkerFlags()
    """Who computes the evaluations; the result does not depend on it."""

    def run(self, console: Console) -> int:
        """Work until every run is finished; return the exit status.

        Raises:
            InvalidData: the file or a flag is invalid.
            RunFileError: a run's file exists and belongs to another run.
        """
        from engine.runs.campaign import read_campaign

        if self.jobs < 1:
            raise InvalidData(f"jobs must be at least 1, not {self.jobs}")
        check(self.computing)
        runs = read_campaign(self.file)
        folder = self.out
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as e:
            raise RunFileError(f"{folder} cannot be made: {e.strerror or e}") from None
        waiting = [run for run in runs if not is_finished(folder / run.file, run)]
        n_finished = len(runs) - len(waiting)
        console.print(f"{len(runs)} runs in {as_typed(folder)}, {n_finished} of them finished", markup=False)
        if self.dry_run:
            for run in runs:
                state = "waits" if run in waiting else "is finished"
                console.print(f"{run.file} {state}: {run.config.evaluations} evaluations", markup=False)
            return 0
        failed = _work(waiting, self, console)
        if failed:
            for file, reason in failed.items():
                console.print(f"tensatlas: {file}: {reason}", markup=False)
            console.print("The same command resumes what is unfinished.")
            return 1
        files = tuple(folder / run.file for run in runs)
        report = Compare(paths=files, out=folder / "report", baseline=self.baseline, images=self.images)
        report.run(console)
        return 0


def is_finished(path: Path, planned: PlannedRun) -> bool:
    """Tell whether a run's file has all its evaluations.

    Raises:
        RunFileError: it is damaged, or belongs to another run.
    """
    if not path.exists():
        return False
    with RunReader(path) as reader:
        if reader.config != planned.config:
            raise RunFileError(
                f"{path} has another configuration than the campaign; move it away or choose another --out"
            )
        last = reader.last_generation()
        return last is not None and reader.n_evaluations() >= reader.config.evaluations


def _work(waiting: Sequence[PlannedRun], command: Campaign, console: Console) -> dict[str, str]:
    """Run all, several at a time; return why some could not be finished."""
    queue = [(run, 1) for run in waiting]
    active: dict[subprocess.Popen[bytes], tuple[PlannedRun, int]] = {}
    failed: dict[str, str] = {}
    n_done = 0
    try:
        while queue or active:
            while queue and len(active) < command.jobs:
                run, attempt = queue.pop(0)
                active[_start(run, command)] = run, attempt
                console.print(f"{run.file} {'begins' if attempt == 1 else 'continues'}", markup=False)
            time.sleep(POLL)
            for process in [p for p in active if p.poll() is not None]:
                run, attempt = active.pop(process)
                if process.returncode == 0 and is_finished(command.out / run.file, run):
                    n_done += 1
                    console.print(f"{run.file} is finished ({n_done} of {len(waiting)})", markup=False)
                elif attempt < ATTEMPTS:
                    queue.append((run, attempt + 1))
                else:
                    failed[run.file] = _last_line(_log(command.out / run.file))
    finally:
        for process in active:
            process.send_signal(signal.SIGTERM)  # it saves and stops
        for process in active:
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(60)
    return failed


def _start(run: PlannedRun, command: Campaign) -> subprocess.Popen[bytes]:
    path = command.out / run.file
    job = {
        "path": str(path),
        "config": to_json(run.config),
        "flags": dataclasses.asdict(command.computing) | {"slurm": _text(command.computing.slurm)},
    }
    with open(_log(path), "ab") as log:
        process = subprocess.Popen(
            module_line("app.cli.campaign"), stdin=subprocess.PIPE, stdout=log, stderr=log
        )
    assert process.stdin is not None
    with contextlib.suppress(BrokenPipeError), process.stdin as pipe:
        pipe.write(json.dumps(job).encode())
    return process


def _text(path: Path | None) -> str | None:
    return None if path is None else str(path)


def _run_one(job: dict[str, Any]) -> int:
    """Start or resume one run in a separate process; return the exit status."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    flags = job["flags"] | {"slurm": None if job["flags"]["slurm"] is None else Path(job["flags"]["slurm"])}
    path, console = Path(job["path"]), Console(stderr=True, highlight=False, soft_wrap=True)
    try:
        config = None if path.exists() else from_json(job["config"])
        compute_run(path, config, WorkerFlags(**flags), console)
    except TensAtlasError as e:
        console.print(f"tensatlas: {e}", markup=False)
        return 2
    except KeyboardInterrupt:
        return 130
    return 0


def _log(path: Path) -> Path:
    return path.with_suffix(".log")


def _last_line(log: Path) -> str:
    try:
        lines = log.read_text(encoding="utf-8", errors="replace").strip().splitlines()
    except OSError:
        lines = []
    return f"{lines[-1].removeprefix('tensatlas: ') if lines else 'it ended at once'} (see {log})"


if __name__ == "__main__":
    sys.exit(_run_one(json.load(sys.stdin)))
