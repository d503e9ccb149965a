"""The elites of a run as a table whose columns are named as in pyribs' ``ArchiveDataFrame``."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from engine.analysis.elite_maps import final_descriptor
from engine.errors import ExportError, RunFileError
from engine.files import compact_json, csv_text, write_files
from engine.search.archive import Cell, cell_name
from engine.search.axes import Axis, body_axes, body_measure, cell_centre, cell_index, trajectory_axes
from engine.search.descriptors import TrajectoryDescriptor, sensory_data
from engine.simulation.evaluation import Evaluation
from engine.storage.reader import RunReader
from engine.tasks import get_task

Table = dict[str, list[Any]]
"""Columns by name, all equally long; None where a row has no such value."""


def elite_table(reader: RunReader, archive: str | None = None) -> Table:
    """Return a row for every elite at the end of a run, sorted by archive and cell.

    ``objective`` is f_s in cm; ``measures_0``, ``measures_1`` ... lie along the archive's axes, in their
    units; ``index`` is the cell's in row-major order. Body and controller are JSON.

    Args:
        reader: of the run.
        archive: the only archive to take; None for all.

    Raises:
        RunFileError: there is no finished generation or no such archive, or the file is damaged.
    """
    last = reader.finished_generation(archive)
    distance = get_task(reader.config.task).target_distance
    names = sorted(last.archives) if archive is None else [archive]
    most = max(len(last.archives[name].axes) for name in names)
    rows = []
    for name in names:
        axes = last.archives[name].axes
        shape = tuple(a.n for a in axes)
        movement = [axes[i] for i in trajectory_axes(axes)]
        descriptor = final_descriptor(reader, movement) if movement else None
        contents = reader.contents(name, last.number)
        with reader.guard():
            for cell, e in sorted(contents.items()):
                if e.fitness is None:
                    raise RunFileError(
                        f"{reader.path} is damaged: evaluation {e.solution.number} holds a cell of a map"
                    )
                measures = _measures(axes, cell, e, descriptor, reader.config.map_search.sensory)
                rows.append(
                    {
                        "archive": name,
                        "index": int(np.ravel_multi_index(cell, shape)),
                        "objective": 100.0 * (distance - e.fitness),
                        **{f"measures_{i}": v for i, v in enumerate(measures)},
                        "cell": cell_name(cell),
                        "evaluation": e.solution.number,
                        "parent": e.solution.parent,
                        "solution_morphology": compact_json(e.solution.morphology.to_json()),
                        "solution_controller": compact_json(e.solution.controller.to_json()),
                    }
                )
    columns = ["archive", "index", "objective", *(f"measures_{i}" for i in range(most))]
    columns += ["cell", "evaluation", "parent", "solution_morphology", "solution_controller"]
    return {c: [row.get(c) for row in rows] for c in columns}


def _measures(
    axes: Sequence[Axis],
    cell: Cell,
    e: Evaluation,
    descriptor: TrajectoryDescriptor | None,
    sensory: str,
) -> list[float]:
    """Return an elite's values along an archive's axes.

    An elite without a trajectory, and one that is placed at the edge of a map because it lies outside,
    is put at the centre of its cell.
    """
    values = [cell_centre(axis, i) for axis, i in zip(axes, cell, strict=True)]
    for i in body_axes(axes):
        values[i] = body_measure(axes[i], e.solution.morphology)
    if descriptor is not None and e.trajectory.size:
        described = descriptor.transform(sensory_data([e.trajectory], sensory))[0]
        for i, value in zip(trajectory_axes(axes), described, strict=True):
            if cell_index(axes[i], value) == cell[i]:
                values[i] = float(value)
    return values


def csv_bytes(table: Table) -> bytes:
    """Return a table as CSV."""
    return csv_text([table, *zip(*table.values(), strict=True)]).encode()


def write_table(table: Table, path: Path) -> None:
    """Write a table as CSV, or as Parquet where the name ends in ``.parquet``.

    Raises:
        ExportError: the name ends in something else, pyarrow is missing or the file cannot be written.
    """
    match path.suffix.lower():
        case ".csv":
            content = csv_bytes(table)
        case ".parquet":
            content = _parquet(table)
        case _:
            raise ExportError(f"{path}: a table's name ends in .csv or .parquet")
    try:
        write_files({path: content})
    except OSError as e:
        raise ExportError(f"{path} cannot be written: {e.strerror}") from None


def _parquet(table: Table) -> bytes:
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError:
        raise ExportError(
            "Parquet needs pyarrow; install it with: pip install 'tensatlas[parquet]', or write a .csv"
        ) from None
    sink = pyarrow.BufferOutputStream()
    parquet.write_table(pyarrow.table(table), sink)
    return sink.getvalue().to_pybytes()
