"""From the poses of the rods to what is drawn: rods, nodes, cables and their tension."""

from __future__ import annotations

import dataclasses

import numpy as np
from scipy.spatial.transform import Rotation

from engine.body import module as t
from engine.body.kinematics import END_PLACES, END_RODS, internal_tension, passive_tension, points_on
from engine.body.morphology import Morphology
from viz import theme

ROD_DRAWN_RADIUS = 0.0021
NODE_DRAWN_RADIUS = 0.0030
ACTUATOR_DRAWN_RADIUS = 0.0055
STRAIN_FULL_COLOR = 1.6
"""Strain at which a passive cable of the stiffest module has its full colour; a settled module is at 1.3."""


@dataclasses.dataclass(frozen=True, slots=True)
class Drawing:
    """One frame of a robot, in metres.

    Attributes:
        points: (rods + nodes + actuators + 2 cables, 3) float32: all places, in that order.
        rod_turns: (rods, 4) quaternions (w, x, y, z) that turn a cylinder along z.
        cable_colors: (cables, 2, 3) uint8.
        tension: (cables,) 0 slack to 1 in the full colour; of every module the passive cables, then the
            servo's.
    """

    points: np.ndarray
    rod_turns: np.ndarray
    cable_colors: np.ndarray
    tension: np.ndarray

    @property
    def rod_positions(self) -> np.ndarray:
        """(rods, 3) centres."""
        return self.points[: len(self.rod_turns)]

    @property
    def nodes(self) -> np.ndarray:
        """(nodes + actuators, 3) centres of spheres."""
        return self.points[len(self.rod_turns) : len(self.points) - 2 * len(self.tension)]

    @property
    def cables(self) -> np.ndarray:
        """(cables, 2, 3) end points."""
        return self.points[len(self.points) - 2 * len(self.tension) :].reshape(-1, 2, 3)

    @property
    def centres(self) -> np.ndarray:
        """(modules, 3) means of the centres of their rods."""
        return self.rod_positions.reshape(-1, len(t.RODS), 3).mean(axis=1)


