"""Randomness that belongs to places of the plane, so that it does not depend on the region one looks at."""

import math

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from rfiddesign.floor import prepared_copy
from rfiddesign.geometry.lattice import MAX_POINTS, Lattice, in_reading_order

#: Candidates per tile: many enough that a stream of its own costs little, few enough to follow a floor's border.
_CANDIDATES_PER_TILE = 300

#: Of the plane covered by discs of the minimum distance about the points, hard-core thinning can reach less than all.
_LARGEST_COVER = 0.95


def largest_min_distance(points_per_mm2: float) -> float:
    """Return the largest minimum distance [mm] that `hard_core_points` offers at a density."""
    return math.sqrt(_LARGEST_COVER / (math.pi * points_per_mm2))


def hard_core_points(
    region: BaseGeometry, points_per_mm2: float, min_distance: float, seed: int
) -> NDArray[np.float64]:
    """Return random points (n, 2) [mm] in `region`, none closer than `min_distance` to another, by y then x.

    Matern's second hard-core process: candidates at random (a Poisson process), each with a random mark; a candidate
    stays if no other within `min_distance` has a lower mark. Of c candidates per mm^2,
    (1 - exp(-c pi d^2)) / (pi d^2) stay (B. Matern, "Spatial variation", 1960), which is solved for c, so the
    density is met on average. Tiles of the plane have streams of their own, and a candidate's fate hangs on its
    neighbourhood alone: the points in a place are the same for every region.
    """
    cover = points_per_mm2 * math.pi * min_distance**2
    density = points_per_mm2 * (-math.log1p(-cover) / cover if cover > 0 else 1.0)
    if not region.area * density <= MAX_POINTS:
        raise ValueError(
            f"number of random tags = {region.area * points_per_mm2:.3g}: must be at most "
            f"{MAX_POINTS * points_per_mm2 / density:.3g}; lower the density or cut the area"
        )
    region = prepared_copy(region)
    candidates, mark = _candidates(region, min_distance, density, seed)
    # scipy.spatial takes longer to import than most patterns to lay.
    from scipy.spatial import cKDTree

    tree = cKDTree(candidates, balanced_tree=False)
    pairs = tree.query_pairs(min_distance, output_type="ndarray") if min_distance > 0 else np.empty((0, 2), dtype=int)
    is_kept = np.ones(len(candidates), dtype=bool)
    is_kept[np.where(mark[pairs[:, 0]] < mark[pairs[:, 1]], pairs[:, 1], pairs[:, 0])] = False
    points = candidates[is_kept]
    return in_reading_order(points[shapely.contains_xy(region, points)])


def lattice_uniform(seed: int, indices: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return a uniform number (n,) in [0, 1) for each index pair (n, 2): a hash of seed and indices, splitmix64."""
    state = _mixed(np.full(len(indices), seed, dtype=np.uint64))
    for column in indices.astype(np.int64).view(np.uint64).T:
        state = _mixed(state ^ column)
    return (state >> np.uint64(11)) * 2.0**-53


def _mixed(state: NDArray[np.uint64]) -> NDArray[np.uint64]:
    state = state + np.uint64(0x9E3779B97F4A7C15)
    state = (state ^ (state >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    state = (state ^ (state >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return state ^ (state >> np.uint64(31))


def _candidates(
    region: BaseGeometry, margin: float, per_mm2: float, seed: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return points (n, 2) and marks (n,) of a Poisson process: at least those within `margin` of `region`."""
    side = max(math.sqrt(_CANDIDATES_PER_TILE / per_mm2), 2 * margin)
    drawn = [np.empty((0, 3))]
    for column, row in _tiles_near(region, margin, side).tolist():
        # Seed words must not be negative: 0, -1, 1, -2, ... become 0, 1, 2, 3, ...
        words = [seed, *(2 * index if index >= 0 else -2 * index - 1 for index in (column, row))]
        generator = np.random.Generator(np.random.PCG64(words))
        n_candidates = generator.poisson(per_mm2 * side**2)
        drawn.append(generator.random((n_candidates, 3)) + np.array((column, row, 0)))
    candidates = np.concatenate(drawn)
    return candidates[:, :2] * side, candidates[:, 2]


def _tiles_near(region: BaseGeometry, margin: float, side: float) -> NDArray[np.int64]:
    """Return column and row (n, 2) of the square tiles within `margin` of `region`; `margin` is at most half a side."""
    inside = Lattice(((side, 0.0), (0.0, side))).indices_within(region)
    # No place of the border is further than half a side from one of these points, so the tiles next to theirs suffice.
    along = np.floor(shapely.get_coordinates(shapely.segmentize(region.boundary, side)) / side).astype(np.int64)
    beside = np.stack(np.meshgrid((-1, 0, 1), (-1, 0, 1)), axis=-1).reshape(-1, 2)
    tiles = np.unique(np.concatenate([inside, (along[:, None, :] + beside).reshape(-1, 2)]), axis=0)
    low = tiles * side
    boxes = shapely.box(low[:, 0], low[:, 1], low[:, 0] + side, low[:, 1] + side)
    return tiles[shapely.dwithin(region, boxes, margin)]
