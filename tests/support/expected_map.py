"""What an archive of trajectories should hold, worked out with scikit-learn and tables of candidates."""

import numpy as np
from sklearn.decomposition import PCA
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from tests.support.made_up import sensed


def compete(archive, cell, e):
    """Offer an evaluation to a table of elites."""
    candidates = [c for c in (archive.get(cell), e) if c is not None]
    archive[cell] = min(candidates, key=lambda c: (c.fitness, c.solution.number))


def numbers(archive):
    """Return the numbers of a table's elites."""
    return {cell: e.solution.number for cell, e in archive.items()}


class ExpectedMap:
    """The elites by cell.

    Args:
        refits: generations at which the projection is fitted anew.
        first_axes: the cell of an evaluation along the axes before the two of the projection.
    """

    def __init__(self, refits, first_axes=lambda _: ()):
        self.refits, self.first_axes = refits, first_axes
        self.cells = {}
        self.projection = None
        self.refitted = self.rebounded = False
        self.meaningful = True

    def tell(self, number, whole):
        self.refitted = self.rebounded = False
        elites = [e for _, e in sorted(self.cells.items())]
        if self.projection is None:
            if len(whole) < 2:
                return
            self._fit(whole)
        elif number in self.refits and len(elites) >= 2:
            self._fit(elites)
            self._place(elites)
        if not whole:
            return
        values = self.projection.transform(sensed(whole))
        steps = (values - self.low) / self.step  # the smallest value is 0, the largest n - 1
        if ((steps < -0.5) | (steps >= np.array([8.5, 9.5]))).any():
            elites = [e for _, e in sorted(self.cells.items())]
            self._cut(self.projection.transform(sensed([*elites, *whole])))
            self._place(elites)
        self._place(whole, into=self.cells)

    def _fit(self, evaluations):
        # with fewer points the second component is rounding error
        self.meaningful &= len(evaluations) >= 4
        self.projection = make_pipeline(StandardScaler(), PCA(n_components=2, svd_solver="full"))
        self._cut(self.projection.fit_transform(sensed(evaluations)))
        self.refitted = True

    def _cut(self, values):
        self.low = values.min(axis=0)
        self.step = (values.max(axis=0) - self.low) / np.array([8, 9])
        self.rebounded = True

    def _place(self, evaluations, into=None):
        into = {} if into is None else into
        values = self.projection.transform(sensed(evaluations)) if evaluations else []
        for e, v in zip(evaluations, values, strict=True):
            last = (int(i) for i in np.rint((v - self.low) / self.step))
            compete(into, (*self.first_axes(e), *last), e)
        self.cells = into
