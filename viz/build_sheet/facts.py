"""What a build sheet is about: one robot, where it comes from, how it was simulated."""

from __future__ import annotations

import dataclasses
import datetime
import re
from collections.abc import Sequence
from typing import Final

import numpy as np

from engine.analysis.as_built import AsBuilt
from engine.analysis.robustness import Robustness, load_robust_of
from engine.body import module as t
from engine.body.morphology import Morphology
from engine.config import RunConfig, task_of
from engine.errors import InvalidData, printable
from engine.export import Trial, robot_hash, robot_id
from engine.fabrication.as_built import Twin
from engine.fabrication.dimensions.feet import NO_FEET, FeetPlan
from engine.fabrication.dimensions.joints import Joint, joints
from engine.search.archive import Cell, cell_name
from engine.simulation.built import PUBLISHED, Built
from engine.simulation.evaluation import Evaluation
from engine.simulation.rollout import Head
from engine.storage.reader import RunReader
from engine.tasks import Task
from viz.robot.skeleton import Skeleton

MODULE_MASS: Final = t.SERVO_ROD_MASS + (len(t.RODS) - 1) * t.ROD_MASS
"""What a module weighs in the simulation, in kg."""


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class ArchivePlace:
    """Where in a run a robot was found: an archive and a cell of it."""

    archive: str
    cell: Cell

    @property
    def name(self) -> str:
        """For people and for links: ``morphology 3,7``."""
        return f"{self.archive} {cell_name(self.cell)}"


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Facts:
    """One robot of a run.

    Attributes:
        run_name: file name of the run, without its ending.
        date: day the run was started, ``2026-11-24``, or ``unknown``.
        place: where the robot was found; None if by its number alone.
        config: of the run.
        evaluation: of the robot.
        trial: one of its trials, simulated again.
        robust: what evaluating the run's elites again has shown; None if that was not done.
        versions: of the programs that the run was made with.
        twin: the robot as it would be built; None if that was not asked for.
        as_built: how it does then.
        feet: that it wears, if its gene says that it has some.
    """

    run_name: str
    date: str
    place: ArchivePlace | None
    config: RunConfig
    evaluation: Evaluation
    trial: Trial
    robust: Robustness | None
    versions: dict[str, str]
    twin: Twin | None = None
    as_built: AsBuilt | None = None
    feet: FeetPlan = NO_FEET

    @property
    def built(self) -> Built:
        """What the robot is like as built, for what its modules must measure."""
        return PUBLISHED if self.twin is None else self.twin.built

    @property
    def number(self) -> int:
        """Of the robot in its run, by which the app calls it."""
        return self.evaluation.solution.number

    @property
    def morphology(self) -> Morphology:
        """The body's genotype."""
        return self.evaluation.solution.morphology

    @property
    def head(self) -> Head:
        """Which end goes first."""
        return Head.of(self.morphology, self.evaluation.head_is_end)

    @property
    def task(self) -> Task:
        """What the robot is asked to do."""
        return task_of(self.config)

    @property
    def where(self) -> str:
        """For people: where in its run the robot is."""
        return self.place.name if self.place else f"evaluation {self.evaluation.solution.number}"

    @property
    def name(self) -> str:
        """What the robot is called wherever its run is known."""
        return f"Robot {self.evaluation.solution.number}"

    @property
    def robot_id(self) -> str:
        """What tells it from the robots of all runs."""
        return robot_id(self.config, self.evaluation.solution)

    @property
    def robot_hash(self) -> str:
        """SHA-256 of genotypes, task and physics."""
        return robot_hash(self.config, self.evaluation.solution)

    @property
    def f_s(self) -> float:
        """How much closer to its targets the robot ends, in m."""
        assert self.evaluation.fitness is not None
        return self.task.target_distance - self.evaluation.fitness

    @property
    def mass(self) -> float:
        """What the robot weighs in the simulation, in kg, before inertia is scaled."""
        return self.morphology.n_modules * MODULE_MASS

    @property
    def joints(self) -> tuple[Joint, ...]:
        """How each module is joined to the next one."""
        return joints(self.morphology)

    @property
    def body(self) -> Skeleton:
        """The robot settled on the ground, as simulated."""
        return Skeleton.settled(self.trial.pose)

    @property
    def levelled(self) -> Skeleton:
        """The same, turned about the vertical and moved over the origin: it points along x, its head first.

        The direction is that from the centre of the module at one end to that at the other.
        """
        body = self.body
        centres = body.centres
        along = (centres[-1] - centres[0])[:2]
        along = along / np.linalg.norm(along) * (1.0 if self.head.is_end else -1.0)
        turn = np.array([[along[0], along[1], 0.0], [-along[1], along[0], 0.0], [0.0, 0.0, 1.0]])
        middle = np.append(centres.mean(axis=0)[:2], 0.0)
        return body.moved(lambda points: (points - middle) @ turn.T)

    @property
    def link(self) -> str:
        """The explorer's address of this robot, after the host: ``?run=NAME&archive=A&cell=I,J``."""
        where = f"&archive={self.place.archive}&cell={cell_name(self.place.cell)}" if self.place else ""
        return f"?run={self.run_name}{where}"

    @property
    def size(self) -> tuple[float, float, float]:
        """Length along the robot, width and height over the ground in m, settled, with rods' thickness."""
        low, high = self.extent()
        length, width, _ = high - low
        return float(length), float(width), float(high[2])

    @property
    def link_gaps(self) -> tuple[float, float]:
        """Least and largest distance of joined nodes in m, settled: links yield to what pulls at them."""
        ends = links(self.body, self.joints)
        gaps = np.linalg.norm(ends[:, 0] - ends[:, 1], axis=-1)
        return float(gaps.min()), float(gaps.max())

    def module_name(self, i: int) -> str:
        """Return a module's number for people; it says which module is the head."""
        number = t.module_number(i)
        return f"{number} (head)" if i == self.head.module else str(number)

    def extent(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the corners (3,) of the box round the levelled robot, in m."""
        points = self.levelled.nodes.reshape(-1, 3)
        return points.min(axis=0) - t.ROD_RADIUS, points.max(axis=0) + t.ROD_RADIUS


def links(body: Skeleton, joints: Sequence[Joint]) -> np.ndarray:
    """Return the (3 (M - 1), 2, 3) ends of the links between modules, in m."""
    ends = [(body.nodes[j.module, a], body.nodes[j.module + 1, b]) for j in joints for a, b in j.node_pairs]
    return np.array(ends).reshape(-1, 2, 3)


def gather(
    reader: RunReader,
    evaluation: Evaluation,
    trial: Trial,
    place: ArchivePlace | None = None,
    twin: Twin | None = None,
    as_built: AsBuilt | None = None,
    feet: FeetPlan = NO_FEET,
) -> Facts:
    """Collect what a build sheet is about.

    Args:
        reader: of the run.
        evaluation: of the robot.
        trial: one of its trials, simulated again.
        place: where the robot was found.
        twin: the robot as it would be built.
        as_built: how it does then.
        feet: that it wears.
    """
    return Facts(
        run_name=printable(reader.path.stem),
        date=run_date(reader.created_at),
        place=place,
        config=reader.config,
        evaluation=evaluation,
        trial=trial,
        robust=_robustness(reader),
        versions=reader.versions,
        twin=twin,
        as_built=as_built,
        feet=feet,
    )


def run_date(created_at: str) -> str:
    """Return the day of a run file's ``created_at``, or ``unknown`` for a file that does not say."""
    match = re.match(r"\d{4}-\d\d-\d\d", created_at)
    try:
        return datetime.date.fromisoformat(match[0]).isoformat() if match else "unknown"
    except ValueError:
        return "unknown"


def _robustness(reader: RunReader) -> Robustness | None:
    """Return what evaluating elites again has shown, if the file beside the run is there and fits it."""
    try:
        return load_robust_of(reader)
    except InvalidData:
        return None
