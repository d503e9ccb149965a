"""Saves the intact part of a damaged run in a new file.

Evaluations cost hours, archives nothing: the search is repeated from the configuration and the evaluations,
generation by generation. That restores everything else in the file, and reveals every evaluation whose
solution has changed. Evaluations after a gap fit only if the same solutions fill it again, so they are kept
until the resumed run gets there. Where the search cannot be repeated (a projection, a file without
trajectories, other versions), whole generations are copied as they are recorded.
"""

from __future__ import annotations

import contextlib
import dataclasses
import json
import math
from collections import defaultdict, deque
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from engine.config import RunConfig, create_algorithm
from engine.errors import RunFileError
from engine.simulation.evaluation import Evaluation, Solution
from engine.storage.lock import holder_of, is_being_written
from engine.storage.rows import statistics
from engine.storage.salvaged_tables import SalvagedTables
from engine.storage.writer import RunWriter
from engine.tasks import get_task

_LAST_DIGITS: Final = 1e-12
"""Largest relative difference between numbers that are the same but for their last digits."""


@dataclasses.dataclass(slots=True)
class Recovered:
    """The result of saving a run.

    Attributes:
        n_generations: whole ones that were saved.
        n_recorded: generations that the run had closed, as far as the damaged file tells.
        n_evaluations: all that were saved, including those after the last whole generation.
        n_after: those after the last whole generation.
        damaged: numbers of the evaluations that were found but differ from what was written.
        missing: numbers of the evaluations of closed generations that were not found.
        resumable: whether the new file can be resumed, as if nothing had happened.
        notes: further sentences for the user.
    """

    n_generations: int = 0
    n_recorded: int = 0
    n_evaluations: int = 0
    n_after: int = 0
    damaged: list[int] = dataclasses.field(default_factory=list)
    missing: list[int] = dataclasses.field(default_factory=list)
    resumable: bool = False
    notes: list[str] = dataclasses.field(default_factory=list)


def recover(path: Path, out: Path, *, like: Path | None = None) -> Recovered:
    """Save every whole generation of a run, and the evaluations after them, into a new file.

    Args:
        path: of the run; only read.
        out: of the file to create.
        like: a run of the same configuration, for a file that has lost its own.

    Raises:
        RunFileError: nothing can be saved, the run is being written, or ``out`` exists or cannot be written.
    """
    if is_being_written(path):
        raise RunFileError(f"{path} is being written ({holder_of(path)}); stop that first")
    if out.exists():
        raise RunFileError(f"{out} exists; choose another name for what is saved")
    tables = SalvagedTables(path)
    if "slimmed" in tables.meta:
        raise RunFileError(f"{path} is slimmed; recover the run it was made from, or slim that one again")
    config, versions = tables.configuration(like)
    evaluations = tables.check_evaluations(config)
    if not evaluations:
        raise RunFileError(f"{path} has no whole evaluation left; nothing can be saved")
    n_whole = tables.n_whole(evaluations)
    report = Recovered()
    try:
        if not tables.projection and all(e.trajectory.shape[1] for e in evaluations.values()):
            _repeat(tables, config, versions, evaluations, out, report)
            differs = tables.first_difference(out)
            if report.n_generations < n_whole or (differs is not None and report.n_generations == n_whole):
                out.unlink()
                report = Recovered()
                report.notes.append("copied as recorded: its search comes out differently here and now")
            elif differs is not None:
                report.notes.append(f"its archives come out differently from generation {differs} on")
        if not out.exists():
            if not n_whole:
                raise RunFileError(f"{path} has no whole generation left that can be saved")
            _copy(tables, config, versions, evaluations, out, n_whole, report)
    except BaseException:
        with contextlib.suppress(OSError):
            out.unlink(missing_ok=True)
        raise
    # evaluations of a generation imply that those before it are closed
    open_one = max(tables.generation_of.values(), default=0)
    n_closed = min((n for n, g in tables.generation_of.items() if g == open_one), default=0)
    n_closed = max(n_closed, *(c.n_evaluations for c in tables.generations.values()), 0)
    report.n_recorded = max(open_one, 1 + max(tables.generations, default=-1))
    report.damaged = sorted(tables.damaged)
    known = set(evaluations) | tables.damaged
    report.missing = sorted(set(range(min(n_closed, config.evaluations))) - known)
    return report


