"""Double-Map MAP-Elites (Zardini et al., GECCO 2021, algorithm 2).

Two independent archives see every solution: one is laid out by the body, the other by the trajectory
of the head, projected on its first two principal components. Half of the parents come from each.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

from engine.body.morphology import StiffnessMode
from engine.errors import InvalidData
from engine.search.algorithm import Recall
from engine.search.archive import Cell, DeepGridArchive, GridArchive, cell_name, parse_cell
from engine.search.axes import Axis
from engine.search.descriptors import CONTROLLER_SHAPE, morphology_cell
from engine.search.map_search import PAPER_REFITS, MapSearch
from engine.search.trajectory_archive import TrajectoryMap, morphology_archive, morphology_axes
from engine.simulation.evaluation import Evaluation, Solution

MAX_CELL_CAPACITY: Final = 1000


def check_cell_capacity(capacity: int) -> None:
    """Check how many individuals a cell of the controller archive is to hold.

    Raises:
        InvalidData: none, or so many that a run file's state would grow out of hand.
    """
    if not 1 <= capacity <= MAX_CELL_CAPACITY:
        raise InvalidData(f"cell_capacity must be from 1 to {MAX_CELL_CAPACITY}, not {capacity}")


class DoubleMapMapElites(MapSearch):
    """DM-ME; with a cell capacity above 1, the authors' second configuration, "deep grid".

    Args:
        n_inputs: what the controllers sense.
        n_initial: random solutions of generation 0.
        batch_size: solutions per later generation, an even number.
        refit_generations: when standardiser and PCA are fitted anew.
        sensory: ``positions`` or ``displacements``, see ``descriptors.sensory_data``.
        cell_capacity: individuals that a cell of the controller archive holds. More than one make it a
            ``DeepGridArchive``, all of whose individuals standardiser and PCA are fitted to.
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
        cell_capacity: int = 1,
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
        check_cell_capacity(cell_capacity)
        self._morphology = morphology_archive(stiffness)
        controller = GridArchive(shape=CONTROLLER_SHAPE)
        if cell_capacity > 1:
            rng = self._variation.rng
            controller = DeepGridArchive(shape=CONTROLLER_SHAPE, capacity=cell_capacity, rng=rng)
        self._trajectories = TrajectoryMap(
            archive=controller,
            refit_generations=refit_generations,
            sensory=sensory,
        )

    @property
    def archives(self) -> Mapping[str, GridArchive]:
        """The morphology and the controller archive."""
        return {"morphology": self._morphology, "controller": self._trajectories.archive}

    def axes(self, archive: str) -> tuple[Axis, ...]:
        """Describe the axes of an archive as they are now."""
        if archive == "morphology":
            return morphology_axes(self._stiffness)
        return self._trajectories.axes()

    def state(self) -> dict[str, Any]:
        """Return what any search does, and who is in the cells of a deep grid."""
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

    def _mutants(self, n: int) -> list[Solution]:
        return [*self._sample("morphology", n - n // 2), *self._sample("controller", n // 2)]

    def _offer(self, whole: Sequence[Evaluation]) -> None:
        for e in whole:
            self._morphology.add(morphology_cell(e.solution.morphology), e)
        self._trajectories.tell(self._generation, whole)
