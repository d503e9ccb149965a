"""Robots to start a run from: elites of another run, genotype files, rows of a table."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable
from pathlib import Path
from typing import Final

from engine.analysis.evaluation_table import read_genotypes
from engine.body.morphology import Morphology
from engine.control.genome import Controller
from engine.errors import UNEXPECTED_DATA, InvalidData, RunFileError, printable
from engine.files import open_file
from engine.search.archive import parse_cell
from engine.search.variation import GivenRobot
from engine.storage.reader import RunReader
from engine.storage.schema import SUFFIX
from engine.tasks import Task, get_task

MAX_GENOTYPE: Final = 10_000_000
"""Bytes of the largest genotype file that is read."""
_CHOSEN: Final = re.compile(rf"(.*?{re.escape(SUFFIX)})([:#].*)", re.DOTALL)
"""A run file, and which of its robots are meant."""
_NAME: Final = 60
"""Characters of a file's name that are kept with a robot."""


def read_robots(sources: Iterable[str], task: Task) -> list[GivenRobot]:
    """Return the robots of some sources, in their order, each genotype once.

    The robots of a run with another task, which senses more or less, keep the inputs whose names both have.

    Args:
        sources: each a run file, whose last elites are meant, or those of some cells of its first map:
            ``run.tsmr:3,4:5,7``, or any robots by their numbers: ``run.tsmr#63,7``; a ``genotype.json`` as
            ``export`` writes it; or a table with the columns of ``evaluation_table``, as CSV or Parquet.
        task: what they are to do.

    Raises:
        InvalidData: a file cannot be read or holds no genotype; the message names it.
        RunFileError: a run cannot be read.
    """
    found: dict[tuple[Morphology, Controller], GivenRobot] = {}
    for source in sources:
        for robot in _robots(source, task):
            found.setdefault((robot.morphology, robot.controller), robot)
    return list(found.values())


def _robots(source: str, task: Task) -> list[GivenRobot]:
    chosen = _CHOSEN.fullmatch(source)
    path = Path(source if chosen is None else chosen[1])
    match path.suffix.lower():
        case ".tsmr":
            return _of_run(path, "" if chosen is None else chosen[2], task)
        case ".json":
            return [_of_file(path)]
        case ".csv" | ".parquet":
            genotypes = read_genotypes(path)
            return [GivenRobot(*g, f"{_name(path)} row {k}") for k, g in enumerate(genotypes, start=1)]
    raise InvalidData(
        f"{source}: robots to start from are in a run file ({SUFFIX}), a genotype.json or a table (.csv,"
        " .parquet)"
    )


def _of_run(path: Path, which: str, task: Task) -> list[GivenRobot]:
    """Return the last elites of a run, or those of cells, ``:3,4:5,7``, or robots by number, ``#63,7``."""
    with RunReader(path) as reader:
        numbers = _numbers(which) if which.startswith("#") else _elites(reader, which)
        known = reader.evaluations(set(numbers))
        told_in = reader.config.task
    solutions = [known[n].solution for n in numbers]
    return [
        GivenRobot(s.morphology, _told(s.controller, told_in, task), f"{_name(path)} robot {s.number}")
        for s in solutions
    ]


def _told(controller: Controller, told_in: str, task: Task) -> Controller:
    """Return a controller of a run, by its task's name, for a task that may sense other things."""
    if told_in == task.name or controller.n_inputs == task.n_inputs:
        return controller
    return controller.sensing(get_task(told_in).inputs, task.inputs)


def _elites(reader: RunReader, cells: str) -> list[int]:
    last = reader.finished_generation()
    archive = next(iter(last.archives))
    if cells:
        return [reader.elite_at(archive, parse_cell(cell)) for cell in cells[1:].split(":")]
    numbers = sorted(set(reader.placements(archive, last.number).values()))
    if not numbers:
        raise RunFileError(f"{reader.path} has no elite to start from")
    return numbers


def _numbers(which: str) -> list[int]:
    if not re.fullmatch(r"#\d{1,9}(,\d{1,9})*", which):
        raise InvalidData(f"robots are named by their numbers, such as #63,7, not {printable(which)[:40]}")
    return list(map(int, which[1:].split(",")))


def _of_file(path: Path) -> GivenRobot:
    try:
        with open_file(path) as f:
            content = f.read(MAX_GENOTYPE + 1)
        if len(content) > MAX_GENOTYPE:
            raise InvalidData(f"it has more than {MAX_GENOTYPE / 1e6:.0f} MB")
        data = json.loads(content)
        return GivenRobot(
            Morphology.from_json(data["morphology"]), Controller.from_json(data["controller"]), _name(path)
        )
    except OSError as e:
        raise InvalidData(f"{path} cannot be read: {e.strerror or e}") from None
    except InvalidData as e:
        raise InvalidData(f"{path}: {e}") from None
    except KeyError as e:
        raise InvalidData(f"{path} is no genotype: it has no {e}") from None
    except UNEXPECTED_DATA as e:
        raise InvalidData(f"{path} is no genotype: {e}") from None


def _name(path: Path) -> str:
    return printable(path.name)[-_NAME:]
