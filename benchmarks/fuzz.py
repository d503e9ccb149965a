"""What strangers may send, mutated: it is read or refused in one line, and nothing else happens.

``python -m benchmarks.fuzz`` reads 10,000 inputs: run files and their logs and lock files, genotypes,
configurations, task files, re-evaluations, failure dumps, uploads, materials. It exits with 1 if one
crashes or hangs the reader, makes it run code, connect to a network, start a program or touch a file outside
its folder.
Input N of a kind is always the same: ``--only KIND --first N --inputs 1`` repeats one.
"""

from __future__ import annotations

import copy
import dataclasses
import faulthandler
import json
import os
import random
import shutil
import signal
import sqlite3
import sys
import tempfile
import time
import typing
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, Final

import mujoco
import numpy as np
import tyro
from rich.console import Console

from app.runs.upload import keep
from benchmarks.rows import Row, show
from benchmarks.sealed import seal_again
from engine.analysis.robustness import load_robust
from engine.body.morphology import Morphology
from engine.config import RunConfig, create_algorithm, from_json, preset, replaced, to_json
from engine.control.genome import Controller
from engine.control.network import NetworkBatch
from engine.errors import TensAtlasError
from engine.fabrication.materials import PRESETS, load_materials, preset_text
from engine.replay.dump import Dump, read_dump, write_dump
from engine.replay.replay import Replay
from engine.simulation.divergence import Failure
from engine.simulation.evaluation import Evaluation, FailedTrial
from engine.simulation.model import build_robot
from engine.simulation.provenance import versions
from engine.simulation.trials import TrialConfig
from engine.storage import raw
from engine.storage.check import check_run
from engine.storage.lock import holder_of, is_being_written, lock_path
from engine.storage.reader import RunReader
from engine.storage.recovery import recover
from engine.storage.rows import statistics
from engine.storage.writer import RunWriter
from engine.tasks import fitness, load_task

PATIENCE: Final = 20
"""Seconds after which an input counts as hanging the reader."""
_PROJECT: Final = Path(__file__).resolve().parent.parent
_TASK: Final = _PROJECT / "docs" / "tasks" / "climb_step.py"


@dataclasses.dataclass(frozen=True)
class Arguments:
    """Feed mutated inputs to everything that reads what strangers send."""

    inputs: int = 10_000
    """Inputs in all."""
    only: str = ""
    """The only kind of input."""
    first: int = 0
    """Number of each kind's first input."""


Reader = Callable[[bytes, Path], None]
"""Reads an input, in a folder of its own; raises ``TensAtlasError`` if it refuses it."""
Mutator = Callable[[bytes, random.Random], bytes]
"""Changes a proper input."""


@dataclasses.dataclass(frozen=True)
class Kind:
    """A kind of input.

    Attributes:
        seed: a proper one.
        read: reads one.
        mutate: changes one, in one input of two; the others have bytes changed anywhere.
        share: of the inputs.
    """

    seed: bytes
    read: Reader
    mutate: Mutator | None = None
    share: float = 1.0


@dataclasses.dataclass
class Outcome:
    """What came of the inputs of a kind.

    Attributes:
        n_read, n_refused: inputs that were read, that were refused in a line.
        faults: what else happened, by number of the input.
        slowest: seconds that the slowest input took.
    """

    n_read: int = 0
    n_refused: int = 0
    faults: list[str] = dataclasses.field(default_factory=list)
    slowest: float = 0.0


