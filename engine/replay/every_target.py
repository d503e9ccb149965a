"""Many robots' trials towards every target at once: what a page of a whole archive plays.

Robots of one size share vectors of the kernel, so that a trial costs a fraction of a ``Replay``'s. Nobody
watches meanwhile: only every so-manieth pose is kept.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator, Sequence
from typing import Final

import numpy as np

from engine.body.module import RODS
from engine.config import RunConfig, task_of
from engine.simulation.batch import SPAN
from engine.simulation.evaluation import MOST_TOGETHER, Evaluation, in_groups
from engine.simulation.physics import check_timestep
from engine.simulation.rollout import Head
from engine.simulation.trials import start_trials, trials_of
from engine.tasks.walls import Wall

N_RODS: Final = len(RODS)
RELEASED: Final = 1.0
"""Commanded length of a cable that does not pull, in m: robots settle with their servos off."""


@dataclasses.dataclass(frozen=True, slots=True)
class RecordedTrial:
    """A trial from the moment at which the target is placed.

    Attributes:
        poses: (frames, modules, 6, 7) float32 positions (m) and quaternions (w, x, y, z) of the rods; the
            first when the target is placed. One that fails ends before it does.
        lengths: (frames, modules, 5) float32 commanded lengths of the internal cables, in m.
        target: (2,) in the world, in m.
        walls: in the world.
        score: how the task scores its end, in m; None if it failed.
        failure: why it failed, or None.
    """

    poses: np.ndarray
    lengths: np.ndarray
    target: np.ndarray
    walls: tuple[Wall, ...]
    score: float | None
    failure: str | None


def replay_every_target(
    config: RunConfig,
    evaluations: Sequence[Evaluation],
    *,
    updates_per_frame: int,
    n_threads: int = 1,
    progress: Callable[[float], None] = lambda _seconds: None,
) -> Iterator[tuple[Evaluation, list[RecordedTrial]]]:
    """Simulate robots again, each towards every target, exactly as they were evaluated under the first noise.

    Args:
        config: of the run that they belong to.
        evaluations: the robots.
        updates_per_frame: control updates between two frames.
        n_threads: threads that simulate.
        progress: called from time to time with how many seconds of robots' time have been simulated since;
            what it raises ends the work.

    Yields:
        A robot and its trials in the task's order; large robots first.

    Raises:
        InvalidData: today's robots do not survive the run's physics.
        TaskError: a user's task returns invalid values.
    """
    check_timestep(config.physics)
    known = {e.solution.number: e for e in evaluations}
    for group in in_groups([known[n].solution for n in sorted(known)], MOST_TOGETHER):
        own = [known[solution.number] for solution in group]
        yield from _replay(config, own, updates_per_frame, n_threads, progress)


def _replay(
    config: RunConfig,
    evaluations: Sequence[Evaluation],
    updates_per_frame: int,
    n_threads: int,
    progress: Callable[[float], None],
) -> Iterator[tuple[Evaluation, list[RecordedTrial]]]:
    """Simulate robots of one size."""
    task, solutions = task_of(config), [e.solution for e in evaluations]
    bodies = [s.morphology for s in solutions]
    loop = start_trials(
        bodies,
        [s.controller for s in solutions],
        # of every target its first noise
        trials_of(task, bodies[0].n_modules, config.trials.repeats)[:: config.trials.repeats],
        numbers=[s.number for s in solutions],
        run_seed=config.seed,
        task=task,
        physics=config.physics,
        times=config.trials,
        heads=[Head.of(e.solution.morphology, e.head_is_end) for e in evaluations],
        n_threads=n_threads,
    ).loop
    period, start = config.physics.control_period, loop.sim.n_updates
    poses = [loop.sim.qpos[None].astype(np.float32)]
    lengths = [np.full((1, *loop.sim.commanded.shape), RELEASED, np.float32)]
    left = round(config.trials.trial_time / period)
    while left > 0:
        span = loop.advance(min(SPAN, left))
        left -= len(span.updates)
        kept = [k for k, n in enumerate(span.updates) if (n - start) % updates_per_frame == 0]
        poses.append(span.qpos[kept].astype(np.float32))
        lengths.append(span.commanded[kept].astype(np.float32))
        progress(len(evaluations) * task.n_targets * len(span.updates) * period)
    moved, told = np.concatenate(poses), np.concatenate(lengths)
    scores = loop.scores()
    for r, evaluation in enumerate(evaluations):
        trials = []
        for k in range(task.n_targets):
            failure = loop.sim.failures[r * task.n_targets + k]
            # frames before the update after which it was stopped
            n = (
                len(moved)
                if failure is None
                else max(-(-(failure.n_updates - start) // updates_per_frame), 0)
            )
            trials.append(
                RecordedTrial(
                    poses=moved[:n, r, k].reshape(-1, *told.shape[3:4], N_RODS, 7),
                    lengths=told[:n, r, k],
                    target=np.asarray(loop.targets[r, k], dtype=float),
                    walls=loop.walls[r][k],
                    score=None if failure is not None else float(scores[r, k]),
                    failure=None if failure is None else str(failure),
                )
            )
        yield evaluation, trials
