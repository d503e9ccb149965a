"""The rows of the table ``details``: controllers that are stored as changes of older ones."""

from __future__ import annotations

import dataclasses
from collections import OrderedDict
from collections.abc import Iterable
from typing import Any, Final

from engine.errors import UNEXPECTED_DATA, InvalidData
from engine.simulation.evaluation import Solution
from engine.storage.layouts.controllers import EMPTY, Genes, decode, encode
from engine.storage.layouts.tables import Query, digest, in_chunks

LONGEST: Final = 4
"""Most bases of bases that a controller is stored over. With every one more, a lost row takes more others
with it and a controller is read more slowly.
"""
_WORTH: Final = 0.9
"""Largest share of its own size that a controller may take over its base, or it is stored alone."""
_TOLERATED: Final = 16
"""Most that are read."""
_REMEMBERED: Final = 128
"""Controllers that a writer remembers, of the latest evaluations."""


@dataclasses.dataclass(frozen=True, slots=True)
class Detail:
    """What a row of ``details`` holds.

    Attributes:
        base: number of the evaluation that the controller is stored over.
        depth: how many bases of bases there are.
        genes: of the controller.
        distances, trajectory: as they are stored.
    """

    base: int | None
    depth: int
    genes: Genes
    distances: bytes
    trajectory: bytes


@dataclasses.dataclass(frozen=True, slots=True)
class _Known:
    """A controller that another one may be stored over."""

    base: int | None
    depth: int
    genes: Genes
    values: frozenset[float]


class Bases:
    """Reads controllers with all that they are stored over, and chooses what a new one is stored over.

    Args:
        query: runs a statement.
    """

    def __init__(self, query: Query) -> None:
        self._query = query
        self._latest: OrderedDict[int, _Known] = OrderedDict()

    def details(self, numbers: Iterable[int]) -> dict[int, Detail]:
        """Return the details of some evaluations, and of their bases, by number.

        Raises:
            InvalidData: a row is not what was written, or a base is missing.
        """
        rows: dict[int, Any] = {}
        wanted = set(numbers)
        for _ in range(_TOLERATED + 1):
            for condition, part in in_chunks(wanted):
                rows |= {
                    r["number"]: r for r in self._query(f"SELECT * FROM details WHERE {condition}", part)
                }
            wanted = {r["base"] for r in rows.values() if r["base"] is not None} - set(rows)
        return details_of(rows)

    def choose(self, s: Solution) -> tuple[int | None, bytes]:
        """Return the base of a new controller, if any, and the controller as bytes; remember it.

        The base is the parent, one of the parent's bases or one of the latest controllers: that with the most
        equal values. ViE-NEAT's ``parent`` is the body's alone.
        """
        genes = Genes.of(s.controller)
        values = frozenset(genes.values.tolist())
        candidates = {**self._line(s.parent), **self._latest}
        n_shared = {
            n: len(values & known.values)
            for n, known in candidates.items()
            if n < s.number and known.depth < LONGEST
        }
        # numbers decide between equals, so that equal runs are equal files
        best = max(n_shared, key=lambda n: (n_shared[n], n), default=None)
        base, content = None, encode(genes)
        if best is not None:
            changes = encode(genes, candidates[best].genes)
            if len(changes) < _WORTH * len(content):
                base, content = best, changes
        depth = 0 if base is None else candidates[base].depth + 1
        self._latest[s.number] = _Known(base, depth, genes, values)
        if len(self._latest) > _REMEMBERED:
            self._latest.popitem(last=False)
        return base, content

    def _line(self, number: int | None) -> dict[int, _Known]:
        """Return a controller and all that it is stored over; nothing if it is not in the file."""
        found: dict[int, _Known] = {}
        while number is not None and number in self._latest:
            found[number] = self._latest[number]
            number = found[number].base
        if number is not None:
            found |= {
                n: _Known(d.base, d.depth, d.genes, frozenset(d.genes.values.tolist()))
                for n, d in self.details([number]).items()
            }
        return found


def details_of(rows: dict[int, Any]) -> dict[int, Detail]:
    """Return what rows of ``details`` hold, by number; all bases are among them.

    Raises:
        InvalidData: a row is not what was written, or a base is missing.
    """
    found: dict[int, Detail] = {}
    for number in sorted(rows):
        found[number] = detail_of(rows[number], found)
    return found


def detail_of(row: Any, known: dict[int, Detail]) -> Detail:
    """Return what a row of ``details`` holds, its columns found by their places.

    Args:
        row: of the table.
        known: the details of the bases, by number.

    Raises:
        InvalidData: the row is not what was written, or the base is not known.
    """
    number, base, controller, distances, trajectory, _ = row
    where = f"evaluation {number}"
    if row[-1] != digest(tuple(row)[:-1], "details"):
        raise InvalidData(f"{where} differs from what was written")
    under = None
    if base is not None:
        under = known.get(base)
        if under is None or base >= number or under.depth >= _TOLERATED:
            raise InvalidData(f"{where} is stored over evaluation {base}, which is missing or impossible")
    try:
        genes = decode(controller, EMPTY if under is None else under.genes)
    except InvalidData as e:
        raise InvalidData(f"{where}: {e}") from None
    except UNEXPECTED_DATA as e:
        raise InvalidData(f"{where} is damaged: {e}") from None
    if not isinstance(distances, bytes) or not isinstance(trajectory, bytes):
        raise InvalidData(f"{where}: distances or trajectory are no bytes")
    return Detail(base, 0 if under is None else under.depth + 1, genes, distances, trajectory)
