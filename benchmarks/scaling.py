"""How evaluations scale with the workers: ``python -m benchmarks.scaling``.

First real robots on this machine, by threads, processes and a local Dask cluster. Then clusters of up to
512 workers whose evaluations only take the time that real ones do: the algorithm, the checks and the run
file are real and their CPU time is measured; the workers' time is reckoned, not waited for.
"""

from __future__ import annotations

import contextlib
import dataclasses
import heapq
import math
import os
import random
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import tyro

from engine.body.morphology import Morphology
from engine.config import RunConfig, preset
from engine.control.operators import Neat
from engine.errors import TensAtlasError
from engine.runs import evolve as run
from engine.runs.run_loop import Progress
from engine.simulation.evaluation import Evaluation, Solution
from engine.simulation.provenance import Origin, this_computer
from engine.simulation.trials import TrialConfig
from engine.tasks import get_task
from engine.workers.dask_workers import DaskWorkers, local_cluster
from engine.workers.evaluator import create_evaluator
from engine.workers.job import Result, World, world_of
from engine.workers.pool import Died, PoolQueue, Workers
from engine.workers.processes import ProcessWorkers

SECONDS_PER_TRIAL = {2: 0.51, 4: 0.94, 6: 1.34, 8: 1.81, 10: 2.66}
"""CPU seconds of one trial by modules, as one of eight: docs/physics.md."""
TRANSFER = 0.003
"""Seconds from the end of an evaluation to the beginning of the next on the same worker, at least."""
MOST_OVERHEAD = 0.02
"""Share of a second's evaluation that may be lost around it."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Arguments:
    """Measure how evaluations scale."""

    robots: int = 24
    """Real robots to evaluate by each kind of worker; 0 leaves that part out."""
    trial_time: float = 10.0
    """Seconds of their trials; four each."""
    workers: tuple[int, ...] = (1, 2)
    """Workers of this machine."""
    clusters: tuple[int, ...] = (64, 128, 256, 512)
    """Workers of the simulated clusters; none leave that part out."""
    generations: int = 100
    """Generations of a simulated run after its 1,080 random robots."""
    overlaps: tuple[float, ...] = (0.0, 1.0, 2.0, 3.0)
    """Overlaps to try, as solutions under way per worker; 0 is the published algorithm."""


class SimulatedWorkers:
    """Workers whose evaluations take as long as real ones, by a clock that is not waited for.

    Args:
        n_workers: of them.
    """

    def __init__(self, n_workers: int) -> None:
        self.n_workers = n_workers
        self.now = 0.0
        """Seconds since the start: reckoned for the workers, CPU time for whoever calls."""
        self.busy = 0.0
        """Seconds that workers have computed."""
        self.waiting = 0.0
        """Seconds that the caller has waited for them."""
        self._free = [0.0] * n_workers
        self._events: list[tuple[float, int, Sequence[Solution]]] = []
        self._left_at = time.process_time()
        self._rng = np.random.default_rng(0)

    def submit(self, world: World, solutions: Sequence[Solution]) -> None:
        """Have solutions evaluated on the worker that is free first."""
        trials = world.config.trials.repeats * get_task(world.config.task).n_targets
        duration = trials * sum(seconds_per_trial(s.morphology.n_modules) for s in solutions)
        begin = max(heapq.heappop(self._free), self._time()) + TRANSFER
        heapq.heappush(self._free, begin + duration)
        heapq.heappush(self._events, (begin + duration, solutions[0].number, solutions))
        self.busy += duration

    def wait(self) -> list[tuple[Sequence[Solution], list[Result] | Died]]:
        """Return what is finished by now, or else what is finished next."""
        self.now = self._time()
        self.waiting += max(self._events[0][0] - self.now, 0.0)
        self.now = max(self.now, self._events[0][0])
        found: list[tuple[Sequence[Solution], list[Result] | Died]] = []
        while self._events and self._events[0][0] <= self.now:
            solutions = heapq.heappop(self._events)[2]
            results = [Result(self._made_up(s), None, Origin(this_computer())) for s in solutions]
            found.append((solutions, results))
        self._left_at = time.process_time()
        return found

    def _time(self) -> float:
        """Return the time, the caller's own since it was last here included."""
        return self.now + time.process_time() - self._left_at

    def _made_up(self, solution: Solution) -> Evaluation:
        trajectory = np.cumsum(self._rng.normal(0.0, 0.01, (4, 40, 2)), axis=1).astype(np.float32)
        distances = self._rng.uniform(0.1, 0.5, (4, 2))
        return Evaluation(
            solution=solution,
            fitness=float(distances.mean()),
            distances=distances,
            trajectory=trajectory,
            head_is_end=False,
        )


def seconds_per_trial(n_modules: int) -> float:
    """Return the CPU seconds of a trial of 43 s."""
    return float(np.interp(n_modules, list(SECONDS_PER_TRIAL), list(SECONDS_PER_TRIAL.values())))


def main(arguments: Arguments) -> int:
    """Run and return the exit status.

    Raises:
        TensAtlasError: Dask is not installed.
    """
    well = True
    if arguments.robots:
        well &= _this_machine(arguments)
    for n in arguments.clusters:
        _cluster(n, arguments)
    print("no row falls short" if well else "a row falls short")
    return int(not well)


