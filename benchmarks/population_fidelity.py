"""How far and along what paths robots go, ours against the published ones, as populations."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Sequence
from typing import Final

import numpy as np
from scipy.stats import spearmanr

from benchmarks import reference
from benchmarks.reference import ReferenceRobot
from benchmarks.rows import Row
from engine.simulation.physics import Physics
from engine.simulation.trials import Trial, TrialConfig, start_trials
from engine.tasks import GOAL_REACHING, TRIAL_TIME, target_offsets

CLASSES: Final = {"soft (0.1-0.3)": (1, 3), "medium (0.4-0.7)": (4, 7), "stiff (0.8-1.0)": (8, 10)}
RUNS: Final = (0, 1, 2, 3)
"""Which of the published runs are replayed: two targets, each with two noise seeds."""
NET: Final = "net displacement"
PATH: Final = "path at 1 Hz"
RANK: Final = 0.6
"""Least rank correlation with the simulator with two friction directions; 0.7 is the aim."""


@dataclasses.dataclass(frozen=True, slots=True)
class Population:
    """What many robots did, R runs each.

    Attributes:
        net: (robots, R) distance from the head's first to its last position, in m.
        path: (robots, R) length of the head's path at 1 Hz, in m.
        heights: (robots, R) lists of (modules,) heights at the end, in m; see ``height_difference``.
    """

    net: np.ndarray
    path: np.ndarray
    heights: list[np.ndarray]

    @classmethod
    def of(cls, trajectories: Sequence[np.ndarray], heights: list[np.ndarray]) -> Population:
        """Measure (R, seconds + 1, 2) trajectories, one array per robot."""
        steps = [np.diff(t, axis=1) for t in trajectories]
        return cls(
            net=np.array([np.linalg.norm(t[:, -1] - t[:, 0], axis=-1) for t in trajectories]),
            path=np.array([np.linalg.norm(s, axis=-1).sum(axis=-1) for s in steps]),
            heights=heights,
        )


def published(robots: Sequence[ReferenceRobot], runs: Sequence[int] = RUNS) -> Population:
    """Return what the published simulator measured."""
    chosen = list(runs)
    return Population.of([r.trajectory[chosen] for r in robots], [r.heights[chosen] for r in robots])


def two_directions(robots: Sequence[ReferenceRobot]) -> Population:
    """Return what the simulator with two friction directions measured: two targets, one noise seed each."""
    net, path = (np.array(x) for x in zip(*map(reference.two_directions, robots), strict=True))
    return Population(net, path, [])


def replay(
    robots: Sequence[ReferenceRobot], physics: Physics, *, runs: Sequence[int] = RUNS, n_threads: int = 1
) -> Population:
    """Simulate the robots with their networks and targets; every run has noise of its own."""
    results: dict[str, tuple[np.ndarray, np.ndarray]] = {}
    by_size = sorted(robots, key=lambda r: r.morphology.n_modules)
    offsets = target_offsets(GOAL_REACHING, robots[0].bearings[list(runs)].tolist())
    for _, same_size in itertools.groupby(by_size, key=lambda r: r.morphology.n_modules):
        group = list(same_size)
        loop = start_trials(
            [r.morphology for r in group],
            [r.controller for r in group],
            [Trial(run, 0, offset, ()) for run, offset in zip(runs, offsets, strict=True)],
            numbers=range(len(group)),
            run_seed=0,
            task=GOAL_REACHING,
            physics=physics,
            times=TrialConfig(),
            heads=[r.head for r in group],
            n_threads=n_threads,
        ).loop
        trials = loop.run(TRIAL_TIME)
        heights = loop.sim.qpos.reshape(*loop.sim.shape, loop.sim.n_modules, -1, 7)[..., 2].mean(axis=-1)
        for robot, result, height in zip(group, trials, heights, strict=True):
            results[robot.name] = (result.trajectory, height)
    return Population.of([results[r.name][0] for r in robots], [results[r.name][1] for r in robots])


def against_two_directions(robots: Sequence[ReferenceRobot], ours: Population) -> list[Row]:
    """Compare with the published simulator where contacts have two friction directions."""
    theirs = two_directions(robots)
    table = []
    for what, a, b in _both(ours, theirs):
        table += _quartiles(what, a, b)
        table.append(_ordering(what, robots, a, b))
        rank = float(spearmanr(a, b).statistic)
        table.append(Row(f"{what}, rank correlation", f"{rank:.2f}", f"at least {RANK}", rank >= RANK))
    return table


def against_published(robots: Sequence[ReferenceRobot], ours: Population, theirs: Population) -> list[Row]:
    """Compare with the simulator as published, whose net displacements are an artefact and not judged."""
    table = []
    for what, a, b in _both(ours, theirs):
        rank = Row(f"{what}, rank correlation", f"{float(spearmanr(a, b).statistic):.2f}", "")
        if what == NET:
            table.append(Row(f"{what}, median", f"{np.median(a):.1f} cm", f"published {np.median(b):.1f}"))
        else:
            table += [*_quartiles(what, a, b), _ordering(what, robots, a, b)]
        table.append(rank)
    spread = [100 * float(np.median(np.abs(p.net[:, 0] - p.net[:, 1]))) for p in (ours, theirs)]
    table.append(Row("two noise seeds differ by", f"{spread[0]:.2f} cm", f"{spread[1]:.2f} published"))
    difference = 1000 * np.array(height_difference(ours, theirs))
    table.append(
        Row(
            "heights of the modules at the end",
            f"median difference {np.median(difference):.1f} mm, {np.mean(difference < 1.5):.0%} of the robots"
            " below 1.5 mm",
            "",
        )
    )
    return table


def _both(ours: Population, theirs: Population) -> list[tuple[str, np.ndarray, np.ndarray]]:
    """Return net displacements and paths of two populations, one number per robot, in cm."""
    return [
        (what, 100 * np.median(a, axis=1), 100 * np.median(b, axis=1))
        for what, a, b in ((NET, ours.net, theirs.net), (PATH, ours.path, theirs.path))
    ]


def _quartiles(what: str, a: np.ndarray, b: np.ndarray) -> list[Row]:
    table = []
    for name, q, limit in (("lower quartile", 25, 0.4), ("median", 50, 0.25), ("upper quartile", 75, 0.4)):
        x, y = np.percentile(a, q), np.percentile(b, q)
        wanted = f"{y:.1f} +- {limit:.0%}"
        table.append(Row(f"{what}, {name}", f"{x:.1f} cm", wanted, bool(abs(x / y - 1) <= limit)))
    return table


def height_difference(ours: Population, theirs: Population) -> list[float]:
    """Return per robot the mean difference of its modules' heights at the end of the first run, in m."""
    pairs = zip(ours.heights, theirs.heights, strict=True)
    return [float(np.abs(a[0] - b[0]).mean()) for a, b in pairs]


