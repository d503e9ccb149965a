"""MAP-Elites (Mouret and Clune, 2015) as Zardini et al., GECCO 2021, compare DM-ME with.

One archive is laid out by the body and by the trajectory of the head together: its cells are the pairs
of a cell of each of DM-ME's two archives.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from engine.body.morphology import StiffnessMode
from engine.search.archive import GridArchive
from engine.search.axes import Axis
from engine.search.descriptors import (
    CONTROLLER_SHAPE,
    morphology_cell,
    morphology_shape,
    n_possible_morphology_cells,
)
from engine.search.map_search import PAPER_REFITS, MapSearch
from engine.search.trajectory_archive import TrajectoryMap, morphology_axes
from engine.simulation.evaluation import Evaluation, Solution


class MapElites(MapSearch):
    """MAP-Elites on one archive of 9 x 10 x 9 x 10 cells.

    With a stiffness per module it has 9 x 10 x 10 x 9 x 10. Parents are drawn uniformly from the archive;
    mutation and the refits are those of DM-ME.

    Args:
        n_inputs: what the controllers sense.
        n_initial: random solutions of generation 0.
        batch_size: solutions per later generation, an even number.
        refit_generations: when standardiser and PCA are fitted anew, on the archive's elites.
        sensory: ``positions`` or ``displacements``, see ``descriptors.sensory_data``.
        stiffness: whether a body's modules share one stiffness.
        seed: of all the algorithm's draws.
        budget: total number of solutions; the last generation may be smaller.
        overlap: generations that may be asked for before the one in front of them has been told.

    Raises:
        InvalidData: the numbers contradict each other.
    """

    def __init__(
        self,
        *,
        n_inputs: int,
        n_initial: int = 1080,
        batch_size: int = 24,
        refit_generations: Sequence[int] = PAPER_REFITS,
        sensory: str = "positions",
        stiffness: StiffnessMode = "shared",
        seed: int = 0,
        budget: int = 45_000,
        overlap: int = 0,
    ) -> None:
        super().__init__(
            n_inputs=n_inputs,
            n_initial=n_initial,
            batch_size=batch_size,
            refit_generations=refit_generations,
            stiffness=stiffness,
            seed=seed,
            budget=budget,
            overlap=overlap,
        )
        n_controller_cells = CONTROLLER_SHAPE[0] * CONTROLLER_SHAPE[1]
        self._trajectories = TrajectoryMap(
            archive=GridArchive(
                shape=(*morphology_shape(stiffness), *CONTROLLER_SHAPE),
                n_possible=n_possible_morphology_cells(stiffness) * n_controller_cells,
            ),
            first_axes=lambda e: morphology_cell(e.solution.morphology),
            refit_generations=refit_generations,
            sensory=sensory,
        )

    @property
    def archives(self) -> Mapping[str, GridArchive]:
        """The one archive."""
        return {"grid": self._trajectories.archive}

    def axes(self, archive: str) -> tuple[Axis, ...]:
        """Describe the axes of the archive as they are now: first the body's, then the trajectory's."""
        if archive not in self.archives:
            raise KeyError(archive)
        return (*morphology_axes(self._stiffness), *self._trajectories.axes())

    def _mutants(self, n: int) -> list[Solution]:
        return self._sample("grid", n)

    def _offer(self, whole: Sequence[Evaluation]) -> None:
        self._trajectories.tell(self._generation, whole)