class Watch:
    """Sees what Python does while an input is read."""

    _FORBIDDEN: Final = (
        *("os.system", "os.exec", "os.posix_spawn", "os.fork", "subprocess.Popen", "pickle.find_class"),
        *("socket.connect", "socket.bind", "ctypes.dlopen", "webbrowser.open"),
    )
    _CHANGING: Final = (
        *("os.remove", "os.rename", "os.mkdir", "os.rmdir", "os.link", "os.symlink", "os.truncate"),
        "shutil.rmtree",
    )
    _WRITING: Final = os.O_WRONLY | os.O_RDWR | os.O_CREAT

    def __init__(self) -> None:
        self.folder: Path | None = None
        self.seen: list[str] = []
        self.code_allowed = False
        sys.addaudithook(self._hook)

    def _hook(self, event: str, arguments: tuple[Any, ...]) -> None:
        if self.folder is None:
            return
        if event in self._FORBIDDEN:
            if event == "subprocess.Popen" and tuple(arguments[1][: len(raw.COMMAND)]) == raw.COMMAND:
                return  # reads the first bytes of a file that SQLite refuses
            self.seen.append(f"{event} {arguments!r:.80}")
        elif event == "exec" and not self.code_allowed:
            name = getattr(arguments[0], "co_filename", "?")
            # modules that are imported late are the program's own, and typing evaluates its annotations
            asking = sys._getframe(1).f_code.co_filename
            if not Path(name).is_file() and not name.startswith("<frozen") and asking != typing.__file__:
                self.seen.append(f"ran code {name!r:.80}")
        elif event == "open" and isinstance(arguments[0], str | bytes | os.PathLike):
            mode, flags = arguments[1], arguments[2]
            writes = isinstance(flags, int) and flags & self._WRITING
            writes = writes or (isinstance(mode, str) and set(mode) & set("wax+"))
            path = Path(os.path.normpath(Path(os.fsdecode(arguments[0])).absolute()))
            ours = path.is_relative_to(self.folder) or "__pycache__" in path.parts or str(path) == os.devnull
            if writes and not ours:
                self.seen.append(f"opened {path} for writing")
        elif event in self._CHANGING:
            # the last arguments are the folders that relative names are meant in, -1 for the current one
            folders = [a for a in arguments if isinstance(a, int)]
            for a in arguments:
                if isinstance(a, str | bytes | os.PathLike):
                    place = Path.cwd()
                    if folders and folders[-1] >= 0:
                        place = Path(f"/proc/self/fd/{folders[-1]}").resolve()
                    path = Path(os.path.normpath(place / os.fsdecode(a)))
                    if not path.is_relative_to(self.folder):
                        self.seen.append(f"{event} {path}")


def mutate(content: bytes, rng: random.Random) -> bytes:
    """Return bytes with a few changes: flipped, overwritten, cut out, doubled, inserted, cut short."""
    data = bytearray(content)
    for _ in range(rng.choice((1, 1, 2, 4, 16))):
        at = rng.randrange(len(data) + 1)
        n = min(rng.choice((1, 1, 2, 4, 64, 512)), max(len(data) - at, 0))
        match rng.randrange(8):
            case 0 | 1 if n:
                data[at] ^= 1 << rng.randrange(8)
            case 2 if n:
                data[at : at + n] = rng.randbytes(n)
            case 3:
                del data[at : at + n]
            case 4:
                data[at:at] = data[at : at + n]
            case 5:
                data[at:at] = rng.choice(_NASTY)
            case 6 if rng.random() < 0.3:
                del data[at:]
            case _ if n:
                data[at : at + n] = bytes([rng.choice((0, 255, 48, 57))]) * n
    return bytes(data)