def _repeat(
    tables: SalvagedTables,
    config: RunConfig,
    versions: Mapping[str, str],
    evaluations: dict[int, Evaluation],
    out: Path,
    report: Recovered,
) -> None:
    """Repeat the search with the evaluations that are there."""
    given = tables.given()
    algorithm = create_algorithm(config, given)
    distance = get_task(config.task).target_distance
    seconds, later = 0.0, True
    with RunWriter.create(out, config, versions, created_at=tables.created_at, given=given) as writer:
        under_way: deque[list[Solution]] = deque()
        while True:
            while len(under_way) <= config.overlap and (solutions := algorithm.ask()):
                under_way.append(solutions)
                for s in solutions:
                    if s.number not in evaluations:
                        evaluations.update(tables.learn(config, s))
            if not under_way:
                break
            solutions = under_way.popleft()
            found = [evaluations[s.number] for s in solutions if s.number in evaluations]
            asked = {s.number: s for s in solutions}
            known = [
                dataclasses.replace(e, solution=asked[e.solution.number])
                for e in found
                if _alike(e.solution, asked[e.solution.number])
            ]
            g = algorithm.generation
            writer.add_evaluations(g, known, tables.origins_of(known))
            report.n_evaluations += len(known)
            if len(known) < len(found):
                differing = sorted({e.solution.number for e in found} - {e.solution.number for e in known})
                tables.damaged.update(differing)
                # one flipped byte changes one solution, other versions change them all
                later = len(differing) <= len(found) // 2
            if len(known) < len(solutions):
                report.n_after = len(known)
                break
            algorithm.tell(known)
            recorded = tables.generations.get(g)
            seconds = max(seconds, recorded.seconds) if recorded else seconds
            writer.close_generation(
                algorithm, statistics(algorithm, distance), seconds, recorded.finished_at if recorded else ""
            )
            report.n_generations += 1
        if solutions and later:
            report.n_after += _keep_for_later(tables, evaluations, solutions[-1].number, writer)
            report.n_evaluations = report.n_evaluations - len(known) + report.n_after
    report.resumable = True


def _alike(recorded: Solution, asked: Solution) -> bool:
    """Tell whether two solutions are the same but for the last digits of what was drawn from a Gaussian.

    Earlier versions left these digits to the C library.
    """
    if recorded == asked:
        return True
    numbers: list[list[float]] = []
    bare = []
    for s in (recorded, asked):
        c = s.controller
        numbers.append([*(n.bias for n in c.nodes), *(x.weight for x in c.connections)])
        controller = dataclasses.replace(
            c,
            nodes=tuple(dataclasses.replace(n, bias=0.0) for n in c.nodes),
            connections=tuple(dataclasses.replace(x, weight=0.0) for x in c.connections),
        )
        bare.append(dataclasses.replace(s, controller=controller))
    return bare[0] == bare[1] and all(
        math.isclose(a, b, rel_tol=_LAST_DIGITS) for a, b in zip(*numbers, strict=True)
    )


def _keep_for_later(
    tables: SalvagedTables, evaluations: Mapping[int, Evaluation], last: int, writer: RunWriter
) -> int:
    """Save the evaluations of later generations; return how many."""
    by_generation: dict[int, list[Evaluation]] = defaultdict(list)
    for number, e in evaluations.items():
        if number > last:
            by_generation[tables.generation_of[number]].append(e)
    for generation, group in by_generation.items():
        writer.add_evaluations(generation, group, tables.origins_of(group))
    return sum(map(len, by_generation.values()))


def _copy(
    tables: SalvagedTables,
    config: RunConfig,
    versions: Mapping[str, str],
    evaluations: Mapping[int, Evaluation],
    out: Path,
    n: int,
    report: Recovered,
) -> None:
    """Copy whole generations as they are recorded."""
    at_end = tables.state is not None and tables.state[0] == n - 1 and _is_json(tables.state[1])
    kept = {k: e for k, e in sorted(evaluations.items()) if tables.generation_of[k] < n + int(at_end)}
    by_generation: dict[int, list[Evaluation]] = defaultdict(list)
    for number, e in kept.items():
        by_generation[tables.generation_of[number]].append(e)
    origin = tables.projection, tables.created_at, tables.given()
    with RunWriter.create(out, config, versions, *origin) as writer:
        for generation, group in sorted(by_generation.items()):
            writer.add_evaluations(generation, group, tables.origins_of(group))
        for generation in range(n):
            changes = sorted({c for c in tables.placements if c[0] == generation}, key=lambda c: c[:3])
            writer.add_recorded(tables.generations[generation], changes)
        if at_end and tables.state is not None:
            writer.set_recorded_state(*tables.state)
    report.n_generations = n
    report.n_evaluations = len(kept)
    report.n_after = sum(tables.generation_of[k] >= n for k in kept)
    report.resumable = (
        at_end and tables.projection is None and all(e.trajectory.shape[1] for e in kept.values())
    )


def _is_json(text: str) -> bool:
    try:
        json.loads(text)
    except (ValueError, RecursionError):
        return False
    return True
