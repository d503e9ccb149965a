"""What one browser looks at: the run and its generations, the chosen robot and its trial.

Each part has one owner, which alone changes it; all others only read. The basket has its owner in
``app.downloads``, how maps are drawn in ``app.maps``.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Self

from engine.analysis.profile import ProfileHistory
from engine.replay.trial import FIRST_TRIAL, TrialChoice
from engine.search.archive import Cell
from engine.simulation.evaluation import Evaluation
from engine.storage.reader import RunReader
from engine.storage.rows import Ancestor, Generation
from engine.tasks import get_task


@dataclasses.dataclass(slots=True)
class ShownRun:
    """The run that is shown. Only ``Session`` changes it.

    Attributes:
        path: of the run, None before one is shown.
        reader: whose contents are on the screen; after the file was replaced, the library holds a newer one.
        generations: the closed generations of the run, in order.
        history: the profiles of the archives at their ends.
        follow_newest: whether the maps follow a live run.
    """

    path: Path | None = None
    reader: RunReader | None = None
    generations: list[Generation] = dataclasses.field(default_factory=list)
    history: ProfileHistory | None = None
    follow_newest: bool = True

    def begin(self, path: Path, reader: RunReader) -> None:
        """Show another run, of which no generation is known yet."""
        self.path, self.reader = path, reader
        self.generations, self.follow_newest = [], True
        self.history = ProfileHistory(get_task(reader.config.task))

    def add(self, reader: RunReader, generations: Sequence[Generation]) -> None:
        """Take note of generations that have been closed since the last ones.

        Raises:
            RunFileError: the run is damaged.
        """
        if self.history is not None and generations:
            self.history.extend(reader, generations)
        self.generations += generations

    def look_at(self, number: int) -> None:
        """Follow a live run if this is its last generation, else stop following it."""
        self.follow_newest = self.last is not None and number == self.last.number

    @property
    def last(self) -> Generation | None:
        """The last closed generation of the run."""
        return self.generations[-1] if self.generations else None


@dataclasses.dataclass(frozen=True, slots=True)
class Selection:
    """The robot of a clicked cell and the map it was clicked on.

    Attributes:
        archive: in which it was chosen.
        cell: of the archive, None if none of its cells held the robot.
        evaluation: the robot.
        entered: generation of the evaluation.
        line: the robot that was clicked on a map and its ancestors, the youngest first. Choosing an ancestor
            keeps the line, the archive and the cell.
    """

    archive: str
    cell: Cell | None
    evaluation: Evaluation
    entered: int | None
    line: tuple[Ancestor, ...] = ()

    @classmethod
    def of(cls, reader: RunReader, archive: str, cell: Cell | None, number: int) -> Self:
        """Return the robot of an evaluation as chosen in an archive.

        Raises:
            RunFileError: the run has no such evaluation.
        """
        evaluation, entered = reader.evaluation(number), reader.generation_of(number)
        return cls(archive, cell, evaluation, entered, tuple(reader.lineage(number)))

    @property
    def is_ancestor(self) -> bool:
        """Whether the robot is an ancestor of the one that the cell holds."""
        return bool(self.line) and self.line[0].number != self.number

    @property
    def own_cell(self) -> Cell | None:
        """The cell that holds the robot itself; None if none does."""
        return None if self.is_ancestor else self.cell

    @property
    def number(self) -> int:
        """Number of its evaluation."""
        return self.evaluation.solution.number


@dataclasses.dataclass(slots=True)
class Choice:
    """The chosen robot and the trial of it that is replayed. Only ``ChosenRobot`` changes it.

    Attributes:
        selection: the robot, None for none.
        trial: of the robot.
        greets: whether nobody has chosen the robot: the app greets with it.
    """

    selection: Selection | None = None
    trial: TrialChoice = FIRST_TRIAL
    greets: bool = False

    @property
    def wanted(self) -> Selection | None:
        """The robot that the user, or an address, has chosen."""
        return None if self.greets else self.selection

    def select(self, selection: Selection) -> None:
        """Choose another robot; the trial is kept."""
        self.selection = selection

    def replay(self, trial: TrialChoice) -> None:
        """Choose another trial."""
        self.trial = trial

    def forget(self) -> None:
        """Choose no robot."""
        self.selection, self.trial, self.greets = None, FIRST_TRIAL, False
