"""Failure dumps: a failed simulation as a file that can be viewed anywhere.

A dump is a ZIP archive of ``failure.json`` (what failed, why, genotypes, physics, versions),
``robot.xml`` (MJCF; its keyframe ``before_failure`` is the state that the dump starts from),
``state.npy`` (that state, complete) and ``controls.npy`` (the commands of every control update from
there to the failure).
"""

from __future__ import annotations

import dataclasses
import io
import json
import typing
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import mujoco
import numpy as np

from engine.body.module import SERVO_NODES
from engine.body.morphology import Morphology
from engine.config import RunConfig, physics_from_json
from engine.control.genome import Controller
from engine.errors import UNEXPECTED_DATA, DumpError, InvalidData
from engine.files import open_file, read_zip, write_files, zip_bytes
from engine.simulation.divergence import MAX_UPDATES, Failure
from engine.simulation.evaluation import FailedTrial, Solution, Stage
from engine.simulation.model import RobotModel, build_robot, build_spec, with_walls, xml_with_state
from engine.simulation.physics import Physics, physics_to_json
from engine.simulation.trials import MAX_REPEATS
from engine.tasks import get_task
from engine.tasks.walls import MAX_WALLS, Wall, add_walls

SUFFIX: Final = ".tsdump"
FORMAT: Final = "tensatlas-failure"
FORMAT_VERSION: Final = 2
"""Format 1 had no walls."""
MAX_DUMPS: Final = 20
"""Largest number of dumps of a run; later failures are only counted. A dump has 10 to 30 kB."""
MAX_BYTES: Final = 4 * 1024 * 1024
"""Largest dump that is read."""
_MEMBERS: Final = dict.fromkeys(("failure.json", "robot.xml", "state.npy", "controls.npy"), MAX_BYTES)
_MAX_TEXT: Final = 500
_KEYS: Final = {
    *("format", "version", "number", "morphology", "controller", "head_is_end", "stage", "target", "repeat"),
    *("reason", "n_updates", "task", "physics", "run_seed", "versions", "walls"),
}


@dataclasses.dataclass(frozen=True, slots=True, eq=False)
class Dump:
    """What a dump holds.

    Attributes:
        task: what the robot was asked to do.
        physics: how it was simulated.
        run_seed: of the run; with the solution's number it gives the seed of the noise.
        failed: what failed; of the solution only number, morphology and controller are kept.
        versions: of the packages that simulated it, by name.
    """

    task: str
    physics: Physics
    run_seed: int
    failed: FailedTrial
    versions: dict[str, str]

    @property
    def robot(self) -> RobotModel:
        """The robot's model without walls."""
        return build_robot(self.failed.solution.morphology, self.physics)

    @property
    def model(self) -> mujoco.MjModel:
        """The robot's model in the world where it failed."""
        return with_walls(self.robot, self.failed.walls)

    @property
    def file_name(self) -> str:
        """Its name in a run's folder of failures: which simulation of which evaluation."""
        f = self.failed
        where = f.stage if f.stage != "trial" else f"target-{f.target}-repeat-{f.repeat}"
        return f"evaluation-{f.solution.number:06}-{where}{SUFFIX}"


class DumpFolder:
    """The folder of a run's failure dumps; it is made with the first dump.

    Args:
        folder: the dumps' folder.
        config: of the run.
        versions: of the packages that simulate.
        n_failed: failures of the run so far, which count towards ``MAX_DUMPS``.
    """

    def __init__(
        self, folder: Path, *, config: RunConfig, versions: Mapping[str, str], n_failed: int
    ) -> None:
        self._folder = folder
        self._config = config
        self._versions = dict(versions)
        self._n_failed = n_failed

    def keep(self, failed: FailedTrial) -> str:
        """Write a dump unless there are ``MAX_DUMPS``; return a note about it. Never raises."""
        self._n_failed += 1
        if self._n_failed > MAX_DUMPS:
            return ""
        config = self._config
        dump = Dump(config.task, failed.physics or config.physics, config.seed, failed, self._versions)
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            write_dump(dump, self._folder / dump.file_name)
        except DumpError as e:
            return f" (not dumped: {e})"
        except OSError as e:
            return f" (not dumped: {e.strerror or type(e).__name__})"
        return f" (dumped to {dump.file_name})"


def write_dump(dump: Dump, path: Path) -> None:
    """Write a dump; the file appears complete or not at all, and replaces an earlier one.

    Raises:
        DumpError: it cannot be written; the message has no path.
    """
    try:
        write_files({path: _pack(dump)})
    except OSError as e:
        raise DumpError(e.strerror or type(e).__name__) from None


def read_dump(path: Path) -> Dump:
    """Read a dump from any source.

    Raises:
        DumpError: the file is missing, damaged, no dump, or newer than this program.
    """
    try:
        with open_file(path) as f:
            content = f.read(MAX_BYTES + 1)
    except (OSError, ValueError) as e:
        reason = (e.strerror if isinstance(e, OSError) else None) or str(e)
        raise DumpError(f"{path} cannot be read: {reason}") from None
    if len(content) > MAX_BYTES:
        raise DumpError(f"{path} is too large for a failure dump")
    if not content.startswith(b"PK"):
        raise DumpError(f"{path} is not a failure dump")
    try:
        return _unpack(content)
    except InvalidData as e:
        raise DumpError(f"{path} is not a failure dump that can be shown: {_line(e)}") from None
    except UNEXPECTED_DATA as e:
        raise DumpError(f"{path} is damaged: {_line(e)}") from None


