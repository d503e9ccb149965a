"""Saving what is whole of a damaged run, into a new file.

Evaluations cost hours, archives nothing: from the configuration and the evaluations the search is repeated,
generation by generation, as it went. That gives back everything else in the file, and shows every evaluation
whose solution is not what it was. What the evaluations after a gap are worth depends on what will fill it,
so they are kept for when the run comes there. Where repeating is not possible (a projection, a file rid of
its trajectories, other versions), whole generations are copied as they are recorded.
"""

from __future__ import annotations

import contextlib
import dataclasses
import json
from collections import defaultdict, deque
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Final

from engine.config import RunConfig, from_json
from engine.errors import UNEXPECTED_DATA, InvalidData, RunFileError, UnknownTask
from engine.evaluation import Evaluation, Solution
from engine.lock import holder_of, is_being_written
from engine.reader import RunReader, check_fits
from engine.records import digest, from_row
from engine.run import create_algorithm, statistics
from engine.salvage import Row, salvage
from engine.store import RunWriter
from engine.tasks import fitness, get_task

COLUMNS: Final = (
    "number generation morphology controller parent operator source fitness distances trajectory head_is_end"
    " failure"
).split()
_FITNESS: Final = COLUMNS.index("fitness")


@dataclasses.dataclass(slots=True)
class Recovered:
    """What has been saved.

    Attributes:
        n_generations: whole ones.
        n_recorded: generations that were closed, as far as the damaged file tells.
        n_evaluations: saved, those after the last whole generation among them.
        n_after: of them, those after it.
        damaged: numbers of the evaluations that were found but are not what was written.
        missing: numbers of evaluations of closed generations of which there is nothing.
        resumable: whether the run can be gone on with, as if nothing had happened.
        notes: what else is to be said.
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
    tables = _Tables(path)
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
    # whoever has evaluated something of a generation has closed those before it
    open_one = max(tables.generation_of.values(), default=0)
    n_closed = min((n for n, g in tables.generation_of.items() if g == open_one), default=0)
    n_closed = max((n_closed, *(int(r[1]) for r in tables.generations.values())))
    report.n_recorded = max(open_one, 1 + max(tables.generations, default=-1))
    report.damaged = sorted(tables.damaged)
    known = set(evaluations) | tables.damaged
    report.missing = sorted(set(range(min(n_closed, config.evaluations))) - known)
    return report


class _Tables:
    """The rows of a damaged run by table, as far as they look like rows of it."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.meta: dict[str, Any] = {}
        self.rows: dict[int, tuple[Any, ...]] = {}
        self.generation_of: dict[int, int] = {}
        self.damaged: set[int] = set()
        self.generations: dict[int, tuple[Any, ...]] = {}
        self.placements: list[tuple[Any, ...]] = []
        self.state: tuple[Any, ...] | None = None
        self._digests: dict[int, bytes] = {}
        self._candidates: dict[int, list[tuple[Any, ...]]] = defaultdict(list)
        for row in salvage(path).rows:
            self._sort(row)

    @property
    def projection(self) -> dict[str, str] | None:
        """What a projected run was made of."""
        return self.meta.get("projection")

    def configuration(self, like: Path | None) -> tuple[RunConfig, dict[str, str]]:
        """Return the run's configuration and versions."""
        try:
            config = from_json(self.meta.get("config"))
        except UnknownTask as e:
            raise RunFileError(f"{self.path} cannot be recovered: {e}") from None
        except (InvalidData, *UNEXPECTED_DATA):
            if like is None:
                raise RunFileError(
                    f"{self.path} has lost its configuration; name a run of the same configuration"
                    " with --like RUN"
                ) from None
            with RunReader(like) as reader:
                return reader.config, reader.versions
        versions = self.meta.get("versions")
        return config, {str(k): str(v) for k, v in versions.items()} if isinstance(versions, dict) else {}

    @property
    def created_at(self) -> str:
        """When the run was made, which ties other files to it."""
        return str(self.meta.get("created_at", ""))

    def check_evaluations(self, config: RunConfig) -> dict[int, Evaluation]:
        """Return the evaluations that are what was written, by number, and remember which are not."""
        found = {}
        for number, rows in sorted(self._candidates.items()):
            for row in rows:
                e = self._evaluation(config, number, row)
                if e is not None:
                    found[number] = e
                    self.rows[number] = row
                    self.generation_of[number] = row[1]
            if number not in found:
                self.damaged.add(number)
        return found

    def n_whole(self, evaluations: Mapping[int, Evaluation]) -> int:
        """Return how many generations are whole as they are recorded."""
        n = n_evaluations = 0
        while n in self.generations:
            total = self.generations[n][1]
            if type(total) is not int or not all(k in evaluations for k in range(n_evaluations, total)):
                break
            if not self._placements_are_whole(n, evaluations):
                break
            n, n_evaluations = n + 1, total
        return n

    def first_difference(self, out: Path) -> int | None:
        """Return the first generation whose recorded placements are not those of a recovered run."""
        with RunReader(out) as reader:
            last = reader.last_closed()
            if last is None:
                return None
            again = {
                (g, name, cell, n) for name in last.archives for g, cell, n in reader.placement_changes(name)
            }
        differing = [
            g
            for g, name, cell, n in self.placements
            if g <= last.number and (g, name, _cell(cell), n) not in again
        ]
        return min(differing, default=None)

    def _placements_are_whole(self, generation: int, evaluations: Mapping[int, Evaluation]) -> bool:
        """Tell whether the archives of a generation are filled as much as its figures say."""
        held: dict[tuple[str, str], int | None] = {}
        for g, archive, cell, number in sorted(self.placements, key=lambda p: p[0]):
            if g <= generation:
                held[archive, cell] = number
        try:
            figures = json.loads(self.generations[generation][3])
            for name, f in figures.items():
                filled = [n for (archive, _), n in held.items() if archive == name and n is not None]
                n_cells = 1
                for axis in f["axes"]:
                    n_cells *= int(axis["n"])
                if len(filled) != round(f["coverage"] * n_cells) or not set(filled) <= set(evaluations):
                    return False
        except UNEXPECTED_DATA:
            return False
        return True

    def _evaluation(self, config: RunConfig, number: int, row: tuple[Any, ...]) -> Evaluation | None:
        try:
            e = from_row(dict(zip(COLUMNS, row, strict=True)))
            check_fits(config, e)
            if type(row[1]) is not int or row[1] < 0:
                return None
            known = self._digests.get(number)
            if known is not None:
                return e if digest(row) == known else None
            # a file of the first format has no digests; of what was measured at least this can be checked
            return e if e.fitness is None or e.fitness == fitness(e.distances) else None
        except (InvalidData, *UNEXPECTED_DATA):
            return None

    def _sort(self, row: Row) -> None:
        match row:
            case Row(int(number), (None, int(), *_)) if len(row.values) == len(COLUMNS) and number >= 0:
                values = [number, *row.values[1:]]
                if type(values[_FITNESS]) is int:  # SQLite stores whole numbers short
                    values[_FITNESS] = float(values[_FITNESS])
                self._candidates[number].append(tuple(values))
            case Row(int(number), (None, int(), int(), str(), str(), float() | int())) if number >= 0:
                self.generations[number] = (number, *row.values[1:])
            case Row(1, (None, int(), str())):
                self.state = (1, *row.values[1:])
            case Row(int(number), (None, bytes(value))):
                self._digests[number] = value
            case Row(None, (str(archive), str(cell), int(generation), int() | None as number)):
                self.placements.append((generation, archive, cell, number))
            case Row(None, (str(key), str(value))):
                with contextlib.suppress(ValueError, RecursionError):
                    self.meta[key] = json.loads(value)


