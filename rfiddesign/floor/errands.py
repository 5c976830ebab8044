"""Errands: shortest ways between places drawn evenly over a floor, so that drives come everywhere."""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from rfiddesign import require
from rfiddesign.floor._route_kernels import ray_distance
from rfiddesign.floor.navigation_grid import NavigationGrid, navigation_grid
from rfiddesign.floor.plan import Floor
from rfiddesign.numerics._noise_kernels import fill_fine_uniform, step_key

#: Cells of the grid that ways are found on: not smaller than this, not many more than so many on the whole floor.
LEAST_CELL_MM, USUAL_CELLS = 150.0, 10_000
#: Places that errands lead to, before each is moved a little.
N_PLACES = 200
MAX_ERRANDS = 20_000


@dataclass(frozen=True, eq=False)
class _Ways:
    """Ways on a grid: from each cell to each place."""

    grid: NavigationGrid
    places: NDArray[np.int64]
    next_cell: NDArray[np.int32]


def errands(floor: Floor, key: np.uint64, length_mm: float) -> NDArray[np.float64]:
    """Draw a polyline inside `floor.navigable`: from a place on the floor to the next, each the shortest way.

    Places are drawn from 200 that lie evenly over the floor, and each is moved at random as far as is free. Shortest
    ways are those on a grid whose corners are cut where the floor allows.

    Parameters
    ----------
    floor : the floor to drive on.
    key : 64-bit key of the stream that all is drawn from.
    length_mm : least length of the whole route [mm].

    Returns
    -------
    Waypoints (n, 2) [mm]. The last errand is driven to its end, beyond `length_mm`.

    Raises
    ------
    ValueError : if the length is not positive, or the floor so small that the route needs more than 20,000 errands.
    """
    require.positive("length_mm", length_mm)
    ways = _ways(floor)
    to, here = _place(floor, ways, key, 0)
    waypoints, length = [here[None]], 0.0
    for errand in range(1, MAX_ERRANDS + 1):
        cell = ways.places[to]
        to, there = _place(floor, ways, key, errand)
        legs = _straightened(floor, np.vstack([here, _cells_between(ways, cell, to), there]))
        length += float(np.hypot(*np.diff(legs, axis=0).T).sum())
        waypoints.append(legs[1:])
        if length >= length_mm:
            return np.concatenate(waypoints)
        here = there
    raise ValueError(f"length_mm is {length_mm:g}; the floor is too small for a route of that length")


@lru_cache(maxsize=8)
def _ways(floor: Floor) -> _Ways:
    cell_mm = max(LEAST_CELL_MM, math.sqrt(floor.navigable.area / USUAL_CELLS))
    grid = navigation_grid(floor.navigable, cell_mm)
    n = len(grid.points_mm)
    places = np.unique(np.linspace(0, n - 1, min(n, N_PLACES)).round().astype(np.int64))
    graph = csr_array((grid.link_mm, tuple(grid.links.T)), shape=(n, n))
    _, before = dijkstra(graph, directed=False, indices=places, return_predecessors=True)
    # On an undirected graph the cell before, seen from the place, is the next on the way to it.
    return _Ways(grid, places, before.astype(np.int32))


def _place(floor: Floor, ways: _Ways, key: np.uint64, errand: int) -> tuple[int, NDArray[np.float64]]:
    """The place of an errand, by number, and where about it (2,) the errand ends [mm]."""
    draws = np.empty(3)
    fill_fine_uniform(np.uint64(step_key(key, 0, errand)), draws)
    to = int(draws[0] * len(ways.places))
    cell = ways.places[to]
    centre, room = ways.grid.points_mm[cell], max(float(ways.grid.clearance_mm[cell]), 0.0)
    moved = centre + room * (2.0 * draws[1:] - 1.0)
    return to, moved if _is_free(floor, centre, moved) else centre


def _cells_between(ways: _Ways, cell: int, to: int) -> NDArray[np.float64]:
    """Centres (k, 2) of the cells on the way from a cell to a place, both included."""
    way, goal = [cell], ways.places[to]
    while way[-1] != goal:
        way.append(int(ways.next_cell[to, way[-1]]))
    return ways.grid.points_mm[way]


def _straightened(floor: Floor, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """The points (n, 2) of a way without those that the robot can leave out by driving straight."""
    kept, i = [0], 0
    while i < len(points) - 1:
        # The next point can always be driven to.
        j = len(points) - 1
        while j > i + 1 and not _is_free(floor, points[i], points[j]):
            j -= 1
        kept.append(j)
        i = j
    return points[kept]


def _is_free(floor: Floor, begin: NDArray[np.float64], end: NDArray[np.float64]) -> bool:
    """Whether the straight way from a place inside to another stays inside."""
    dx, dy = float(end[0] - begin[0]), float(end[1] - begin[1])
    length = math.hypot(dx, dy)
    if length == 0.0:
        return True
    return ray_distance(floor.navigable_edges, float(begin[0]), float(begin[1]), dx / length, dy / length) > length
