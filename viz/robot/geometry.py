"""A robot as it is drawn, at any moment of a replay: rods, nodes, cables with their tension, friction."""

from __future__ import annotations

import dataclasses
import functools
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from engine.body import module as t
from engine.body.kinematics import internal_tension, passive_tension, points_on
from engine.body.morphology import Morphology
from engine.replay.recording import Playable, mix, mix_turns, place_of
from viz import theme
from viz.robot.skeleton import N_POINTS, posed

ROD_DRAWN_RADIUS: Final = 0.0021
CABLE_DRAWN_RADIUS: Final = 0.00075
NODE_DRAWN_RADIUS: Final = 0.0030
ACTUATOR_DRAWN_RADIUS: Final = 0.0055
TARGET_RADIUS: Final = 0.02
TARGET_HEIGHT: Final = 0.06
"""In m, as everything here: a target is drawn as a disc on the ground with a post."""
STRAIN_FULL_COLOR: Final = 1.6
"""Strain at which a passive cable of the stiffest module has its full colour; a settled module is at 1.3."""
AT_ONCE: Final = 25
"""Frames of a replay that are drawn at once: a second's worth."""
ARROW_PER_NEWTON: Final = 0.5
"""Length of an arrow in m for a friction of 1 N: 1 cm is 0.02 N, a twelfth of a module's weight."""
LEAST_FRICTION: Final = 0.004
"""Friction in N below which no arrow is drawn."""
ARROW_HEAD: Final = 0.006
"""Length of the strokes of an arrow's head, in m."""
ARROW_LIFT: Final = 0.004
"""How high arrows lie over the ground, in m."""
_NODE_PLACES: Final = t.NODES - t.ROD_MIDDLES[t.NODE_RODS]


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
    def rods(self) -> np.ndarray:
        """(rods, 2, 3) end points."""
        return self.nodes.reshape(-1, N_POINTS, 3)[:, np.array(t.RODS)].reshape(-1, 2, 3)

    @property
    def centres(self) -> np.ndarray:
        """(modules, 3) means of the centres of their rods."""
        return self.rod_positions.reshape(-1, len(t.RODS), 3).mean(axis=1)


