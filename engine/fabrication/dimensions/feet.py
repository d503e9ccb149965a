"""Which rod ends of a robot get feet that grip one way, and which way each of them points.

The simulation gives every node of a robot such feet, forward always along the chain. A real foot sits on one
rod end and keeps its direction there. So feet are put where the rod ends touch the ground in the robot's
trials, and each points the way that was forward for it on average. Of two rod ends that are tied together
one at most gets a foot: there is no room for two.
"""

from __future__ import annotations

import dataclasses
from typing import Final

import numpy as np

from engine.body.morphology import Morphology
from engine.config import RunConfig
from engine.fabrication.dimensions.joints import joints
from engine.replay.contact_record import ContactRecord, contact_record
from engine.replay.every_target import replay_every_target
from engine.replay.recording import UPDATES_PER_FRAME
from engine.simulation.evaluation import Evaluation

LEAST_SHARE: Final = 0.05
"""Part of the time for which a node must touch the ground to get a foot, unless it does at rest."""
LEAN_STEP: Final = 30
"""Feet are printed with leans that are multiples of this, in degrees."""
CLOCK_STEP: Final = 10
"""Directions about the rod are given in multiples of this, in degrees."""
TEST_FEET: Final = 3
"""How many feet the sled of the friction test stands on."""
TEST_LEAN: Final = 90
"""Their lean in degrees: they stand upright below the sled and slide along it."""


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Foot:
    """A foot on a rod end.

    Attributes:
        number: of the foot, from 1.
        module: index of its module.
        node: its rod end.
        lean: angle between the way it slides and the rod's outward direction, in degrees.
        clock: where its notch points about the rod, in degrees clockwise seen from outside; 0 is towards the
            middle of the module.
        share: part of the trials' time for which the node touches the ground.
        forward, backward: how far the node slides that way and against it on the ground, per trial, in m.
        off: angle in degrees between the way the foot points and forward on average over its contacts.
    """

    number: int
    module: int
    node: int
    lean: int
    clock: int
    share: float
    forward: float
    backward: float
    off: float

    @property
    def part(self) -> str:
        """Name of the part to print."""
        return foot_name(self.lean)

    @property
    def direction(self) -> np.ndarray:
        """(3,) which way it slides, in its rod end's frame: z outwards, x to the middle of the module."""
        lean, turn = np.radians(self.lean), -np.radians(self.clock)
        return np.array([np.sin(lean) * np.cos(turn), np.sin(lean) * np.sin(turn), np.cos(lean)])


@dataclasses.dataclass(frozen=True, slots=True)
class FeetPlan:
    """The feet of a robot.

    Attributes:
        feet: in the order of their numbers.
        covered: part of all the contact of its rod ends with the ground that is under a foot.
    """

    feet: tuple[Foot, ...]
    covered: float


NO_FEET: Final = FeetPlan((), 0.0)
"""Of a robot without feet."""


def foot_name(lean: int) -> str:
    """Return the name of the part that is a foot of some lean, in degrees."""
    return f"foot_{lean:03}"


def planned_feet(morphology: Morphology, record: ContactRecord) -> FeetPlan:
    """Return the feet of a robot by what its rod ends did, module by module, node by node."""
    feet: list[Foot] = []
    wanted = record.resting | (record.share >= LEAST_SHARE)
    for joint in joints(morphology):
        for a, b in joint.node_pairs:
            pair = (joint.module, a), (joint.module + 1, b)
            if all(wanted[end] for end in pair):
                wanted[min(pair, key=lambda end: record.share[end])] = False
    for module, node in np.argwhere(wanted).tolist():
        mean = record.facing[module, node]
        x, y, z = mean / np.linalg.norm(mean)
        foot = Foot(
            number=len(feet) + 1,
            module=module,
            node=node,
            lean=_nearest(np.degrees(np.arccos(np.clip(z, -1.0, 1.0))), LEAN_STEP),
            clock=_nearest(-np.degrees(np.arctan2(y, x)), CLOCK_STEP) % 360,
            share=float(record.share[module, node]),
            forward=float(record.forward[module, node]),
            backward=float(record.backward[module, node]),
            off=0.0,
        )
        off = np.degrees(np.arccos(np.clip(mean @ foot.direction, -1.0, 1.0)))
        feet.append(dataclasses.replace(foot, off=float(off)))
    touching = float(record.share.sum())
    return FeetPlan(tuple(feet), sum(f.share for f in feet) / touching if touching else 0.0)


def robot_feet(config: RunConfig, evaluation: Evaluation) -> FeetPlan:
    """Return the feet of an evaluated robot; its trials towards all targets are simulated again.

    Raises:
        InvalidData: today's robots do not survive the run's physics.
        TaskError: a user's task returns invalid values.
    """
    morphology = evaluation.solution.morphology
    if morphology.feet == "none":
        return NO_FEET
    ((_, trials),) = replay_every_target(config, [evaluation], updates_per_frame=UPDATES_PER_FRAME)
    poses = [trial.poses for trial in trials if len(trial.poses)]
    return planned_feet(morphology, contact_record(poses, morphology.feet))


def _nearest(value: float, step: int) -> int:
    return step * round(float(value) / step)