def _pack(dump: Dump) -> bytes:
    f, s = dump.failed, dump.failed.solution
    spec = build_spec(s.morphology, physics=dump.physics)
    add_walls(spec, f.walls)
    content = {
        "format": FORMAT,
        "version": FORMAT_VERSION,
        "number": s.number,
        "morphology": s.morphology.to_json(),
        "controller": s.controller.to_json(),
        "head_is_end": f.head_is_end,
        "stage": f.stage,
        "target": f.target,
        "repeat": f.repeat,
        "reason": f.failure.reason,
        "n_updates": f.failure.n_updates,
        "task": dump.task,
        "physics": physics_to_json(dump.physics),
        "run_seed": dump.run_seed,
        "versions": dump.versions,
        "walls": [w.to_json() for w in f.walls],
    }
    return zip_bytes(
        {
            "failure.json": (json.dumps(content, indent=2, allow_nan=False) + "\n").encode(),
            "robot.xml": xml_with_state(spec, "before_failure", f.failure.state).encode(),
            "state.npy": _npy_header(f.failure.state.shape) + f.failure.state.astype("<f8").tobytes(),
            "controls.npy": _npy_header(f.failure.controls.shape)
            + f.failure.controls.astype("<f8").tobytes(),
        }
    )


def _unpack(content: bytes) -> Dump:
    files = read_zip(content, _MEMBERS)
    data = json.loads(files["failure.json"])
    if not isinstance(data, dict) or data.get("format") != FORMAT:
        raise InvalidData("its failure.json is of another program")
    if type(data.get("version")) is not int or data["version"] > FORMAT_VERSION:
        raise InvalidData("it was made by a newer TensAtlas; update this one")
    if data["version"] == 1:
        data = {**data, "walls": []}
    if set(data) != _KEYS:
        raise InvalidData(f"its failure.json must have exactly the keys {', '.join(sorted(_KEYS))}")
    task = get_task(_text("task", data["task"]))
    solution = Solution(
        number=_whole("number", data["number"], 10**9),
        morphology=Morphology.from_json(data["morphology"]),
        controller=Controller.from_json(data["controller"]),
    )
    if type(data["head_is_end"]) is not bool or data["stage"] not in typing.get_args(Stage):
        raise InvalidData("head_is_end or stage is invalid")
    target = repeat = None
    if data["stage"] == "trial":
        target = _whole("target", data["target"], task.n_targets - 1)
        repeat = _whole("repeat", data["repeat"], MAX_REPEATS - 1)
    elif data["target"] is not None or data["repeat"] is not None:
        raise InvalidData("only a trial has a target")
    if not isinstance(data["versions"], dict) or len(data["versions"]) > 50:
        raise InvalidData("versions must be a table of names and versions")
    controls = _array(files["controls.npy"], len(SERVO_NODES) * solution.morphology.n_modules)
    n_updates = _whole("n_updates", data["n_updates"], 10**12)
    if not 1 <= len(controls) <= min(MAX_UPDATES, n_updates):
        raise InvalidData(f"it must have from 1 to {MAX_UPDATES} control updates, not {len(controls)}")
    failure = Failure(_text("reason", data["reason"]), n_updates, _array(files["state.npy"]), controls)
    failed = FailedTrial(
        solution=solution,
        head_is_end=data["head_is_end"],
        stage=data["stage"],
        target=target,
        repeat=repeat,
        failure=failure,
        walls=_walls(data["walls"]),
    )
    versions = {_text("versions", k): _text("versions", v) for k, v in data["versions"].items()}
    physics = physics_from_json(data["physics"])
    dump = Dump(task.name, physics, _whole("run_seed", data["run_seed"], 2**32 - 1), failed, versions)
    size = mujoco.mj_stateSize(dump.model, mujoco.mjtState.mjSTATE_INTEGRATION)
    # the commands may have any value: they may be what went wrong
    if failure.state.shape != (size,) or not np.isfinite(failure.state[: size - controls.shape[1]]).all():
        raise InvalidData(f"its state must be {size} finite numbers")
    return dump


def _walls(data: Any) -> tuple[Wall, ...]:
    if not isinstance(data, list) or len(data) > MAX_WALLS:
        raise InvalidData(f"walls must be a list of at most {MAX_WALLS}")
    return tuple(map(Wall.from_json, data))


def _npy_header(shape: tuple[int, ...]) -> bytes:
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, {"descr": "<f8", "fortran_order": False, "shape": shape})
    return header.getvalue()


def _array(content: bytes, columns: int | None = None) -> np.ndarray:
    """Read an .npy file that was made with ``_npy_header`` for a known number of columns, if any."""
    n = (len(content) - len(_npy_header((0,)))) // 8
    shape = (n,) if columns is None else (n // columns, columns)
    header = _npy_header(shape)
    if not content.startswith(header) or len(content) != len(header) + 8 * int(np.prod(shape)):
        raise InvalidData("an array has the wrong size")
    return np.frombuffer(content, "<f8", offset=len(header)).reshape(shape).astype(float)


def _whole(what: str, value: Any, most: int) -> int:
    if type(value) is not int or not 0 <= value <= most:
        raise InvalidData(f"{what} must be a whole number from 0 to {most}")
    return value


def _text(what: str, value: Any) -> str:
    if not isinstance(value, str) or len(value) > _MAX_TEXT or not value.isprintable():
        raise InvalidData(f"{what} must be one line of text")
    return value


def _line(error: Exception) -> str:
    lines = str(error).splitlines()
    return lines[0][:_MAX_TEXT] if lines else type(error).__name__
