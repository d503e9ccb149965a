"""The robots that one browser's user has put aside, from any runs."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Final

from app.downloads.robot_folder import robot_folder
from app.gui.file_maker import ProgressCallback
from engine.errors import InvalidData, printable
from engine.fabrication.materials import PRESETS, Materials, load_materials
from engine.search.archive import Cell
from engine.simulation.evaluation import Evaluation
from engine.storage.reader import RunReader
from engine.tasks import get_task
from viz.build_sheet.facts import ArchivePlace
from viz.build_sheet.style import PaperName

MOST: Final = 50
"""Largest number of robots in a basket; simulating them for their export takes minutes."""
PAPERS: Final[dict[str, PaperName]] = {"A4": "a4", "Letter": "letter"}
"""Names of papers as shown, the usual one first."""
MEMORY_KEY: Final = "tensatlas-basket"
"""Key under which a tab remembers its basket."""


@dataclasses.dataclass(frozen=True, slots=True)
class BasketItem:
    """A robot in the basket.

    Attributes:
        path: of its run.
        number: of its evaluation.
        modules: how many it has.
        f_s: in cm, None if it has no fitness.
        archive: in which it was chosen, empty if that is no longer known.
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
        return f"{printable(self.path.stem)}_robot_{self.number}"


def item_of(
    reader: RunReader, evaluation: Evaluation, archive: str = "", cell: Cell | None = None
) -> BasketItem:
    """Return a robot as an item of the basket.

    Args:
        reader: of its run.
        evaluation: of the robot.
        archive: in which it was chosen, if that is known.
        cell: of the archive that holds it, None if none does or it is not known.
    """
    solution, distance = evaluation.solution, get_task(reader.config.task).target_distance
    f_s = None if evaluation.fitness is None else 100.0 * (distance - evaluation.fitness)
    return BasketItem(reader.path, solution.number, solution.morphology.n_modules, f_s, archive, cell)


def added(basket: Iterable[BasketItem], item: BasketItem) -> tuple[BasketItem, ...]:
    """Return a basket with one more robot, at its end.

    Raises:
        InvalidData: it is there already, or the basket is full.
    """
    items = tuple(basket)
    if any((i.path, i.number) == (item.path, item.number) for i in items):
        raise InvalidData(f"Robot {item.number} of {printable(item.path.stem)} is in the basket already.")
    if len(items) >= MOST:
        raise InvalidData(f"The basket is full: it holds {MOST} robots. Download or clear it first.")
    return (*items, item)


def folder_names(basket: Iterable[BasketItem]) -> list[str]:
    """Return a folder name for each robot; runs of equal names in different folders are told apart."""
    names: list[str] = []
    for item in basket:
        name, k = item.name, 2
        while name in names:
            name, k = f"{item.name}_{k}", k + 1
        names.append(name)
    return names


@dataclasses.dataclass(frozen=True, slots=True)
class ExportChoice:
    """What an export is made with."""

    materials: Materials
    paper: PaperName

    @classmethod
    def of(cls, paper: object, material: object) -> ExportChoice:
        """Read what a browser sends: nothing but what is on offer, so that no name is ever used as a path.

        Raises:
            InvalidData: one of the two is not on offer.
        """
        if not isinstance(paper, str) or paper not in PAPERS:
            raise InvalidData(f"Choose a paper: {' or '.join(PAPERS)}.")
        if not isinstance(material, str) or material not in PRESETS:
            raise InvalidData(f"Choose a material: {', '.join(PRESETS)}.")
        return cls(load_materials(material), PAPERS[paper])


def exported(
    item: BasketItem, reader: RunReader, progress: ProgressCallback, choice: ExportChoice
) -> dict[str, bytes]:
    """Return a robot's folder: content by name.

    Args:
        item: the robot.
        reader: of its run.
        progress: told before every step; what it raises ends it.
        choice: what it is built from, and the paper of its build sheet.

    Raises:
        TensAtlasError: the robot cannot be exported.
    """
    place = None if item.cell is None else ArchivePlace(archive=item.archive, cell=item.cell)
    return robot_folder(
        reader, item.number, materials=choice.materials, place=place, paper=choice.paper, progress=progress
    )


def export_basket(
    basket: Iterable[BasketItem],
    reader: Callable[[Path], RunReader],
    progress: ProgressCallback,
    choice: ExportChoice,
) -> dict[str, bytes]:
    """Return the exports of all robots, each in its own folder.

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
