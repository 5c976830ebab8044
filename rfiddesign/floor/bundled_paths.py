"""Shortest paths between stations, drawn together where that costs little."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra, minimum_spanning_tree

from rfiddesign import require
from rfiddesign.floor.navigation_grid import NavigationGrid

# No predecessor, as scipy writes it.
_NONE = -9999


@dataclass(frozen=True)
class BundleRules:
    """What makes a path cheap.

    Parameters
    ----------
    used_factor : cost of a way that other paths use, over its cost otherwise; 1: paths do not know of each other.
    clearance_mm : clearance that paths prefer [mm]; beyond it a cell costs no more than its length.
    wall_factor : cost of a way along the wall over that of a way with the preferred clearance; between them it falls
        with the square of what is missing.
    joins : "all": every pair of stations is joined by a path; "spanning": the pairs of a shortest spanning tree, so
        that every station is reached and detours are accepted.
    """

    used_factor: float = 0.7
    clearance_mm: float = 300.0
    wall_factor: float = 4.0
    joins: str = "all"

    def __post_init__(self) -> None:
        require.within("used_factor", self.used_factor, low=0.01, high=1.0)
        require.within("clearance_mm", self.clearance_mm, low=0.0, high=1e5)
        require.within("wall_factor", self.wall_factor, low=1.0, high=1000.0)
        if self.joins not in ("all", "spanning"):
            raise ValueError(f"joins is {self.joins!r}, must be all or spanning")


def bundled_links(
    grid: NavigationGrid, stations: NDArray[np.int64], rules: BundleRules | None = None
) -> NDArray[np.bool_]:
    """Which links (m,) of a grid the paths between stations use.

    Station by station, one search (Dijkstra) finds the paths to all others that it is to be joined with; the links they
    use are cheaper for the stations that follow.

    Parameters
    ----------
    grid : where robots can drive.
    stations : cells (n,) of the stations.
    rules : what makes a path cheap.
    """
    rules = rules or BundleRules()
    cost = grid.link_mm * _wall_costs(grid, rules)
    joined = _joined(grid, stations, cost, rules)
    used = np.zeros(len(cost), bool)
    for i, station in enumerate(stations):
        others = stations[i + 1 :][joined[i, i + 1 :]]
        if len(others):
            used |= _paths(grid, cost * np.where(used, rules.used_factor, 1.0), station, others)
    return used


def _wall_costs(grid: NavigationGrid, rules: BundleRules) -> NDArray[np.float64]:
    """Factors (m,) on the lengths of links for what they lack in clearance."""
    if rules.clearance_mm == 0.0:
        return np.ones(len(grid.links))
    lack = np.clip(1.0 - grid.clearance_mm[grid.links].min(axis=1) / rules.clearance_mm, 0.0, 1.0)
    return 1.0 + (rules.wall_factor - 1.0) * lack**2


def _joined(grid: NavigationGrid, stations: NDArray, cost: NDArray, rules: BundleRules) -> NDArray[np.bool_]:
    """Which stations (n, n) are joined with which."""
    n = len(stations)
    if rules.joins == "all":
        return np.ones((n, n), bool)
    distance = dijkstra(_graph(grid, cost), directed=False, indices=stations)[:, stations]
    tree = minimum_spanning_tree(distance).toarray() > 0
    return tree | tree.T


def _graph(grid: NavigationGrid, cost: NDArray) -> csr_array:
    n = len(grid.points_mm)
    return csr_array((cost, tuple(grid.links.T)), shape=(n, n))


def _paths(grid: NavigationGrid, cost: NDArray, station: int, others: NDArray) -> NDArray[np.bool_]:
    """Links (m,) on the cheapest paths from a station to others."""
    _, before = dijkstra(_graph(grid, cost), directed=False, indices=station, return_predecessors=True)
    is_met = np.zeros(len(before), bool)
    for cell in others.tolist():
        while before[cell] != _NONE and not is_met[cell]:
            is_met[cell] = True
            cell = before[cell]
    begin, end = grid.links.T
    return (is_met[begin] & (before[begin] == end)) | (is_met[end] & (before[end] == begin))