def _repeat(
    tables: _Tables,
    config: RunConfig,
    versions: Mapping[str, str],
    evaluations: Mapping[int, Evaluation],
    out: Path,
    report: Recovered,
) -> None:
    """Repeat the search with the evaluations that are there."""
    algorithm = create_algorithm(config)
    distance = get_task(config.task).target_distance
    seconds, later = 0.0, True
    with RunWriter.create(out, config, versions, created_at=tables.created_at) as writer:
        under_way: deque[list[Solution]] = deque()
        while True:
            while len(under_way) <= config.overlap and (solutions := algorithm.ask()):
                under_way.append(solutions)
            if not under_way:
                break
            solutions = under_way.popleft()
            found = [evaluations[s.number] for s in solutions if s.number in evaluations]
            asked = {s.number: s for s in solutions}
            known = [e for e in found if e.solution == asked[e.solution.number]]
            g = algorithm.generation
            writer.add_evaluations(g, known)
            report.n_evaluations += len(known)
            if len(known) < len(found):
                differing = [e.solution.number for e in found if e not in known]
                tables.damaged.update(differing)
                # one flipped byte changes one solution, other versions change them all
                later = len(differing) <= len(found) // 2
            if len(known) < len(solutions):
                report.n_after = len(known)
                break
            algorithm.tell(known)
            recorded = tables.generations.get(g)
            seconds = max(seconds, float(recorded[5])) if recorded else seconds
            writer.close_generation(
                algorithm, statistics(algorithm, distance), seconds, str(recorded[4]) if recorded else ""
            )
            report.n_generations += 1
        if solutions and later:
            report.n_after += _keep_for_later(tables, evaluations, solutions[-1].number, writer)
            report.n_evaluations = report.n_evaluations - len(known) + report.n_after
    report.resumable = True


