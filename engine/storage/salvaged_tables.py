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
from engine.simulation.evaluation import Evaluation
from engine.simulation.provenance import Computer, Origin
from engine.storage.reader import RunReader, check_fits
from engine.storage.rows import digest, from_row
from engine.storage.salvage import Row, salvage
from engine.storage.schema import COLUMNS
from engine.tasks import fitness

_COLUMNS: Final = COLUMNS["evaluations"].split()
_FITNESS: Final = _COLUMNS.index("fitness")


class SalvagedTables:
    """The rows of a damaged run by table; a row that does not fit its table is left out."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.meta: dict[str, Any] = {}
        self.rows: dict[int, tuple[Any, ...]] = {}
        self.generation_of: dict[int, int] = {}
        self.damaged: set[int] = set()
        self.generations: dict[int, tuple[Any, ...]] = {}
        self.placements: list[tuple[Any, ...]] = []
        self.state: tuple[Any, ...] | None = None
        self._computers: dict[int, str] = {}
        self._computed: dict[int, tuple[int, float | None]] = {}
        self._digests: dict[int, bytes] = {}
        self._candidates: dict[int, list[tuple[Any, ...]]] = defaultdict(list)
        for row in salvage(path).rows:
            self._sort(row)

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

    @property
    def created_at(self) -> str:
        """When the run was made, which identifies it in other files."""
        return str(self.meta.get("created_at", ""))

    def check_evaluations(self, config: RunConfig) -> dict[int, Evaluation]:
        """Return the intact evaluations, by number, and remember the damaged ones."""
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
        """Tell whether the archives of a generation have as many filled cells as its figures say."""
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
        match row:
            case Row(int(number), (None, int(), *_)) if len(row.values) == len(_COLUMNS) and number >= 0:
                values = [number, *row.values[1:]]
                if type(values[_FITNESS]) is int:  # SQLite stores whole numbers short
                    values[_FITNESS] = float(values[_FITNESS])
                self._candidates[number].append(tuple(values))
            case Row(int(number), (None, int(), int(), str(), str(), float() | int())) if number >= 0:
                self.generations[number] = (number, *row.values[1:])
            case Row(1, (None, int(), str())):
                self.state = (1, *row.values[1:])
            case Row(int(number), (None, str(facts))):
                self._computers[number] = facts
            case Row(int(number), (None, int(computer), (float() | int() | None) as seconds)):
                self._computed[number] = computer, seconds
            case Row(int(number), (None, bytes(value))):
                self._digests[number] = value
            case Row(None, (str(archive), str(cell), int(generation), int() | None as number)):
                self.placements.append((generation, archive, cell, number))
            case Row(None, (str(key), str(value))):
                with contextlib.suppress(ValueError, RecursionError):
                    self.meta[key] = json.loads(value)


def _cell(text: str) -> tuple[int, ...] | None:
    try:
        return tuple(int(p) for p in text.split(","))
    except ValueError:
        return None
