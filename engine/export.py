"""Exports an evaluation of a run file as files for other programs, and gives its robot an id.

The trial towards target 0, repeat 0, is simulated again; controls, path and replay come from it.
"""

from __future__ import annotations

import dataclasses
import hashlib
import importlib.resources
import json
import math
import os
import shutil
import uuid
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import mujoco
import numpy as np

from engine import config as configuration
from engine.body import module as t
from engine.body.feet import FEET_TEXT
from engine.body.morphology import Morphology
from engine.config import RunConfig
from engine.errors import ExportError, printable
from engine.fabrication.bill_of_materials import simulated_mass
from engine.files import compact_json, csv_text
from engine.replay.replay import Replay
from engine.simulation.batch import Span
from engine.simulation.evaluation import Evaluation, Solution
from engine.simulation.model import build_spec, xml_with_state
from engine.simulation.physics import Physics, Simulator, physics_to_json
from engine.simulation.provenance import versions
from engine.simulation.rollout import Head
from engine.simulation.trials import physics_of
from engine.storage.reader import RunReader
from engine.tasks import get_task, target_offsets, task_version
from engine.tasks.walls import Wall, add_walls

GENOTYPE_FORMAT: Final = "tensatlas-genotype"
GENOTYPE_VERSION: Final = 1
TARGET: Final = 0
"""Target of the trial that is exported, numbered from 0."""
REPEAT: Final = 0
"""Its repeat, numbered from 0."""
ID_LENGTH: Final = 10
"""Hexadecimal digits of an id: among a million robots two share one with a probability of half a percent."""


_BY_MUJOCO: Final = """\
The exported trial was computed with MuJoCo {mujoco}. On the same machine that version repeats the
motion exactly; another version or processor may round differently, and contacts amplify every
rounding: the motion then leaves the recorded one after some seconds, by millimetres to
centimetres."""
_BY_KERNEL: Final = """\
The exported trial was computed by TensAtlas's own kernel, which solves the same equations as
MuJoCo {mujoco} with Newton's method. A step of the two agrees to about 1e-7 m/s, and contacts
amplify every difference: the motion leaves the recorded one after some seconds, by millimetres to
centimetres."""
REPEATABLE: Final[Mapping[Simulator, str]] = {
    "mujoco": _BY_MUJOCO,
    "kernel": _BY_KERNEL,
}
"""How exactly ``play.py`` repeats the exported trial, by what simulated it."""


@dataclasses.dataclass(frozen=True, slots=True)
class Trial:
    """One trial, simulated again; K control updates, S seconds.

    Attributes:
        settled: the complete state after settling.
        pose: (modules, 6, 7) positions in m and quaternions (w, x, y, z) of the rods after settling.
        commands: (K, modules x 5) commanded lengths in m, in the order of the actuators.
        path: (S + 1, 2) head positions at 1 Hz in the settled head's frame, in m.
        score: how the task scores the end, in m.
        walls: that stand in the world.
        replay: its frames, from the drop to the end.
    """

    settled: np.ndarray
    pose: np.ndarray
    commands: np.ndarray
    path: np.ndarray
    score: float
    walls: tuple[Wall, ...]
    replay: Replay


def export_files(reader: RunReader, number: int, trial: Trial | None = None) -> dict[str, bytes]:
    """Return name and content of every file that describes an evaluation.

    Args:
        reader: of the run.
        number: of the evaluation.
        trial: its trial, if it has been simulated again already.

    Raises:
        RunFileError: there is no such evaluation, or it is damaged.
        ExportError: its simulation failed, so that there is nothing to show.
    """
    evaluation = reader.evaluation(number)
    trial = simulate_trial(reader.config, evaluation) if trial is None else trial
    names, xml = _robot_xml(reader.config, evaluation.solution, trial)
    period = reader.config.physics.control_period
    # nine decimals undo the rounding of k x period; the lengths themselves keep every digit
    controls = [[round(k * period, 9), *row] for k, row in enumerate(trial.commands.tolist())]
    target = target_offsets(get_task(reader.config.task))[TARGET].tolist()
    path = [[float(s), *xy, *target] for s, xy in enumerate(trial.path.tolist())]
    columns = ["time_s", "head_x_m", "head_y_m", "target_x_m", "target_y_m"]
    files = {
        "README.md": _readme(reader, evaluation, trial),
        "robot.xml": xml,
        "controls.csv": csv_text([["time_s", *names], *controls]),
        "trajectory.csv": csv_text([columns, *path]),
        "play.py": _template("export_play.py"),
        "genotype.json": _genotype(reader, evaluation),
    }
    return {name: text.encode() for name, text in files.items()}


