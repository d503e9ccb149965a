"""The runs of one task in their groups, described and tested."""

from __future__ import annotations

import dataclasses
import functools
import itertools
from collections.abc import Sequence

from engine.analysis.comparison.groups import ALGORITHM_NAMES, Settings, name_groups, settings
from engine.analysis.comparison.measures import MEASURES
from engine.analysis.comparison.run_result import RunResult
from engine.analysis.comparison.significance import (
    ALPHA,
    EffectSize,
    RankTest,
    effect_size,
    fewest,
    holm,
    rank_sum,
    signed_rank,
)
from engine.analysis.comparison.statistics import Statistics, Trend, describe, trend
from engine.analysis.elite_maps import MORPHOLOGY


@dataclasses.dataclass(frozen=True, slots=True)
class Group:
    """Runs that repeat each other: their configurations agree in all but the seed.

    Attributes:
        name: what sets it apart from the other groups of the task.
        settings: that its runs share.
        runs: at least one.
    """

    name: str
    settings: Settings
    runs: tuple[RunResult, ...]

    @property
    def algorithm(self) -> str:
        """Name of the algorithm; empty for a variant that the paper says nothing of."""
        config = self.runs[0].config
        published = config.map_search.cell_capacity == 1 and config.stiffness == "shared"
        return config.algorithm if published else ""

    def values(self, measure: str) -> list[float]:
        """Return a measure of each run; runs without it are left out."""
        return [v for r in self.runs if (v := r.measure(measure)) is not None]

    def statistics(self, measure: str) -> Statistics | None:
        """Return the statistics of a measure over the runs, or None if no run has it."""
        values = self.values(measure)
        return describe(values) if values else None

    def trend(self, measure: str) -> Trend:
        """Return one of ``measures.TRENDS`` over evaluations, in its unit."""
        steps = []
        for run in self.runs:
            points = [(p.n_evaluations, v) for p in run.points if (v := p.measure(measure)) is not None]
            steps.append(([n for n, _ in points], [v for _, v in points]))
        return trend(steps)

    @property
    def map_shape(self) -> tuple[int, ...]:
        """Cells along each axis of the runs' morphology maps."""
        return tuple(a.n for a in self.runs[0].maps[MORPHOLOGY].axes)


def make_groups(runs: Sequence[RunResult], at: int | None = None) -> tuple[Group, ...]:
    """Put runs of one task together that repeat each other.

    Args:
        runs: in any order.
        at: evaluations that they are compared at, see ``groups.settings``.

    Returns:
        The groups in the paper's order of the algorithms, the shortest name first; runs by seed.
    """
    found: list[tuple[Settings, list[RunResult]]] = []
    for run in sorted(runs, key=lambda r: r.config.seed):
        own = settings(run.config, at)
        members = next((m for s, m in found if s == own), None)
        if members is None:
            found.append((own, [run]))
        else:
            members.append(run)
    names = name_groups([s for s, _ in found])
    order = {name: k for k, name in enumerate(ALGORITHM_NAMES)}
    groups = [Group(n, s, tuple(m)) for n, (s, m) in zip(names, found, strict=True)]
    return tuple(
        sorted(
            groups,
            key=lambda g: (order.get(str(g.settings["algorithm"]), len(order)), g.name.count(","), g.name),
        )
    )


@dataclasses.dataclass(frozen=True, slots=True)
class PairTest:
    """The test of two groups on one measure.

    Attributes:
        measure: by name.
        first, second: the groups; where one is the baseline, it is the second.
        result: of the test alone.
        corrected_p: by Holm's method, for all tests of this measure on this task.
        effect: how often the first exceeds the second.
    """

    measure: str
    first: Group
    second: Group
    result: RankTest
    corrected_p: float
    effect: EffectSize

    @property
    def significant(self) -> bool:
        """Whether the groups differ at ``ALPHA`` after the correction; never where there are too few runs."""
        return self.result.enough and self.corrected_p < ALPHA

    @property
    def sizes(self) -> str:
        """How many runs are tested: ``4, 6`` of two groups, ``4 pairs``."""
        n, m = self.result.n
        return f"{n} pair{'s' if n > 1 else ''}" if self.result.kind == "signed-rank" else f"{n}, {m}"

    @property
    def verdict(self) -> str:
        """What the test has shown, in a few words beside the names of the groups."""
        if not self.significant:
            return "no difference shown" if self.result.enough else "too few runs"
        return f"{(self.first if self.effect.value > 0.5 else self.second).name} is higher"

    def sentence(self) -> str:
        """Say what the test has shown."""
        first, second = self.first.name, self.second.name
        if not self.result.enough:
            n, m = self.result.n
            if self.result.kind == "signed-rank":
                found = f"{_count(n, 'pair')} of runs of {first} and {second} {'is' if n == 1 else 'are'}"
            else:
                found = f"{_count(n, 'run')} of {first} and {_count(m, 'run')} of {second} are"
            return (
                f"{found} too few to say anything: even if all of one beat all of the other, p would be"
                f" {self.result.smallest_p:.2g}. {_fewest(self.result)} could reach {ALPHA:g}."
            )
        if self.significant:
            return f"{first} and {second} differ: {self.verdict}."
        return f"No difference between {first} and {second} is shown."


