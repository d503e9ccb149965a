"""What a worker receives, solutions with all that decides their evaluation, and what it returns.

A job is small and pure: whichever worker computes it, and however often, the outcome is the same.
"""

from __future__ import annotations

import dataclasses
import hashlib
import platform
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np

from engine.config import RunConfig, task_of
from engine.errors import ClusterError, TaskError, printable
from engine.simulation.evaluation import Evaluation, FailedTrial, LocalEvaluator, Solution
from engine.simulation.provenance import Origin, body_fingerprint, this_computer
from engine.tasks import BUILT_IN, get_task, load_task, task_version


@dataclasses.dataclass(frozen=True, slots=True)
class World:
    """All that decides an evaluation besides the solution.

    Attributes:
        config: of the run.
        body: fingerprint of how robots are modelled.
        task_source: the Python file that defines the run's task, None for a built-in one.
    """

    config: RunConfig
    body: str
    task_source: bytes | None = None


@dataclasses.dataclass(frozen=True, slots=True)
class Result:
    """What a job found of one of its solutions.

    Attributes:
        evaluation: of the solution.
        failed: its first simulation that failed, or None.
        origin: what computed it, and its share of the job's CPU seconds.
    """

    evaluation: Evaluation
    failed: FailedTrial | None
    origin: Origin


def world_of(config: RunConfig) -> World:
    """Return the world of a run, with the file of a user's task.

    Raises:
        TaskError: that file cannot be read any more, or has changed since it was loaded.
    """
    if config.task in BUILT_IN:
        return World(config, body_fingerprint())
    file = Path(get_task(config.task).file)
    try:
        source = file.read_bytes()
    except OSError as e:
        raise TaskError(f"{file} cannot be read: {e.strerror or e}") from None
    if task_version(config.task) != {f"task {config.task}": source_version(source)}:
        raise TaskError(f"{file} has changed since it was loaded; start again")
    return World(config, body_fingerprint(), source)


def source_version(source: bytes) -> str:
    """Return what ``tasks.task_version`` says of a task file with this content."""
    return f"sha256:{hashlib.sha256(source).hexdigest()[:16]}"


def compute(world: World, solutions: Sequence[Solution]) -> list[Result]:
    """Evaluate solutions on one thread of this process.

    Raises:
        ClusterError: this process has a version of TensAtlas that models robots differently.
        TaskError: a user's task fails.
    """
    started = time.process_time()
    if world.body != body_fingerprint():
        raise ClusterError(
            f"a worker on {platform.node()} has another version of TensAtlas, whose robots differ; install"
            " the same there"
        )
    _load(world)
    failures: dict[int, FailedTrial] = {}

    def keep(failed: FailedTrial) -> str:
        failures[failed.solution.number] = failed
        return ""  # the process that submitted the job stores it

    config = world.config
    evaluator = LocalEvaluator(
        task=task_of(config),
        physics=config.physics,
        trials=config.trials,
        run_seed=config.seed,
        keep_failure=keep,
    )
    evaluations = [e for group in evaluator.evaluate(solutions) for e in group]
    origin = Origin(this_computer(), (time.process_time() - started) / len(evaluations))
    return [Result(e, failures.get(e.solution.number), origin) for e in evaluations]


def unfinished(config: RunConfig, solution: Solution, reason: str) -> Evaluation:
    """Return the evaluation of a solution that no worker survives."""
    task, trials = get_task(config.task), config.trials
    return Evaluation(
        solution=solution,
        fitness=None,
        distances=np.full((task.n_targets, trials.repeats), np.nan),
        trajectory=np.zeros((task.n_targets, int(trials.trial_time), 2), np.float32),
        head_is_end=False,
        failure=printable(reason),
    )


_TASK_FOLDER: Final = "tensatlas-task-"


def _load(world: World) -> None:
    """Load the task of a world unless this process has it already."""
    if world.task_source is None:
        return
    name = world.config.task
    if task_version(name) == {f"task {name}": source_version(world.task_source)}:
        return
    with tempfile.TemporaryDirectory(prefix=_TASK_FOLDER) as folder:
        file = Path(folder) / "task.py"
        file.write_bytes(world.task_source)
        load_task(file)
