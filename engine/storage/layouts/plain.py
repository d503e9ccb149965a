"""The tables of formats 1 and 2: genotypes and figures as JSON, trajectories as they are."""

from __future__ import annotations

import dataclasses
import functools
import json
import math
from collections.abc import Iterable, Iterator, Sequence
from typing import Any, Final

import numpy as np

from engine.body.morphology import Morphology
from engine.control.genome import Controller
from engine.errors import UNEXPECTED_DATA, InvalidData
from engine.files import compact_json
from engine.simulation.evaluation import Evaluation
from engine.simulation.provenance import Computer, Origin
from engine.storage.layouts.tables import CHUNK, Change, Closed, Query, Record, digest, in_chunks


def to_row(generation: int, e: Evaluation) -> tuple[Any, ...]:
    """Return an evaluation in the order of the columns of the table ``evaluations``."""
    s = e.solution
    return (
        s.number,
        generation,
        compact_json(s.morphology.to_json()),
        compact_json(s.controller.to_json()),
        s.parent,
        s.operator,
        s.source,
        e.fitness,
        compact_json(_finite(e.distances)),
        e.trajectory.astype("<f4").tobytes(),
        int(e.head_is_end),
        e.failure,
    )


_LONGEST: Final = {
    "morphology": 10_000,
    "controller": 4_000_000,
    "distances": 1_000_000,
    "trajectory": 4_000_000,
}
"""Characters or bytes of a column, several times what the largest robot needs in the longest trials."""


def from_row(row: Any) -> Evaluation:
    """Read an evaluation back from its row, whose columns are found by name.

    Raises:
        InvalidData: a value is not what ``to_row`` writes.
    """
    where = f"evaluation {row['number']}"
    try:
        for name, most in _LONGEST.items():
            if len(row[name]) > most:
                raise InvalidData(f"its {name} has a length of {len(row[name])}; {most} is the most")
        distances = np.array(json.loads(row["distances"]), dtype=float)
        trajectory = np.frombuffer(row["trajectory"], dtype="<f4")
        if distances.ndim != 2 or not distances.size or trajectory.size % (2 * len(distances)):
            raise InvalidData("distances or trajectory have the wrong size")
        controller = Controller.from_json(json.loads(row["controller"]))
        return _record(row).evaluation(controller, distances, trajectory.reshape(len(distances), -1, 2))
    except InvalidData as e:
        raise InvalidData(f"{where}: {e}") from None
    except UNEXPECTED_DATA as e:
        raise InvalidData(f"{where} is damaged: {e}") from None


def _record(row: Any) -> Record:
    return Record(
        number=int(row["number"]),
        generation=int(row["generation"]),
        morphology=_body(row["morphology"]),
        parent=None if row["parent"] is None else int(row["parent"]),
        operator=str(row["operator"]),
        source=None if row["source"] is None else str(row["source"]),
        fitness=row["fitness"],
        head_is_end=bool(row["head_is_end"]),
        failure=None if row["failure"] is None else str(row["failure"]),
    )


@functools.lru_cache(maxsize=4096)
def _body(text: str) -> Morphology:
    return Morphology.from_json(json.loads(text))


def _finite(values: np.ndarray) -> list[list[float | None]]:
    """Return nested lists, None for what a diverged simulation left undefined."""
    return [[float(v) if math.isfinite(v) else None for v in row] for row in values]