@dataclasses.dataclass(frozen=True)
class TaskComparison:
    """The groups of one task.

    Attributes:
        task: its name.
        groups: as ``make_groups`` orders them.
        baseline: the group that all others are tested against; None: all are tested against each other.
    """

    task: str
    groups: tuple[Group, ...]
    baseline: Group | None = None

    @property
    def runs(self) -> list[RunResult]:
        """All runs of the task."""
        return [r for g in self.groups for r in g.runs]

    @property
    def threshold(self) -> float:
        """F_s in m above which cells are counted."""
        return self.runs[0].threshold

    @property
    def measures(self) -> list[str]:
        """The measures that any run has."""
        return [m for m in MEASURES if any(g.values(m) for g in self.groups)]

    @functools.cached_property
    def tests(self) -> tuple[PairTest, ...]:
        """The tests of all pairs of groups, or of all against the baseline; a family for each measure.

        Sums over maps with different numbers of cells are sums of different lengths, and not tested.
        """
        pairs = (
            [(g, self.baseline) for g in self.groups if g is not self.baseline]
            if self.baseline
            else list(itertools.combinations(self.groups, 2))
        )
        found: list[PairTest] = []
        for name, measure in MEASURES.items():
            family = [
                (a, b, *_test(a, b, name))
                for a, b in pairs
                if measure.tested
                and a.values(name)
                and b.values(name)
                and (not measure.sums or a.map_shape == b.map_shape)
            ]
            corrected = holm([t.p for _, _, t, _ in family])
            found += [
                PairTest(name, a, b, t, p, e) for (a, b, t, e), p in zip(family, corrected, strict=True)
            ]
        return tuple(found)

    def test(self, measure: str, group: Group) -> PairTest | None:
        """Return the test of a group against the baseline, or None."""
        return next((t for t in self.tests if t.measure == measure and t.first is group), None)

    @property
    def remark(self) -> str:
        """A sentence if no test could show anything, or none after the correction; else nothing."""
        tests = self.tests
        if tests and not any(t.result.enough for t in tests):
            return (
                f"There are too few runs to say which group is better: {_fewest(tests[0].result)} could reach"
                f" {ALPHA:g}, even if all of one beat all of the other."
            )
        families = [[t for t in tests if t.measure == m] for m in {t.measure: None for t in tests}]
        hopeless = [f for f in families if f and not any(len(f) * t.result.smallest_p <= ALPHA for t in f)]
        if tests and len(hopeless) == len(families):
            n = len(hopeless[0])
            return (
                f"Corrected for {n} tests, no difference between so few runs can reach {ALPHA:g}:"
                f" {_fewest(hopeless[0][0].result, n)} could. The effect sizes say more than the tests do."
            )
        return ""


def _test(first: Group, second: Group, measure: str) -> tuple[RankTest, EffectSize]:
    """Test two groups: by pairs if each run of the smaller one has the random robots of one of the other."""
    runs, others = (
        [(r, v) for r in g.runs if (v := r.measure(measure)) is not None] for g in (first, second)
    )
    pairs = [(r, o, (v, w)) for r, v in runs for o, w in others if r.repeats(o)]
    one_to_one = len({id(r) for r, _, _ in pairs}) == len({id(o) for _, o, _ in pairs}) == len(pairs)
    if one_to_one and len(pairs) == min(len(runs), len(others)):
        values = [v for _, _, v in pairs]
        a, b = zip(*values, strict=True)
        return signed_rank(values), effect_size(a, b, paired=True)
    return rank_sum(first.values(measure), second.values(measure)), effect_size(
        first.values(measure), second.values(measure)
    )


def _fewest(result: RankTest, n_tests: int = 1) -> str:
    """Say how many runs are the fewest that could show a difference."""
    n = fewest(result.kind, n_tests)
    if result.kind == "signed-rank":
        m = fewest("rank-sum", n_tests)
        return f"{n} pairs of runs with the same seeds, or {m} runs of each with others,"
    return f"{n} runs of each are the fewest whose difference"


def _count(n: int, what: str) -> str:
    return f"{n} {what}" if n == 1 else f"{n} {what}s"
