"""From an evaluation in a run file to a folder that a person can take away.

The trial towards target 0, repeat 0, is simulated again, and everything that moves in the folder
comes from it.
"""

from __future__ import annotations

import dataclasses
import io
import json
import math
import shutil
import uuid
import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import mujoco
import numpy as np

from engine import config as configuration
from engine import tensegrity as t
from engine.bill_of_materials import bill_of_materials, total_mass
from engine.config import RunConfig
from engine.errors import ExportError
from engine.evaluation import Evaluation, noise_seed
from engine.morphology import Morphology
from engine.reader import RunReader
from engine.robot import build_spec
from engine.run import versions
from engine.simulation import ClosedLoop, Head, SimulationBatch, build_robots, settle
from engine.tasks import get_task, target_offsets

GENOTYPE_FORMAT: Final = "tensatlas-genotype"
GENOTYPE_VERSION: Final = 1
TARGET: Final = 0
REPEAT: Final = 0
"""The trial that is exported."""


@dataclasses.dataclass(frozen=True, slots=True)
class _Trial:
    """One trial, simulated again; K control updates, S seconds.

    Attributes:
        settled: the complete state after settling.
        commands: (K, modules x 5) commanded lengths in m, in the order of the actuators.
        path: (S + 1, 2) head positions at 1 Hz in the settled head's frame, in m.
        distance: from head to target at the end, in m.
    """

    settled: np.ndarray
    commands: np.ndarray
    path: np.ndarray
    distance: float


def export_files(reader: RunReader, number: int) -> dict[str, bytes]:
    """Return name and content of every file that describes an evaluation.

    Args:
        reader: of the run.
        number: of the evaluation.

    Raises:
        RunFileError: there is no such evaluation, or it is damaged.
        ExportError: its simulation failed, so that there is nothing to show.
    """
    evaluation = reader.evaluation(number)
    if evaluation.fitness is None or not np.isfinite(evaluation.distances).all():
        reason = evaluation.failure or "it has no complete result"
        raise ExportError(f"evaluation {number} cannot be exported, choose another: {reason}")
    trial = _simulate(reader.config, evaluation)
    names, xml = _robot_xml(reader.config, evaluation.solution.morphology, trial)
    period = reader.config.physics.control_period
    # nine decimals undo the rounding of k x period; the lengths themselves keep every digit
    controls = [[round(k * period, 9), *row] for k, row in enumerate(trial.commands.tolist())]
    target = target_offsets(get_task(reader.config.task))[TARGET].tolist()
    path = [[float(s), *xy, *target] for s, xy in enumerate(trial.path.tolist())]
    columns = ["time_s", "head_x_m", "head_y_m", "target_x_m", "target_y_m"]
    files = {
        "README.md": _readme(reader, evaluation, trial),
        "robot.xml": xml,
        "controls.csv": _csv(["time_s", *names], controls),
        "trajectory.csv": _csv(columns, path),
        "play.py": _PLAY,
        "genotype.json": _genotype(reader, evaluation),
        "bill_of_materials.csv": bill_of_materials(evaluation.solution.morphology),
    }
    return {name: text.encode() for name, text in files.items()}


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
        where = out.resolve()
        if where.exists() and not (where.is_dir() and not any(where.iterdir())):
            raise ExportError(f"{out} exists already; choose another folder")
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


def zip_bytes(files: dict[str, bytes], folder_name: str) -> bytes:
    """Return a ZIP archive of files in one folder; equal files give equal bytes.

    Args:
        files: content by name.
        folder_name: of the one folder at the archive's top.
    """
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in sorted(files):
            entry = zipfile.ZipInfo(f"{folder_name}/{name}", date_time=(1980, 1, 1, 0, 0, 0))
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.create_system = 3  # not the system that happens to run this
            entry.external_attr = 0o644 << 16
            archive.writestr(entry, files[name])
    return buffer.getvalue()


def _simulate(config: RunConfig, evaluation: Evaluation) -> _Trial:
    """Repeat the exported trial exactly as it was evaluated."""
    solution, task, physics = evaluation.solution, get_task(config.task), config.physics
    robots = build_robots([solution.morphology], task, physics)
    settled = settle(robots, physics=physics, duration=config.trials.settle_time)
    loop = ClosedLoop(
        settled,
        robots,
        heads=[Head.of(solution.morphology, evaluation.head_is_end)],
        controllers=[solution.controller],
        targets=target_offsets(task)[None, TARGET, None],
        seeds=[[noise_seed(config.seed, solution.number, TARGET, REPEAT)]],
        task=task,
        physics=physics,
    )
    commands: list[np.ndarray] = []

    def observe(sim: SimulationBatch) -> None:
        commands.append(sim.commanded[0, 0].ravel().copy())

    state = settled.state()[0, 0]
    (result,) = loop.run(config.trials.trial_time, observe)
    if result.failure is not None:
        raise ExportError(
            f"evaluation {solution.number} cannot be repeated with this version: {result.failure}"
        )
    return _Trial(state, np.array(commands), result.trajectory[0], float(result.final_distance[0]))


