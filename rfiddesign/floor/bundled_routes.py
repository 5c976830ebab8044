"""From stations to a network of routes: paths over a grid, drawn together and evened out."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from rfiddesign import require
from rfiddesign.floor.bundled_paths import BundleRules, bundled_links
from rfiddesign.floor.chains import chains_of, spared
from rfiddesign.floor.navigation_grid import NavigationGrid, navigation_grid
from rfiddesign.floor.plan import Floor, largest_part
from rfiddesign.floor.prepared import prepared_copy
from rfiddesign.floor.route_network import RouteNetwork, swath_of
from rfiddesign.floor.stations import placed_stations, spread_stations

# A route may leave its cells by this many cells where that makes it straighter.
_STRAIGHTEN_CELLS = 1.5


@dataclass(frozen=True)
class NetworkRules:
    """How routes are laid.

    Parameters
    ----------
    cell_mm : side of the cells that paths are searched on [mm].
    margin_mm : robots may be so far off the routes [mm]: routes keep it from where the robot's centre cannot be.
    bundle : what makes a path cheap.
    detour : a piece is left out if the way round is at most so many times as long.
    """

    cell_mm: float = 100.0
    margin_mm: float = 50.0
    bundle: BundleRules = field(default_factory=BundleRules)
    detour: float = 1.25

    def __post_init__(self) -> None:
        require.within("cell_mm", self.cell_mm, low=1.0, high=10_000.0)
        require.within("margin_mm", self.margin_mm, low=0.0, high=10_000.0)
        require.within("detour", self.detour, low=1.0, high=10.0)


def bundled_routes(
    floor: Floor,
    stations: int | Sequence[Sequence[float]],
    half_width_mm: float,
    rules: NetworkRules | None = None,
    seed: int = 0,
) -> RouteNetwork:
    """Join stations by a network of routes that stays where the robot's centre may be, `margin_mm` from its border.

    Paths are shortest paths on a grid on which cells near walls are dear and cells that earlier paths use are cheap.
    The cells used become chains between stations and junctions; chains whose way round is hardly longer are left out;
    what remains is straightened where the floor allows it.

    Parameters
    ----------
    floor : the floor.
    stations : how many to spread over the floor, or where they are: (x, y) [mm].
    half_width_mm : half the width of what a robot sweeps [mm].
    rules : how routes are laid.
    seed : draws the first of the stations that are spread.

    Raises
    ------
    ValueError : if the floor has no room for routes or stations, or a station lies where no robot can get to.
    """
    rules = rules or NetworkRules()
    require.positive("half_width_mm", half_width_mm)
    region = largest_part(floor.navigable.buffer(-rules.margin_mm)) if rules.margin_mm else floor.navigable
    if region.is_empty:
        raise ValueError(f"margin_mm is {rules.margin_mm:g}: no place on the floor has so much room")
    grid = navigation_grid(region, rules.cell_mm)
    if isinstance(stations, int):
        cells = spread_stations(grid, stations, seed, rules.bundle.clearance_mm)
    else:
        cells = placed_stations(grid, stations)
    used = grid.links[bundled_links(grid, cells, rules.bundle)]
    chains = chains_of(spared(grid, used, cells, rules.detour), cells)
    nodes = _nodes(chains, cells)
    number = {cell: i for i, cell in enumerate(nodes)}
    region = prepared_copy(region)
    edges = tuple(
        straightened(grid.points_mm[list(chain)], region, _STRAIGHTEN_CELLS * grid.cell_mm) for chain in chains
    )
    ends = np.array([(number[chain[0]], number[chain[-1]]) for chain in chains])
    return RouteNetwork(_at(grid, nodes), len(cells), ends, edges, swath_of(edges, half_width_mm, floor))


def straightened(line: NDArray[np.float64], region: BaseGeometry, tolerance: float) -> NDArray[np.float64]:
    """Leave out corners (k, 2) of a line as long as it stays within a tolerance of them and inside a region.

    D. Douglas, T. Peucker, "Algorithms for the reduction of the number of points required to represent a digitized line
    or its caricature" (1973), with a second reason to keep a corner.
    """
    kept = {0, len(line) - 1}
    todo = [(0, len(line) - 1)]
    while todo:
        first, last = todo.pop()
        if last - first < 2:
            continue
        between, leg = line[first + 1 : last], line[last] - line[first]
        along = np.clip((between - line[first]) @ leg / max(float(leg @ leg), 1e-12), 0.0, 1.0)
        off = np.hypot(*(between - line[first] - along[:, None] * leg).T)
        if off.max() <= tolerance and region.covers(shapely.LineString(line[[first, last]])):
            continue
        farthest = first + 1 + int(off.argmax()) if off.max() > 0.0 else (first + last) // 2
        kept.add(farthest)
        todo += [(first, farthest), (farthest, last)]
    return line[sorted(kept)]


def _nodes(chains: list[tuple[int, ...]], stations: NDArray[np.int64]) -> list[int]:
    """Cells of the nodes: the stations in their order, then the junctions."""
    at_stations = set(stations.tolist())
    junctions = {cell for chain in chains for cell in (chain[0], chain[-1])} - at_stations
    return [*stations.tolist(), *sorted(junctions)]


def _at(grid: NavigationGrid, cells: list[int]) -> NDArray[np.float64]:
    return grid.points_mm[cells]
