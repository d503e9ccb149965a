"""An archive that is laid out by what the head did."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from engine.search.archive import Cell, GridArchive
from engine.search.axes import Axis
from engine.search.descriptors import TrajectoryDescriptor, sensory_data
from engine.simulation.evaluation import Evaluation


class TrajectoryArchive:
    """An archive whose last two axes are the principal components of the head's trajectories.

    Standardiser and PCA are fitted to the first evaluations, and at the scheduled generations to all
    individuals of the archive. The bounds of the cells follow every fit, and are recomputed when a value
    falls outside. After either, all individuals are described anew and added again in the order of the cells;
    in a deep grid, a cell that overflows then replaces as it always does.

    Args:
        archive: empty, and filled here only.
        first_axes: the cell of an evaluation along the axes before the two.
        refit_generations: when standardiser and PCA are fitted anew.
        sensory: ``positions`` or ``displacements``, see ``descriptors.sensory_data``.
    """

    def __init__(
        self,
        *,
        archive: GridArchive,
        first_axes: Callable[[Evaluation], Cell] = lambda _: (),
        refit_generations: Iterable[int],
        sensory: str,
    ) -> None:
        self.archive = archive
        self._first_axes = first_axes
        self._refits = frozenset(refit_generations)
        self._sensory = sensory
        self._descriptor = TrajectoryDescriptor(shape=archive.shape[-2:])

    @property
    def fitted(self) -> bool:
        """Whether standardiser and PCA have been fitted."""
        return self._descriptor.fitted

    def axes(self) -> tuple[Axis, ...]:
        """Describe the last two axes as they are now."""
        d = self._descriptor
        return tuple(
            Axis(f"PCA {i + 1}", float(d.lower[i]), float(d.upper[i]), d.shape[i])
            for i in range(len(d.shape))
        )

    def tell(self, generation: int, whole: Sequence[Evaluation]) -> None:
        """Offer the evaluations of a generation that did not fail.

        Before the first fit, which needs two evaluations, a single one is left out.
        """
        descriptor = self._descriptor
        held = self.archive.individuals()
        if not descriptor.fitted:
            if len(whole) < 2:
                return
            descriptor.fit(self._data(whole))
        elif generation in self._refits and len(held) >= 2:
            descriptor.fit(self._data(held))
            self._redescribe()
        if not whole:
            return
        described = descriptor.transform(self._data(whole))
        if descriptor.out_of_bounds(described):
            everyone = [*self.archive.individuals(), *whole]
            descriptor.set_bounds(descriptor.transform(self._data(everyone)))
            self._redescribe()
        for e, d in zip(whole, described, strict=True):
            self.archive.add(self._cell(e, d), e)

    def state(self) -> dict[str, Any] | None:
        """Return standardiser, PCA and bounds, JSON-ready, or None before the first fit."""
        return self._descriptor.state() if self._descriptor.fitted else None

    def restore(self, state: dict[str, Any] | None) -> None:
        """Go back to what ``state`` returned; the archive's contents are restored separately."""
        if state is not None:
            self._descriptor.restore(state)

    def _redescribe(self) -> None:
        held = self.archive.individuals()
        if held:
            described = self._descriptor.transform(self._data(held))
            self.archive.reinsert((self._cell(e, d), e) for e, d in zip(held, described, strict=True))

    def _cell(self, e: Evaluation, descriptor: np.ndarray) -> Cell:
        return (*self._first_axes(e), *self._descriptor.cell(descriptor))

    def _data(self, evaluations: Sequence[Evaluation]) -> np.ndarray:
        return sensory_data([e.trajectory for e in evaluations], self._sensory)