def robot_hash(config: RunConfig, solution: Solution) -> str:
    """Return the SHA-256 of what a robot is and does: both genotypes, the task and the physics.

    Equal robots of different runs have the same hash; the run's name, its seed and the noise do not count.
    """
    # left out where they are as robots were before there was a choice
    choices = {"sensors": config.sensors, "unfed_outputs": config.trials.unfed_outputs}
    former = {"sensors": "centimetres", "unfed_outputs": "bias"}
    content: dict[str, Any] = {
        "morphology": solution.morphology.to_json(),
        "controller": solution.controller.to_json(),
        "task": {"name": config.task, **task_version(config.task)},
        "physics": physics_to_json(config.physics),
    }
    if solution.morphology.feet == "none":
        for name in ("feet_forward", "feet_backward"):
            del content["physics"][name]
    content["task"] |= {name: value for name, value in choices.items() if value != former[name]}
    return hashlib.sha256(compact_json(content).encode()).hexdigest()


def robot_id(config: RunConfig, solution: Solution) -> str:
    """Return the first digits of ``robot_hash``, short enough to read aloud."""
    return robot_hash(config, solution)[:ID_LENGTH]


def check_folder(out: Path) -> None:
    """Check that a folder can be made, before time is spent on its content.

    Raises:
        ExportError: ``out`` exists and is not an empty folder, or it cannot be written.
    """
    try:
        where = out.resolve()
        if where.exists() and not (where.is_dir() and not any(where.iterdir())):
            raise ExportError(f"{out} exists already; choose another folder")
        above = next(p for p in where.parents if p.exists())
        if not above.is_dir():
            raise ExportError(f"{out} cannot be written: {above} is not a folder")
        if not os.access(above, os.W_OK | os.X_OK):
            raise ExportError(f"{out} cannot be written: permission denied in {above}")
    except OSError as e:
        raise ExportError(f"{out} cannot be written: {e.strerror or e}") from None


def write_folder(files: dict[str, bytes], out: Path) -> None:
    """Write files into a new folder; either all of them appear or none.

    Args:
        files: content by name; a name may hold folders, separated by slashes.
        out: the folder; missing parents are created.

    Raises:
        ExportError: ``out`` exists and is not an empty folder, or it cannot be written.
    """
    partial: Path | None = None
    try:
        check_folder(out)
        where = out.resolve()
        partial = where.parent / f".{where.name}.{uuid.uuid4().hex}.part"
        partial.mkdir(parents=True)
        for name, content in files.items():
            path = partial / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
        if where.exists():
            where.rmdir()
        partial.rename(where)
    except OSError as e:
        raise ExportError(f"{out} cannot be written: {e.strerror or e}") from None
    finally:
        if partial is not None:
            shutil.rmtree(partial, ignore_errors=True)


def simulate_trial(config: RunConfig, evaluation: Evaluation) -> Trial:
    """Repeat the exported trial exactly as it was evaluated.

    Raises:
        ExportError: the evaluation failed, or cannot be repeated with this version.
    """
    if evaluation.fitness is None or not np.isfinite(evaluation.distances).all():
        reason = evaluation.failure or "it has no complete result"
        number = evaluation.solution.number
        raise ExportError(f"evaluation {number} cannot be exported, choose another: {reason}")
    spans: list[Span] = []
    replay = Replay(config, evaluation, target=TARGET, repeat=REPEAT, observer=spans.append)
    replay.advance(0.0)
    loop, path = replay.loop, []
    if loop is not None and replay.failure is None:
        settled, pose = loop.sim.state()[0, 0], loop.sim.qpos[0, 0].reshape(-1, len(t.RODS), 7).copy()
        path.append(loop.head()[0, 0])
        for second in range(1, math.floor(config.trials.trial_time) + 1):
            replay.advance(float(second))
            path.append(loop.head()[0, 0])
        replay.advance(config.trials.trial_time)
    if replay.failure is not None or replay.score is None:
        raise ExportError(
            f"evaluation {evaluation.solution.number} cannot be repeated with this version: {replay.failure}"
        )
    commands = np.concatenate([s.commanded[:, 0, 0] for s in spans if s.sensed is not None])
    commands = commands.reshape(len(commands), -1)
    return Trial(settled, pose, commands, np.array(path), replay.score, replay.walls, replay)


