"""The tables of a damaged run, built from the rows that are left."""

from __future__ import annotations

import contextlib
import json
from collections import defaultdict
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Final

from engine.config import RunConfig, from_json
from engine.errors import UNEXPECTED_DATA, InvalidData, RunFileError, UnknownTask
from engine.search.variation import GivenRobot
from engine.simulation.evaluation import Evaluation, Solution
from engine.simulation.provenance import Computer, Origin
from engine.storage.layouts.bases import Detail, detail_of
from engine.storage.layouts.compact import (
    closed_of,
    digest_of_changes,
    evaluation_of,
    record_of,
    unpacked,
)
from engine.storage.layouts.controllers import Genes
from engine.storage.layouts.plain import from_row
from engine.storage.layouts.tables import Change, Closed, Record, digest
from engine.storage.reader import RunReader, check_fits
from engine.storage.salvage import Row, salvage
from engine.storage.schema import COLUMNS
from engine.tasks import fitness

_COLUMNS: Final = COLUMNS[2]["evaluations"].split()
_FITNESS: Final = _COLUMNS.index("fitness")


class SalvagedTables:
    """The rows of a damaged run by table, whatever its format; a row that does not fit its table is left out.

    Attributes:
        path: of the run.
        meta: facts about the whole run, by key.
        generation_of: the generation of each evaluation that is whole.
        damaged: numbers of evaluations that differ from what was written.
        generations: what is recorded of each.
        placements: all changes of maps.
        state: the generation and the JSON that resuming needs.
        pages: how many there are, are missing and are broken; its rows are gone.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.meta: dict[str, Any] = {}
        self.generation_of: dict[int, int] = {}
        self.damaged: set[int] = set()
        self.generations: dict[int, Closed] = {}
        self.placements: list[Change] = []
        self.state: tuple[int, str] | None = None
        self._computers: dict[int, str] = {}
        self._computed: dict[int, tuple[int, float | None]] = {}
        self._digests: dict[int, bytes] = {}
        self._candidates: dict[int, list[tuple[Any, ...]]] = defaultdict(list)
        self._records: dict[int, list[tuple[Any, ...]]] = defaultdict(list)
        self._details: dict[int, list[tuple[Any, ...]]] = defaultdict(list)
        self._links: dict[int, tuple[Any, ...]] = {}
        self._known: dict[int, Detail] = {}
        self._waiting: dict[int, tuple[Record | None, tuple[Any, ...]]] = {}
        self.pages = salvage(path)
        for row in self.pages.rows:
            self._sort(row)
        self.pages.rows.clear()

    @property
    def n_visible(self) -> int:
        """How many evaluations are there, whether they are whole or not."""
        return len({*self._candidates, *self._records})

    @property
    def projection(self) -> dict[str, str] | None:
        """The source of a projected run."""
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

    def given(self) -> list[GivenRobot]:
        """Return the robots that the run started from; none if they are lost."""
        try:
            return [GivenRobot.from_json(robot) for robot in self.meta.get("given", [])]
        except (InvalidData, *UNEXPECTED_DATA):
            return []

    @property
    def created_at(self) -> str:
        """When the run was made, which identifies it in other files."""
        return str(self.meta.get("created_at", ""))

    def check_evaluations(self, config: RunConfig) -> dict[int, Evaluation]:
        """Return the intact evaluations, by number, and remember the damaged ones.

        Those whose controller is stored over one that is lost wait until this is known, see ``learn``.
        """
        found = {}
        for number, rows in sorted(self._candidates.items()):
            for row in rows:
                e = self._plain_evaluation(config, number, row)
                if e is not None:
                    found[number] = e
                    self.generation_of[number] = row[1]
            if number not in found:
                self.damaged.add(number)
        for number in sorted({*self._records, *self._details}):
            records, details = self._records.get(number, []), self._details.get(number, [])
            record = next(filter(None, map(_intact_record, records)), None)
            detail = next((d for d in details if d[-1] == digest(d[:-1], "details")), None)
            if detail is not None:
                self._waiting[number] = record, detail
            if records and (record is None or detail is None):
                self.damaged.add(number)
        return found | self._decoded(config)

    def learn(self, config: RunConfig, s: Solution) -> dict[int, Evaluation]:
        """Take a solution whose evaluation is lost; return the evaluations that were waiting for it."""
        if not self._waiting:
            return {}
        self._known[s.number] = Detail(None, 0, Genes.of(s.controller), b"", b"")
        return self._decoded(config)

    def _decoded(self, config: RunConfig) -> dict[int, Evaluation]:
        found = {}
        for number, (record, row) in sorted(self._waiting.items()):
            if row[1] is not None and row[1] not in self._known:
                continue
            del self._waiting[number]
            try:
                self._known[number] = detail_of(row, self._known)
                if record is not None:
                    e = evaluation_of(record, self._known)
                    check_fits(config, e)
                    found[number] = e
                    self.generation_of[number] = record.generation
            except (InvalidData, *UNEXPECTED_DATA):
                self.damaged.add(number)
        return found

    def origins_of(self, evaluations: Iterable[Evaluation]) -> list[Origin | None]:
        """Return the origin of each evaluation, None where it is not known or lost."""
        origins: list[Origin | None] = []
        for e in evaluations:
            computer, seconds = self._computed.get(e.solution.number, (None, None))
            try:
                facts = Computer.from_json(json.loads(self._computers[computer or 0]))
                origins.append(Origin(facts, None if seconds is None else float(seconds)))
            except (InvalidData, *UNEXPECTED_DATA):
                origins.append(None)
        return origins

    def n_whole(self, evaluations: Mapping[int, Evaluation]) -> int:
        """Return how many generations are recorded whole."""
        n = n_evaluations = 0
        before = b""
        while n in self.generations:
            total = self.generations[n].n_evaluations
            if not all(k in evaluations for k in range(n_evaluations, total)):
                break
            link = self._links.get(n)
            if link is not None:
                changes = sorted((c for c in self.placements if c[0] == n), key=lambda c: c[:3])
                if link[-1] != digest((*link[:-1], before), "generations"):
                    break
                if link[-2] != digest_of_changes(changes):
                    break
                before = link[-1]
            elif not self._placements_are_whole(n, evaluations):
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
        """Tell whether the archives of a generation have as many filled cells as its figures say."""
        held: dict[tuple[str, str], int | None] = {}
        for g, archive, cell, number in sorted(self.placements, key=lambda p: p[0]):
            if g <= generation:
                held[archive, cell] = number
        try:
            figures = json.loads(self.generations[generation].archives)
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

    def _plain_evaluation(self, config: RunConfig, number: int, row: tuple[Any, ...]) -> Evaluation | None:
        try:
            e = from_row(dict(zip(_COLUMNS, row, strict=True)))
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
        values = (row.rowid, *row.values[1:])
        match row:
            # format 3
            case Row(int(number), (None, int(), str(), int() | None, str(), *_)) if len(values) == 12:
                spent = values[10]
                self._records[number].append((*values[:6], _real(values[6]), *values[7:]))
                if type(values[9]) is int and (spent is None or type(spent) is int):
                    self._computed[number] = values[9], None if spent is None else spent / 1e6
            case Row(int(number), (None, int() | None, bytes(), bytes(), bytes(), bytes())):
                self._details[number].append(values)
            case Row(int(number), (None, int(), int(), bytes(), str(), float() | int(), bytes(), bytes())):
                with contextlib.suppress(InvalidData, *UNEXPECTED_DATA):
                    self._links[number] = (*values[:5], float(values[5]), *values[6:])
                    self.generations[number] = closed_of(self._links[number])
            case Row(1, (None, int(generation), bytes(algorithm), bytes())):
                intact = values[-1] == digest(values[:-1], "state")
                if intact and (self.state is None or self.state[0] < generation):
                    with contextlib.suppress(InvalidData, *UNEXPECTED_DATA):
                        self.state = generation, unpacked(algorithm)
            case Row(int(number), (None, str(facts), int(), bytes())):
                if values[-1] == digest(values[:-1], "computers"):
                    self._computers[number] = facts
            case Row(None, (int(), str(), str(), int() | None)):
                self.placements.append(row.values)
            # formats 1 and 2
            case Row(int(number), (None, int(), str(), str(), *_)) if len(values) == 12 and number >= 0:
                # SQLite stores whole numbers short
                ordered = (*values[:_FITNESS], _real(values[_FITNESS]), *values[_FITNESS + 1 :])
                self._candidates[number].append(ordered)
            case Row(int(number), (None, int(), int(), str(), str(), float() | int())) if number >= 0:
                self.generations[number] = Closed(*values)
            case Row(1, (None, int(generation), str(algorithm))):
                self.state = generation, algorithm
            case Row(int(number), (None, str(facts))):
                self._computers[number] = facts
            case Row(int(number), (None, int(computer), (float() | int() | None) as seconds)):
                self._computed[number] = computer, seconds
            case Row(int(number), (None, bytes(value))):
                self._digests[number] = value
            case Row(None, (str(archive), str(cell), int(generation), int() | None as number)):
                self.placements.append((generation, archive, cell, number))
            # both
            case Row(None, (str(key), str(value))):
                with contextlib.suppress(ValueError, RecursionError):
                    self.meta[key] = json.loads(value)


def _real(value: Any) -> Any:
    """Return a number as the column that holds fractions gives it back."""
    return float(value) if type(value) is int else value


def _intact_record(row: tuple[Any, ...]) -> Record | None:
    try:
        return record_of(row)
    except (InvalidData, *UNEXPECTED_DATA):
        return None


def _cell(text: str) -> tuple[int, ...] | None:
    try:
        return tuple(int(p) for p in text.split(","))
    except ValueError:
        return None
