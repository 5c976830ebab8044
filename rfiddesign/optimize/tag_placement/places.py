"""Candidate places of tags: a grid along and across the routes, as wide as antennas see."""

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from shapely.geometry.base import BaseGeometry

from rfiddesign.optimize.tag_placement.windows import route_length

LEGS_AT_ONCE = 1000
MAX_PLACES = 40_000_000
#: Of two places of different legs that are closer than this share of the finer grid step, one is left out.
CLOSE_SHARE = 0.6


def tag_places(
    routes: Sequence[NDArray], half_width: float, along: float, across: float, allowed: BaseGeometry | None = None
) -> NDArray[np.float64]:
    """Return places (n, 2) [mm] about the routes at which tags may lie.

    Every leg has a grid of its own, symmetric about it, so that rows of places run along the leg and tags can lie where
    the antennas pass with their whole width. At bends and joints the grids of legs overlap; the denser of it is
    thinned.

    Parameters
    ----------
    half_width : how far to either side of a route antennas see [mm]; also how far places reach beyond its ends.
    along, across : steps of the grids [mm].
    allowed : region in which tags may lie; None is everywhere.

    Raises
    ------
    ValueError : if there are more places than memory holds, or none.
    """
    n_rows = math.floor(half_width / across)
    expected = sum(route_length(route) for route in routes) / along * (2 * n_rows + 1)
    if expected > MAX_PLACES:
        raise ValueError(f"along_mm, across_mm = {along:g}, {across:g}: give more than {MAX_PLACES} places of tags")
    rows = across * np.arange(-n_rows, n_rows + 1)
    legs = [leg for route in routes for leg in pairwise(route)]
    sizes, blocks = [], []
    # Block by block: the memory of millions of small arrays at once is not given back.
    for at in range(0, len(legs), LEGS_AT_ONCE):
        grids = [_leg_grid(start, end, rows, along, half_width) for start, end in legs[at : at + LEGS_AT_ONCE]]
        sizes += [len(grid) for grid in grids]
        blocks.append(np.concatenate(grids))
    places = np.concatenate(blocks)
    del blocks
    is_own = np.repeat(np.arange(len(legs), dtype=np.int32), sizes)
    if allowed is not None:
        shapely.prepare(allowed)
        is_allowed = shapely.contains_xy(allowed, places)
        places, is_own = places[is_allowed], is_own[is_allowed]
    if len(places) == 0:
        raise ValueError("allowed: leaves no place for a tag along the routes")
    return places[apart(places, CLOSE_SHARE * min(along, across), is_own)]


def _leg_grid(start: NDArray, end: NDArray, rows: NDArray, along: float, margin: float) -> NDArray[np.float64]:
    vector = end - start
    size = math.hypot(*vector)
    forward = vector / size
    # Symmetric about the leg's middle: a leg driven back has the same places.
    n = math.floor((size / 2 + margin) / along)
    steps = along * np.arange(-n, n + 1)
    s, v = (axis.ravel() for axis in np.meshgrid(steps, rows, indexing="ij"))
    beyond = np.maximum(np.abs(s) - size / 2, 0.0)
    is_near = np.hypot(beyond, v) <= margin
    left = np.array([-forward[1], forward[0]])
    return (start + end) / 2 + s[is_near, None] * forward + v[is_near, None] * left


def apart(places: NDArray, distance: float, leg: NDArray | None = None) -> NDArray[np.bool_]:
    """Which places stay, when of any two that are closer than `distance` the later one goes, for one that stays.

    If `leg` (n,) is given, places of the same leg do not mind each other.
    """
    is_kept = np.ones(len(places), dtype=bool)
    if len(places) == 0:
        return is_kept
    pairs = np.sort(cKDTree(places).query_pairs(distance * (1 - 1e-9), output_type="ndarray"), axis=1)
    if leg is not None:
        pairs = pairs[leg[pairs[:, 0]] != leg[pairs[:, 1]]]
    for first, second in pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))].tolist():
        if is_kept[first]:
            is_kept[second] = False
    return is_kept
