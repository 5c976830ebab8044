"""Lattices of points in the plane, and the points of a lattice within a region."""

from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray
from shapely.geometry.base import BaseGeometry

from rfiddesign import require

#: More points than this are refused before memory is taken for them.
MAX_POINTS = 50_000_000

# A border this close to a lattice point, in lattice steps, is taken to run through it: floors are drawn in round
# numbers, and whether their tags count must not hang on the last bit of a division.
_ON_BORDER = 1e-9


@dataclass(frozen=True)
class Lattice:
    """The points origin + i a + j b for all whole i and j, where a and b are the two vectors of `basis_mm`.

    Parameters
    ----------
    basis_mm : the vectors a and b [mm].
    origin_mm : one of the points [mm].

    Raises
    ------
    ValueError : if a number is not finite, or a and b are parallel.
    """

    basis_mm: tuple[tuple[float, float], tuple[float, float]]
    origin_mm: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self):
        (ax, ay), (bx, by) = self.basis_mm
        for value in (ax, ay, bx, by):
            require.finite("basis_mm", value)
        for value in self.origin_mm:
            require.finite("origin_mm", value)
        if abs(ax * by - ay * bx) <= 1e-12 * np.hypot(ax, ay) * np.hypot(bx, by):
            raise ValueError(f"basis_mm = {self.basis_mm!r}: the two vectors must not be parallel")

    @property
    def cell_area_mm2(self) -> float:
        """Area [mm^2] per point."""
        (ax, ay), (bx, by) = self.basis_mm
        return abs(ax * by - ay * bx)

    @property
    def reduced_basis_mm(self) -> NDArray[np.float64]:
        """Basis (2, 2) [mm] of the same points (Gauss): the shortest a, the shortest b beside it, turning left."""
        a, b = (np.array(vector, dtype=np.float64) for vector in self.basis_mm)
        while True:
            if a @ a > b @ b:
                a, b = b, a
            steps = float(a @ b) / float(a @ a)
            # At half a step, as in a triangular lattice, b and b - a are as long: rounding must not send b to and fro.
            if abs(steps) <= 0.5 + 1e-9:
                return np.stack([a, b if a[0] * b[1] > a[1] * b[0] else -b])
            b = b - round(steps) * a

    @property
    def min_distance_mm(self) -> float:
        """Distance [mm] between a point and the next: the shorter vector of the reduced basis."""
        return float(np.linalg.norm(self.reduced_basis_mm[0]))

    def at(self, indices: ArrayLike) -> NDArray[np.float64]:
        """Return the points (..., 2) [mm] with indices (..., 2), i and j."""
        indices = np.asarray(indices, dtype=np.float64)
        (ax, ay), (bx, by) = self.basis_mm
        i, j = indices[..., 0], indices[..., 1]
        return np.stack([self.origin_mm[0] + i * ax + j * bx, self.origin_mm[1] + i * ay + j * by], axis=-1)

    def index_of(self, points: ArrayLike) -> NDArray[np.float64]:
        """Return the indices (..., 2), not rounded, of points (..., 2) [mm]: undoes `at`."""
        (ax, ay), (bx, by) = self.basis_mm
        x, y = np.moveaxis(np.asarray(points, dtype=np.float64) - self.origin_mm, -1, 0)
        return np.stack([x * by - y * bx, y * ax - x * ay], axis=-1) / (ax * by - ay * bx)

    def points_in(self, bounds: tuple[float, float, float, float]) -> NDArray[np.float64]:
        """Return the points (n, 2) [mm] in the box min x, min y, max x, max y, its border included, by y then x."""
        x_min, y_min, x_max, y_max = bounds
        corners = self.index_of([(x_min, y_min), (x_max, y_min), (x_max, y_max), (x_min, y_max)])
        low, high = np.floor(corners.min(axis=0)), np.ceil(corners.max(axis=0))
        _check_count(np.prod(high - low + 1))
        i, j = np.meshgrid(np.arange(low[0], high[0] + 1), np.arange(low[1], high[1] + 1))
        points = self.at(np.stack([i.ravel(), j.ravel()], axis=-1))
        # The slack keeps points that lie on the border but for rounding.
        slack = _ON_BORDER * np.abs(self.basis_mm).max()
        x, y = points.T
        is_in = (x >= x_min - slack) & (x <= x_max + slack) & (y >= y_min - slack) & (y <= y_max + slack)
        return in_reading_order(points[is_in])

    def indices_within(self, region: BaseGeometry) -> NDArray[np.int64]:
        """Return the indices (n, 2) of the points within a polygon, with or without holes, or several of them.

        Of a border just the side towards lower i and j belongs to a region, so that regions side by side share no
        point and lose none. Row by row the border is crossed at sorted places; between an odd and the next even
        crossing lies the inside. The work grows with border and points found, not with the region's bounding box.

        Raises
        ------
        ValueError : if more than `MAX_POINTS` are to be expected.
        """
        _check_count(region.area / self.cell_area_mm2)
        row, place = self._crossings(region)
        ends = np.ceil(place - _ON_BORDER).astype(np.int64).reshape(-1, 2)
        n_between = ends[:, 1] - ends[:, 0]
        n_before = np.cumsum(n_between) - n_between
        i = np.arange(n_between.sum()) + np.repeat(ends[:, 0] - n_before, n_between)
        return np.stack([i, np.repeat(row[::2], n_between)], axis=-1)

    def lay(self, region: BaseGeometry) -> NDArray[np.float64]:
        """Return the points (n, 2) [mm] within `region`, as `indices_within`, by y then x."""
        points = self.at(self.indices_within(region))
        (ax, ay), (_, by) = self.basis_mm
        return points if ay == 0 and ax > 0 and by > 0 else in_reading_order(points)

    def _crossings(self, region: BaseGeometry) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Return where the region's border crosses the rows j: row (n,) and place i (n,), sorted by row, then place."""
        corners, ring = shapely.get_coordinates(shapely.get_rings(shapely.get_parts(region)), return_index=True)
        corners = self.index_of(corners)
        is_edge = ring[1:] == ring[:-1]
        start, end = corners[:-1][is_edge], corners[1:][is_edge]
        low, high = np.minimum(start, end), np.maximum(start, end)
        _check_count((high - low)[:, 1].sum())
        first_row = np.ceil(low[:, 1] - _ON_BORDER).astype(np.int64)
        n_rows = np.ceil(high[:, 1] - _ON_BORDER).astype(np.int64) - first_row
        edge = np.repeat(np.arange(len(start)), n_rows)
        row = np.arange(len(edge)) + np.repeat(first_row - np.cumsum(n_rows) + n_rows, n_rows)
        step = end[edge] - start[edge]
        place = start[edge, 0] + (row - start[edge, 1]) * step[:, 0] / step[:, 1]
        place = np.clip(place, low[edge, 0], high[edge, 0])
        order = np.lexsort((place, row))
        return row[order], place[order]


def in_reading_order(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return points (n, 2) sorted by y, then x."""
    return points[np.lexsort((points[:, 0], points[:, 1]))]


def _check_count(expected: float) -> None:
    if not expected <= MAX_POINTS:
        raise ValueError(
            f"number of tags = {expected:.3g}: must be at most {MAX_POINTS}; widen the pitch or cut the area"
        )
