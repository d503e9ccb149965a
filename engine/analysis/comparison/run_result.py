"""What a comparison takes from one run: its figures over evaluations and its maps."""

from __future__ import annotations

import dataclasses
import hashlib
from collections.abc import Mapping
from pathlib import Path

from engine.analysis.comparison.measures import TRENDS
from engine.analysis.elite_maps import (
    CONTROLLER,
    GRID,
    MORPHOLOGY,
    EliteMap,
    double_elites,
    lift,
    load_maps,
)
from engine.analysis.profile import count_above, map_over_time, offset_qd_score, threshold
from engine.analysis.robustness import load_robust_of
from engine.analysis.steering import mirrored_pairs, steers
from engine.config import RunConfig
from engine.errors import InvalidData, RunFileError
from engine.files import compact_json
from engine.search.axes import body_axes
from engine.storage.reader import RunReader
from engine.storage.rows import Generation
from engine.tasks import get_task


class NothingToCompareError(RunFileError):
    """A run that has not finished a generation, or none within the evaluations to compare at."""


@dataclasses.dataclass(frozen=True, slots=True)
class Point:
    """The morphology map after some evaluations; lengths in m, ``best`` None while it is empty.

    ``above`` is how many of its cells are above the comparison's threshold.
    """

    n_evaluations: int
    best: float | None
    qd_score: float
    coverage: float
    offset_qd_score: float
    above: int

    def measure(self, name: str) -> float | None:
        """Return a figure of ``measures.TRENDS`` in its unit."""
        value: float | None = getattr(self, name)
        return value if value is None or name == "above" else 100.0 * value


@dataclasses.dataclass(frozen=True, slots=True)
class Robust:
    """What the elites of a morphology map do under fresh noise.

    Attributes:
        n_repeats: evaluations of each elite, the fewest.
        means: of f_s in m, of each elite that did not fail every time.
        versions: that simulated.
    """

    n_repeats: int
    means: tuple[float, ...]
    versions: Mapping[str, str]

    @property
    def best(self) -> float | None:
        """Largest mean in cm."""
        return 100.0 * max(self.means) if self.means else None


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class RunResult:
    """One run of a comparison.

    Attributes:
        path: of its file.
        config: of the run.
        versions: that it was started with.
        projected_from: name of the run that its archives were projected from, or None.
        points: of the morphology map at the end of each generation; at least one.
        seconds: computing time.
        maps: by name: ``morphology``, and where the run has them ``controller`` and ``grid``.
        threshold: f_s in m above which cells are counted.
        first_robots: digests of the genotypes of some robots of its first generation.
        robust: means of the morphology map's elites under fresh noise, or None.
        steering: share of the morphology map's elites whose controllers tell left from right; None where no
            targets are on both sides.
        no_grid: why ``grid`` is missing, if it could have been expected.
        no_robust: why ``robust`` is missing, if elites were evaluated again.
    """

    path: Path
    config: RunConfig
    versions: Mapping[str, str]
    projected_from: str | None
    points: tuple[Point, ...]
    seconds: float
    maps: Mapping[str, EliteMap]
    threshold: float
    first_robots: frozenset[str] = frozenset()
    robust: Robust | None = None
    steering: float | None = None
    no_grid: str | None = None
    no_robust: str | None = None

    @property
    def initial_distance(self) -> float:
        """d_init of f_s, in m."""
        return get_task(self.config.task).target_distance

    @property
    def n_evaluations(self) -> int:
        """Number of evaluations that its figures cover."""
        return self.points[-1].n_evaluations

    def repeats(self, other: RunResult) -> bool:
        """Tell whether another run began with the same random robots, so that the two are not independent."""
        return self.config.seed == other.config.seed and not self.first_robots.isdisjoint(other.first_robots)

    @property
    def finished(self) -> bool:
        """Whether its budget is spent."""
        return self.n_evaluations >= self.config.evaluations

    def measure(self, name: str) -> float | None:
        """Return a figure of the end of the run in its unit; None if it has none.

        Args:
            name: of ``measures.MEASURES``.

        Raises:
            KeyError: there is no such figure.
        """
        if name in TRENDS:
            return self.points[-1].measure(name)
        match name:
            case "robust_best":
                return None if self.robust is None else self.robust.best
            case "robust_qd_score":
                return None if self.robust is None else 100.0 * sum(self.robust.means)
            case "robust_above":
                return None if self.robust is None else float(count_above(self.robust.means, self.threshold))
            case "steering":
                return None if self.steering is None else 100.0 * self.steering
            case "evaluations":
                return float(self.n_evaluations)
            case "hours":
                return self.seconds / 3600.0
        raise KeyError(name)


