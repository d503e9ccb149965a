"""The orientation table: which face joins the next module, with which nodes and in which turn."""

from __future__ import annotations

import dataclasses

import numpy as np

from engine.body import module as t
from engine.body.morphology import Morphology
from engine.simulation.model import module_placements


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Joint:
    """The joint between a module and the next one.

    Attributes:
        module: index of the first of the two; the other is the next.
        face: of the first, 1 to 8.
        next_face: face of the next module that meets it: the one opposite that module's own joining face.
        node_pairs: three pairs (node of the first, node of the next) that are tied together; they fix how the
            modules are turned.
        link: distance between two tied nodes, in m (simulated).
    """

    module: int
    face: int
    next_face: int
    node_pairs: tuple[tuple[int, int], ...]
    link: float


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Orientation:
    """How a module stands in the chain as built.

    Attributes:
        module: index from 0.
        face: its joining face, towards the next module; the last module's stays free.
        rear_face: the face opposite, towards the module before; the first module's stays free.
        servo_angle: where the middle of its servo rod lies, in degrees clockwise from straight up, seen along
            the chain from module 0.
        turn: clockwise turn of the servo against that of the module before, 0 to 360 degrees; None for
            module 0.
        rotation: (3, 3) from the module's own frame to the robot's (chain along +x, z up).
        centre: (3,) in m, in the robot's frame.
    """

    module: int
    face: int
    rear_face: int
    servo_angle: float
    turn: float | None
    rotation: np.ndarray
    centre: np.ndarray


def joints(morphology: Morphology) -> tuple[Joint, ...]:
    """Return the joints of a robot: one fewer than modules."""
    result = []
    for i in range(morphology.n_modules - 1):
        face = morphology.faces[i]
        next_face = t.OPPOSITE_FACE[morphology.faces[i + 1]]
        a, b = t.FACES[face], t.FACES[next_face]
        pairs = tuple((a[p], b[q]) for p, q in t.JOINT_ORDER)
        result.append(Joint(module=i, face=face, next_face=next_face, node_pairs=pairs, link=t.LINK_PLAY))
    return tuple(result)


def orientations(morphology: Morphology) -> tuple[Orientation, ...]:
    """Return how each module stands in the chain, in their order."""
    result: list[Orientation] = []
    for i, (turn, centre) in enumerate(module_placements(morphology)):
        servo = turn.apply(t.ROD_MIDDLES[t.SERVO_ROD])
        # looking along +x with z up, y points to the left
        angle = float(np.degrees(np.arctan2(-servo[1], servo[2]))) % 360.0
        angle = round(angle, 6) % 360.0
        before = result[-1].servo_angle if result else None
        result.append(
            Orientation(
                module=i,
                face=morphology.faces[i],
                rear_face=t.OPPOSITE_FACE[morphology.faces[i]],
                servo_angle=angle,
                turn=None if before is None else round((angle - before) % 360.0, 6) % 360.0,
                rotation=turn.as_matrix(),
                centre=centre,
            )
        )
    return tuple(result)