class RobotGeometry:
    """Draws a robot.

    Args:
        morphology: its body.
        head_module: index of the head module, which has a colour of its own.
    """

    def __init__(self, morphology: Morphology, head_module: int) -> None:
        self.n_modules = morphology.n_modules
        self._stiffness = np.array(morphology.stiffnesses)[:, None]
        self._full_tension = full_tension(morphology)
        plain = [*[theme.CABLE] * len(t.CABLES), *[theme.SERVO_CABLE] * len(t.SERVO_NODES)]
        self._plain_colors = np.tile(np.array(plain, dtype=np.uint8), (self.n_modules, 1, 1))
        rod_colors = np.full((self.n_modules, len(t.RODS), 3), theme.ROD, dtype=np.uint8)
        rod_colors[head_module] = theme.HEAD_ROD
        rod_colors[:, t.SERVO_ROD] = theme.SERVO_ROD
        self.rod_colors = rod_colors.reshape(-1, 3)
        """(rods, 3) uint8."""
        node_colors = [*[theme.NODE] * len(t.NODES), theme.SERVO_ROD]
        self.node_colors = np.tile(np.array(node_colors, dtype=np.uint8), (self.n_modules, 1))
        """(nodes + actuators, 3) uint8."""
        radii = [*[NODE_DRAWN_RADIUS] * len(t.NODES), ACTUATOR_DRAWN_RADIUS]
        self.node_radii = np.tile(radii, self.n_modules)
        """(nodes + actuators,) in m."""

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
        nodes, ends = posed(poses)
        shares = self._tensions(ends, lengths)
        colors = self._tension_colors(shares) if tension else np.tile(self._plain_colors, (n, 1, 1, 1))
        places = [a.reshape(n, -1, 3) for a in (position, nodes, ends)]
        arrays = (
            np.concatenate(places, axis=1),
            _multiply(turn, _alignment()).reshape(n, -1, 4).astype(np.float32),
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


class DrawnReplay:
    """Draws the robot of a replay at any moment: many frames at once, and what lies between two of them.

    Args:
        geometry: of the robot.
        replay: of it.
    """

    def __init__(self, geometry: RobotGeometry, replay: Playable) -> None:
        self._geometry, self._replay = geometry, replay
        self._first = 0
        self._tension = True
        self._drawings: list[Drawing] = []

    def at(self, moment: float, *, tension: bool) -> Drawing:
        """Return the drawing of a moment; never one beyond what has been simulated.

        Between two frames everything moves along straight lines, rods turn by ``mix_turns``, and colours are
        those of the nearer frame. The ends of cables then lie off the ends of the rods by 0.1 mm in the
        median, and by up to 3 mm during the tenth of a second in which a dropped module folds.

        Args:
            moment: of the replay's clock, in s; there must be a frame.
            tension: whether the colours of the cables show it.
        """
        index, part = place_of(self._replay, moment)
        last = index + (part > 0.0)
        if tension != self._tension or not self._first <= index <= last < self._first + len(self._drawings):
            self._draw(index, tension)
        k = index - self._first
        one = self._drawings[k]
        if not part:
            return one
        other = self._drawings[k + 1]
        nearer = one if part < 0.5 else other
        return Drawing(
            points=mix(one.points, other.points, part),
            rod_turns=mix_turns(one.rod_turns, other.rod_turns, part),
            cable_colors=nearer.cable_colors,
            tension=nearer.tension,
        )

    def _draw(self, first: int, tension: bool) -> None:
        frames = self._replay.frames[first : first + AT_ONCE]
        poses, lengths = np.array([f.pose for f in frames]), np.array([f.lengths for f in frames])
        self._drawings = self._geometry.draw_all(poses, lengths, tension=tension)
        self._first, self._tension = first, tension


def full_tension(morphology: Morphology) -> float:
    """Return the tension in N at which a passive cable of a robot is drawn in its full colour."""
    length = (1.0 + STRAIN_FULL_COLOR) * t.CABLE_REST_LENGTH
    return float(passive_tension(length, np.array(max(morphology.stiffnesses))))


def _blend(low: tuple[int, ...], high: tuple[int, ...], part: np.ndarray) -> np.ndarray:
    part = np.clip(part, 0.0, 1.0)[..., None]
    return np.round(np.array(low) * (1.0 - part) + np.array(high) * part).astype(np.uint8)


@functools.cache
def _alignment() -> np.ndarray:
    """Return the (6, 4) quaternions that turn a cylinder along z into each rod of a module as built."""
    return np.array([_quaternion_from_z(t.NODES[b] - t.NODES[a]) for a, b in t.RODS])


def _quaternion_from_z(axis: np.ndarray) -> np.ndarray:
    turn = Rotation.align_vectors([axis / np.linalg.norm(axis)], [[0.0, 0.0, 1.0]])[0]
    return turn.as_quat(scalar_first=True)


def _multiply(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    pw, pu, qw, qu = p[..., :1], p[..., 1:], q[..., :1], q[..., 1:]
    w = pw * qw - (pu * qu).sum(axis=-1, keepdims=True)
    return np.concatenate([w, pw * qu + qw * pu + np.cross(pu, qu)], axis=-1)


def friction_arrows(pose: np.ndarray, forces: np.ndarray) -> np.ndarray:
    """Return the (n, 3, 2, 3) float32 strokes of arrows in m: shaft and both sides of the head.

    They say how the ground pushes the robot, and begin where it does.

    Args:
        pose: (M, 6, 7) positions in m and quaternions (w, x, y, z) of the rods.
        forces: (M, 12, 3) of the ground on the nodes, in N.
    """
    level = forces[..., :2].astype(float)
    size = np.linalg.norm(level, axis=-1)
    felt = size >= LEAST_FRICTION
    if not felt.any():
        return np.zeros((0, 3, 2, 3), np.float32)
    start = points_on(pose.astype(float), t.NODE_RODS, _NODE_PLACES)[felt]
    start[:, 2] = ARROW_LIFT
    way = np.zeros_like(start)
    way[:, :2] = level[felt] / size[felt][:, None]
    tip = start + ARROW_PER_NEWTON * size[felt][:, None] * way
    side = np.stack([-way[:, 1], way[:, 0], way[:, 2]], axis=-1)
    heads = [np.stack([tip, tip - ARROW_HEAD * (0.8 * way + sign * 0.6 * side)], axis=1) for sign in (-1, 1)]
    return np.stack([np.stack([start, tip], axis=1), *heads], axis=1).astype(np.float32)
