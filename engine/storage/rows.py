"""Evaluations as rows of a run file, and back, with every value checked on the way in."""

from __future__ import annotations

import hashlib
import json
import math
import struct
from collections.abc import Sequence
from typing import Any

import numpy as np

from engine.body.morphology import Morphology
from engine.control.genome import Controller
from engine.errors import UNEXPECTED_DATA, InvalidData
from engine.search.archive import Cell
from engine.simulation.evaluation import Evaluation, Solution


def cell_name(cell: Cell) -> str:
    """Return a cell as written on the command line and in a run file: ``i,j``."""
    return ",".join(map(str, cell))


def parse_cell(text: str) -> Cell:
    """Read ``i,j`` back.

    Raises:
        InvalidData: it is not whole numbers separated by commas.
    """
    parts = text.split(",")
    if not all(p.strip().isdecimal() and len(p) < 10 for p in parts):
        raise InvalidData(f"a cell is written like 3,7, not {text!r}")
    return tuple(int(p) for p in parts)


def to_row(generation: int, e: Evaluation) -> tuple[Any, ...]:
    """Return an evaluation in the order of the columns of the table ``evaluations``."""
    s = e.solution
    return (
        s.number,
        generation,
        dump(s.morphology.to_json()),
        dump(s.controller.to_json()),
        s.parent,
        s.operator,
        s.source,
        e.fitness,
        dump(_finite(e.distances)),
        e.trajectory.astype("<f4").tobytes(),
        int(e.head_is_end),
        e.failure,
    )


def from_row(row: Any) -> Evaluation:
    """Read an evaluation back from its row, whose columns are found by name.

    Raises:
        InvalidData: a value is not what ``to_row`` writes.
    """
    where = f"evaluation {row['number']}"
    try:
        distances = np.array(json.loads(row["distances"]), dtype=float)
        trajectory = np.frombuffer(row["trajectory"], dtype="<f4")
        if distances.ndim != 2 or not distances.size or trajectory.size % (2 * len(distances)):
            raise InvalidData(f"{where}: distances or trajectory have the wrong size")
        fitness = row["fitness"]
        if fitness is not None and not (
            isinstance(fitness, float) and math.isfinite(fitness) and np.isfinite(trajectory).all()
        ):
            raise InvalidData(f"{where}: fitness or trajectory is not a finite number")
        solution = Solution(
            number=int(row["number"]),
            morphology=Morphology.from_json(json.loads(row["morphology"])),
            controller=Controller.from_json(json.loads(row["controller"])),
            parent=None if row["parent"] is None else int(row["parent"]),
            operator=str(row["operator"]),
            source=None if row["source"] is None else str(row["source"]),
        )
        return Evaluation(
            solution=solution,
            fitness=fitness,
            distances=distances,
            trajectory=trajectory.reshape(len(distances), -1, 2),
            head_is_end=bool(row["head_is_end"]),
            failure=None if row["failure"] is None else str(row["failure"]),
        )
    except InvalidData as e:
        raise e if str(e).startswith(where) else InvalidData(f"{where}: {e}") from None
    except UNEXPECTED_DATA as e:
        raise InvalidData(f"{where} is damaged: {e}") from None


def digest(row: Sequence[Any]) -> bytes:
    """Return what tells a row of the table ``evaluations`` from one whose bytes have changed since.

    Args:
        row: as ``to_row`` returns it or the table holds it.
    """
    found = hashlib.blake2b(digest_size=8)
    for value in row:
        match value:
            case None:
                kind, content = b"n", b""
            case bytes():
                kind, content = b"b", value
            case float():
                kind, content = b"f", struct.pack(">d", value)
            case _:
                kind, content = b"t", str(value).encode(errors="surrogateescape")
        found.update(kind + len(content).to_bytes(8, "big") + content)
    return found.digest()


def dump(value: Any) -> str:
    """Return compact JSON; floats survive the trip exactly."""
    return json.dumps(value, separators=(",", ":"), allow_nan=False)


def _finite(values: np.ndarray) -> list[list[float | None]]:
    """Return nested lists, None for what a diverged simulation left undefined."""
    return [[float(v) if math.isfinite(v) else None for v in row] for row in values]
