"""From the poses of the rods to what is drawn: rods, nodes, cables and their tension."""

from __future__ import annotations

import dataclasses

import numpy as np
from scipy.spatial.transform import Rotation

from engine import tensegrity as t
from engine.morphology import Morphology
from viz import theme

ROD_DRAWN_RADIUS = 0.0021
NODE_DRAWN_RADIUS = 0.0030
ACTUATOR_DRAWN_RADIUS = 0.0055
STRAIN_FULL_COLOR = 1.6
"""Strain at which a passive cable is drawn in its full colour; a settled module is at 1.3."""


@dataclasses.dataclass(frozen=True, slots=True)
class Drawing:
    """One frame of a robot, in metres.

    Attributes:
        rod_positions: (rods, 3) centres.
        rod_turns: (rods, 4) quaternions (w, x, y, z) that turn a cylinder along z.
        nodes: (nodes + actuators, 3) centres of spheres.
        cables: (cables, 2, 3) end points.
        cable_colors: (cables, 2, 3) uint8.
        tension: (cables,) 0 slack to 1 in the full colour; of every module the passive cables, then the
            servo's.
    """

    rod_positions: np.ndarray
    rod_turns: np.ndarray
    nodes: np.ndarray
    cables: np.ndarray
    cable_colors: np.ndarray
    tension: np.ndarray


class RobotGeometry:
    """Draws a robot of a given body.

    Args:
        morphology: the body.
        head_module: index of the head module, drawn in its own colour.
    """

    def __init__(self, morphology: Morphology, head_module: int) -> None:
        self.n_modules = morphology.n_modules
        middles = np.array([t.NODES[[a, b]].mean(axis=0) for a, b in t.RODS])
        axes = np.array([t.NODES[b] - t.NODES[a] for a, b in t.RODS])
        self._align = np.array([_quaternion_from_z(a) for a in axes])
        # points fixed to rods: nodes, actuator, then the two anchors of every cable
        passive = [(t.rod_of(n), t.passive_anchor(n, o)) for a, b in t.CABLES for n, o in ((a, b), (b, a))]
        servo = [
            (rod, point)
            for n in t.SERVO_NODES
            for rod, point in zip((t.SERVO_ROD, t.rod_of(n)), t.servo_anchors(n), strict=True)
        ]
        fixed = [(t.rod_of(n), p) for n, p in enumerate(t.NODES)]
        fixed.append((t.SERVO_ROD, t.ACTUATOR_POINT))
        every = [*fixed, *passive, *servo]
        self._rod = np.array([r for r, _ in every])
        self._local = np.array([p - middles[r] for r, p in every])
        self._n_fixed = len(fixed)
        self._n_passive = len(t.CABLES)
        rod_colors = np.tile(np.array(theme.ROD, dtype=np.uint8), (self.n_modules, len(t.RODS), 1))
        rod_colors[:, t.SERVO_ROD] = theme.SERVO_ROD
        plain = [r for r in range(len(t.RODS)) if r != t.SERVO_ROD]
        rod_colors[head_module, plain] = theme.HEAD_ROD
        self.rod_colors = rod_colors.reshape(-1, 3)
        node_colors = np.tile(
            np.array([*[theme.NODE] * len(t.NODES), theme.SERVO_ROD], dtype=np.uint8),
            (self.n_modules, 1),
        )
        self.node_colors = node_colors.reshape(-1, 3)
        radii = [*[NODE_DRAWN_RADIUS] * len(t.NODES), ACTUATOR_DRAWN_RADIUS]
        self.node_radii = np.tile(radii, self.n_modules)

    def draw(self, pose: np.ndarray, lengths: np.ndarray) -> Drawing:
        """Place everything.

        Args:
            pose: (modules, 6, 7) positions in m and quaternions of the rods.
            lengths: (modules, 5) commanded lengths of the internal cables, in m.
        """
        position = pose[..., :3].astype(float)
        turn = pose[..., 3:].astype(float)
        points = position[:, self._rod] + _rotate(turn[:, self._rod], self._local)
        ends = points[:, self._n_fixed :].reshape(self.n_modules, -1, 2, 3)
        length = np.linalg.norm(ends[:, :, 1] - ends[:, :, 0], axis=-1)
        passive, servo = np.split(length, [self._n_passive], axis=1)
        strain = np.clip(passive / t.CABLE_REST_LENGTH - 1.0, 0.0, None)
        pull = np.clip(t.SERVO_OFFSET + t.SERVO_GAIN * (servo - lengths), 0.0, t.SERVO_MAX_TENSION)
        stretched, pulled = np.clip(strain / STRAIN_FULL_COLOR, 0.0, 1.0), pull / t.SERVO_MAX_TENSION
        colors = np.concatenate(
            [
                _blend(theme.CABLE_SLACK, theme.CABLE_TAUT, stretched),
                _blend(theme.SERVO_SLACK, theme.SERVO_TAUT, pulled),
            ],
            axis=1,
        )
        return Drawing(
            rod_positions=position.reshape(-1, 3).astype(np.float32),
            rod_turns=_multiply(turn, self._align).reshape(-1, 4).astype(np.float32),
            nodes=points[:, : self._n_fixed].reshape(-1, 3).astype(np.float32),
            cables=ends.reshape(-1, 2, 3).astype(np.float32),
            cable_colors=np.repeat(colors.reshape(-1, 1, 3), 2, axis=1),
            tension=np.concatenate([stretched, pulled], axis=1).ravel(),
        )


def _blend(low: tuple[int, ...], high: tuple[int, ...], part: np.ndarray) -> np.ndarray:
    part = np.clip(part, 0.0, 1.0)[..., None]
    return np.round(np.array(low) * (1.0 - part) + np.array(high) * part).astype(np.uint8)


def _quaternion_from_z(axis: np.ndarray) -> np.ndarray:
    turn = Rotation.align_vectors([axis / np.linalg.norm(axis)], [[0.0, 0.0, 1.0]])[0]
    return turn.as_quat(scalar_first=True)


def _rotate(q: np.ndarray, v: np.ndarray) -> np.ndarray:
    w, u = q[..., :1], q[..., 1:]
    return v + 2.0 * np.cross(u, np.cross(u, v) + w * v)


def _multiply(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    pw, pu, qw, qu = p[..., :1], p[..., 1:], q[..., :1], q[..., 1:]
    w = pw * qw - (pu * qu).sum(axis=-1, keepdims=True)
    return np.concatenate([w, pw * qu + qw * pu + np.cross(pu, qu)], axis=-1)
