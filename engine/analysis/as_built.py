"""How a robot does as it would be built: the design, robots of the design, and one difference at a time.

Every evaluation here has noise that the run never used, and the head that the run found: a built robot does
not look for its head again. What differs is given as physics; ``engine.fabrication.as_built`` makes them.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Any, Final

import numpy as np

from engine.analysis.robustness import deviation_of, load_robust_of, mean_of
from engine.analysis.verify import with_noise
from engine.config import RunConfig, task_of
from engine.errors import InvalidData
from engine.search.archive import Cell
from engine.simulation.evaluation import Evaluation, LocalEvaluator
from engine.simulation.physics import Physics
from engine.storage.reader import RunReader

MAX_SAMPLES: Final = 1000
WORTH: Final = 0.5
"""Part of its evolved f_s that a robot must keep to be worth building."""
KEEPS: Final = 0.7
"""Part of its evolved f_s that a robot should keep; of one that does not, it is said what costs it."""
NAMED: Final = 3
"""How many differences are named that a robot loses by."""
TOLD: Final = 0.001
"""Least that a difference costs, in m, for it to be named."""
SPREAD: Final = "spread"
"""Key of how robots of one design differ, among what costs a robot."""
_SPREAD: Final = (
    "how robots of the design differ",
    "evolve with --as-built --spread, whose robots stand it; pull test, tilting test and the limiters'"
    " weight narrow it",
)
WORST: Final = 0.1
"""Part of the built robots that do worse than ``AsBuilt.worst``."""


@dataclasses.dataclass(frozen=True, slots=True)
class Scores:
    """Evaluations of one robot, or of several robots of one design.

    Attributes:
        f_s: of each evaluation how much closer to its targets the robot ends, in m; None if it failed.
        distances: (targets,) mean final distances in m of those that did not fail; None if all failed.
        trajectory: (targets, seconds, 2) their mean path, in m; None if all failed.
    """

    f_s: tuple[float | None, ...]
    distances: np.ndarray | None
    trajectory: np.ndarray | None

    @classmethod
    def of(cls, evaluations: Sequence[Evaluation], target_distance: float) -> Scores:
        """Return the scores of evaluations of a task whose targets are so far away, in m."""
        worked = [e for e in evaluations if e.fitness is not None]
        return cls(
            tuple(None if e.fitness is None else target_distance - e.fitness for e in evaluations),
            np.mean([e.distances.mean(axis=1) for e in worked], axis=0) if worked else None,
            np.mean([e.trajectory for e in worked], axis=0) if worked else None,
        )

    @property
    def known(self) -> np.ndarray:
        """(N,) f_s in m of the evaluations that did not fail."""
        return np.array([f for f in self.f_s if f is not None])

    @property
    def n_failed(self) -> int:
        """How many failed."""
        return sum(f is None for f in self.f_s)

    @property
    def mean(self) -> float | None:
        """Mean f_s in m; None if all failed."""
        return mean_of(self.known)

    @property
    def deviation(self) -> float | None:
        """Standard deviation of f_s in m; None for fewer than two."""
        return deviation_of(self.known)


@dataclasses.dataclass(frozen=True, slots=True)
class AsBuilt:
    """A robot as evolved and as it would be built.

    Attributes:
        evolved: with the run's physics.
        nominal: the design.
        robots: of the design, one evaluation each.
        alone: by its key, with one difference alone.
        pairs: the design by the friction of its feet, forward and backward; empty without feet.
    """

    evolved: Scores
    nominal: Scores
    robots: Scores
    alone: Mapping[str, Scores]
    pairs: Mapping[tuple[float, float], Scores] = dataclasses.field(default_factory=dict)

    @property
    def worst(self) -> float | None:
        """f_s in m below which the worst tenth of the robots are; None if all failed."""
        return float(np.quantile(self.robots.known, WORST)) if len(self.robots.known) else None

    @property
    def kept(self) -> float | None:
        """Part of the evolved f_s that the robots keep on average; None if there was none to keep."""
        before, after = self.evolved.mean, self.robots.mean
        if before is None or before <= 0.0:
            return None
        return 0.0 if after is None else after / before

    @property
    def worth_building(self) -> bool:
        """Whether the robots keep more than half of it."""
        return self.kept is not None and self.kept > WORTH

    @property
    def costs(self) -> list[tuple[str, float]]:
        """By key what each difference alone costs in m of f_s, the costliest first.

        One with which every evaluation fails costs all there is.
        """
        before = self.evolved.mean
        if before is None:
            return []
        found = [(key, before - (0.0 if s.mean is None else s.mean)) for key, s in self.alone.items()]
        return sorted(found, key=lambda cost: -cost[1])

    @property
    def all_costs(self) -> list[tuple[str, float]]:
        """``costs``, and under ``SPREAD`` by how much robots of the design do worse than the design."""
        found = self.costs
        if self.nominal.mean is not None and self.robots.mean is not None:
            found.append((SPREAD, self.nominal.mean - self.robots.mean))
        return sorted(found, key=lambda cost: -cost[1])

    def sentences(self, names: Mapping[str, tuple[str, str]]) -> list[str]:
        """Return what this comes to, for people.

        Args:
            names: of every difference by its key its name and what would make it smaller.
        """
        if self.evolved.mean is None or self.robots.mean is None:
            return ["Not worth building: its simulations fail."]
        spread = "" if self.robots.deviation is None else f" ± {100 * self.robots.deviation:.1f}"
        evolved, built = 100 * self.evolved.mean, 100 * self.robots.mean
        found = [f"Evolved {evolved:.1f} cm, as built {built:.1f}{spread} cm."]
        names = {**names, SPREAD: _SPREAD}
        costly = [(key, cost) for key, cost in self.all_costs if cost >= TOLD]
        if self.kept is not None and self.kept >= KEEPS:
            if costly:
                key, cost = costly[0]
                found.append(f"Costs most: {names[key][0]} ({100 * cost:.1f} cm).")
            return found
        lost = "more than all" if self.kept is None or self.kept < 0 else f"{100 * (1 - self.kept):.0f} %"
        say = "It loses" if self.worth_building else "Not worth building: it loses"
        found.append(f"{say} {lost} of that.")
        found += [f"{100 * cost:.1f} cm by {names[key][0]}: {names[key][1]}." for key, cost in costly[:NAMED]]
        return found


def simulate_as_built(
    config: RunConfig,
    evaluation: Evaluation,
    *,
    nominal: Physics,
    robots: Sequence[Physics],
    alone: Mapping[str, Physics],
    n_seeds: int,
    pairs: Mapping[tuple[float, float], Physics] = MappingProxyType({}),
    n_threads: int = 1,
    observer: Callable[[int, int], None] = lambda _done, _all: None,
) -> AsBuilt:
    """Simulate a robot as it would be built.

    Args:
        config: of the run that the evaluation belongs to.
        evaluation: of the robot.
        nominal: physics of the design.
        robots: physics of robots of the design.
        alone: physics with one difference each, by its key.
        n_seeds: evaluations under fresh noise but for the robots, which have one each.
        pairs: physics of the design by the friction of its feet.
        n_threads: threads that simulate; the result does not depend on it.
        observer: told how many evaluations are done, and of how many.

    Raises:
        InvalidData: there are too many robots, or none.
    """
    check_samples(len(robots))
    total = n_seeds * (2 + len(alone) + len(pairs)) + len(robots)
    done = 0
    task = task_of(config)

    def evaluated(physics: Physics, seeds: Sequence[int]) -> list[Evaluation]:
        nonlocal done
        evaluator = LocalEvaluator(
            task=task,
            physics=physics,
            trials=config.trials,
            run_seed=config.seed,
            n_threads=n_threads,
            head_is_end=evaluation.head_is_end,
        )
        solutions = [with_noise(evaluation.solution, k) for k in seeds]
        found = {e.solution.number: e for group in evaluator.evaluate(solutions) for e in group}
        done += len(seeds)
        observer(done, total)
        return [found[s.number] for s in solutions]

    def scores(evaluations: Sequence[Evaluation]) -> Scores:
        return Scores.of(evaluations, task.target_distance)

    seeds = range(1, n_seeds + 1)
    return AsBuilt(
        evolved=scores(evaluated(config.physics, seeds)),
        nominal=scores(evaluated(nominal, seeds)),
        robots=scores([evaluated(robot, [k])[0] for k, robot in enumerate(robots, start=1)]),
        alone={key: scores(evaluated(physics, seeds)) for key, physics in alone.items()},
        pairs={pair: scores(evaluated(physics, seeds)) for pair, physics in pairs.items()},
    )


def best_elites(reader: RunReader, archive: str, n: int) -> list[tuple[Cell, Evaluation]]:
    """Return the n best elites of a map with their cells: by f_s under fresh noise if that is known.

    Args:
        reader: of the run.
        archive: name of the map.
        n: how many; fewer if the map holds fewer.

    Raises:
        InvalidData: fewer than one is asked for, or results beside the run are of another run.
        RunFileError: there is no such archive, or the file is damaged.
    """
    if n < 1:
        raise InvalidData(f"best must be at least 1, not {n}")
    held = reader.contents(archive, reader.finished_generation(archive).number)
    known = load_robust_of(reader)

    def fitness(evaluation: Evaluation) -> float:
        number = evaluation.solution.number
        again = None if known is None else known.mean(number)
        recorded = math.inf if evaluation.fitness is None else evaluation.fitness
        return recorded if again is None else again

    with reader.guard():
        best = sorted(held.items(), key=lambda item: (fitness(item[1]), item[0]))[:n]
    return [(cell, reader.evaluation(e.solution.number)) for cell, e in best]


def check_samples(n: int) -> None:
    """Make sure that so many robots can be simulated.

    Raises:
        InvalidData: there are too many, or none.
    """
    if not 1 <= n <= MAX_SAMPLES:
        raise InvalidData(f"samples must be from 1 to {MAX_SAMPLES}, not {n}")


def as_built_facts(found: AsBuilt) -> dict[str, Any]:
    """Return the results as JSON-ready values; f_s in cm."""

    def facts(scores: Scores) -> dict[str, Any]:
        return {
            "f_s_cm": [None if f is None else 100.0 * f for f in scores.f_s],
            "f_s_mean_cm": None if scores.mean is None else 100.0 * scores.mean,
            "f_s_deviation_cm": None if scores.deviation is None else 100.0 * scores.deviation,
        }

    return {
        "evolved": facts(found.evolved),
        "nominal": facts(found.nominal),
        "robots": facts(found.robots),
        "worst_tenth_cm": None if found.worst is None else 100.0 * found.worst,
        "kept": found.kept,
        "worth_building": found.worth_building,
        "alone": {key: facts(scores) for key, scores in found.alone.items()},
        "costs_cm": {key: 100.0 * cost for key, cost in found.costs},
        "spread_costs_cm": {key: 100.0 * cost for key, cost in found.all_costs}.get(SPREAD),
        "feet": [
            {"forward": forward, "backward": backward, **facts(scores)}
            for (forward, backward), scores in found.pairs.items()
        ],
    }
