"""How many of a map's cells hold a robot that is good for something, and what that is for a task.

The QD score of the paper adds up f_s, which is negative for a robot that ends farther away than it began. So
filling a cell can lower it. Beside it stands the score with pyribs' offset, which no cell can lower.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from typing import Final

import numpy as np

from engine.search.archive import Cell
from engine.storage.reader import RunReader
from engine.storage.rows import Generation
from engine.tasks import Task
from engine.tasks.goal_reaching import GOAL_REACHING
from engine.tasks.squeezing import SQUEEZING, entrance
from engine.tasks.task import fitness, target_offsets

_STEPS: Final = 60
"""Of a search that makes an interval smaller by 0.618 each: to a billionth of a billionth."""


@functools.lru_cache(maxsize=64)
def unsteered_limit(task: Task) -> float:
    """Return the largest f_s in m of a robot that takes the same way whatever the target.

    Wherever it ends, that is one place for all targets. The fitness is a convex function of the place, so
    that it falls towards its least value along each axis.
    """
    targets = target_offsets(task)
    reach = task.target_distance

    def at(x: float, y: float) -> float:
        return fitness(np.linalg.norm(targets - [x, y], axis=1)[:, None])

    def along_y(x: float) -> float:
        return _least(lambda y: at(x, y), -reach, reach)

    return task.target_distance - _least(along_y, -reach, reach)


def _least(of: Callable[[float], float], low: float, high: float) -> float:
    """Return the least value of a convex function over an interval (golden section)."""
    ratio = (math.sqrt(5.0) - 1.0) / 2.0
    a, b = high - ratio * (high - low), low + ratio * (high - low)
    of_a, of_b = of(a), of(b)
    for _ in range(_STEPS):
        if of_a < of_b:
            high, b, of_b = b, a, of_a
            a = high - ratio * (high - low)
            of_a = of(a)
        else:
            low, a, of_a = a, b, of_b
            b = low + ratio * (high - low)
            of_b = of(b)
    return float(min(of_a, of_b))


def aperture(task: Task) -> float | None:
    """Return the f_s in m of a head that stands in the entrance of squeezing's aperture.

    The paper draws a line there, at 15.17 cm. Other tasks have none.
    """
    if task.name != SQUEEZING.name:
        return None
    targets = target_offsets(task)
    remaining = np.linalg.norm(targets - entrance(targets), axis=1)
    return task.target_distance - fitness(remaining[:, None])


def threshold(task: Task) -> float:
    """Return the f_s in m above which a robot does what a task is about.

    That is what no robot reaches that does not steer: 0.79 cm for goal reaching. Where all targets lie in
    about one direction, so that such a robot gets more than half the way, it is the aperture of squeezing, or
    half the way.
    """
    half, limit = task.target_distance / 2.0, unsteered_limit(task)
    if limit < half:
        return limit
    return half if (at := aperture(task)) is None else at


def still_limit(task: Task) -> float:
    """Return the |f_s| in m below which a robot counts as lying still.

    That is the threshold of goal reaching, 0.79 cm, or that of the task if it is lower: what a robot gets by
    chance that rolls over once where it lies, whatever a task counts as success.
    """
    return min(threshold(task), threshold(GOAL_REACHING))


def count_above(values: Iterable[float], limit: float) -> int:
    """Return how many values are above a limit."""
    return sum(v > limit for v in values)


def offset_qd_score(values: Iterable[float], initial_distance: float) -> float:
    """Return the QD score in m of a map whose cells count from the worst f_s on, which is never negative.

    pyribs subtracts an offset from every objective, the least that there can be, so that filling a cell never
    lowers the score. Here it is minus the distance at the start: a robot that ends twice as far away as it
    began counts nothing, and so does one that is farther still, which no robot has been. An empty cell counts
    as much as such a robot.

    Args:
        values: f_s of the filled cells, in m.
        initial_distance: d_init of f_s, in m.
    """
    return math.fsum(max(v + initial_distance, 0.0) for v in values)


def counts_above(values: Iterable[float], limits: np.ndarray) -> np.ndarray:
    """Return how many values are above each of some limits, (k,) for (k,) limits."""
    ordered = np.sort(np.array(list(values), dtype=float))
    return len(ordered) - np.searchsorted(ordered, limits, side="right")


def map_over_time(
    reader: RunReader,
    archive: str,
    generations: Sequence[Generation],
    *,
    keep: Sequence[int] | None = None,
    held: dict[Cell, float] | None = None,
) -> Iterator[dict[Cell, float]]:
    """Yield the fitness in m of every filled cell of an archive at the end of each generation.

    Args:
        reader: of the run.
        archive: its name.
        generations: in order.
        keep: indices of axes to project on: a cell then has the best that was ever placed in it. None: all.
        held: what cells had before the first of the generations, to be changed; None if that is the run's
            first.

    Raises:
        RunFileError: the run is damaged.
    """
    changes = reader.placement_changes(archive, -1 if held is None else generations[0].number - 1)
    known = reader.summaries({n for _, _, n in changes if n is not None})
    held = {} if held is None else held
    position = 0
    for generation in generations:
        with reader.guard():
            while position < len(changes) and changes[position][0] <= generation.number:
                _, cell, n = changes[position]
                position += 1
                if keep is not None:
                    if n is not None:
                        onto = tuple(cell[i] for i in keep)
                        held[onto] = min(known[n].fitness, held.get(onto, math.inf))
                elif n is None:
                    held.pop(cell, None)
                else:
                    held[cell] = known[n].fitness
        yield held


@dataclasses.dataclass(frozen=True, slots=True)
class Profile:
    """An archive at some moment.

    Attributes:
        above: cells above the task's threshold.
        offset_qd_score: in m.
    """

    above: int
    offset_qd_score: float

    @classmethod
    def of(cls, values: Collection[float], task: Task) -> Profile:
        """Return that of an archive whose elites have some f_s in m."""
        return cls(count_above(values, threshold(task)), offset_qd_score(values, task.target_distance))


class ProfileHistory:
    """The profiles of all archives of a run at the end of each generation; it grows with a live run.

    Args:
        task: of the run.
    """

    def __init__(self, task: Task) -> None:
        self._task = task
        self.threshold = threshold(task)
        """f_s in m above which cells are counted."""
        self._held: dict[str, dict[Cell, float]] = {}
        self._found: dict[tuple[int, str], Profile] = {}

    def extend(self, reader: RunReader, generations: Sequence[Generation]) -> None:
        """Take in generations that follow on those that are known.

        Args:
            reader: of the run.
            generations: closed since, in order.

        Raises:
            RunFileError: the run is damaged.
        """
        task = self._task
        for archive in {name: None for g in generations for name in g.archives}:
            held = self._held.setdefault(archive, {})
            history = map_over_time(reader, archive, generations, held=held)
            for generation, now in zip(generations, history, strict=True):
                values = [task.target_distance - fitness for fitness in now.values()]
                self._found[generation.number, archive] = Profile.of(values, task)

    def get(self, generation: int, archive: str) -> Profile | None:
        """Return the profile of an archive at the end of a generation, None if it is not known."""
        return self._found.get((generation, archive))
