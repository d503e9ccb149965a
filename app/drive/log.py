"""The log of a drive: lines of JSON, the first about the robot, then one for every picture."""

from __future__ import annotations

import dataclasses
import json
import math
from pathlib import Path
from typing import Any, Final, TextIO

import numpy as np

from app.drive.eyes import HeadPose, Seen
from engine.errors import UNEXPECTED_DATA, ExportError, InvalidData

FORMAT: Final = "tensatlas-drive"
VERSION: Final = 1
LARGEST: Final = 64 * 2**20
"""Bytes of the largest log that is read: 40 hours at 25 pictures a second are less."""
FARTHEST: Final = 100.0
"""Metres, and seconds times 1000, beyond which no number of a log is believed."""


@dataclasses.dataclass(frozen=True, slots=True)
class Driven:
    """Which robot was driven.

    Attributes:
        robot: number of its evaluation, as the board says.
        modules: how many it has.
        task: name of its task.
        run: name of its run's file, empty if it was not named.
        simulated: whether the robot was simulated.
    """

    robot: int
    modules: int
    task: str
    run: str
    simulated: bool


@dataclasses.dataclass(frozen=True, slots=True)
class Record:
    """One picture of a log.

    Attributes:
        time: since the board was told to go, in s.
        head: None where it was hidden.
        target: (2,) in m, None where it was hidden.
        sent: line to the board, empty for none.
        heard: lines of the board since the last picture.
    """

    time: float
    head: HeadPose | None
    target: np.ndarray | None
    sent: str = ""
    heard: tuple[str, ...] = ()


class LogWriter:
    """Writes a log while it happens, so that a drive that breaks off has one, too.

    Args:
        path: of a new file.
        driven: which robot.

    Raises:
        ExportError: the file is there already or cannot be written.
    """

    def __init__(self, path: Path, driven: Driven) -> None:
        self._path = path
        self._file = self._open()
        self._write({"format": FORMAT, "version": VERSION, **dataclasses.asdict(driven)})

    def add(self, time: float, seen: Seen, sent: str, heard: tuple[str, ...]) -> None:
        """Add a picture; the arguments are those of ``Record``.

        Raises:
            ExportError: the file cannot be written.
        """
        head, target = seen.head, seen.target
        entry: dict[str, Any] = {"time": round(time, 4)}
        if head is not None:
            entry["head"] = [round(v, 5) for v in (head.x, head.y, head.direction)]
        if target is not None:
            entry["target"] = [round(float(v), 5) for v in target]
        if sent:
            entry["sent"] = sent
        if heard:
            entry["heard"] = list(heard)
        self._write(entry)

    def close(self) -> None:
        """End the log."""
        self._file.close()

    def _open(self) -> TextIO:
        try:
            return self._path.open("x", encoding="utf-8")
        except FileExistsError:
            raise ExportError(f"{self._path} is there already; name another file with --log") from None
        except OSError as e:
            raise ExportError(f"{self._path} cannot be written: {e.strerror}") from None

    def _write(self, entry: dict[str, Any]) -> None:
        try:
            self._file.write(json.dumps(entry, allow_nan=False) + "\n")
            self._file.flush()
        except OSError as e:
            raise ExportError(f"{self._path} cannot be written: {e.strerror}") from None


def read_log(path: Path) -> tuple[Driven, list[Record]]:
    """Return what a log tells.

    Raises:
        InvalidData: the file cannot be read, or is no log.
    """
    try:
        if path.stat().st_size > LARGEST:
            raise InvalidData(f"{path} is too large for the log of a drive")
        lines = path.read_text(encoding="utf-8").splitlines()
    except OSError as e:
        raise InvalidData(f"{path} cannot be read: {e.strerror}") from None
    except UnicodeDecodeError:
        raise InvalidData(f"{path} is no log of a drive") from None
    try:
        first = json.loads(lines[0])
        known = first["format"] == FORMAT
        version = int(first["version"])
    except UNEXPECTED_DATA:
        raise InvalidData(f"{path} is no log of a drive") from None
    if not known or version < VERSION:
        raise InvalidData(f"{path} is no log of a drive")
    if version > VERSION:
        raise InvalidData(f"{path} is of a newer TensAtlas")
    records: list[Record] = []
    try:
        driven = Driven(
            robot=int(first["robot"]),
            modules=int(first["modules"]),
            task=str(first["task"]),
            run=str(first["run"]),
            simulated=bool(first["simulated"]),
        )
        for line in lines[1:]:
            records.append(_record(json.loads(line)))
    except UNEXPECTED_DATA:
        raise InvalidData(
            f"{path}: what follows line {len(records) + 1} is not what a drive writes"
        ) from None
    return driven, records


def _record(entry: dict[str, Any]) -> Record:
    """Return a picture from its line.

    Raises:
        ValueError: a number is beyond belief.
    """
    head = HeadPose(*map(_number, entry["head"])) if "head" in entry else None
    target = np.array([_number(v) for v in entry["target"]]) if "target" in entry else None
    if target is not None and target.shape != (2,):
        raise ValueError
    time = _number(entry["time"] / 1000.0) * 1000.0
    heard = tuple(str(line) for line in entry.get("heard", []))
    return Record(time, head, target, str(entry.get("sent", "")), heard)


def _number(value: Any) -> float:
    if not math.isfinite(value) or abs(value) > FARTHEST:
        raise ValueError
    return float(value)
