"""The tables of format 3: compressed columns, and a digest of every row."""

from __future__ import annotations

import dataclasses
import functools
import json
import zlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, Final, cast

import numpy as np

from engine.body.feet import Feet
from engine.body.morphology import Morphology
from engine.errors import UNEXPECTED_DATA, InvalidData
from engine.simulation.evaluation import Evaluation
from engine.simulation.provenance import Computer, Origin
from engine.storage.layouts import trajectories
from engine.storage.layouts.bases import Bases, Detail
from engine.storage.layouts.numbers import Bytes, inflate, varint
from engine.storage.layouts.tables import CHUNK, Change, Closed, Query, Record, digest, in_chunks

MAX_JSON: Final = 64_000_000
"""Largest size in bytes of compressed JSON before its compression."""
SEAL: Final = "digest"
"""Key of the row of ``meta`` that holds the digest of all others."""


@dataclasses.dataclass(frozen=True, slots=True)
class _Totals:
    """The columns of ``totals``, in their order."""

    n_evaluations: int = 0
    n_details: int = 0
    n_states: int = 0
    n_computers: int = 0
    last_generation: int | None = None


class CompactTables:
    """The ``Tables`` of a run in format 3.

    Args:
        query: runs a statement.
    """

    def __init__(self, query: Query) -> None:
        self._query = query
        self._bases = Bases(query)

    # ---- reading

    def meta(self) -> dict[str, Any]:
        """Return the facts about the whole run, by key."""
        rows = {str(k): v for k, v in self._query("SELECT key, value FROM meta")}
        if rows.pop(SEAL, None) != seal(rows):
            raise InvalidData("its configuration or the table meta differs from what was written")
        return {k: json.loads(v) for k, v in rows.items()}

    def n_evaluations(self) -> int:
        """Return the number of evaluations."""
        return self._totals().n_evaluations

    def last_generation(self) -> int | None:
        """Return the number of the last closed generation."""
        return self._totals().last_generation

    def closed(self, after: int) -> list[Closed]:
        """Return the closed generations with a greater number."""
        return [closed_of(row) for row in self._generations(after)]

    def changes(self, after: int) -> list[Change]:
        """Return all changes of maps after a generation."""
        placed = {row[0]: row[6] for row in self._generations(after)}
        found: dict[int, list[Change]] = {g: [] for g in placed}
        rows = self._query(
            "SELECT generation, archive, cell, evaluation FROM placements WHERE generation > ?"
            " ORDER BY generation, archive, cell",
            (after,),
        )
        for row in rows:
            # a generation that is newer than the list of them is left for the next time
            if row[0] in found:
                found[row[0]].append(tuple(row))
        for generation, changes in found.items():
            if placed[generation] != digest_of_changes(changes):
                raise InvalidData(f"the maps of generation {generation} differ from what was written")
        return [change for changes in found.values() for change in changes]

    def state(self) -> tuple[int, str] | None:
        """Return what resuming needs."""
        totals = self._totals()
        rows = self._query("SELECT * FROM state")
        if not totals.n_states and not rows:
            return None
        (row,) = rows
        last = -1 if totals.last_generation is None else totals.last_generation
        if row["digest"] != digest(tuple(row)[:-1], "state") or row["generation"] < last:
            raise InvalidData("the state to resume from differs from what was written")
        return int(row["generation"]), unpacked(row["algorithm"])

    def computers(self) -> list[tuple[str, int]]:
        """Return each computer and its number of evaluations."""
        found = [(str(r["facts"]), int(r["n_evaluations"])) for r in self._computers().values()]
        return sorted((c for c in found if c[1]), key=lambda c: (-c[1], c[0]))

    def records(self, condition: str, parameters: tuple[Any, ...]) -> list[Record]:
        """Return the records that a condition chooses."""
        rows = self._query(f"SELECT * FROM evaluations WHERE {condition} ORDER BY number", parameters)
        return [record_of(r) for r in rows]

    def evaluations(self, numbers: Iterable[int]) -> Iterator[tuple[int, Evaluation]]:
        """Yield generations and evaluations."""
        for condition, part in in_chunks(numbers):
            records = self.records(condition, part)
            details = self._bases.details([r.number for r in records])
            for r in records:
                yield r.generation, evaluation_of(r, details)

    def origins(self, numbers: Iterable[int]) -> dict[int, Origin]:
        """Return what computed each evaluation."""
        computers = {
            number: Computer.from_json(json.loads(r["facts"])) for number, r in self._computers().items()
        }
        found = {}
        for condition, part in in_chunks(numbers):
            for r in self._query(f"SELECT * FROM evaluations WHERE {condition}", part):
                record_of(r)
                if r["computer"] is not None:
                    spent = r["microseconds"]
                    found[r["number"]] = Origin(
                        computers[r["computer"]], None if spent is None else spent / 1e6
                    )
        return found

    def lacks_trajectories(self) -> bool:
        """Tell whether any evaluation is without its trajectory."""
        totals = self._totals()
        if totals.n_details < totals.n_evaluations:
            return True
        return bool(self._query("SELECT 1 FROM details WHERE length(trajectory) = 0 LIMIT 1"))

    def check_numbers(self) -> None:
        """Make sure that no evaluation is missing."""
        totals = self._totals()
        for table, n in (("evaluations", totals.n_evaluations), ("details", totals.n_details)):
            (found,) = self._query(f"SELECT COUNT(*) FROM {table}")[0]
            if found != n:
                raise InvalidData(f"table {table} has {found} rows instead of {n}")

    def differing(self) -> Iterator[tuple[str, list[Any]]]:
        """Yield the rows that are not what was written, table by table."""
        for table, check in (("meta", self.meta), ("totals", self._totals), ("state", self.state)):
            try:
                check()
            except (InvalidData, *UNEXPECTED_DATA):
                yield table, ["the whole"]
        for table, key in (("evaluations", "number"), ("details", "number"), ("computers", "id")):
            keys = [r[0] for r in self._query(f"SELECT {key} FROM {table} ORDER BY 1")]
            changed = []
            for i in range(0, len(keys), CHUNK):
                part = tuple(keys[i : i + CHUNK])
                rows = self._query(
                    f"SELECT * FROM {table} WHERE {key} IN ({','.join('?' * len(part))}) ORDER BY 1", part
                )
                changed += [r[0] for r in rows if r["digest"] != digest(tuple(r)[:-1], table)]
            if changed:
                yield table, changed
            try:
                n = getattr(self._totals(), f"n_{table}")
            except (InvalidData, *UNEXPECTED_DATA):
                continue
            if len(keys) < n:
                yield table, [f"{n - len(keys)} are missing"]
        try:
            self.changes(-1)
        except (InvalidData, *UNEXPECTED_DATA) as e:
            yield "generations", [str(e)]

    def _totals(self) -> _Totals:
        rows = self._query("SELECT * FROM totals")
        if len(rows) != 1 or rows[0]["digest"] != digest(tuple(rows[0])[:-1], "totals"):
            raise InvalidData("the table totals differs from what was written")
        return _Totals(*tuple(rows[0])[1:-1])

    def _generations(self, after: int) -> list[tuple[Any, ...]]:
        """Return the rows of the closed generations with a greater number, in order."""
        last = self._totals().last_generation
        if last is None or last <= after:
            return []
        rows = self._query(
            "SELECT * FROM generations WHERE generation > ? AND generation <= ? ORDER BY generation",
            (after, last),
        )
        if not rows or rows[-1]["generation"] != last:
            raise InvalidData(f"generation {last} is missing")
        # each digest is also of the one before, so that none can be missing between two
        before = self._digest_before(rows[0]["generation"])
        found = [tuple(r) for r in rows]
        for values in found:
            if values[-1] != digest((*values[:-1], before), "generations"):
                raise InvalidData(f"generation {values[0]} differs from what was written")
            before = values[-1]
        return found

    def _digest_before(self, generation: int) -> bytes:
        """Return the digest of the generation before one, or nothing for the first."""
        sql = "SELECT digest FROM generations WHERE generation < ? ORDER BY generation DESC LIMIT 1"
        before = self._query(sql, (generation,))
        return before[0][0] if before else b""

    def _computers(self) -> dict[int, Any]:
        n = self._totals().n_computers
        rows = self._query("SELECT * FROM computers")
        if len(rows) < n or any(r["digest"] != digest(tuple(r)[:-1], "computers") for r in rows):
            raise InvalidData("the table computers differs from what was written")
        return {int(r["id"]): r for r in rows}

    # ---- writing

    def create(self, meta: dict[str, str]) -> None:
        """Fill the tables of a new run.

        Args:
            meta: JSON by key.
        """
        for key, value in (meta | {SEAL: seal(meta)}).items():
            self._query("INSERT INTO meta VALUES (?, ?)", (key, value))
        self._insert("totals", (1, *dataclasses.astuple(_Totals())))

    def add_evaluations(
        self, generation: int, evaluations: Sequence[Evaluation], origins: Sequence[Origin | None]
    ) -> None:
        """Save evaluations of a generation."""
        known = {e.solution.number: o for e, o in zip(evaluations, origins, strict=False) if o is not None}
        self.add_records([Record.of(generation, e) for e in evaluations], known)
        self.add_details(evaluations)

    def add_records(self, records: Sequence[Record], origins: Mapping[int, Origin]) -> None:
        """Save what is not large of evaluations, and what computed them, by number."""
        for r in records:
            self._insert("evaluations", self._to_row(r, origins.get(r.number)))
        totals = self._totals()
        self._set(totals, n_evaluations=totals.n_evaluations + len(records))

    def add_details(self, evaluations: Sequence[Evaluation]) -> None:
        """Save controllers, distances and trajectories of evaluations."""
        for e in evaluations:
            base, controller = self._bases.choose(e.solution)
            distances = varint(len(e.distances)) + e.distances.astype("<f8").tobytes()
            trajectory = trajectories.encode(e.trajectory)
            self._insert("details", (e.solution.number, base, controller, distances, trajectory))
        totals = self._totals()
        self._set(totals, n_details=totals.n_details + len(evaluations))

    def add_generation(self, closed: Closed, changes: Sequence[Change]) -> None:
        """Save a closed generation and its changes of maps."""
        ordered = sorted(changes, key=lambda c: c[:3])
        for change in ordered:
            self._query("INSERT INTO placements VALUES (?, ?, ?, ?)", change)
        values = (*dataclasses.astuple(closed), digest_of_changes(ordered))
        values = (*values[:3], packed(closed.archives), *values[4:])
        chained = digest((*values, self._digest_before(closed.generation)), "generations")
        self._query("INSERT INTO generations VALUES (?, ?, ?, ?, ?, ?, ?, ?)", (*values, chained))
        self._set(self._totals(), last_generation=closed.generation)

    def set_state(self, generation: int, algorithm: str) -> None:
        """Save what resuming needs."""
        self._set(self._totals(), n_states=1)
        self._insert("state", (1, generation, packed(algorithm)))

    def _to_row(self, r: Record, origin: Origin | None) -> tuple[Any, ...]:
        seconds = None if origin is None else origin.seconds
        return (
            r.number,
            r.generation,
            body_text(r.morphology),
            r.parent,
            r.operator,
            r.source,
            r.fitness,
            int(r.head_is_end),
            r.failure,
            None if origin is None else self._computer(origin.computer),
            None if seconds is None else round(1e6 * seconds),
        )

    def _computer(self, computer: Computer) -> int:
        """Count an evaluation of a computer and return its number."""
        facts = json.dumps(dataclasses.asdict(computer), sort_keys=True)
        known = self._computers()
        for number, row in known.items():
            if row["facts"] == facts:
                self._insert("computers", (number, facts, row["n_evaluations"] + 1))
                return number
        number = 1 + max(known, default=0)
        self._insert("computers", (number, facts, 1))
        self._set(self._totals(), n_computers=len(known) + 1)
        return number

    def _set(self, totals: _Totals, **changes: int) -> None:
        self._insert("totals", (1, *dataclasses.astuple(dataclasses.replace(totals, **changes))))

    def _insert(self, table: str, row: tuple[Any, ...]) -> None:
        """Save a row in place of the one of this key, if there may be one."""
        verb = "INSERT OR REPLACE" if table in ("totals", "state", "computers") else "INSERT"
        marks = ",".join("?" * (len(row) + 1))
        self._query(f"{verb} INTO {table} VALUES ({marks})", (*row, digest(row, table)))