def _this_machine(a: Arguments) -> bool:
    config = dataclasses.replace(
        preset("quick"), seed=1, trials=TrialConfig(repeats=1, trial_time=a.trial_time)
    )
    rng, neat = random.Random(1), Neat(n_inputs=2)
    solutions = [
        Solution(
            number=k,
            morphology=Morphology(1 + k % 10, tuple(rng.randint(1, 8) for _ in range(2 + k % 9))),
            controller=neat.random(rng),
        )
        for k in range(a.robots)
    ]
    print(
        f"{a.robots} robots of all sizes, four trials of {a.trial_time:g} s each, {os.cpu_count()} cores\n"
        "workers                evaluations/min  relative  lost around an evaluation, ms  verdict"
    )
    well, base = True, math.nan
    for n in a.workers:
        for kind in ("threads", "processes", "dask"):
            started = time.perf_counter()
            if kind == "threads":
                evaluator = create_evaluator(config, n)
                assert sum(len(group) for group in evaluator.evaluate(solutions)) == a.robots
                seconds, lost = time.perf_counter() - started, math.nan
            else:
                with _workers(kind, n) as workers:
                    seconds, lost = _pool(workers, config, solutions)
            rate = 60 * a.robots / seconds
            base = rate if math.isnan(base) else base
            good = math.isnan(lost) or lost <= MOST_OVERHEAD
            well &= good
            print(
                f"{n:3} {kind:<18} {rate:15.1f}  {rate / base:8.2f}"
                f"  {'-' if math.isnan(lost) else f'{1000 * lost:.1f}':>29}"
                f"  {'' if math.isnan(lost) else 'holds' if good else 'falls short'}",
                flush=True,
            )
    return well


@contextlib.contextmanager
def _workers(kind: str, n: int) -> Iterator[Workers]:
    if kind == "processes":
        with ProcessWorkers(n) as processes:
            yield processes
    else:
        with DaskWorkers(local_cluster(n)) as dask:
            yield dask


def _pool(workers: Workers, config: RunConfig, solutions: list[Solution]) -> tuple[float, float]:
    """Return the seconds that an evaluation of all takes, and those lost around each on its worker.

    What is lost is measured with evaluations of a hundredth of the time, as many as keep the workers busy
    to the end: the time of the workers less the CPU time of the evaluations.
    """
    evaluator = PoolQueue(workers=workers, world=world_of(config))
    list(evaluator.evaluate(solutions[: 2 * workers.n_workers]))  # imports are not what is measured
    started = time.perf_counter()
    found = [e for group in evaluator.evaluate(solutions) for e in group]
    seconds = time.perf_counter() - started
    assert len(found) == len(solutions)
    short = dataclasses.replace(
        config, trials=TrialConfig(repeats=1, settle_time=0.1, open_loop_time=0.02, trial_time=1.0)
    )
    smallest = [
        dataclasses.replace(solutions[0], number=k, morphology=Morphology(5, (1, 1))) for k in range(100)
    ]
    evaluator = PoolQueue(workers=workers, world=world_of(short))
    list(evaluator.evaluate(smallest[: 2 * workers.n_workers]))
    started = time.perf_counter()
    computed = 0.0
    for group in evaluator.evaluate(smallest):
        for e in group:
            origin = evaluator.origin(e.solution.number)
            computed += 0.0 if origin is None or origin.seconds is None else origin.seconds
    elapsed = time.perf_counter() - started
    return seconds, max(elapsed * workers.n_workers - computed, 0.0) / len(smallest)


def _cluster(n_workers: int, a: Arguments) -> None:
    paper = preset("paper")
    sizes = paper.map_search
    print(
        f"\n{n_workers} simulated workers, {sizes.initial} random robots and {a.generations} generations of"
        f" {sizes.batch_size}, eight trials each\n"
        "overlap  under way  evaluations/h  workers busy  command busy  hours for 45,000"
    )
    for per_worker in a.overlaps:
        overlap = math.ceil(max(per_worker * n_workers / sizes.batch_size - 1, 0))
        config = dataclasses.replace(
            paper, evaluations=sizes.initial + a.generations * sizes.batch_size, overlap=overlap
        )
        workers = SimulatedWorkers(n_workers)
        after: dict[str, float] = {}

        def remember(
            progress: Progress, w: SimulatedWorkers = workers, after: dict[str, float] = after
        ) -> None:
            if progress.generation == 1 and not after:  # random robots keep any cluster busy
                after.update(now=w.now, waiting=w.waiting)

        with tempfile.TemporaryDirectory() as folder:
            run.evolve(Path(folder) / "run.tsmr", config, workers=workers, observer=remember)
        searched = workers.now - after["now"]
        rate = a.generations * sizes.batch_size / searched
        mean = workers.busy / config.evaluations
        print(
            f"{overlap:7}  {(overlap + 1) * sizes.batch_size:9}  {3600 * rate:13.0f}"
            f"  {rate * mean / n_workers:12.0%}"
            f"  {1 - (workers.waiting - after['waiting']) / searched:12.0%}"
            f"  {(45_000 - sizes.initial) / rate / 3600 + after['now'] / 3600:16.2f}",
            flush=True,
        )


if __name__ == "__main__":
    try:
        sys.exit(main(tyro.cli(Arguments)))
    except TensAtlasError as error:
        sys.exit(f"scaling: {error}")
