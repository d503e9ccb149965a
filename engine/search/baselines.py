"""Simpler searches that DM-ME is compared with, on the same two maps."""

from __future__ import annotations

from engine.search.dm_me import DoubleMapMapElites
from engine.simulation.evaluation import Solution


class RandomSearch(DoubleMapMapElites):
    """Every solution is random; the maps only keep the best of each cell."""

    def _mutants(self, n: int) -> list[Solution]:
        return [self._variation.random() for _ in range(n)]


class MorphologyMapElites(DoubleMapMapElites):
    """MAP-Elites on the 2-D morphology map; elites of the controller map, kept for show, have no children."""

    def _mutants(self, n: int) -> list[Solution]:
        return self._sample("morphology", n)