def seal(meta: dict[str, str]) -> str:
    """Return the digest of the rows of ``meta``, JSON by key, as a hexadecimal number."""
    return digest([part for item in sorted(meta.items()) for part in item], "meta").hex()


def digest_of_changes(changes: Sequence[Change]) -> bytes:
    """Return the digest of the changes of one generation, in the order of archive and cell."""
    return digest([value for change in changes for value in change], "placements")


def record_of(row: Any) -> Record:
    """Return the record that a row of ``evaluations`` holds, its columns found by their places.

    Raises:
        InvalidData: it is not what was written.
    """
    number, generation, morphology, parent, operator, source, fitness, head_is_end, failure, *rest = row
    where = f"evaluation {number}"
    if rest[-1] != digest(tuple(row)[:-1], "evaluations"):
        raise InvalidData(f"{where} differs from what was written")
    try:
        return Record(
            _whole(number),
            _whole(generation),
            body_of(morphology),
            None if parent is None else _whole(parent),
            str(operator),
            None if source is None else str(source),
            fitness,
            bool(head_is_end),
            None if failure is None else str(failure),
        )
    except InvalidData as e:
        raise InvalidData(f"{where}: {e}") from None
    except UNEXPECTED_DATA as e:
        raise InvalidData(f"{where} is damaged: {e}") from None


