"""Measurements of the published simulator, in ``tests/reference/``, which says where they come from."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any, Final

import numpy as np

from engine.body.morphology import Morphology
from engine.control.genome import ConnectionGene, Controller, NodeGene
from engine.simulation.rollout import Head

FOLDER: Final = Path(__file__).parent.parent / "tests" / "reference"
STATIC: Final = "tensoft_static.json"
GOAL_REACHING: Final = "tensoft_goal_reaching.json"
TWO_DIRECTIONS: Final = "tensoft_two_directions.json"


def load(name: str) -> dict[str, Any]:
    """Return the contents of one of the files."""
    return json.loads((FOLDER / name).read_text(encoding="utf-8"))


@dataclasses.dataclass(frozen=True, slots=True)
class ReferenceRobot:
    """A robot that the published simulator replayed; R runs of 40 s.

    Attributes:
        name: as in the file.
        morphology, controller: what it is.
        head: which module leads and what counts as its front; see ``published_head``.
        bearings: (R,) of the targets, in rad, positive to the left.
        trajectory: (R, 41, 2) head positions at 1 Hz in the settled head's frame: ahead, left, in m.
        heights: (R, modules) of the modules' centres at the end, in m.
    """

    name: str
    morphology: Morphology
    controller: Controller
    head: Head
    bearings: np.ndarray
    trajectory: np.ndarray
    heights: np.ndarray


def published_head(morphology: Morphology, head_is_front: bool) -> Head:
    """Return the head as the published program has it.

    Its head module is the chain's first one if it found the robot to run forwards, else the last one; the
    head's front is the face of the module's gene at either end, so at the first module it looks along the
    robot. Which end the controller's first outputs drive follows from the modules' heights at the end of
    the replays: with the other end they are off by 1 to 6 mm, with this one by less than 1 mm.
    """
    head = Head.of(morphology, is_end=not head_is_front)
    return head if head.is_end else dataclasses.replace(head, front=head.rear, rear=head.front)


def robots() -> list[ReferenceRobot]:
    """Return all robots that were replayed on goal reaching."""
    return [_robot(r) for r in load(GOAL_REACHING)["robots"]]


def two_directions(robot: ReferenceRobot) -> tuple[list[float], list[float]]:
    """Return what a robot did where contacts have two friction directions, run by run.

    Returns:
        Net displacements and lengths of the paths at 1 Hz of its head in 40 s, in m.
    """
    runs = [run for run in load(TWO_DIRECTIONS)["runs"] if run["id"] == robot.name]
    return [0.01 * run["net_cm"] for run in runs], [0.01 * run["path_cm"] for run in runs]


def _robot(record: dict[str, Any]) -> ReferenceRobot:
    morphology = Morphology(round(10 * record["stiffness"]), tuple(record["faces"]))
    runs = record["runs"]
    right_ahead = 0.01 * np.array([r["head_1hz_cm"] for r in runs])
    return ReferenceRobot(
        name=record["id"],
        morphology=morphology,
        controller=_controller(record["controller"]),
        head=published_head(morphology, record["head_is_front"]),
        bearings=np.array([r["target_bearing_rad"] for r in runs]),
        trajectory=np.stack([right_ahead[..., 1], -right_ahead[..., 0]], axis=-1),
        heights=0.01 * np.array([r["module_centre_heights_end_cm"] for r in runs]),
    )


def _controller(record: dict[str, Any]) -> Controller:
    nodes = tuple(NodeGene(n["key"], n["bias"]) for n in record["nodes"])
    links = [(source, n["key"], weight) for n in record["nodes"] for source, weight in n["inputs"]]
    genes = tuple(ConnectionGene(*link, enabled=True, innovation=k) for k, link in enumerate(links))
    return Controller(len(record["inputs"]), nodes, genes)