def overwrite(content: bytes, rng: random.Random) -> bytes:
    """Return bytes of which a few were overwritten where they are."""
    data = bytearray(content)
    for _ in range(rng.choice((1, 1, 2, 4, 16))):
        # the first page and the heads of the others say where everything is
        at = rng.choice(
            (rng.randrange(4096), rng.randrange(len(data)), 4096 * rng.randrange(len(data) // 4096))
        )
        n = rng.choice((1, 1, 1, 2, 4, 100))
        data[at : at + n] = rng.randbytes(len(data[at : at + n]))
    return bytes(data)


def mutate_rows(content: bytes, rng: random.Random) -> bytes:
    """Return a run file in which a value or the definition of a table was replaced."""
    db = sqlite3.connect(":memory:", isolation_level=None)
    db.deserialize(content)
    tables = [r[0] for r in db.execute("SELECT name FROM sqlite_master WHERE type = 'table'")]
    table = rng.choice(tables)
    value = rng.choice((*_VALUES[:15], "x", "{}", "[1]", b"", b"\xff\xfe", "[" * 3000, "9" * 5000, "../../x"))
    if isinstance(value, int) and abs(value) >= 2**63:
        value = 2**63 - 1
    with suppress(sqlite3.Error):
        match rng.randrange(9):
            case 0:
                db.execute(f"ALTER TABLE {table} RENAME TO gone")
                endless = "WITH RECURSIVE x(number) AS (SELECT 1 UNION ALL SELECT number + 1 FROM x)"
                db.execute(f"CREATE VIEW {table} AS {endless} SELECT number FROM x")
            case 1:
                db.execute(f"CREATE TRIGGER t AFTER INSERT ON {table} BEGIN DELETE FROM meta; END")
            case 2:
                db.execute(f"DELETE FROM {table} WHERE random() % 2")
            case 3:
                db.execute(f"ALTER TABLE {table} ADD COLUMN more AS (hex(zeroblob(100000000)))")
            case 4 | 5:
                column = rng.choice(("controller", "distances", "trajectory"))
                number, old = rng.choice(db.execute(f"SELECT number, {column} FROM details").fetchall())
                db.execute(f"UPDATE details SET {column} = ? WHERE number = ?", (mutate(old, rng), number))
            case _:
                columns = [r[1] for r in db.execute(f"PRAGMA table_info({table})")]
                column = rng.choice(columns)
                some = rng.choice(("1", "random() % 3 = 0"))
                db.execute(f"UPDATE {table} SET {column} = ? WHERE {some}", (value,))
    # a stranger knows how digests are made
    if rng.random() < 0.5:
        with suppress(sqlite3.Error, ValueError):
            seal_again(db)
    changed = db.serialize()
    db.close()
    return changed


_NASTY: Final = (
    *(b"\0", b"\xff\xfe", b"../../../tmp/x", b"1e999", b"-1", b"NaN", b"9" * 400, b"[" * 3000, b"{}"),
    *(b'"', b"\\u0000", b"\xed\xa0\x80", b"\n", b"__import__('os').system('id')", b"99999999999"),
)
_VALUES: Final = (
    *(None, True, False, 0, -1, 1, 2**31, 2**63, -(2**70), 10**30, 0.0, -0.0, 1e308, 1e-308, 0.5),
    *(float("nan"), float("inf"), "", "x", "../..", "\0", "9" * 50, [], {}, [[]], {"": 0}, [0] * 1000),
)


def mutate_json(content: bytes, rng: random.Random) -> bytes:
    """Return JSON with a few values replaced, removed or doubled."""
    data = json.loads(content)
    for _ in range(rng.choice((1, 1, 2, 5))):
        holder: Any = {"": data}
        key: Any = ""
        # down to some value
        while isinstance(holder[key], dict | list) and holder[key] and rng.random() < 0.8:
            holder = holder[key]
            key = rng.choice(list(holder)) if isinstance(holder, dict) else rng.randrange(len(holder))
        match rng.randrange(5):
            case 0 if key != "":
                del holder[key]
            case 1 if isinstance(holder, list):
                holder.insert(key, holder[key])
            case 2 if type(holder[key]) in (int, float):
                holder[key] = holder[key] * rng.choice((-1, 10, 1e6, 0.1)) + rng.choice((0, 1))
            case _:
                holder[key] = copy.deepcopy(rng.choice(_VALUES))
                if key == "":
                    data = holder[key]
    return json.dumps(data).encode()


def kinds(folder: Path) -> dict[str, Kind]:
    """Return what is fed, with proper inputs made in a folder."""
    config = replaced(
        preset("smoke"),
        evaluations=20,
        initial=8,
        refit_generations=(0, 1),
        trials=TrialConfig(repeats=1, trial_time=2.0),
    )
    e = _a_run(folder / "seed.tsmr", config)
    robust = {
        "format": 1,
        "created_at": "2026-01-01T00:00:00+00:00",
        "versions": {"mujoco": "4.0.0"},
        "elites": {str(n): {"recorded": 0.4, "repeats": {"1": 0.41, "2": None}} for n in range(3)},
    }
    body = json.dumps(e.solution.morphology.to_json()).encode()
    brain = json.dumps(e.solution.controller.to_json()).encode()
    lock = {"pid": 4000, "host": "elsewhere", "boot": "", "since": "2026", "command": "x", "key": "0"}
    return {
        "run file": Kind((folder / "seed.tsmr").read_bytes(), _read_run, mutate=overwrite, share=3.0),
        "run file's values": Kind((folder / "seed.tsmr").read_bytes(), _read_run, mutate=mutate_rows),
        "uploaded run": Kind((folder / "seed.tsmr").read_bytes(), _read_upload, mutate=overwrite),
        "run file's log": Kind(_a_log(folder), _read_log, mutate=overwrite),
        "lock file": Kind(json.dumps(lock).encode(), _read_lock, mutate=mutate_json),
        "configuration": Kind(json.dumps(to_json(config)).encode(), _read_config, mutate=mutate_json),
        "morphology": Kind(body, _read_body, mutate=mutate_json),
        "controller": Kind(brain, _read_brain, mutate=mutate_json),
        "re-evaluation": Kind(json.dumps(robust).encode(), _read_robust, mutate=mutate_json),
        "failure dump": Kind(_a_dump(folder, e, config), _read_dump),
        "materials file": Kind(preset_text(PRESETS[0]).encode(), _read_materials),
        # a task file is code that its user names: it is run, but an error in it is one line
        "task file": Kind(_TASK.read_bytes(), _read_task, share=0.5),
    }


def _a_run(path: Path, config: RunConfig) -> Evaluation:
    """Write a run of three generations whose figures are made up; return an evaluation."""
    algorithm, rng = create_algorithm(config), np.random.default_rng(0)
    with RunWriter.create(path, config, versions()) as writer:
        while solutions := algorithm.ask():
            evaluations = []
            for s in solutions:
                distances = rng.uniform(0.2, 0.6, (4, 1))
                trajectory = rng.normal(0.0, 0.1, (4, 2, 2)).astype(np.float32)
                evaluations.append(
                    Evaluation(
                        solution=s,
                        fitness=fitness(distances),
                        distances=distances,
                        trajectory=trajectory,
                        head_is_end=True,
                    )
                )
            writer.add_evaluations(algorithm.generation, evaluations)
            algorithm.tell(evaluations)
            writer.close_generation(algorithm, statistics(algorithm, 0.45), 1.0)
    return min(evaluations, key=lambda x: x.solution.morphology.n_modules)


def _a_dump(folder: Path, e: Any, config: Any) -> bytes:
    model = build_robot(e.solution.morphology, config.physics).model
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    state = np.empty(mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_INTEGRATION))
    mujoco.mj_getState(model, data, state, mujoco.mjtState.mjSTATE_INTEGRATION)
    failure = Failure("made up", 3, state, np.zeros((3, model.nu)))
    failed = FailedTrial(
        solution=e.solution, head_is_end=True, stage="trial", target=0, repeat=0, failure=failure
    )
    write_dump(Dump(config.task, config.physics, 1, failed, {"mujoco": "4"}), folder / "seed.tsdump")
    return (folder / "seed.tsdump").read_bytes()


def _a_log(folder: Path) -> bytes:
    """Return the write-ahead log of a run whose writer was killed before it folded it in."""
    path = folder / "log.tsmr"
    with RunReader(folder / "seed.tsmr") as reader:
        evaluations, config = reader.all_evaluations()[:8], reader.config
    with RunWriter.create(path, config, {}) as writer:
        writer.add_evaluations(0, evaluations)
        log = path.with_name(path.name + "-wal").read_bytes()
        shutil.copy(path, folder / "beside-log.tsmr")
    return log


def _read_run(content: bytes, folder: Path) -> None:
    path = folder / "input.tsmr"
    path.write_bytes(content)
    list(check_run(path))
    try:
        with RunReader(path) as reader:
            _read_everything(reader)
    finally:
        with suppress(TensAtlasError):
            recover(path, folder / "saved.tsmr")
            with RunReader(folder / "saved.tsmr") as saved:
                _read_everything(saved)


def _read_upload(content: bytes, folder: Path) -> None:
    name = random.Random(content).choice(
        ("run.tsmr", "../../x", "", "/etc/passwd", "a\\..\\b", "\0", "x" * 999)
    )
    kept = keep(name, content, folder / "uploads")
    if kept.parent != folder / "uploads":
        raise AssertionError(f"kept in {kept}")


def _read_log(content: bytes, folder: Path) -> None:
    shutil.copy(folder.parent / "beside-log.tsmr", folder / "input.tsmr")
    (folder / "input.tsmr-wal").write_bytes(content)
    with suppress(TensAtlasError):
        recover(folder / "input.tsmr", folder / "saved.tsmr")
    with RunReader(folder / "input.tsmr") as reader:
        _read_everything(reader)


def _read_everything(reader: RunReader) -> None:
    evaluations = reader.all_evaluations()
    last = reader.last_closed()
    reader.canonical_hash()
    reader.algorithm_state()
    if last is not None:
        reader.elites(last)
        for name in last.archives:
            reader.members(name)
            reader.placement_changes(name)
    for e in evaluations[:1]:
        with suppress(TensAtlasError):
            Replay(reader.config, e, target=0, repeat=0)


def _read_lock(content: bytes, folder: Path) -> None:
    path = folder / "input.tsmr"
    lock_path(path).write_bytes(content)
    str(holder_of(path))
    is_being_written(path)


def _read_config(content: bytes, _folder: Path) -> None:
    from_json(_json(content))


def _read_body(content: bytes, _folder: Path) -> None:
    Morphology.from_json(_json(content))


def _read_brain(content: bytes, _folder: Path) -> None:
    NetworkBatch([Controller.from_json(_json(content))])


def _read_robust(content: bytes, folder: Path) -> None:
    (folder / "input.robust.json").write_bytes(content)
    found = load_robust(folder / "input.robust.json")
    found.f_s(0.45)


def _read_dump(content: bytes, folder: Path) -> None:
    (folder / "input.tsdump").write_bytes(content)
    read_dump(folder / "input.tsdump")


def _read_materials(content: bytes, folder: Path) -> None:
    (folder / "input.toml").write_bytes(content)
    load_materials(folder / "input.toml")


def _read_task(content: bytes, folder: Path) -> None:
    (folder / "input.py").write_bytes(content)
    watch.code_allowed = True
    try:
        load_task(folder / "input.py")
    finally:
        watch.code_allowed = False


def _json(content: bytes) -> Any:
    try:
        return json.loads(content)
    except (ValueError, RecursionError):
        raise TensAtlasError("not JSON") from None


watch = Watch()


@contextmanager
def patience() -> Iterator[None]:
    """Interrupt what takes too long; what cannot be interrupted ends the process with a trace."""
    faulthandler.dump_traceback_later(3 * PATIENCE, exit=True)
    before = signal.signal(signal.SIGALRM, _too_long)
    signal.alarm(PATIENCE)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)
        faulthandler.cancel_dump_traceback_later()


