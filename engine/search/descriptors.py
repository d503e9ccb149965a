"""What describes a controller: where the trajectories of its robot's head lie among others."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from threadpoolctl import threadpool_limits

from engine.search.archive import Cell

CONTROLLER_SHAPE: Final = (9, 10)


def sensory_data(trajectories: Sequence[np.ndarray], kind: str) -> np.ndarray:
    """Return the (n, targets x seconds x 2) sensory data of trajectories.

    Args:
        trajectories: n arrays (targets, seconds, 2) of head positions at 1 Hz.
        kind: ``positions``, or ``displacements`` from second to second.
    """
    paths = np.asarray(trajectories, dtype=float)
    if kind == "displacements":
        paths = np.diff(paths, axis=2, prepend=0.0)
    return paths.reshape(len(paths), -1)


def _rounded(values: np.ndarray, units: np.ndarray) -> np.ndarray:
    """Return values rounded to about ten digits of their units (the power of two below each).

    Linear algebra is tuned to each kind of processor, so its last digits differ between them (some 1e-16 of a
    unit). Without these digits a run gives the same archive on every processor.
    """
    step = np.ldexp(1.0, np.frexp(units)[1] - 34)
    return np.round(values / step) * step


class TrajectoryDescriptor:
    """Standardise, project on the first principal components, cut into cells.

    The owner repeats both fits and the bounds of the cells when the schedule or a value out of bounds
    requires it.

    Args:
        shape: number of cells along each component.
    """

    def __init__(self, *, shape: tuple[int, ...] = CONTROLLER_SHAPE) -> None:
        self.shape = shape
        self._mean: np.ndarray | None = None
        self._scale = np.empty(0)
        self._components = np.empty(0)
        self.lower = np.zeros(len(shape))
        self.width = np.ones(len(shape))

    @property
    def fitted(self) -> bool:
        """Whether ``fit`` has been called."""
        return self._mean is not None

    @property
    def upper(self) -> np.ndarray:
        """(dims,) upper bound of the last cell of each axis."""
        return self.lower + self.width * np.array(self.shape)

    def fit(self, data: np.ndarray) -> None:
        """Fit standardiser and PCA together, and the bounds to the same data.

        Args:
            data: (n, features) sensory data.
        """
        # imported here: they take a second, and few commands and workers fit anything
        from sklearn.decomposition import PCA
        from sklearn.preprocessing import StandardScaler

        # one thread: the number of threads changes the last bits
        with threadpool_limits(1):
            scaler = StandardScaler().fit(data)
            standard = scaler.transform(data)
            n_components = min(len(self.shape), *data.shape)
            pca = PCA(n_components=n_components, svd_solver="full").fit(standard)
        self._mean = _rounded(scaler.mean_ + pca.mean_ * scaler.scale_, scaler.scale_)
        self._scale = _rounded(scaler.scale_, scaler.scale_)
        self._components = np.zeros((len(self.shape), data.shape[1]))
        self._components[:n_components] = _rounded(pca.components_, np.ones(1))
        self.set_bounds(self.transform(data))

    def transform(self, data: np.ndarray) -> np.ndarray:
        """Return the (n, dims) descriptors of (n, features) sensory data.

        A row's result does not depend on the other rows.
        """
        assert self._mean is not None, "fit first"
        standard = (data - self._mean) / self._scale
        return (standard[:, None, :] * self._components).sum(axis=-1)

    def set_bounds(self, descriptors: np.ndarray) -> None:
        """Cut each axis so that its extreme values sit at the centres of the first and last cell.

        Args:
            descriptors: (n, dims) values that must fit in.
        """
        low, high = descriptors.min(axis=0), descriptors.max(axis=0)
        cells = np.array(self.shape)
        span = np.where(high > low, high - low, 1.0)
        # an axis of a single cell takes the whole span
        self.width = span / np.maximum(cells - 1, 1) * np.where(cells == 1, 2.0, 1.0)
        self.lower = np.where(cells == 1, (low + high) / 2 - self.width / 2, low - self.width / 2)

    def out_of_bounds(self, descriptors: np.ndarray) -> bool:
        """Tell whether any of the (n, dims) descriptors lies outside the cells."""
        return bool(((descriptors < self.lower) | (descriptors >= self.upper)).any())

    def cell(self, descriptor: np.ndarray) -> Cell:
        """Return the cell of a (dims,) descriptor, which must lie within the bounds."""
        index = np.floor((descriptor - self.lower) / self.width).astype(int)
        index = np.clip(index, 0, np.array(self.shape) - 1)
        return tuple(int(i) for i in index)

    def state(self) -> dict[str, Any]:
        """Return everything ``restore`` needs, JSON-ready."""
        assert self._mean is not None, "fit first"
        return {
            "mean": self._mean.tolist(),
            "scale": self._scale.tolist(),
            "components": self._components.tolist(),
            "lower": self.lower.tolist(),
            "width": self.width.tolist(),
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Go back to what ``state`` returned."""
        self._mean = np.array(state["mean"])
        self._scale = np.array(state["scale"])
        self._components = np.array(state["components"])
        self.lower = np.array(state["lower"])
        self.width = np.array(state["width"])
