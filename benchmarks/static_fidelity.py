"""Shapes of modules and chains, ours against the published ones. Lengths here are in cm, as measured."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from typing import Any, Final

import mujoco
import numpy as np

from benchmarks import reference
from benchmarks.rows import Row
from engine.body import module as t
from engine.body import servo
from engine.body.morphology import Morphology
from engine.simulation.model import RobotModel, build_robot
from engine.simulation.physics import Physics

HOLD: Final = 5.0
"""Seconds for which every state is held before it is measured."""
OFF: Final = 1.0
"""Target length in m that lets an internal cable hang slack."""
PAIRS: Final = {"1-5": 1, "2-6": 2, "3-7": 3, "4-8": 4}


@dataclasses.dataclass(frozen=True, slots=True)
class SingleModule:
    """A morphology of one module, which no robot has; for measurements only."""

    stiffness_level: int
    faces: tuple[int, ...] = (1,)
    n_modules: int = 1
    feet: str = "none"

    @property
    def stiffness_levels(self) -> tuple[int, ...]:
        """The one module's level."""
        return (self.stiffness_level,)

    @property
    def stiffnesses(self) -> tuple[float, ...]:
        """Relative stiffness of the one module's passive cables."""
        return (self.stiffness_level / 10,)


class Body:
    """A robot that holds one servo command after the other.

    Args:
        morphology: which robot.
        physics: how it is simulated.
        gravity: False lets it float.
    """

    def __init__(self, morphology: Any, physics: Physics, *, gravity: bool) -> None:
        self.robot: RobotModel = build_robot(morphology, physics, gravity=gravity)
        self._data = mujoco.MjData(self.robot.model)

    def hold(self, command: float | None) -> None:
        """Hold a command in degrees, or None for servos off, until everything rests."""
        lengths = np.full(len(t.SERVO_NODES), OFF)
        if command is not None:
            lengths = servo.target_lengths(np.array(command))
        self._data.ctrl[:] = np.tile(lengths, self.robot.n_modules)
        mujoco.mj_step(self.robot.model, self._data, round(HOLD / self.robot.model.opt.timestep))
        mujoco.mj_forward(self.robot.model, self._data)

    def nodes(self, module: int = 0) -> np.ndarray:
        """Return the (12, 3) nodes of a module."""
        points = []
        for n, node in enumerate(t.NODES):
            body = self.robot.rod_bodies[module, t.rod_of(n)]
            half = (node - t.NODES[n ^ 1]) / 2
            points.append(self._data.xpos[body] + self._data.xmat[body].reshape(3, 3) @ half)
        return 100 * np.array(points)

    def face_distance(self, face: int) -> float:
        """Return the distance from a face's centre to its opposite's, of the first module."""
        nodes = self.nodes()
        a, b = (nodes[list(t.FACES[f])].mean(axis=0) for f in (face, t.OPPOSITE_FACE[face]))
        return float(np.linalg.norm(a - b))

    def centre_of_mass_height(self) -> float:
        """Return the height of the robot's centre of mass."""
        mass = self.robot.model.body_mass
        return float(100 * mass @ self._data.xipos[:, 2] / mass.sum())

    def length(self) -> float:
        """Return the distance between the centres of the first and the last module."""
        first, last = (self._data.xpos[self.robot.rod_bodies[k]].mean(axis=0) for k in (0, -1))
        return float(100 * np.linalg.norm(first - last))


def floating_module(record: dict[str, Any], physics: Physics) -> Iterator[tuple[dict[str, Any], Body]]:
    """Take one module without gravity through the states of a measurement."""
    body = Body(SingleModule(round(10 * record["stiffness"])), physics, gravity=False)
    for state in record["zero_gravity"]:
        body.hold(_command(state))
        yield state, body