def _too_long(*_: object) -> None:
    raise TimeoutError(f"it takes longer than {PATIENCE} s")


def feed(name: str, kind: Kind, number: int, folder: Path, outcome: Outcome) -> None:
    """Read one input and see what happens."""
    rng = random.Random(f"{name} {number}")
    change = kind.mutate if kind.mutate is not None and rng.random() < 0.5 else mutate
    content = change(kind.seed, rng)
    place = folder / "place"
    place.mkdir()
    beside = sorted(folder.iterdir())
    watch.folder, watch.seen = place, []
    started = time.monotonic()
    try:
        with patience():
            kind.read(content, place)
        outcome.n_read += 1
    except TensAtlasError as e:
        outcome.n_refused += 1
        if len(str(e).splitlines()) > 1 or len(str(e)) > 2000:
            outcome.faults.append(f"{name} {number}: not one line: {str(e)[:200]!r}")
    except BaseException as e:
        if isinstance(e, KeyboardInterrupt):
            raise
        outcome.faults.append(f"{name} {number}: {type(e).__name__}: {str(e)[:200]}")
    finally:
        watch.folder = None
    outcome.slowest = max(outcome.slowest, time.monotonic() - started)
    outcome.faults += [f"{name} {number}: {what}" for what in watch.seen]
    if sorted(folder.iterdir()) != beside:
        outcome.faults.append(f"{name} {number}: a file appeared outside its folder")
    shutil.rmtree(place)