class RobotGeometry:
    """Draws a robot of a given body.

    Args:
        morphology: the body.
        head_module: index of the head module, drawn in its own colour.
    """

    def __init__(self, morphology: Morphology, head_module: int) -> None:
        self.n_modules = morphology.n_modules
        axes = np.array([t.NODES[b] - t.NODES[a] for a, b in t.RODS])
        self._align = np.array([_quaternion_from_z(a) for a in axes])
        # points fixed to rods: nodes and actuator
        fixed = [(t.rod_of(n), p) for n, p in enumerate(t.NODES)]
        fixed.append((t.SERVO_ROD, t.ACTUATOR_POINT))
        places = [p - t.ROD_MIDDLES[r] for r, p in fixed]
        self._n_fixed = len(fixed)
        self._rod = np.array([*(r for r, _ in fixed), *END_RODS])
        self._local = np.array([*places, *END_PLACES], dtype=np.float32)
        self._stiffness = np.array(morphology.stiffnesses)[:, None]
        self._full_tension = full_tension(morphology)
        plain = [*[theme.CABLE] * len(t.CABLES), *[theme.SERVO_CABLE] * len(t.SERVO_NODES)]
        self._plain_colors = np.tile(np.array(plain, dtype=np.uint8), (self.n_modules, 1, 1))
        rod_colors = np.tile(np.array(theme.ROD, dtype=np.uint8), (self.n_modules, len(t.RODS), 1))
        rod_colors[:, t.SERVO_ROD] = theme.SERVO_ROD
        plain_rods = [r for r in range(len(t.RODS)) if r != t.SERVO_ROD]
        rod_colors[head_module, plain_rods] = theme.HEAD_ROD
        self.rod_colors = rod_colors.reshape(-1, 3)
        node_colors = np.tile(
            np.array([*[theme.NODE] * len(t.NODES), theme.SERVO_ROD], dtype=np.uint8),
            (self.n_modules, 1),
        )
        self.node_colors = node_colors.reshape(-1, 3)
        radii = [*[NODE_DRAWN_RADIUS] * len(t.NODES), ACTUATOR_DRAWN_RADIUS]
        self.node_radii = np.tile(radii, self.n_modules)

    def draw(self, pose: np.ndarray, lengths: np.ndarray, *, tension: bool = True) -> Drawing:
        """Place everything.

        Args:
            pose: (modules, 6, 7) positions in m and quaternions of the rods.
            lengths: (modules, 5) commanded lengths of the internal cables, in m.
            tension: whether the colours of the cables show it.
        """
        return self.draw_all(pose[None], lengths[None], tension=tension)[0]

    def draw_all(self, poses: np.ndarray, lengths: np.ndarray, *, tension: bool = True) -> list[Drawing]:
        """Place everything in several frames at once, which costs little more than in one.

        Args:
            poses: (frames, modules, 6, 7) positions in m and quaternions of the rods.
            lengths: (frames, modules, 5) commanded lengths of the internal cables, in m.
            tension: whether the colours of the cables show it.
        """
        n = len(poses)
        poses = poses.astype(np.float32)
        position, turn = poses[..., :3], poses[..., 3:]
        points = points_on(poses, self._rod, self._local)
        nodes = points[..., : self._n_fixed, :]
        ends = points[..., self._n_fixed :, :].reshape(*points.shape[:2], -1, 2, 3)
        shares = self._tensions(ends, lengths)
        colors = self._tension_colors(shares) if tension else np.tile(self._plain_colors, (n, 1, 1, 1))
        places = [a.reshape(n, -1, 3) for a in (position, nodes, ends)]
        arrays = (
            np.concatenate(places, axis=1),
            _multiply(turn, self._align).reshape(n, -1, 4).astype(np.float32),
            np.repeat(colors.reshape(n, -1, 1, 3), 2, axis=2),
            shares.reshape(n, -1),
        )
        return [Drawing(*of_one) for of_one in zip(*arrays, strict=True)]

    def _tensions(self, ends: np.ndarray, commanded: np.ndarray) -> np.ndarray:
        """Return the (..., modules, cables) tensions as shares of those that have the full colour."""
        length = np.linalg.norm(ends[..., 1, :] - ends[..., 0, :], axis=-1)
        passive, internal = np.split(length, [len(t.CABLES)], axis=-1)
        pull = passive_tension(passive, self._stiffness) / self._full_tension
        drawn_in = internal_tension(internal, commanded) / t.SERVO_MAX_TENSION
        return np.clip(np.concatenate([pull, drawn_in], axis=-1), 0.0, 1.0)

    def _tension_colors(self, shares: np.ndarray) -> np.ndarray:
        pull, drawn_in = np.split(shares, [len(t.CABLES)], axis=-1)
        return np.concatenate(
            [
                _blend(theme.CABLE_SLACK, theme.CABLE_TAUT, pull),
                _blend(theme.SERVO_SLACK, theme.SERVO_TAUT, drawn_in),
            ],
            axis=-2,
        )


def full_tension(morphology: Morphology) -> float:
    """Return the tension in N at which a passive cable of a robot is drawn in its full colour."""
    length = (1.0 + STRAIN_FULL_COLOR) * t.CABLE_REST_LENGTH
    return float(passive_tension(length, np.array(max(morphology.stiffnesses))))


def _blend(low: tuple[int, ...], high: tuple[int, ...], part: np.ndarray) -> np.ndarray:
    part = np.clip(part, 0.0, 1.0)[..., None]
    return np.round(np.array(low) * (1.0 - part) + np.array(high) * part).astype(np.uint8)


def _quaternion_from_z(axis: np.ndarray) -> np.ndarray:
    turn = Rotation.align_vectors([axis / np.linalg.norm(axis)], [[0.0, 0.0, 1.0]])[0]
    return turn.as_quat(scalar_first=True)


def _multiply(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    pw, pu, qw, qu = p[..., :1], p[..., 1:], q[..., :1], q[..., 1:]
    w = pw * qw - (pu * qu).sum(axis=-1, keepdims=True)
    return np.concatenate([w, pw * qu + qw * pu + np.cross(pu, qu)], axis=-1)