def _robot_xml(
    config: RunConfig,
    morphology: Morphology,
    trial: _Trial,
) -> tuple[list[str], str]:
    """Return the actuators' names and MJCF that compiles to the same numbers, bit for bit."""
    walls = get_task(config.task).walls(morphology.n_modules)
    spec = build_spec(morphology, physics=config.physics, walls=walls)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_setState(model, data, trial.settled, mujoco.mjtState.mjSTATE_INTEGRATION)
    spec.add_key(name="settled", time=data.time, qpos=data.qpos, qvel=data.qvel, ctrl=data.ctrl)
    # a keyframe has no place for the solver's starting point, without which motions drift apart
    spec.add_numeric(name="settled_qacc_warmstart", data=data.qacc_warmstart, size=model.nv)
    # compiled values are saved with six digits, values as written in the spec with all
    spec.compiler.savecompiled = False
    return [a.name for a in spec.actuators], spec.to_xml()


def _csv(header: Sequence[str], rows: Sequence[Sequence[float]]) -> str:
    return "".join(",".join(map(str, row)) + "\n" for row in (header, *rows))


def _genotype(reader: RunReader, e: Evaluation) -> str:
    s = e.solution
    head = Head.of(s.morphology, e.head_is_end)
    assert e.fitness is not None
    content = {
        "format": GENOTYPE_FORMAT,
        "version": GENOTYPE_VERSION,
        "run_file": reader.path.name,
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
        "versions": {"run": reader.versions, "export": versions()},
    }
    return json.dumps(content, indent=2, allow_nan=False) + "\n"


def _readme(reader: RunReader, e: Evaluation, trial: _Trial) -> str:
    task, trials = get_task(reader.config.task), reader.config.trials
    morphology, head = e.solution.morphology, Head.of(e.solution.morphology, e.head_is_end)
    assert e.fitness is not None
    recorded = float(e.distances[TARGET, REPEAT])
    return _README.format(
        number=e.solution.number,
        run=reader.path.name,
        task=task.name,
        n=morphology.n_modules,
        level=morphology.stiffness,
        stiffness=t.stiffness_n_per_m(morphology.stiffness),
        faces=", ".join(map(str, morphology.faces)),
        head=head.module,
        end="last" if head.is_end else "first",
        mass=1000.0 * total_mass(morphology),
        start=100.0 * task.target_distance,
        f_s=100.0 * (task.target_distance - e.fitness),
        targets="\n".join(
            f"| {_bearing(b)} | {d.mean():.2f} | {', '.join(f'{x:.2f}' for x in d)} |"
            for b, d in zip(task.target_bearings, 100.0 * e.distances, strict=True)
        ),
        target=_bearing(task.target_bearings[TARGET]),
        repeats=trials.repeats,
        settle=trials.settle_time,
        trial=trials.trial_time,
        rate=1.0 / reader.config.physics.control_period,
        again=100.0 * trial.distance,
        recorded=100.0 * recorded,
        same="the same to the last bit"
        if trial.distance == recorded
        else "not the same: the run was computed on another kind of machine or with other versions",
        scale=reader.config.physics.inertia_scale,
        mujoco=mujoco.mj_versionString(),
    )


def _bearing(angle: float) -> str:
    degrees = math.degrees(angle)
    return f"{abs(degrees):.0f}° {'left' if degrees > 0 else 'right'}" if degrees else "ahead"


