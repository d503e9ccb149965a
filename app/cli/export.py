"""The command ``export``: one robot as a folder, or every elite of a run."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import tyro
from rich.console import Console

from engine.errors import ExportError, InvalidData, TensAtlasError, as_typed
from engine.files import csv_text, write_files
from engine.search.archive import cell_name, parse_cell
from engine.storage.reader import RunReader

if TYPE_CHECKING:  # the libraries that draw and shape take a while to import; other commands do not need them
    from engine.fabrication.materials import Materials
    from viz.build_sheet.facts import ArchivePlace

INDEX = "index.csv"


@dataclasses.dataclass(frozen=True, kw_only=True)
class Export:
    """Write a robot as a folder: build sheet, parts to make, firmware, MJCF, genotypes, replay.

    With --all-elites a folder for every robot that holds a cell.
    """

    path: tyro.conf.Positional[Path]
    """Run file."""
    archive: str | None = None
    """Map to take the elite from: morphology, which is the default, or controller, or of MAP-Elites grid.
    For --all-elites the only map to take."""
    cell: str | None = None
    """Cell of the map, such as 3,7 or 3,7,0,4; all count from 0."""
    all_elites: bool = False
    """Export every elite once, each into its own folder, with a table of the cells."""
    out: Path
    """Folder to create."""
    materials: str = "latex-sheet"
    """What it is built from: latex-sheet, tpu-85a, silicone-sheet, or a TOML file of yours."""
    paper: Literal["a4", "letter"] = "a4"
    """Paper that the build sheet is printed on."""
    kit: bool = False
    """Only what is needed to buy, build and measure module 1, before the others are built."""

    def run(self, console: Console) -> None:
        """Write the folder of one robot, or the folders of all.

        Raises:
            InvalidData: neither a cell nor all elites are asked for, or both; a materials file has an error;
                the cell is empty or lies outside the map.
            RunFileError: the run cannot be read or has no such archive.
            ExportError: the folder exists or cannot be written, or robots could not be exported.
        """
        from engine.export import check_folder, write_folder
        from engine.fabrication.materials import load_materials
        from viz.build_sheet.facts import ArchivePlace

        if (self.cell is None) == (not self.all_elites):
            raise InvalidData("say which robot with --cell I,J, or --all-elites for every one, not both")
        if self.kit and self.all_elites:
            raise InvalidData("a kit is for one robot: say which with --cell I,J")
        check_folder(self.out)
        materials = load_materials(self.materials)
        with RunReader(self.path) as reader:
            if self.cell is None:
                self._write_all(reader, materials, console)
                return
            place = ArchivePlace(archive=self.archive or "morphology", cell=parse_cell(self.cell))
            number = reader.elite_at(place.archive, place.cell)
            write_folder(self._files(reader, number, place, materials), self.out)
            if instead := self._instead(reader, number, materials):
                console.print(instead, markup=False)
        what, first = ("a kit for module 1 of ", "kit.pdf") if self.kit else ("", "build_sheet.pdf")
        console.print(
            f"Wrote {what}robot {number} to {as_typed(self.out)}; start with its {first}", markup=False
        )

    @staticmethod
    def _instead(reader: RunReader, number: int, materials: Materials) -> str:
        """Return what a robot is made of if not of what was asked for, and why; empty if of that."""
        from engine.fabrication.dimensions.cable_problems import makeable

        return makeable(reader.evaluation(number).solution.morphology, materials).instead

    def _files(
        self, reader: RunReader, number: int, place: ArchivePlace, materials: Materials
    ) -> dict[str, bytes]:
        from app.downloads.kit_folder import kit_folder
        from app.downloads.robot_folder import robot_folder

        if self.kit:
            return kit_folder(reader, number, materials=materials, place=place, paper=self.paper)
        return robot_folder(reader, number, materials=materials, place=place, paper=self.paper)

    def _write_all(self, reader: RunReader, materials: Materials, console: Console) -> None:
        """Write a folder for every robot that is an elite somewhere, and a table of the cells."""
        from engine.export import write_folder

        elites = self._elites(reader)
        first: dict[int, ArchivePlace] = {}
        for place, number in elites.items():
            first.setdefault(number, place)
        failed: list[str] = []
        replaced = 0
        for k, (number, place) in enumerate(first.items(), start=1):
            try:
                files = self._files(reader, number, place, materials)
            except TensAtlasError as e:  # the others can still be exported
                failed.append(str(e))
            else:
                write_folder(files, self.out / f"robot_{number}")
                replaced += bool(self._instead(reader, number, materials))
            if k % 10 == 0 or k == len(first):
                console.print(f"{k} of {len(first)} robots", markup=False)
        rows = [[p.archive, cell_name(p.cell), number, f"robot_{number}"] for p, number in elites.items()]
        index = self.out / INDEX
        try:
            write_files({index: csv_text([["archive", "cell", "evaluation", "folder"], *rows])})
        except OSError as e:
            raise ExportError(f"{index} cannot be written: {e.strerror or e}") from None
        if replaced:
            console.print(
                f"{replaced} robots are of another material than {self.materials}; their sheets say why",
                markup=False,
            )
        if failed:
            raise ExportError(
                f"{len(failed)} of {len(first)} robots were not exported; the first: {failed[0]}"
            )
        console.print(
            f"Wrote {len(first)} robots of {len(elites)} cells to {as_typed(self.out)};"
            f" {INDEX} says which is which",
            markup=False,
        )

    def _elites(self, reader: RunReader) -> dict[ArchivePlace, int]:
        """Return the number of the robot in every filled cell of the maps to take."""
        from viz.build_sheet.facts import ArchivePlace

        last = reader.finished_generation(self.archive)
        return {
            ArchivePlace(archive=name, cell=cell): number
            for name in (last.archives if self.archive is None else [self.archive])
            for cell, number in sorted(reader.placements(name, last.number).items())
        }
