"""From an archive and a cell to the robot that holds it."""

from __future__ import annotations

from engine.errors import InvalidData, RunFileError
from engine.search.archive import Cell, cell_name
from engine.storage.reader import RunReader


def find_elite(reader: RunReader, archive: str, cell: Cell) -> int:
    """Return the number of the evaluation that a cell holds after the last generation.

    Raises:
        RunFileError: the run has no finished generation or no such archive.
        InvalidData: the cell is empty or lies outside the map.
    """
    last = reader.last_closed()
    if last is None:
        raise RunFileError(f"{reader.path} has no {archive} archive yet")
    if archive not in last.archives:
        found = " and ".join(last.archives)
        raise RunFileError(f"{reader.path} has no {archive} archive; choose with --archive: {found}")
    shape = tuple(a.n for a in last.archives[archive].axes)
    if len(cell) != len(shape) or any(i >= n for i, n in zip(cell, shape, strict=True)):
        limits = ", ".join(f"0..{n - 1}" for n in shape)
        raise InvalidData(f"cell {cell_name(cell)} lies outside the {archive} map ({limits})")
    placed = reader.placements(archive, last.number)
    if cell not in placed:
        raise InvalidData(f"cell {cell_name(cell)} of the {archive} map is empty")
    return placed[cell]
