"""From links of a grid to chains of cells between the places where ways part, and which chains can be spared."""

from collections import defaultdict
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from rfiddesign.floor.navigation_grid import NavigationGrid

Chain = tuple[int, ...]


def chains_of(links: NDArray[np.int64], stations: NDArray[np.int64]) -> list[Chain]:
    """Cut links (m, 2) of cells into chains, each from one node to another.

    Nodes are the stations and the cells at which other than two links meet; a chain names its cells in order, its
    nodes first and last.  Every link is in one chain; chains are in the order of their first cells.
    """
    neighbours: dict[int, list[int]] = defaultdict(list)
    for begin, end in links.tolist():
        neighbours[begin].append(end)
        neighbours[end].append(begin)
    nodes = {cell for cell, others in neighbours.items() if len(others) != 2} | set(stations.tolist())
    found = []
    for node in sorted(nodes):
        for following in sorted(neighbours[node]):
            cells = [node, following]
            while cells[-1] not in nodes:
                one, other = neighbours[cells[-1]]
                cells.append(other if one == cells[-2] else one)
            # Each chain is met from both ends; one that comes back to its node, in both directions.
            if (cells[0], cells[1]) <= (cells[-1], cells[-2]):
                found.append(tuple(cells))
    return found


def spared(grid: NavigationGrid, links: NDArray[np.int64], stations: NDArray[np.int64], detour: float) -> NDArray:
    """Links (k, 2) that remain when chains are left out whose way round is hardly longer, the longest first.

    Parameters
    ----------
    links : (m, 2) links of cells.
    detour : a chain is left out if the way between its ends without it is at most so many times as long, plus two
        cells' diagonals: the small loops where bundled paths meet.
    """
    while True:
        chains = chains_of(links, stations)
        kept = _needed(grid, chains, detour)
        if len(kept) == len(chains):
            return links
        links = np.array([pair for chain in kept for pair in pairwise(chain)])


def chain_mm(grid: NavigationGrid, chain: Chain) -> float:
    """Length of a chain [mm]."""
    return float(np.hypot(*np.diff(grid.points_mm[list(chain)], axis=0).T).sum())


def _needed(grid: NavigationGrid, chains: list[Chain], detour: float) -> list[Chain]:
    lengths = [chain_mm(grid, chain) for chain in chains]
    nodes = sorted({cell for chain in chains for cell in (chain[0], chain[-1])})
    number = {cell: i for i, cell in enumerate(nodes)}
    ends = np.array([(number[chain[0]], number[chain[-1]]) for chain in chains])
    is_kept = np.ones(len(chains), bool)
    allowance = 2.0 * np.sqrt(2.0) * grid.cell_mm
    for i in sorted(range(len(chains)), key=lambda i: (-lengths[i], chains[i])):
        is_kept[i] = False
        if _distance(ends[is_kept], np.array(lengths)[is_kept], len(nodes), ends[i]) > detour * lengths[i] + allowance:
            is_kept[i] = True
    return [chain for chain, kept in zip(chains, is_kept, strict=True) if kept]


def _distance(ends: NDArray, lengths: NDArray, n_nodes: int, of: NDArray) -> float:
    """Length of the shortest way between two nodes by edges with the given ends (m, 2)."""
    # A sparse array adds the lengths of edges between the same two nodes: only the shortest may be in it.
    order = np.lexsort((lengths, ends.max(axis=1), ends.min(axis=1)))
    pairs = np.sort(ends, axis=1)[order]
    is_first = np.ones(len(pairs), bool)
    is_first[1:] = (pairs[1:] != pairs[:-1]).any(axis=1)
    graph = csr_array((lengths[order][is_first], tuple(pairs[is_first].T)), shape=(n_nodes, n_nodes))
    return float(dijkstra(graph, directed=False, indices=int(of[0]))[int(of[1])])
