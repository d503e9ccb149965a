"""Double-Map MAP-Elites (Zardini et al., GECCO 2021, algorithm 2).

Two independent archives see every solution: one is laid out by the body, the other by the trajectory
of the head, projected on its first two principal components. Half of the parents come from each, unless
``controller_share`` says otherwise. Two simpler searches fill the same maps, to compare with.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from engine.search.algorithm import Recall
from engine.search.archive import Cell, DeepGridArchive, GridArchive, cell_name, parse_cell
from engine.search.axes import Axis
from engine.search.map_search import MapSearch
from engine.search.trajectory_archive import TrajectoryArchive
from engine.simulation.evaluation import Evaluation, Solution


class DoubleMapMapElites(MapSearch):
    """DM-ME; with a cell capacity above 1, the authors' second configuration, "deep grid".

    With a deep grid, standardiser and PCA are fitted to all individuals of its cells.
    """

    @property
    def archives(self) -> Mapping[str, GridArchive]:
        """The morphology and the controller archive."""
        return {"morphology": self._morphology, "controller": self._trajectories.archive}

    def axes(self, archive: str) -> tuple[Axis, ...]:
        """Describe the axes of an archive as they are now."""
        if archive == "morphology":
            return self._bodies.axes
        return self._trajectories.axes()

    def state(self) -> dict[str, Any]:
        """Return the state of any map search, and the individuals of a deep grid's cells."""
        archive = self._trajectories.archive
        if not isinstance(archive, DeepGridArchive):
            return super().state()
        members = {
            cell_name(cell): [e.solution.number for e in held] for cell, held in archive.members().items()
        }
        return {**super().state(), "members": {"controller": members}}

    def restore(
        self, state: dict[str, Any], contents: Mapping[str, Mapping[Cell, Evaluation]], recall: Recall
    ) -> None:
        """Go back to the end of a generation."""
        super().restore(state, contents, recall)
        archive = self._trajectories.archive
        if isinstance(archive, DeepGridArchive):
            members = {parse_cell(cell): held for cell, held in state["members"]["controller"].items()}
            known = recall({number for held in members.values() for number in held})
            archive.restore({cell: [known[n] for n in held] for cell, held in members.items()})

    def _create_archives(self) -> None:
        self._morphology = self._bodies.archive()
        shape = self._config.controller_cells
        controller = GridArchive(shape=shape)
        if self._config.cell_capacity > 1:
            controller = DeepGridArchive(
                shape=shape, capacity=self._config.cell_capacity, rng=self._variation.rng
            )
        self._trajectories = TrajectoryArchive(
            archive=controller,
            refit_generations=self._config.refit_generations,
            sensory=self._config.sensory,
        )

    def _mutants(self, n: int) -> list[Solution]:
        n_controller = int(self._config.controller_share * n)
        return [*self._sample("morphology", n - n_controller), *self._sample("controller", n_controller)]

    def _offer(self, whole: Sequence[Evaluation]) -> None:
        for e in whole:
            self._morphology.add(self._body_cell(e), e)
        self._trajectories.tell(self._generation, whole)


class RandomSearch(DoubleMapMapElites):
    """Every solution is random; the maps only keep the best of each cell."""

    def _mutants(self, n: int) -> list[Solution]:
        return [self._variation.random() for _ in range(n)]


class MorphologyMapElites(DoubleMapMapElites):
    """MAP-Elites on the 2-D morphology map; elites of the controller map, kept for show, have no children."""

    def _mutants(self, n: int) -> list[Solution]:
        return self._sample("morphology", n)
