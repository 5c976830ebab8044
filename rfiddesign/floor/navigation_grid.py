"""A grid of places for the robot's centre, with the links between neighbours that stay on the floor."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy import ndimage
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree
from shapely.geometry.base import BaseGeometry

from rfiddesign import require
from rfiddesign.floor.prepared import prepared_copy

# Cells of the box around the floor: some 400 MB at most.
MAX_CELLS = 4_000_000
# Half the diagonal of a cell, and some: no place of a link is farther from the nearer of its ends.
_DEEP_CELLS = 0.75
# Neighbours to the right, above, above right and above left, as (rows, columns).
_STEPS = ((0, 1), (1, 0), (1, 1), (1, -1))


@dataclass(frozen=True, eq=False)
class NavigationGrid:
    """Cells of a region whose centres a robot can drive between.

    Parameters
    ----------
    cell_mm : side of a cell [mm].
    points_mm : centres (n, 2) of the cells inside the region [mm]; all are linked with each other.
    clearance_mm : distance (n,) of each centre to the nearest cell outside, less half a cell [mm].
    links : (m, 2) cells that are linked: neighbours at sides or corners whose straight connection the region covers.
    """

    cell_mm: float
    points_mm: NDArray[np.float64]
    clearance_mm: NDArray[np.float64]
    links: NDArray[np.int64]

    @cached_property
    def link_mm(self) -> NDArray[np.float64]:
        """Length (m,) of each link [mm]."""
        step = self.points_mm[self.links[:, 1]] - self.points_mm[self.links[:, 0]]
        return np.hypot(*step.T)

    def nearest(self, points_mm: NDArray[np.float64]) -> NDArray[np.int64]:
        """Cells (k,) whose centres are nearest to some points (k, 2) [mm]."""
        return cKDTree(self.points_mm).query(points_mm)[1].astype(np.int64)


def navigation_grid(region: BaseGeometry, cell_mm: float) -> NavigationGrid:
    """Lay a grid over a region and keep its largest linked part.

    Parameters
    ----------
    region : where the robot's centre may be [mm].
    cell_mm : side of a cell [mm].

    Raises
    ------
    ValueError : if the cell is not positive, the box around the region has more than 4,000,000 cells, or no two
        neighbouring cells lie inside.
    """
    require.positive("cell_mm", cell_mm)
    low_x, low_y, high_x, high_y = region.bounds
    n_columns, n_rows = (math.floor(side / cell_mm) + 1 for side in (high_x - low_x, high_y - low_y))
    n_cells = n_columns * n_rows
    if n_cells > MAX_CELLS:
        raise ValueError(
            f"cell_mm is {cell_mm:g}: the floor would have {n_cells:,} cells, at most {MAX_CELLS:,} are allowed"
        )
    region = prepared_copy(region)
    x = low_x + cell_mm * (np.arange(n_columns) + 0.5)
    y = low_y + cell_mm * (np.arange(n_rows) + 0.5)
    is_inside = shapely.contains_xy(region, *np.meshgrid(x, y))
    rows, columns = np.nonzero(is_inside)
    points = np.column_stack([x[columns], y[rows]])
    depth = ndimage.distance_transform_edt(np.pad(is_inside, 1))[1:-1, 1:-1][rows, columns]
    links = _links(region, points, is_inside, cell_mm)
    if len(links) == 0:
        raise ValueError(f"cell_mm is {cell_mm:g}: no two neighbouring cells lie where the robot's centre may be")
    return _largest_part(NavigationGrid(cell_mm, points, cell_mm * (depth - 0.5), links))


def _links(region: BaseGeometry, points: NDArray, is_inside: NDArray, cell_mm: float) -> NDArray[np.int64]:
    """Pairs (m, 2) of neighbouring cells whose connection the region covers."""
    number = np.full(is_inside.shape, -1)
    number[is_inside] = np.arange(len(points))
    n_rows, n_columns = is_inside.shape
    found = []
    for rows, columns in _STEPS:
        left, right = max(-columns, 0), n_columns - max(columns, 0)
        begin = number[: n_rows - rows, left:right]
        end = number[rows:, left + columns : right + columns]
        is_pair = (begin >= 0) & (end >= 0)
        found.append(np.column_stack([begin[is_pair], end[is_pair]]))
    links = np.concatenate(found)
    is_deep = ~shapely.dwithin(prepared_copy(region.boundary), shapely.points(points), _DEEP_CELLS * cell_mm)
    is_linked = is_deep[links].all(axis=1)
    doubtful = np.flatnonzero(~is_linked)
    is_linked[doubtful] = shapely.covers(region, shapely.linestrings(points[links[doubtful]]))
    return links[is_linked]


def _largest_part(grid: NavigationGrid) -> NavigationGrid:
    """The largest set of cells that are linked with each other."""
    n = len(grid.points_mm)
    graph = csr_array((np.ones(len(grid.links)), tuple(grid.links.T)), shape=(n, n))
    part = connected_components(graph, directed=False)[1]
    is_kept = part == np.bincount(part).argmax()
    number = np.cumsum(is_kept) - 1
    links = number[grid.links[is_kept[grid.links[:, 0]]]]
    return NavigationGrid(grid.cell_mm, grid.points_mm[is_kept], grid.clearance_mm[is_kept], links)
