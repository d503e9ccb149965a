"""Runs killed at random moments, again and again: each must end like one that nobody disturbed.

``python -m benchmarks.faults`` kills 20 times; exits with 1 if a file cannot be read after a kill or a run
ends differently.
"""

from __future__ import annotations

import dataclasses
import os
import random
import signal
import sys
import tempfile
import time
import traceback
from collections.abc import Callable
from pathlib import Path

import tyro
from rich.console import Console

from benchmarks.rows import Row, show
from engine.config import RunConfig, preset, replaced
from engine.runs import evolve as run
from engine.simulation.trials import TrialConfig
from engine.storage.check import check_run
from engine.storage.lock import is_being_written
from engine.storage.reader import RunReader

SHORT = replaced(
    preset("smoke"),
    evaluations=48,
    initial=18,
    trials=TrialConfig(repeats=1, settle_time=0.2, open_loop_time=0.2, trial_time=1.0),
)
"""A run of real simulations that takes seconds."""


@dataclasses.dataclass(frozen=True)
class Arguments:
    """Kill an evolution at random moments and go on with it."""

    kills: int = 20
    """How often to kill."""
    workers: int = 2
    """Threads that simulate."""
    seed: int = 0
    """Seed of the moments."""


@dataclasses.dataclass
class Outcome:
    """What came of it.

    Attributes:
        kills: how many evaluations and closed generations were saved when each kill struck; None where
            there was no file yet.
        problems: what was wrong with a file after a kill.
        n_runs: runs that were worked through, however often they were interrupted.
        n_identical: of them, those that ended like the undisturbed one.
        seconds: that the undisturbed run took.
    """

    kills: list[tuple[int, int] | None] = dataclasses.field(default_factory=list)
    problems: list[str] = dataclasses.field(default_factory=list)
    n_runs: int = 0
    n_identical: int = 0
    seconds: float = 0.0


def kill_at_random(
    config: RunConfig, folder: Path, *, kills: int, workers: int = 1, seed: int = 0
) -> Outcome:
    """Work through runs in processes that are killed at random moments.

    The process that calls this is forked, so it must have no threads.

    Args:
        config: of the runs.
        folder: to work in.
        kills: how often to kill.
        workers: threads that simulate.
        seed: of the moments.
    """
    rng, outcome = random.Random(seed), Outcome()
    undisturbed = folder / "undisturbed.tsmr"
    started = time.monotonic()
    _wait(_fork(lambda: run.evolve(undisturbed, config, n_threads=workers)))
    outcome.seconds = time.monotonic() - started
    wanted = _hash(undisturbed)
    while len(outcome.kills) < kills:
        path = folder / f"killed-{outcome.n_runs}.tsmr"
        while True:
            pid = _fork(lambda path=path: _go_on(path, config, workers))
            if len(outcome.kills) < kills:
                # so that about six kills strike each run
                time.sleep(rng.uniform(0.0, outcome.seconds / 3.0))
                os.kill(pid, signal.SIGKILL)
            if _wait(pid):
                break
            outcome.kills.append(_saved(path, outcome.problems))
        outcome.n_runs += 1
        outcome.n_identical += _hash(path) == wanted
    return outcome


def _go_on(path: Path, config: RunConfig, workers: int) -> None:
    if path.exists():
        run.resume(path, n_threads=workers)
    else:
        run.evolve(path, config, n_threads=workers)


def _saved(path: Path, problems: list[str]) -> tuple[int, int] | None:
    if is_being_written(path):
        problems.append(f"{path} counts as being written")
    if not path.exists():
        return None
    problems += [f.text for f in check_run(path) if f.verdict == "problem"]
    with RunReader(path) as reader:
        return reader.n_evaluations(), len(reader.generations())


def _hash(path: Path) -> str:
    with RunReader(path) as reader:
        return reader.canonical_hash()


def _fork(work: Callable[[], None]) -> int:
    sys.stdout.flush()
    sys.stderr.flush()
    pid = os.fork()
    if pid:
        return pid
    try:
        work()
    except BaseException:
        traceback.print_exc()
        os._exit(1)
    os._exit(0)


def _wait(pid: int) -> bool:
    """Wait for a process; tell whether it ended by itself rather than by our hand.

    Raises:
        RuntimeError: it failed.
    """
    _, status = os.waitpid(pid, 0)
    if os.WIFSIGNALED(status) and os.WTERMSIG(status) == signal.SIGKILL:
        return False
    if os.waitstatus_to_exitcode(status) != 0:
        raise RuntimeError("a run failed, see above")
    return True


def main(arguments: Arguments) -> int:
    """Kill, compare, print; return the exit status."""
    console = Console()
    with tempfile.TemporaryDirectory() as folder:
        found = kill_at_random(
            SHORT, Path(folder), kills=arguments.kills, workers=arguments.workers, seed=arguments.seed
        )
    saved = [k for k in found.kills if k is not None]
    rows = [
        Row("kills", str(len(found.kills)), str(arguments.kills), len(found.kills) == arguments.kills),
        Row("of them before there was a file", str(len(found.kills) - len(saved)), ""),
        Row("evaluations saved at the kills", " ".join(str(n) for n, _ in saved), ""),
        Row("files with a problem after a kill", str(len(found.problems)), "0", not found.problems),
        Row(
            "runs that end like the undisturbed one",
            str(found.n_identical),
            str(found.n_runs),
            found.n_identical == found.n_runs,
        ),
    ]
    show(f"{SHORT.evaluations} evaluations, {found.seconds:.1f} s undisturbed", rows, console)
    for problem in found.problems:
        console.print(problem, markup=False)
    return int(any(r.passed is False for r in rows))


if __name__ == "__main__":
    sys.exit(main(tyro.cli(Arguments)))