def evaluation_of(record: Record, details: dict[int, Detail]) -> Evaluation:
    """Return an evaluation of its record and the details.

    Raises:
        InvalidData: the details lack it, or are not what was written.
    """
    where = f"evaluation {record.number}"
    detail = details.get(record.number)
    if detail is None:
        raise InvalidData(f"the details of {where} are missing")
    try:
        content = Bytes(detail.distances)
        n = content.varint()
        distances = np.frombuffer(content.rest(), dtype="<f8").astype(float)
        if not 0 < n <= len(distances) or len(distances) % n:
            raise InvalidData("distances or trajectory have the wrong size")
        trajectory = trajectories.decode(detail.trajectory, n)
        return record.evaluation(detail.genes.controller(), distances.reshape(n, -1), trajectory)
    except InvalidData as e:
        raise InvalidData(f"{where}: {e}") from None
    except UNEXPECTED_DATA as e:
        raise InvalidData(f"{where} is damaged: {e}") from None


def closed_of(row: Sequence[Any]) -> Closed:
    """Return the generation that a row of ``generations`` holds, its columns found by their places."""
    n, n_evaluations, n_failed, archives, finished_at, seconds, *_ = row
    return Closed(
        int(n), int(n_evaluations), int(n_failed), unpacked(archives), str(finished_at), float(seconds)
    )