def contraction(physics: Physics, stiffness: Sequence[float] | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Take single modules without gravity through their states.

    Returns:
        (records, states, 4, 2) distances of opposite faces, ours and published, and (records, states)
        our largest distances between two nodes.
    """
    table, widest = [], []
    for record in reference.load(reference.STATIC)["single_module"]:
        if stiffness is None or record["stiffness"] in stiffness:
            distances, widths = [], []
            for state, body in floating_module(record, physics):
                published = state["opposite_face_distance_cm"]
                distances.append([(body.face_distance(f), published[pair]) for pair, f in PAIRS.items()])
                nodes = body.nodes()
                widths.append(np.linalg.norm(nodes[:, None] - nodes, axis=-1).max())
            table.append(distances)
            widest.append(widths)
    return np.array(table), np.array(widest)


def floating_rows(physics: Physics, stiffness: Sequence[float] | None = None) -> list[Row]:
    """Compare one module without gravity."""
    table, node_distances = contraction(physics, stiffness)
    error = table[..., 0] - table[..., 1]
    actuated, others = error[:, :, 0], error[:, :, 1:]
    settled, widest = table[:, 0, 0, 0], node_distances[:, 0]
    rms = [float(np.sqrt(np.mean(e**2))) for e in (actuated, others)]
    largest = float(np.abs(actuated).max())
    return [
        Row("faces 1-5, RMS difference", f"{rms[0]:.3f} cm", "at most 0.12", rms[0] <= 0.12),
        Row("faces 1-5, largest difference", f"{largest:.3f} cm", "at most 0.35", largest <= 0.35),
        Row("other pairs of faces, RMS difference", f"{rms[1]:.3f} cm", "at most 0.2", rms[1] <= 0.2),
        Row(
            "faces 1-5 settled",
            f"{settled.min():.2f} to {settled.max():.2f} cm",
            "7.22 +- 0.08",
            bool(np.all(np.abs(settled - 7.22) <= 0.08)),
        ),
        Row(
            "largest node distance settled",
            f"{widest.min():.2f} to {widest.max():.2f} cm",
            "9.3 +- 0.2",
            bool(np.all(np.abs(widest - 9.3) <= 0.2)),
        ),
    ]


def ground_rows(physics: Physics, max_modules: int = t.MAX_MODULES) -> list[Row]:
    """Compare one module and chains on the ground: heights of the centre of mass and lengths."""
    measured = reference.load(reference.STATIC)
    heights, lengths, chain_heights, chain_lengths = {}, {}, {}, {}
    for record in measured["single_module"]:
        body = Body(SingleModule(round(10 * record["stiffness"])), physics, gravity=True)
        for k, state in enumerate(record["on_ground"]):
            body.hold(_command(state))
            case = f"stiffness {record['stiffness']}, state {k} ({state['state']})"
            heights[case] = body.centre_of_mass_height() / state["centre_of_mass_height_cm"] - 1
            lengths[case] = body.face_distance(1) / state["opposite_face_distance_cm"]["1-5"] - 1
    for record in measured["chains_on_ground"]:
        if record["modules"] > max_modules:
            continue
        morphology = Morphology(round(10 * record["stiffness"]), tuple(record["faces"]))
        body = Body(morphology, physics, gravity=True)
        for state in record["states"]:
            body.hold(_command(state))
            case = f"faces {record['faces']}, stiffness {record['stiffness']}, {state['state']}"
            chain_heights[case] = body.centre_of_mass_height() / state["centre_of_mass_height_cm"] - 1
            chain_lengths[case] = body.length() / state["first_to_last_centre_cm"] - 1
    return [
        _relative("one module: height of its centre of mass", heights),
        _relative("one module: distance of faces 1-5", lengths),
        _relative("chains: height of the centre of mass", chain_heights),
        _relative("chains: first to last module", chain_lengths),
    ]


def convergence_row(physics: Physics, finer: Physics, stiffness: Sequence[float] | None = None) -> Row:
    """Compare the contraction of one module at two time steps."""
    coarse, fine = (contraction(p, stiffness)[0] for p in (physics, finer))
    moved = float(np.abs(coarse - fine).max())
    return Row("one module at a quarter of the time step", f"{moved:.3f} cm", "below 0.05", moved < 0.05)


def _relative(what: str, errors: dict[str, float]) -> Row:
    median = float(np.median(np.abs(list(errors.values()))))
    worst = max(errors, key=lambda case: abs(errors[case]))
    ours = f"median {median:.1%}; worst {errors[worst]:+.0%} ({worst})"
    return Row(what, ours, "median at most 12 %", median <= 0.12)


def _command(state: dict[str, Any]) -> float | None:
    name = state["state"]
    return None if name == "settled" else float(name.removeprefix("cycle_"))