def fuzz(n: int, *, only: str = "", first: int = 0) -> dict[str, Outcome]:
    """Feed n inputs of all kinds; return what came of them by kind."""
    os.environ["TENSATLAS_TASK_TIMEOUT"] = "0"  # the watch on hanging is ours here
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        chosen = {k: v for k, v in kinds(folder).items() if only in ("", k)}
        total = sum(k.share for k in chosen.values())
        outcomes = {}
        for k, kind in chosen.items():
            outcomes[k] = Outcome()
            # whatever is imported late is imported now
            with suppress(TensAtlasError):
                (folder / "place").mkdir()
                kind.read(kind.seed, folder / "place")
            shutil.rmtree(folder / "place")
            for number in range(first, first + max(1, round(n * kind.share / total))):
                feed(k, kind, number, folder, outcomes[k])
    return outcomes


def main(arguments: Arguments) -> int:
    """Feed, print, return the exit status."""
    console = Console()
    started = time.monotonic()
    outcomes = fuzz(arguments.inputs, only=arguments.only, first=arguments.first)
    rows = [
        Row(
            k,
            f"{o.n_read + o.n_refused + len(o.faults)} inputs: {o.n_read} read, {o.n_refused} refused,"
            f" slowest {o.slowest:.1f} s",
            "no fault",
            not o.faults,
        )
        for k, o in outcomes.items()
    ]
    show(f"Mutated inputs, {time.monotonic() - started:.0f} s", rows, console)
    faults = [f for o in outcomes.values() for f in o.faults]
    for fault in faults[:50]:
        console.print(fault, markup=False)
    return int(bool(faults))


if __name__ == "__main__":
    sys.exit(main(tyro.cli(Arguments)))