def _whole(value: Any) -> int:
    if type(value) is not int:
        raise InvalidData(f"expected a whole number, not {value!r:.60}")
    return value


def body_text(body: Morphology) -> str:
    """Return a body as text: its stiffness level, or those of its modules, and its faces: ``8/24336``.

    Its rhythms follow, if it has any, then its feet: ``8/24336/01172``, ``8/24336/01172/end``,
    ``8/24336//end``.
    """
    level = body.stiffness_level
    levels = ",".join(map(str, level)) if isinstance(level, tuple) else str(level)
    parts = [levels, *("".join(map(str, genes)) for genes in (body.faces, body.rhythms))]
    if body.feet != "none":
        parts.append(body.feet)
    return "/".join(parts).removesuffix("/")


@functools.lru_cache(maxsize=4096)
def body_of(text: str) -> Morphology:
    """Return what ``body_text`` made a text of.

    Raises:
        InvalidData: it is no such text.
    """
    try:
        levels, *rest = text.split("/", 3)
        faces, rhythms, feet = (*rest, *("", "", "none")[len(rest) :])
        parts = tuple(map(int, levels.split(",")))
        body = Morphology(
            parts if len(parts) > 1 else parts[0],
            tuple(map(int, faces)),
            tuple(map(int, rhythms)),
            cast(Feet, feet),
        )
        # one body has one text
        if body_text(body) != text:
            raise ValueError
        return body
    except ValueError:
        raise InvalidData(f"{text!r:.60} is no body") from None


def packed(text: str) -> bytes:
    """Return JSON compressed by raw deflate."""
    compressor = zlib.compressobj(6, zlib.DEFLATED, -15, 9)
    return compressor.compress(text.encode()) + compressor.flush()


def unpacked(content: Any) -> str:
    """Return what ``packed`` compressed.

    Raises:
        InvalidData: it is damaged.
    """
    if not isinstance(content, bytes):
        raise InvalidData("compressed data is no bytes")
    return inflate(content, MAX_JSON).decode()
