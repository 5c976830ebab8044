"""A network of routes: stations and junctions, joined by polylines that robots drive along."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra
from shapely.geometry.base import BaseGeometry

from rfiddesign.floor.plan import Floor

# Corners per quarter turn of the swath's rounded ends: it lacks at most 0.05 % of the robot's half width.
_SWATH_SEGMENTS = 24


@dataclass(frozen=True, eq=False)
class RouteNetwork:
    """Routes that robots drive.

    Parameters
    ----------
    nodes_mm : (n, 2) stations, which come first, and junctions [mm].
    n_stations : how many of the nodes are stations.
    ends : (m, 2) the nodes that each edge joins.
    edges_mm : polylines (k, 2) of the edges from their first to their second node [mm].
    swath : the floor that a robot sweeps along the routes [mm].

    Raises
    ------
    ValueError : if there are fewer than two stations, an edge does not begin and end at its nodes, or a station cannot
        be reached from another.
    """

    nodes_mm: NDArray[np.float64] = field(repr=False)
    n_stations: int
    ends: NDArray[np.int64] = field(repr=False)
    edges_mm: tuple[NDArray[np.float64], ...] = field(repr=False)
    swath: BaseGeometry = field(repr=False)

    def __post_init__(self) -> None:
        if not 2 <= self.n_stations <= len(self.nodes_mm):
            raise ValueError(f"n_stations is {self.n_stations}, must be from 2 to the nodes, {len(self.nodes_mm)}")
        if len(self.ends) != len(self.edges_mm):
            raise ValueError(f"ends has {len(self.ends)} rows, must have one for each of {len(self.edges_mm)} edges")
        for i, (edge, nodes) in enumerate(zip(self.edges_mm, self.ends, strict=True)):
            if len(edge) < 2 or not np.array_equal(edge[[0, -1]], self.nodes_mm[nodes]):
                raise ValueError(f"edges_mm[{i}] does not join nodes {nodes.tolist()}")
        if not np.isfinite(self._search[0]).all():
            raise ValueError("a station cannot be reached from another")

    @property
    def stations_mm(self) -> NDArray[np.float64]:
        """Where the stations are (n_stations, 2) [mm]."""
        return self.nodes_mm[: self.n_stations]

    @cached_property
    def edge_lengths_mm(self) -> NDArray[np.float64]:
        """Length (m,) of each edge [mm]."""
        return np.array([length_of(edge) for edge in self.edges_mm])

    @property
    def length_mm(self) -> float:
        """Length of all edges together [mm]."""
        return float(self.edge_lengths_mm.sum())

    def path(self, a: int, b: int) -> NDArray[np.float64]:
        """The shortest way (k, 2) from station `a` to station `b` [mm].

        Raises
        ------
        ValueError : if there is no such station, or both are the same.
        """
        for name, station in (("a", a), ("b", b)):
            if not 0 <= station < self.n_stations:
                raise ValueError(f"{name} is {station}, must be from 0 to {self.n_stations - 1}")
        if a == b:
            raise ValueError(f"b is {b}, must be another station than a")
        before = self._search[1][a]
        parts, node = [], b
        while node != a:
            parts.append(self._edge_between(int(before[node]), node))
            node = int(before[node])
        parts.reverse()
        return np.concatenate([parts[0], *(part[1:] for part in parts[1:])])

    def _edge_between(self, start: int, end: int) -> NDArray[np.float64]:
        """The shortest edge from a node to a neighbour."""
        number, is_reversed = self._edge_numbers[start, end]
        return self.edges_mm[number][::-1] if is_reversed else self.edges_mm[number]

    @cached_property
    def _edge_numbers(self) -> dict[tuple[int, int], tuple[int, bool]]:
        """The shortest edge between each two neighbours, in both directions, and whether it is stored the other way."""
        found = {}
        for i in np.argsort(-self.edge_lengths_mm, kind="stable").tolist():
            start, end = self.ends[i].tolist()
            found[start, end], found[end, start] = (i, False), (i, True)
        return found

    @cached_property
    def _search(self) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
        """Distance and the node before on the shortest way from each station (n_stations, n) to each node."""
        pairs = [(start, end, i) for (start, end), (i, _) in self._edge_numbers.items()]
        starts, ends, numbers = np.array(pairs).T
        n = len(self.nodes_mm)
        graph = csr_array((self.edge_lengths_mm[numbers], (starts, ends)), shape=(n, n))
        stations = np.arange(self.n_stations)
        distance, before = dijkstra(graph, indices=stations, return_predecessors=True)
        return distance[:, : self.n_stations], before


def length_of(polyline: NDArray[np.float64]) -> float:
    """Length of a polyline (k, 2)."""
    return float(np.hypot(*np.diff(polyline, axis=0).T).sum())


def swath_of(edges_mm: tuple[NDArray[np.float64], ...], half_width_mm: float, floor: Floor) -> BaseGeometry:
    """The floor within half a robot's width of some routes [mm]."""
    lines = shapely.MultiLineString([edge.tolist() for edge in edges_mm])
    return lines.buffer(half_width_mm, quad_segs=_SWATH_SEGMENTS).intersection(floor.drivable)