_README: Final = """\
# Robot {number} of {run}

A tensegrity soft modular robot that TensAtlas evolved for the task {task}. It exists in
simulation only.

- {n} modules in a chain, numbered from 0; {mass:.1f} g in all.
- Relative stiffness {level:.1f}: every passive cable has {stiffness:.2f} N/m.
- Joining faces, from module 0 on: {faces}. The next module is attached to that
  face; the last module's stays free.
- The head is module {head}, the {end} of the chain: the end that goes first when all modules
  pulse.

## How well it does

Every trial starts {start:.0f} cm from a target and lasts {trial:g} s, {repeats} per target, each
with its own noise on the commanded cable lengths.

f_s = **{f_s:.2f} cm**: the starting distance minus the fitness, which is the mean over the
targets of the final distance plus half of what the worst target lies above that mean. More is
better; a robot that stays where it is has about 0.

| target | mean final distance (cm) | of each trial (cm) |
| --- | --- | --- |
{targets}

The files below hold the first trial towards the target {target}, simulated again: it ended
{again:.2f} cm from the target. The run recorded {recorded:.2f} cm, {same}.

## Files

- `robot.xml`: the robot in its task's world, for MuJoCo, in SI units (m, kg, s, N). Numbers are
  written in full. Bodies are called `m<module>_rod<rod>`, passive cables
  `m<module>_cable_<node>_<node>`, internal cables and their actuators `m<module>_servo_<node>`;
  an actuator's control is the length commanded to its cable, in m. The keyframe `settled` is the
  robot {settle:g} s after it was dropped, servos released (a commanded length of 1 m leaves a
  cable slack). The numeric `settled_qacc_warmstart` belongs to it: where the solver starts from;
  without it the motion leaves the recorded one after some seconds.
- `controls.csv`: the commanded length (m) of every internal cable at {rate:g} Hz, noise included.
  `time_s` counts from the end of settling; a row holds until the next one.
- `trajectory.csv`: where that takes the head, and the target, at 1 Hz. The origin is the settled
  head's front face, x is ahead, y to the left, in m.
- `play.py`: plays `controls.csv` on `robot.xml` and compares with `trajectory.csv`. It needs
  Python with `pip install mujoco numpy`; `python play.py --view` shows the motion in MuJoCo's
  viewer (on macOS: `mjpython play.py --view`).
- `genotype.json`: body and controller, results, configuration and versions. Lengths end in `_m`
  (metres) or `_cm`.
- `bill_of_materials.csv`: parts, lengths and diameters in mm, masses in g. Its column `basis`
  says which numbers the simulation uses and which are assumed or missing. Nodes and rods are
  numbered as in `robot.xml`.

The exported trial was computed with MuJoCo {mujoco}. On the same machine that version repeats the
motion exactly; another version or processor may round differently, and contacts amplify every
rounding: the motion then leaves the recorded one after some seconds, by millimetres to
centimetres.

## Limits

- Nothing here has been built or measured; all results come from simulation.
- The inertia scale is {scale:g}: in `robot.xml` masses are multiplied by {scale:g} and gravity is
  divided by {scale:g}. Weights and cable forces are those of the real robot, inertia is not: the
  motion is quasi-static, as in the published simulator. `bill_of_materials.csv` lists real
  masses.
- Rods are rigid, and their spin about their own axis has more inertia than a real rod's. Cables
  are massless, pass through each other and through rods, and never break.
- `controls.csv` is a recording. The robot's controller senses where its head and the target are;
  played blindly on another robot or floor, the lengths lead elsewhere.
"""

_PLAY: Final = '''\
"""Plays controls.csv on robot.xml and compares where the head goes with trajectory.csv.

Needs mujoco and numpy. With --view the motion is shown in MuJoCo's viewer, in real time.
"""

import argparse
import contextlib
import json
import time
from pathlib import Path

import mujoco
import numpy as np

HERE = Path(__file__).resolve().parent


def main() -> None:
    """Run the recorded trial."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--view", action="store_true", help="show the motion in MuJoCo's viewer")
    view = parser.parse_args().view

    model = mujoco.MjModel.from_xml_string((HERE / "robot.xml").read_text(encoding="utf-8"))
    about = json.loads((HERE / "genotype.json").read_text(encoding="utf-8"))
    controls = np.loadtxt(HERE / "controls.csv", delimiter=",", skiprows=1, ndmin=2)
    recorded = np.loadtxt(HERE / "trajectory.csv", delimiter=",", skiprows=1, ndmin=2)
    head, period = about["head"], about["config"]["physics"]["control_period"]
    steps = round(period / model.opt.timestep)
    per_second = round(1.0 / period)

    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("settled").id)
    data.qacc_warmstart[:] = model.numeric("settled_qacc_warmstart").data

    def face(bodies: list[str]) -> np.ndarray:
        # each rod has a free joint, whose first two coordinates are its horizontal position
        at = [model.jnt_qposadr[model.body(name).jntadr[0]] for name in bodies]
        return np.mean([data.qpos[i : i + 2] for i in at], axis=0)

    origin = face(head["front_bodies"])
    ahead = origin - face(head["rear_bodies"])
    ahead /= np.linalg.norm(ahead)
    axes = np.array([ahead, [-ahead[1], ahead[0]]])

    def position() -> np.ndarray:
        return axes @ (face(head["front_bodies"]) - origin)

    path = [position()]
    with contextlib.ExitStack() as stack:
        viewer = None
        if view:
            from mujoco.viewer import launch_passive

            viewer = stack.enter_context(launch_passive(model, data))
        start = time.monotonic()
        for k, lengths in enumerate(controls[:, 1:], start=1):
            data.ctrl[:] = lengths
            mujoco.mj_step(model, data, steps)
            if k % per_second == 0:
                path.append(position())
            if viewer is not None:
                if not viewer.is_running():
                    return
                viewer.sync()
                time.sleep(max(0.0, start + k * period - time.monotonic()))

    end, target = position(), recorded[-1, 3:5]
    gap = 1000.0 * np.linalg.norm(np.array(path) - recorded[:, 1:3], axis=1)
    print(f"The head ends at x = {end[0]:.4f} m, y = {end[1]:.4f} m.")
    print(f"Distance from the target: {100.0 * np.linalg.norm(target - end):.2f} cm.")
    print(f"Distance from trajectory.csv: at most {gap.max():.6f} mm, {gap[-1]:.6f} mm at the end.")


if __name__ == "__main__":
    main()
'''
