"""Stations: the places that robots drive between."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from rfiddesign import require
from rfiddesign.floor.navigation_grid import NavigationGrid

MAX_STATIONS = 200


def spread_stations(grid: NavigationGrid, n: int, seed: int, clearance_mm: float = 0.0) -> NDArray[np.int64]:
    """Choose cells (n,) for stations that are spread over the floor: farthest-point sampling by way to drive.

    The first is drawn; each other is the cell whose way to the nearest station so far is longest (T. Gonzalez,
    "Clustering to minimize the maximum intercluster distance", 1985).  Cells with `clearance_mm` around them are
    preferred: all stations lie on such cells if there are enough.

    Raises
    ------
    ValueError : if there are not from 2 to 200 stations, or fewer cells than stations.
    """
    _check_number(n)
    require.seed("seed", seed)
    eligible = np.flatnonzero(grid.clearance_mm >= clearance_mm)
    if len(eligible) < n:
        eligible = np.arange(len(grid.points_mm))
    if len(eligible) < n:
        raise ValueError(f"stations is {n}: the floor has room for {len(eligible)} only")
    graph = _graph(grid)
    first = eligible[int(np.random.Generator(np.random.PCG64(seed)).integers(len(eligible)))]
    chosen = [int(first)]
    distance = dijkstra(graph, directed=False, indices=first)
    while len(chosen) < n:
        chosen.append(int(eligible[distance[eligible].argmax()]))
        distance = np.minimum(distance, dijkstra(graph, directed=False, indices=chosen[-1]))
    return np.array(chosen)


def placed_stations(grid: NavigationGrid, points_mm: Sequence[Sequence[float]]) -> NDArray[np.int64]:
    """Cells (n,) of stations at given points [mm]: those whose centres are nearest, at most a cell away.

    Raises
    ------
    ValueError : if there are not from 2 to 200 stations, one lies where no robot can get to from the others, or two
        share a cell.
    """
    _check_number(len(points_mm))
    points = np.asarray(points_mm, float)
    cells = grid.nearest(points)
    away = np.hypot(*(grid.points_mm[cells] - points).T)
    taken: dict[int, int] = {}
    for i, (cell, distance) in enumerate(zip(cells.tolist(), away.tolist(), strict=True)):
        x, y = points[i].tolist()
        if distance > grid.cell_mm:
            raise ValueError(
                f"stations[{i}] is ({x:g}, {y:g}) mm, {distance:,.0f} mm from where a robot's centre can get to, "
                f"at most {grid.cell_mm:g} mm are allowed"
            )
        if cell in taken:
            raise ValueError(f"stations[{i}] is ({x:g}, {y:g}) mm, must be farther from stations[{taken[cell]}]")
        taken[cell] = i
    return cells


def _graph(grid: NavigationGrid) -> csr_array:
    n = len(grid.points_mm)
    return csr_array((grid.link_mm, tuple(grid.links.T)), shape=(n, n))


def _check_number(n: int) -> None:
    if not 2 <= n <= MAX_STATIONS:
        raise ValueError(f"stations is {n}, must be from 2 to {MAX_STATIONS}")
