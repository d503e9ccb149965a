"""What a robot consists of, as things that a scene can paint, settled on the ground or as built."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Final

import numpy as np
from reportlab.lib.colors import Color
from scipy.spatial.transform import Rotation

from engine.body import module as t
from engine.body.morphology import Morphology
from engine.simulation.model import module_placements
from viz.build_sheet import style
from viz.build_sheet.scene import Ball, Tube
from viz.robot.geometry import RobotGeometry

CABLE_RADIUS: Final = 0.0005
"""Cables have no thickness in the model; they are drawn this thick, in m."""
NODE_RADIUS: Final = 0.0022
ARM_RADIUS: Final = t.ACTUATOR_RADIUS


@dataclasses.dataclass(frozen=True, slots=True)
class Body:
    """Where everything of a robot is, in m; M modules.

    Attributes:
        nodes: (M, 12, 3) rod ends.
        arms: (M, 3) where the internal cables leave the servo's arm.
        cables: (M, 24, 2, 3) ends of the passive cables, in the order of ``module.CABLES``.
        servo_cables: (M, 5, 2, 3) ends of the internal cables, in the order of ``SERVO_NODES``.
        faces: per module the face that the next one joins.
    """

    nodes: np.ndarray
    arms: np.ndarray
    cables: np.ndarray
    servo_cables: np.ndarray
    faces: tuple[int, ...]

    @classmethod
    def settled(cls, morphology: Morphology, pose: np.ndarray) -> Body:
        """Return a robot in a simulated pose (M, 6, 7): positions in m and quaternions of its rods."""
        n = morphology.n_modules
        released = np.ones((n, len(t.SERVO_NODES)))
        drawing = RobotGeometry(morphology, 0).draw(pose, released)
        points = drawing.nodes.reshape(n, len(t.NODES) + 1, 3).astype(float)
        cables = drawing.cables.reshape(n, -1, 2, 3).astype(float)
        passive, servo = np.split(cables, [len(t.CABLES)], axis=1)
        return cls(points[:, :-1], points[:, -1], passive, servo, morphology.faces)

    @classmethod
    def as_built(cls, morphology: Morphology) -> Body:
        """Return a robot with its modules undeformed and in line, as the simulation starts."""
        placed = module_placements(morphology)
        return cls.placed([moved(turn, centre) for turn, centre in placed], morphology.faces)

    @classmethod
    def placed(cls, places: list[Callable[[np.ndarray], np.ndarray]], faces: tuple[int, ...]) -> Body:
        """Return undeformed modules, each moved by a function of points (n, 3) in m."""
        passive = np.array([[t.passive_anchor(a, b), t.passive_anchor(b, a)] for a, b in t.CABLES])
        servo = np.array([t.servo_anchors(node) for node in t.SERVO_NODES])
        return cls(
            np.array([place(t.NODES) for place in places]),
            np.array([place(t.ACTUATOR_POINT[None])[0] for place in places]),
            np.array([place(passive.reshape(-1, 3)).reshape(passive.shape) for place in places]),
            np.array([place(servo.reshape(-1, 3)).reshape(servo.shape) for place in places]),
            faces,
        )

    @property
    def n_modules(self) -> int:
        """Number of modules."""
        return len(self.nodes)

    @property
    def links(self) -> np.ndarray:
        """(3 (M - 1), 2, 3) ends of the links between modules, in m."""
        ends = [
            (self.nodes[i, a], self.nodes[i + 1, b])
            for i in range(self.n_modules - 1)
            for a, b in joined_nodes(self.faces[i], self.faces[i + 1])
        ]
        return np.array(ends).reshape(-1, 2, 3)

    def module(self, i: int) -> Body:
        """Return one module alone."""
        part = slice(i, i + 1)
        return Body(self.nodes[part], self.arms[part], self.cables[part], self.servo_cables[part], ())

    def things(self, *, head: int | None = None) -> list[Tube | Ball]:
        """Return everything in its colour, the rods of the head module in theirs."""
        things: list[Tube | Ball] = []
        for i in range(self.n_modules):
            for r in range(len(t.RODS)):
                color = style.HEAD if i == head else style.ROD
                things.append(self.rod(i, r, style.SERVO if r == t.SERVO_ROD else color))
            things += [Ball(p, NODE_RADIUS, style.NODE) for p in self.nodes[i]]
            things += self.servo(i)
            things += [Tube(a, b, CABLE_RADIUS, style.CABLE) for a, b in self.cables[i]]
        things += [Tube(a, b, 2 * CABLE_RADIUS, style.LINK) for a, b in self.links]
        return things

    def rod(self, i: int, r: int, color: Color) -> Tube:
        """Return a rod of a module."""
        a, b = t.RODS[r]
        return Tube(self.nodes[i, a], self.nodes[i, b], t.ROD_RADIUS, color)

    def servo(self, i: int, arm: Color = style.SERVO, cable: Color = style.SERVO_CABLE) -> list[Tube | Ball]:
        """Return a module's servo arm and its five internal cables."""
        a, b = t.RODS[t.SERVO_ROD]
        middle = (self.nodes[i, a] + self.nodes[i, b]) / 2
        things: list[Tube | Ball] = [Tube(middle, self.arms[i], t.ROD_RADIUS, arm)]
        things.append(Ball(self.arms[i], ARM_RADIUS, arm))
        things += [Tube(p, q, CABLE_RADIUS, cable) for p, q in self.servo_cables[i]]
        return things


def moved(turn: Rotation, shift: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
    """Return the function that turns points (n, 3) and then shifts them, in m."""
    return lambda points: turn.apply(points) + shift


def joined_nodes(face: int, next_face: int) -> list[tuple[int, int]]:
    """Return which node of a module meets which node of the next, for their faces' genes.

    Args:
        face: of the module, the one that the next module joins.
        next_face: of the next module, likewise; what meets this one is the face opposite to it.
    """
    here, there = t.FACES[face], t.FACES[t.OPPOSITE_FACE[next_face]]
    return [(here[p], there[q]) for p, q in t.JOINT_ORDER]
