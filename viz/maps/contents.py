"""The contents of a run's archives at one of its generations."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

from engine.analysis.profile import still_limit
from engine.body.feet import feet_note
from engine.body.module import stiffness_n_per_m
from engine.body.morphology import Morphology
from engine.search.archive import Cell
from engine.search.axes import Axis
from engine.storage.reader import RunReader
from engine.storage.rows import Generation
from engine.tasks import get_task
from viz import words


@dataclasses.dataclass(frozen=True, slots=True)
class ShownElite:
    """What a map says of a robot.

    Attributes:
        number: of its evaluation.
        f_s: in cm.
        generation: of its evaluation.
        morphology: its body.
        still_below: |f_s| in cm below which it counts as lying still.
    """

    number: int
    f_s: float
    generation: int
    morphology: Morphology
    still_below: float = 0.0

    @property
    def lies_still(self) -> bool:
        """Whether it does not come closer to its targets, nor go away from them."""
        return abs(self.f_s) < self.still_below

    @property
    def body(self) -> str:
        """Its faces, one figure each, of which a browser draws it."""
        return "".join(map(str, self.morphology.faces))

    @property
    def hint(self) -> str:
        """The lines of its hover card."""
        body = self.morphology
        stiff = f"relative stiffness {body.stiffness_text}"
        if body.stiffness_mode == "shared":
            stiff += f" ({stiffness_n_per_m(body.stiffness):.0f} N/m)"
        return (
            f"{words.gained(self.f_s, self.still_below)} · f_s {self.f_s:.2f} cm\n"
            f"{body.n_modules} modules, {stiff}{feet_note(body.feet)}\n"
            f"robot {self.number}, generation {self.generation}"
        )


@dataclasses.dataclass(frozen=True, slots=True)
class Content:
    """An archive.

    Attributes:
        axes: of its cells.
        elites: of its filled cells.
        coverage: filled cells as a part of those that a robot can lie in; None if it can lie in any.
    """

    axes: tuple[Axis, ...]
    elites: Mapping[Cell, ShownElite]
    coverage: float | None = None

    def cell_of(self, number: int) -> Cell | None:
        """Return the cell of an evaluation, None if it is no elite."""
        return next((c for c, e in self.elites.items() if e.number == number), None)


def best_elite(
    contents: Mapping[str, Content], robust: Mapping[int, float]
) -> tuple[str, Cell, ShownElite] | None:
    """Return the best robot of some archives: archive, cell and elite; None if all are empty.

    Args:
        contents: the archives by name; of those that hold the robot the first one counts.
        robust: f_s in cm under noise that they were not selected with, by the numbers of evaluations. Robots
            of which it is known come before others, whose recorded f_s counts.
    """
    found = [
        (name, cell, elite) for name, content in contents.items() for cell, elite in content.elites.items()
    ]
    return max(
        found,
        key=lambda f: (f[2].number in robust, robust.get(f[2].number, f[2].f_s), -f[2].number),
        default=None,
    )


def load_contents(reader: RunReader, generation: Generation) -> dict[str, Content]:
    """Return what all archives of a run held at the end of a generation, by name.

    Raises:
        RunFileError: the file cannot be read or is damaged.
    """
    task = get_task(reader.config.task)
    distance, still = task.target_distance, 100 * still_limit(task)
    return {
        name: Content(
            generation.archives[name].axes,
            {
                cell: ShownElite(n, 100 * (distance - s.fitness), s.generation, s.morphology, still)
                for cell, (n, s) in cells.items()
            },
            generation.archives[name].coverage,
        )
        for name, cells in reader.elites(generation).items()
    }
