"""MAP-Elites (Mouret and Clune, 2015) as Zardini et al., GECCO 2021, compare DM-ME with.

One archive is laid out by the body and by the trajectory of the head together: its cells are the pairs
of a cell of each of DM-ME's two archives.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from engine.search.archive import GridArchive
from engine.search.axes import Axis
from engine.search.map_search import MapSearch
from engine.search.trajectory_archive import TrajectoryArchive
from engine.simulation.evaluation import Evaluation, Solution


class MapElites(MapSearch):
    """MAP-Elites on one archive of 9 x 10 x 9 x 10 cells.

    With a stiffness per module it has 9 x 10 x 10 x 9 x 10. Parents are drawn uniformly from the archive;
    mutation and the refits are those of DM-ME.
    """

    @property
    def archives(self) -> Mapping[str, GridArchive]:
        """The one archive."""
        return {"grid": self._trajectories.archive}

    def axes(self, archive: str) -> tuple[Axis, ...]:
        """Describe the axes of the archive as they are now: first the body's, then the trajectory's."""
        if archive not in self.archives:
            raise KeyError(archive)
        return (*self._bodies.axes, *self._trajectories.axes())

    def _create_archives(self) -> None:
        cells = self._config.controller_cells
        self._trajectories = TrajectoryArchive(
            archive=GridArchive(
                shape=(*self._bodies.shape, *cells),
                n_possible=self._bodies.n_possible * cells[0] * cells[1],
            ),
            first_axes=self._body_cell,
            refit_generations=self._config.refit_generations,
            sensory=self._config.sensory,
        )

    def _mutants(self, n: int) -> list[Solution]:
        return self._sample("grid", n)

    def _offer(self, whole: Sequence[Evaluation]) -> None:
        self._trajectories.tell(self._generation, whole)