def load_result(path: Path, at: int | None = None, limit: float | None = None) -> RunResult:
    """Read a run for a comparison.

    Args:
        path: run file.
        at: evaluations to compare at: generations that end later do not count. None: all of them.
        limit: f_s in m above which cells are counted. None: that of the task, see ``profile.threshold``.

    Raises:
        NothingToCompareError: it has no finished generation within those evaluations.
        RunFileError: it is no run file, is damaged, or has no morphology archive to compare.
        InvalidData: what lies beside it of its elites evaluated again is damaged or of another run.
    """
    with RunReader(path) as reader:
        every = reader.generations()
        generations = [g for g in every if at is None or g.n_evaluations <= at]
        if not generations:
            raise NothingToCompareError(
                f"{path} has no finished generation" + (f" within {at} evaluations" if every else " yet")
            )
        last = generations[-1]
        maps = load_maps(reader, last)
        if MORPHOLOGY not in maps:
            raise RunFileError(f"{path} has no morphology archive to compare")
        no_grid = None
        if GRID not in maps and CONTROLLER in maps:
            if last is every[-1]:
                maps, no_grid = _with_grid(reader, last, maps)
            else:
                no_grid = "its PCA is kept as of its last generation only"
        task = get_task(reader.config.task)
        limit = threshold(task) if limit is None else limit
        robust, no_robust = _robust(reader, maps[MORPHOLOGY])
        return RunResult(
            path=path,
            config=reader.config,
            versions=reader.versions,
            projected_from=None if reader.projection is None else reader.projection.get("source", ""),
            points=_points(reader, generations, limit),
            seconds=last.seconds,
            maps=maps,
            threshold=limit,
            first_robots=_first_robots(reader, every[0]),
            robust=robust,
            steering=_steering(reader, maps[MORPHOLOGY]),
            no_grid=no_grid,
            no_robust=no_robust,
        )


def _with_grid(
    reader: RunReader, last: Generation, maps: dict[str, EliteMap]
) -> tuple[dict[str, EliteMap], str | None]:
    """Return the maps, with the 4-D map of two 2-D archives or the reason why there is none."""
    elites = double_elites(reader, last)
    try:
        return maps | {GRID: lift(reader, last, elites).map}, None
    except InvalidData as e:
        return maps, f"{e}; 'tensatlas project' simulates it again"


def _points(reader: RunReader, generations: list[Generation], limit: float) -> tuple[Point, ...]:
    """Return the figures of the morphology map, or of a 4-D archive's projection on the body.

    An elite of a 4-D archive only ever makes way for a better one in its own cell, whose body has the same
    measures, so that the projection holds the best of all that was ever placed.
    """
    distance = get_task(reader.config.task).target_distance
    archive = MORPHOLOGY if MORPHOLOGY in generations[-1].archives else GRID
    generations = [g for g in generations if archive in g.archives]
    axes = generations[-1].archives[archive].axes
    keep = body_axes(axes)
    n_cells = EliteMap(tuple(axes[i] for i in keep), {}).n_cells
    history = map_over_time(reader, archive, generations, keep=keep if archive == GRID else None)
    points = []
    for generation, held in zip(generations, history, strict=True):
        values = [distance - fitness for _, fitness in sorted(held.items())]
        points.append(
            Point(
                generation.n_evaluations,
                best=max(values, default=None),
                qd_score=sum(values),
                coverage=len(values) / n_cells,
                offset_qd_score=offset_qd_score(values, distance),
                above=count_above(values, limit),
            )
        )
    return tuple(points)


def _first_robots(reader: RunReader, first: Generation) -> frozenset[str]:
    """Return digests of the genotypes of random robots; some are enough to tell whether runs share them."""
    solutions = (e.solution for e in reader.evaluations(set(reader.first_robots(first))).values())
    return frozenset(
        hashlib.sha256(compact_json([s.morphology.to_json(), s.controller.to_json()]).encode()).hexdigest()
        for s in solutions
        if s.parent is None
    )


def _robust(reader: RunReader, shown: EliteMap) -> tuple[Robust | None, str | None]:
    """Return what a map's elites do under fresh noise, or None and, if some are known, why."""
    found = load_robust_of(reader)
    if found is None or not shown.elites:
        return None, None
    numbers = [n for _, n in shown.elites.values()]
    repeats = [len(found.samples.get(n, {})) for n in numbers]
    if not all(repeats):
        return None, f"only {sum(map(bool, repeats))} of {len(numbers)} elites of its morphology map"
    distance = get_task(reader.config.task).target_distance
    means = tuple(distance - m for n in numbers if (m := found.mean(n)) is not None)
    return Robust(min(repeats), means, found.versions), None


def _steering(reader: RunReader, shown: EliteMap) -> float | None:
    config = reader.config
    if not shown.elites or not mirrored_pairs(get_task(config.task).target_bearings):
        return None
    elites = reader.evaluations({n for _, n in shown.elites.values()})
    found = steers(config, [e.solution for e in elites.values()])
    return sum(found) / len(found)