def _robot_xml(
    config: RunConfig,
    solution: Solution,
    trial: Trial,
) -> tuple[list[str], str]:
    """Return the actuators' names and MJCF that compiles to the same numbers, bit for bit."""
    physics = physics_of(config.physics, config.seed, solution.number, REPEAT)
    spec = build_spec(solution.morphology, physics=physics)
    add_walls(spec, trial.walls)
    return [a.name for a in spec.actuators], xml_with_state(spec, "settled", trial.settled)


def _genotype(reader: RunReader, e: Evaluation) -> str:
    s = e.solution
    head = Head.of(s.morphology, e.head_is_end)
    assert e.fitness is not None
    content = {
        "format": GENOTYPE_FORMAT,
        "version": GENOTYPE_VERSION,
        "run_file": printable(reader.path.name),
        "number": s.number,
        "morphology": s.morphology.to_json(),
        "controller": s.controller.to_json(),
        "fitness_m": e.fitness,
        "f_s_cm": 100.0 * (get_task(reader.config.task).target_distance - e.fitness),
        "distances_m": e.distances.tolist(),
        "parent": s.parent,
        "operator": s.operator,
        "source": s.source,
        "head": {
            "is_end": head.is_end,
            "module": head.module,
            "front_bodies": [f"m{head.module}_rod{r}" for r in head.front],
            "rear_bodies": [f"m{head.module}_rod{r}" for r in head.rear],
        },
        "config": configuration.to_json(reader.config),
        "versions": {
            "run": reader.versions,
            "export": versions(reader.config.task, reader.config.physics.simulator),
        },
    }
    return json.dumps(content, indent=2, allow_nan=False) + "\n"


def _readme(reader: RunReader, e: Evaluation, trial: Trial) -> str:
    task, trials = get_task(reader.config.task), reader.config.trials
    morphology, head = e.solution.morphology, Head.of(e.solution.morphology, e.head_is_end)
    assert e.fitness is not None
    recorded = float(e.distances[TARGET, REPEAT])
    return _template("export_readme.md").format(
        number=e.solution.number,
        run=printable(reader.path.name),
        task=task.name,
        summary=f": {task.summary}" if task.summary else "",
        score=task.score_name,
        n=morphology.n_modules,
        stiffness=_stiffness(morphology),
        faces=", ".join(map(str, morphology.faces)),
        head=t.module_number(head.module),
        end="last" if head.is_end else "first",
        mass=1000.0 * simulated_mass(morphology),
        start=100.0 * task.target_distance,
        f_s=100.0 * (task.target_distance - e.fitness),
        targets="\n".join(
            f"| {name} | {d.mean():.2f} | {', '.join(f'{x:.2f}' for x in d)} |"
            for name, d in zip(task.target_names, 100.0 * e.distances, strict=True)
        ),
        target=task.target_names[TARGET],
        repeats=trials.repeats,
        settle=trials.settle_time,
        trial=trials.trial_time,
        rate=1.0 / reader.config.physics.control_period,
        again=100.0 * trial.score,
        recorded=100.0 * recorded,
        same="the same to the last bit"
        if trial.score == recorded
        else "not the same: the run was computed on another kind of machine or with other versions",
        scale=reader.config.physics.inertia_scale,
        feet=_feet(morphology, reader.config.physics),
        repeatable=REPEATABLE[reader.config.physics.simulator].format(mujoco=mujoco.mj_versionString()),
    )


def _feet(morphology: Morphology, physics: Physics) -> str:
    """Say what the files lack of a robot's feet."""
    if morphology.feet == "none":
        return ""
    return (
        f"- The robot's feet grip one way: friction with the ground is {physics.feet_forward:g} while they\n"
        f"  slide {FEET_TEXT[morphology.feet]} of the chain, {physics.feet_backward:g} else. MuJoCo knows\n"
        f"  no such friction: in `robot.xml` it is {physics.friction:g} both ways; `play.py` shows\n"
        "  another way of crawling.\n"
    )


def _stiffness(morphology: Morphology) -> str:
    """Say how stiff the modules are, in the unit of the model and as relative stiffness."""
    if morphology.stiffness_mode == "shared":
        force = t.stiffness_n_per_m(morphology.stiffness)
        return f"Relative stiffness {morphology.stiffness:.1f}: every passive cable has {force:.2f} N/m."
    forces = ", ".join(f"{t.stiffness_n_per_m(s):.2f}" for s in morphology.stiffnesses)
    return (
        f"Relative stiffness, from module 1 on: {morphology.stiffness_text.replace(' ', ', ')}. The passive\n"
        f"  cables of a module have, in the same order, {forces} N/m."
    )


def _template(name: str) -> str:
    return (importlib.resources.files("engine") / "data" / name).read_text(encoding="utf-8")