def convergence_rows(ours: Population, finer: Population, factor: int) -> list[Row]:
    """Compare the population with itself at a time step ``factor`` times finer, with the same noise."""
    table = []
    for what, coarse, fine in ((NET, ours.net, finer.net), (PATH, ours.path, finer.path)):
        where = f"{what} at 1/{factor} of the time step"
        medians = [100 * float(np.median(x)) for x in (coarse, fine)]
        seeds = [100 * float(np.median(coarse[:, k::2])) for k in (0, 1)]
        spread = abs(seeds[1] - seeds[0])
        table.append(
            Row(
                f"median {where}",
                f"{medians[0]:.2f} to {medians[1]:.2f} cm",
                f"moves less than between two noise seeds, {spread:.2f}",
                abs(medians[1] - medians[0]) <= spread,
            )
        )
        a, b = (100 * np.median(x, axis=1) for x in (coarse, fine))
        gain, error = float((a - b).mean()), float((a - b).std(ddof=1) / np.sqrt(len(a)))
        table.append(
            Row(
                f"what robots gain by the coarser step, {where}",
                f"{gain:.2f} cm, standard error {error:.2f}",
                "within two standard errors of nothing",
                abs(gain) <= 2.0 * error,
            )
        )
        table.append(Row(f"rank correlation, {where}", f"{float(spearmanr(a, b).statistic):.2f}", ""))
    return table


def _ordering(what: str, robots: Sequence[ReferenceRobot], a: np.ndarray, b: np.ndarray) -> Row:
    level = np.array([r.morphology.stiffness_level for r in robots])
    members = {c: (level >= low) & (level <= high) for c, (low, high) in CLASSES.items()}
    members = {c: m for c, m in members.items() if m.any()}
    ours, theirs = ({c: float(np.median(x[m])) for c, m in members.items()} for x in (a, b))
    same = sorted(ours, key=ours.__getitem__) == sorted(theirs, key=theirs.__getitem__)
    return Row(
        f"{what}, medians of the stiffness classes",
        ", ".join(f"{c.split()[0]} {v:.1f}" for c, v in ours.items()),
        "ordered as " + ", ".join(f"{c.split()[0]} {v:.1f}" for c, v in theirs.items()),
        same,
    )
