"""Every evaluation of a run as a table, in pyribs' style, and genotypes read back from such a table."""

from __future__ import annotations

import contextlib
import csv
import io
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

from engine.analysis.elite_table import Table
from engine.body.morphology import Morphology
from engine.control.genome import Controller
from engine.errors import UNEXPECTED_DATA, InvalidData
from engine.files import compact_json, open_file
from engine.storage.reader import RunReader
from engine.tasks import get_task

BODY: Final = "solution_morphology"
CONTROLLER: Final = "solution_controller"
MAX_ROWS: Final = 100_000
"""Rows of the longest table that is read."""
_MAX_CELL: Final = 4_000_000
"""Characters of the longest cell that is read."""


def evaluation_table(reader: RunReader) -> Table:
    """Return a row for every evaluation of a run, in the order of their numbers.

    ``objective`` is f_s in cm, None where a simulation failed; ``measures_0`` and ``measures_1`` are the
    number of modules and their mean relative stiffness. Body and controller are JSON.

    Args:
        reader: of the run.

    Raises:
        RunFileError: the file is damaged, or slimmed.
    """
    distance = get_task(reader.config.task).target_distance
    columns = ["evaluation", "generation", "parent", "operator", "source", "objective", "measures_0"]
    columns += ["measures_1", "head_is_end", "failure", BODY, CONTROLLER]
    rows = []
    for generation, e in reader.each_evaluation():
        s = e.solution
        rows.append(
            (
                s.number,
                generation,
                s.parent,
                s.operator,
                s.source,
                None if e.fitness is None else 100.0 * (distance - e.fitness),
                s.morphology.n_modules,
                s.morphology.stiffness,
                e.head_is_end,
                e.failure,
                compact_json(s.morphology.to_json()),
                compact_json(s.controller.to_json()),
            )
        )
    return {column: [row[i] for row in rows] for i, column in enumerate(columns)}


def read_genotypes(path: Path) -> list[tuple[Morphology, Controller]]:
    """Return the genotypes of a table's rows, in their order.

    Args:
        path: of a CSV or Parquet file with the columns ``solution_morphology`` and ``solution_controller``.

    Raises:
        InvalidData: the file cannot be read, lacks a column, or a row has no genotype; the message names row
            and column. The first row after the heading is row 1.
    """
    rows = _parquet_rows(path) if path.suffix.lower() == ".parquet" else _csv_rows(path)
    found = []
    for k, (body, controller) in enumerate(rows, start=1):
        if k > MAX_ROWS:
            raise InvalidData(f"{path} has more than {MAX_ROWS} rows")
        where = f"{path}, row {k}, column"
        with _naming(f"{where} {BODY}", body):
            morphology = Morphology.from_json(json.loads(body))
        with _naming(f"{where} {CONTROLLER}", controller):
            found.append((morphology, Controller.from_json(json.loads(controller))))
    return found


@contextlib.contextmanager
def _naming(where: str, text: Any) -> Iterator[None]:
    """Give a context that names the place in a table in every error."""
    try:
        yield
    except InvalidData as e:
        raise InvalidData(f"{where}: {e}") from None
    except UNEXPECTED_DATA as e:
        raise InvalidData(f"{where}: {text!r:.60} is no genotype: {e}") from None


def _csv_rows(path: Path) -> Iterator[tuple[Any, Any]]:
    try:
        with open_file(path) as f, io.TextIOWrapper(f, encoding="utf-8-sig", newline="") as text:
            csv.field_size_limit(_MAX_CELL)
            table = csv.DictReader(text)
            _check_columns(path, table.fieldnames or [])
            for row in table:
                yield row[BODY], row[CONTROLLER]
    except OSError as e:
        raise InvalidData(f"{path} cannot be read: {e.strerror or e}") from None
    except (UnicodeDecodeError, csv.Error) as e:
        raise InvalidData(f"{path} is no table: {e}") from None


def _parquet_rows(path: Path) -> list[tuple[Any, Any]]:
    try:
        from pyarrow import ArrowException, parquet
    except ImportError:
        raise InvalidData(
            "Parquet needs pyarrow; install it with: pip install 'tensatlas[parquet]', or take a .csv"
        ) from None
    try:
        with open_file(path) as f:
            names = parquet.read_schema(f).names
            _check_columns(path, names)
            f.seek(0)
            table = parquet.read_table(f, columns=[BODY, CONTROLLER])
    except (OSError, ArrowException) as e:
        raise InvalidData(f"{path} cannot be read: {e}") from None
    return list(zip(table[BODY].to_pylist(), table[CONTROLLER].to_pylist(), strict=True))


def _check_columns(path: Path, names: Any) -> None:
    for column in (BODY, CONTROLLER):
        if column not in names:
            raise InvalidData(f"{path} has no column {column}; 'tensatlas table' writes such tables")