def _keep_for_later(
    tables: _Tables, evaluations: Mapping[int, Evaluation], last: int, writer: RunWriter
) -> int:
    """Save the evaluations of later generations; return how many."""
    by_generation: dict[int, list[Evaluation]] = defaultdict(list)
    for number, e in evaluations.items():
        if number > last:
            by_generation[tables.generation_of[number]].append(e)
    for generation, group in by_generation.items():
        writer.add_evaluations(generation, group)
    return sum(map(len, by_generation.values()))


def _copy(
    tables: _Tables,
    config: RunConfig,
    versions: Mapping[str, str],
    evaluations: Mapping[int, Evaluation],
    out: Path,
    n: int,
    report: Recovered,
) -> None:
    """Copy whole generations as they are recorded."""
    at_end = tables.state is not None and tables.state[1] == n - 1 and _is_json(tables.state[2])
    kept = [tables.rows[k] for k in sorted(evaluations) if tables.generation_of[k] < n + int(at_end)]
    with RunWriter.create(out, config, versions, tables.projection, tables.created_at) as writer:
        writer.insert("evaluations", kept)
        writer.insert("digests", [(r[0], digest(r)) for r in kept])
        writer.insert("generations", _in_order(r for g, r in tables.generations.items() if g < n))
        writer.insert("placements", _in_order(p for p in tables.placements if p[0] < n))
        if at_end and tables.state is not None:
            writer.insert("state", [tables.state])
    report.n_generations = n
    report.n_evaluations = len(kept)
    report.n_after = sum(r[1] >= n for r in kept)
    report.resumable = at_end and tables.projection is None and all(len(r[9]) for r in kept)


def _in_order(rows: Iterable[tuple[Any, ...]]) -> list[tuple[Any, ...]]:
    return sorted(set(rows), key=lambda r: r[:3])


def _is_json(text: str) -> bool:
    try:
        json.loads(text)
    except (ValueError, RecursionError):
        return False
    return True


def _cell(text: str) -> tuple[int, ...] | None:
    try:
        return tuple(int(p) for p in text.split(","))
    except ValueError:
        return None
