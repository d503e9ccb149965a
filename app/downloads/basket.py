"""The robots that one browser's user has put aside, from any runs."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Final

from app.downloads.export_choice import ExportChoice
from app.downloads.recording import Progress
from app.downloads.robot_folder import robot_folder
from engine.errors import InvalidData
from engine.search.archive import Cell
from engine.simulation.evaluation import Evaluation
from engine.storage.reader import RunReader
from engine.tasks import get_task
from viz.build_sheet.facts import Place

MOST: Final = 50
"""Robots that a basket holds; simulating them for their export takes minutes."""


@dataclasses.dataclass(frozen=True, slots=True)
class Item:
    """A robot in the basket.

    Attributes:
        path: of its run.
        number: of its evaluation.
        modules: how many it has.
        f_s: in cm, None if it has no fitness.
        archive: it was chosen in, empty if that is not known any more.
        cell: of the archive, None if none of its cells holds the robot.
    """

    path: Path
    number: int
    modules: int
    f_s: float | None
    archive: str
    cell: Cell | None

    @property
    def name(self) -> str:
        """Name of its folder."""
        return f"{self.path.stem}_robot_{self.number}"


def item_of(reader: RunReader, evaluation: Evaluation, archive: str = "", cell: Cell | None = None) -> Item:
    """Return a robot as a basket holds it.

    Args:
        reader: of its run.
        evaluation: of the robot.
        archive: it was chosen in, if that is known.
        cell: of the archive that holds it, None if none does or it is not known.
    """
    solution, distance = evaluation.solution, get_task(reader.config.task).target_distance
    f_s = None if evaluation.fitness is None else 100.0 * (distance - evaluation.fitness)
    return Item(reader.path, solution.number, solution.morphology.n_modules, f_s, archive, cell)


def added(basket: Iterable[Item], item: Item) -> tuple[Item, ...]:
    """Return a basket with one more robot, at its end.

    Raises:
        InvalidData: it is there already, or the basket is full.
    """
    items = tuple(basket)
    if any((i.path, i.number) == (item.path, item.number) for i in items):
        raise InvalidData(f"Robot {item.number} of {item.path.stem} is in the basket already.")
    if len(items) >= MOST:
        raise InvalidData(f"The basket is full: it holds {MOST} robots. Download or clear it first.")
    return (*items, item)


def folder_names(basket: Iterable[Item]) -> list[str]:
    """Return a folder name for each robot; runs of equal names in different folders are told apart."""
    names: list[str] = []
    for item in basket:
        name, k = item.name, 2
        while name in names:
            name, k = f"{item.name}_{k}", k + 1
        names.append(name)
    return names


def exported(item: Item, reader: RunReader, progress: Progress, choice: ExportChoice) -> dict[str, bytes]:
    """Return a robot's folder: content by name.

    Args:
        item: the robot.
        reader: of its run.
        progress: told before every step; what it raises ends it.
        choice: what it is built from, and the paper of its build sheet.

    Raises:
        TensAtlasError: the robot cannot be exported.
    """
    place = None if item.cell is None else Place(archive=item.archive, cell=item.cell)
    return robot_folder(
        reader, item.number, materials=choice.materials, place=place, paper=choice.paper, progress=progress
    )


def export_basket(
    basket: Iterable[Item],
    reader: Callable[[Path], RunReader],
    progress: Progress,
    choice: ExportChoice,
) -> dict[str, bytes]:
    """Return the exports of all robots, each in a folder of its own.

    Args:
        basket: the robots.
        reader: returns the reader of a run.
        progress: told before every step of every robot and at the end how far it is; what it raises ends it.
        choice: what all are built from, and their paper.

    Raises:
        TensAtlasError: a run is gone or a robot cannot be exported.
    """
    items = list(basket)
    files: dict[str, bytes] = {}
    for k, (item, folder) in enumerate(zip(items, folder_names(items), strict=True)):

        def step(doing: str, n: int, total: int, k: int = k) -> None:
            progress(f"robot {k + 1} of {len(items)}, {doing}", k * total + n, len(items) * total)

        found = exported(item, reader(item.path), step, choice)
        files |= {f"{folder}/{name}": content for name, content in found.items()}
    progress("packing", len(items), len(items))
    return files