class PlainTables:
    """The ``Tables`` of a run in format 1 or 2.

    Args:
        query: runs a statement.
        version: of the format; 1 has neither digests nor origins.
    """

    def __init__(self, query: Query, version: int) -> None:
        self._query = query
        self._has_digests = version > 1

    def meta(self) -> dict[str, Any]:
        """Return the facts about the whole run, by key."""
        return {k: json.loads(v) for k, v in self._query("SELECT key, value FROM meta")}

    def n_evaluations(self) -> int:
        """Return the number of evaluations.

        Only the open generation's are counted, because counting all reads all of a long run's pages.
        """
        closed = self._query(
            "SELECT generation, n_evaluations FROM generations ORDER BY generation DESC LIMIT 1"
        )
        last, n = (int(v) for v in closed[0]) if closed else (-1, 0)
        # numbers rise from generation to generation
        (opened,) = self._query(
            "SELECT COUNT(*) FROM evaluations WHERE number > COALESCE((SELECT number FROM evaluations"
            " WHERE generation <= ? ORDER BY number DESC LIMIT 1), -1)",
            (last,),
        )[0]
        return n + int(opened)

    def last_generation(self) -> int | None:
        """Return the number of the last closed generation."""
        number = self._query("SELECT MAX(generation) FROM generations")[0][0]
        return None if number is None else int(number)

    def closed(self, after: int) -> list[Closed]:
        """Return the closed generations with a greater number."""
        rows = self._query("SELECT * FROM generations WHERE generation > ? ORDER BY generation", (after,))
        return [Closed(int(r[0]), int(r[1]), int(r[2]), _text(r[3]), str(r[4]), float(r[5])) for r in rows]

    def changes(self, after: int) -> list[Change]:
        """Return all changes of maps after a generation."""
        rows = self._query(
            "SELECT generation, archive, cell, evaluation FROM placements WHERE generation > ?"
            " ORDER BY generation, archive, cell",
            (after,),
        )
        return [(int(g), str(a), str(c), None if n is None else int(n)) for g, a, c, n in rows]

    def state(self) -> tuple[int, str] | None:
        """Return what resuming needs."""
        rows = self._query("SELECT generation, algorithm FROM state")
        return (int(rows[0][0]), _text(rows[0][1])) if rows else None

    def computers(self) -> list[tuple[str, int]]:
        """Return each computer and its number of evaluations; older files have none."""
        if not self._has_origins():
            return []
        rows = self._query(
            "SELECT facts, COUNT(*) FROM computed JOIN computers ON id = computer"
            " GROUP BY facts ORDER BY 2 DESC, 1"
        )
        return [(_text(facts), int(n)) for facts, n in rows]

    def records(self, condition: str, parameters: tuple[Any, ...]) -> list[Record]:
        """Return the records that a condition chooses."""
        rows = self._query(
            "SELECT number, generation, morphology, parent, operator, source, fitness, head_is_end, failure"
            f" FROM evaluations WHERE {condition} ORDER BY number",
            parameters,
        )
        return [_record(r) for r in rows]

    def evaluations(self, numbers: Iterable[int]) -> Iterator[tuple[int, Evaluation]]:
        """Yield generations and evaluations."""
        for condition, part in in_chunks(numbers):
            known = self._digests(condition, part)
            for r in self._query(f"SELECT * FROM evaluations WHERE {condition} ORDER BY number", part):
                if known is not None and known.get(r["number"]) != digest(tuple(r)):
                    raise InvalidData(f"evaluation {r['number']} differs from what was written")
                yield int(r["generation"]), from_row(r)

    def origins(self, numbers: Iterable[int]) -> dict[int, Origin]:
        """Return what computed each evaluation."""
        found = {}
        if self._has_origins():
            for condition, part in in_chunks(numbers):
                rows = self._query(
                    "SELECT evaluation AS number, facts, seconds FROM computed"
                    f" JOIN computers ON id = computer WHERE {condition}",
                    part,
                )
                for number, facts, seconds in rows:
                    computer = Computer.from_json(json.loads(facts))
                    found[int(number)] = Origin(computer, None if seconds is None else float(seconds))
        return found

    def lacks_trajectories(self) -> bool:
        """Tell whether any evaluation is without its trajectory, as in a file made smaller."""
        return bool(self._query("SELECT 1 FROM evaluations WHERE length(trajectory) = 0 LIMIT 1"))

    def check_numbers(self) -> None:
        """Do nothing: nothing says how many evaluations there should be."""

    def differing(self) -> Iterator[tuple[str, list[Any]]]:
        """Yield the evaluations that are not what was written."""
        changed = []
        numbers = [r[0] for r in self._query("SELECT number FROM evaluations ORDER BY number")]
        for i in range(0, len(numbers), CHUNK):
            for condition, part in in_chunks(numbers[i : i + CHUNK]):
                known = self._digests(condition, part)
                if known is not None:
                    rows = self._query(f"SELECT * FROM evaluations WHERE {condition}", part)
                    changed += [r["number"] for r in rows if known.get(r["number"]) != digest(tuple(r))]
        if changed:
            yield "evaluations", changed

    def add_evaluations(
        self, generation: int, evaluations: Sequence[Evaluation], origins: Sequence[Origin | None]
    ) -> None:
        """Save evaluations of a generation."""
        for e in evaluations:
            row = to_row(generation, e)
            self._query(f"INSERT INTO evaluations VALUES ({','.join('?' * len(row))})", row)
            if self._has_digests:
                self._query("INSERT INTO digests VALUES (?, ?)", (row[0], digest(row)))
        if not self._has_origins():
            return
        for e, origin in zip(evaluations, origins, strict=False):
            if origin is not None:
                facts = json.dumps(dataclasses.asdict(origin.computer), sort_keys=True)
                self._query("INSERT OR IGNORE INTO computers (facts) VALUES (?)", (facts,))
                self._query(
                    "INSERT INTO computed SELECT ?, id, ? FROM computers WHERE facts = ?",
                    (e.solution.number, origin.seconds, facts),
                )

    def add_generation(self, closed: Closed, changes: Sequence[Change]) -> None:
        """Save a closed generation."""
        for change in changes:
            self._query("INSERT INTO placements VALUES (?, ?, ?, ?)", change)
        self._query("INSERT INTO generations VALUES (?, ?, ?, ?, ?, ?)", dataclasses.astuple(closed))

    def set_state(self, generation: int, algorithm: str) -> None:
        """Save what resuming needs."""
        self._query("INSERT OR REPLACE INTO state VALUES (1, ?, ?)", (generation, algorithm))

    def _digests(self, condition: str, numbers: tuple[int, ...]) -> dict[int, Any] | None:
        if not self._has_digests:
            return None
        rows = self._query(f"SELECT number, digest FROM digests WHERE {condition}", numbers)
        return dict(map(tuple, rows))

    def _has_origins(self) -> bool:
        return bool(self._query("SELECT 1 FROM sqlite_master WHERE name = 'computed'"))


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise InvalidData(f"expected text, not {value!r:.60}")
    return value
