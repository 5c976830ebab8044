"""A detection area given as a map of read probabilities, as measured on a bench or computed from loop physics."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray
from shapely.geometry.base import BaseGeometry

from rfiddesign import require
from rfiddesign.geometry.polygon_area import covers, signed_distance


@dataclass(frozen=True, eq=False)
class ProbabilityMap:
    """Read probability in square cells centred on the antenna; the area is the cells with a probability above 1/2.

    Parameters
    ----------
    probability : (n_y, n_x), row 0 at the lowest y, column 0 at the lowest x; each from 0 to 1.
    cell_mm : side of a cell [mm].

    Raises
    ------
    ValueError : if a value is no probability, or none exceeds 1/2.
    """

    probability: NDArray[np.float64] = field(repr=False)
    cell_mm: float

    def __post_init__(self):
        require.positive("cell_mm", self.cell_mm)
        probability = np.array(self.probability, dtype=np.float64)
        if probability.ndim != 2 or not ((probability >= 0) & (probability <= 1)).all():
            raise ValueError(f"probability of shape {probability.shape}: must be two-dimensional, each from 0 to 1")
        if not (probability > 0.5).any():
            raise ValueError("probability: must exceed 1/2 in at least one cell, else the antenna reads nothing")
        probability.setflags(write=False)
        object.__setattr__(self, "probability", probability)

    @cached_property
    def _detecting_cells(self) -> NDArray[np.float64]:
        """Centres (n, 2) [mm] of the cells in the area."""
        row, column = np.nonzero(self.probability > 0.5)
        n_y, n_x = self.probability.shape
        return np.stack([column - (n_x - 1) / 2, row - (n_y - 1) / 2], axis=-1) * self.cell_mm

    @cached_property
    def _outline(self) -> BaseGeometry:
        (x, y), half = self._detecting_cells.T, self.cell_mm / 2
        return shapely.union_all(shapely.box(x - half, y - half, x + half, y + half))

    @property
    def area_mm2(self) -> float:
        return len(self._detecting_cells) * self.cell_mm**2

    @property
    def reach_mm(self) -> float:
        corners = np.abs(self._detecting_cells) + self.cell_mm / 2
        return float(np.hypot(*corners.T).max())

    @property
    def centroid_mm(self) -> NDArray[np.float64]:
        return self._detecting_cells.mean(axis=0)

    @property
    def covariance_mm2(self) -> NDArray[np.float64]:
        between_cells = np.cov(self._detecting_cells, rowvar=False, bias=True)
        return between_cells + np.eye(2) * self.cell_mm**2 / 12

    def outline(self) -> BaseGeometry:
        return self._outline

    def contains(self, points: ArrayLike) -> NDArray[np.bool_]:
        return covers(self._outline, points)

    def signed_distance(self, points: ArrayLike) -> NDArray[np.float64]:
        return signed_distance(self._outline, points)

    def probability_at(self, points: ArrayLike) -> NDArray[np.float64]:
        """Return the read probability of the cell in which each of the points (..., 2) [mm] lies, 0 off the map."""
        size = np.array(self.probability.shape[::-1])
        index = np.floor(np.asarray(points, dtype=np.float64) / self.cell_mm + size / 2)
        is_on_map = ((index >= 0) & (index < size)).all(axis=-1)
        column, row = np.moveaxis(np.where(is_on_map[..., None], index, 0).astype(np.intp), -1, 0)
        return np.where(is_on_map, self.probability[row, column], 0.0)
