"""The command ``export``: one robot as a folder, or every elite of a run."""

from __future__ import annotations

from pathlib import Path

from rich.console import Console

from app.cli import commands as c
from app.downloads.robot_folder import robot_folder
from engine.errors import ExportError, InvalidData, TensAtlasError
from engine.export import check_folder, write_folder
from engine.fabrication.materials import Materials, load_materials
from engine.files import csv_text
from engine.search.archive import cell_name, parse_cell
from engine.storage.reader import RunReader
from viz.build_sheet.facts import Place
from viz.build_sheet.style import PaperName

INDEX = "index.csv"


def export(command: c.Export, console: Console) -> None:
    """Write what the command asks for.

    Raises:
        InvalidData: neither a cell nor all elites are asked for, or both; a materials file is not right; the
            cell is empty or lies outside the map.
        RunFileError: the run cannot be read or has no such archive.
        ExportError: the folder exists or cannot be written, or robots could not be exported.
    """
    if (command.cell is None) == (not command.all_elites):
        raise InvalidData("say which robot with --cell I,J, or --all-elites for every one, not both")
    check_folder(command.out)
    materials = load_materials(command.materials)
    with RunReader(command.run) as reader:
        if command.cell is None:
            _export_all(reader, command, materials, console)
            return
        place = Place(archive=command.archive or "morphology", cell=parse_cell(command.cell))
        number = reader.elite_at(place.archive, place.cell)
        files = robot_folder(reader, number, materials=materials, place=place, paper=command.paper)
        write_folder(files, command.out)
    console.print(f"Wrote robot {number} to {command.out}; start with its build_sheet.pdf", markup=False)


def _export_all(reader: RunReader, command: c.Export, materials: Materials, console: Console) -> None:
    """Write a folder for every robot that is an elite somewhere, and a table of the cells."""
    last = reader.finished_generation(command.archive)
    archives = list(last.archives) if command.archive is None else [command.archive]
    elites = {
        Place(archive=name, cell=cell): number
        for name in archives
        for cell, number in sorted(reader.placements(name, last.number).items())
    }
    first: dict[int, Place] = {}
    for place, number in elites.items():
        first.setdefault(number, place)
    failed: list[str] = []
    for k, (number, place) in enumerate(first.items(), start=1):
        failed += _export_one(reader, number, place, command.out, materials, command.paper)
        if k % 10 == 0 or k == len(first):
            console.print(f"{k} of {len(first)} robots", markup=False)
    rows = [[p.archive, cell_name(p.cell), number, f"robot_{number}"] for p, number in elites.items()]
    _write(command.out / INDEX, csv_text([["archive", "cell", "evaluation", "folder"], *rows]))
    if failed:
        raise ExportError(f"{len(failed)} of {len(first)} robots were not exported; the first: {failed[0]}")
    console.print(
        f"Wrote {len(first)} robots of {len(elites)} cells to {command.out}; {INDEX} says which is which",
        markup=False,
    )


def _export_one(
    reader: RunReader, number: int, place: Place, out: Path, materials: Materials, paper: PaperName
) -> list[str]:
    """Write one robot's folder; return why not, if so: the others can still be exported."""
    try:
        files = robot_folder(reader, number, materials=materials, place=place, paper=paper)
    except TensAtlasError as e:
        return [str(e)]
    write_folder(files, out / f"robot_{number}")
    return []


def _write(path: Path, text: str) -> None:
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as e:
        raise ExportError(f"{path} cannot be written: {e.strerror or e}") from None
