"""What one browser looks at: everything that a session remembers, in one place."""

from __future__ import annotations

import dataclasses
from pathlib import Path

from app.downloads.basket import Item
from engine.replay.trial import FIRST_TRIAL, TrialChoice
from engine.search.archive import Cell
from engine.simulation.evaluation import Evaluation
from engine.storage.reader import RunReader
from engine.storage.rows import Ancestor, Generation


@dataclasses.dataclass(frozen=True, slots=True)
class Selection:
    """The robot of a clicked cell and the map it was clicked on.

    Attributes:
        archive: it was chosen in.
        cell: of the archive, None if none of its cells held the robot.
        evaluation: the robot.
        entered: generation of the evaluation.
        line: the robot that was clicked on a map, its parent, and so on. An ancestor that was chosen from it
            keeps it, and the archive and cell of the robot that was clicked.
    """

    archive: str
    cell: Cell | None
    evaluation: Evaluation
    entered: int | None
    line: tuple[Ancestor, ...] = ()

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
class SessionState:
    """The state of a session. Only ``Session`` changes it; a panel is told what to show.

    Attributes:
        path: of the run that is shown, None before one is.
        reader: what the screen shows of it; another one than the library's now if the file was replaced.
        generations: the closed generations of the run, in order.
        follow_newest: whether the maps move on with a live run.
        wanted_generation: where the slider was last.
        selection: the chosen robot.
        trial: of it that is replayed.
        basket: robots that were put aside, of any runs.
    """

    path: Path | None = None
    reader: RunReader | None = None
    generations: list[Generation] = dataclasses.field(default_factory=list)
    follow_newest: bool = True
    wanted_generation: int = 0
    selection: Selection | None = None
    trial: TrialChoice = FIRST_TRIAL
    basket: tuple[Item, ...] = ()

    def begin(self, path: Path, reader: RunReader) -> None:
        """Forget all of another run; the basket stays."""
        self.path, self.reader = path, reader
        self.generations, self.follow_newest = [], True
        self.selection = None
        self.trial = FIRST_TRIAL

    @property
    def last(self) -> Generation | None:
        """The last closed generation of the run."""
        return self.generations[-1] if self.generations else None
