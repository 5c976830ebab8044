"""What the antennas of a robot see of tags along the routes that it drives, at poses spread along them."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from rfiddesign.geometry.areas import DetectionArea
from rfiddesign.geometry.coverage import Coverage, coverage
from rfiddesign.geometry.layouts import ReaderLayout
from rfiddesign.geometry.patterns import TagPattern
from rfiddesign.geometry.route_patterns import PlacedPattern, RouteStrip, pattern_beneath
from rfiddesign.geometry.sampled_coverage import spread, view_levels

N_POSES = 8192
# Poses are taken in this many batches; their scatter tells the error.
N_BATCHES = 16
SEED = 20_261_128


def coverage_on_way(layout: ReaderLayout, area: DetectionArea, pattern: TagPattern) -> Coverage:
    """Return what antennas see of a pattern where robots drive: anywhere, or along the routes that its tags lie on."""
    if isinstance(pattern, PlacedPattern):
        return coverage_along(layout, area, pattern.points_mm, pattern.strip)
    return coverage(layout, area, pattern_beneath(pattern))


def coverage_along(
    layout: ReaderLayout,
    area: DetectionArea,
    tags_mm: NDArray[np.float64],
    strip: RouteStrip,
    *,
    k_max: int = 3,
) -> Coverage:
    """Return what the antennas of `layout` see of tags along routes, averaged over places and deviations.

    Parameters
    ----------
    tags_mm : (n, 2) tags [mm].
    strip : the routes; robots face along them, in either direction, and deviations up to their bounds are equally
        likely.

    Raises
    ------
    ValueError : if there is no tag or no route.
    """
    if len(tags_mm) == 0 or len(strip.routes_mm) == 0:
        raise ValueError("tags_mm, routes_mm: must be at least one tag and one route")
    tree = cKDTree(tags_mm)
    rng = np.random.Generator(np.random.PCG64(SEED))
    batches = np.array(
        [
            view_levels(
                layout, area, tree, poses_along(strip.routes_mm, _shares(rng), strip.lateral_mm, strip.yaw_rad), k_max
            )
            for _ in range(N_BATCHES)
        ]
    )
    *k_coverage, expected_reads, two_tags_share = batches.mean(axis=0).tolist()
    stderr = float((batches.std(axis=0, ddof=1) / math.sqrt(N_BATCHES)).max())
    return Coverage(tuple(k_coverage), expected_reads, two_tags_share, "sampled on routes", stderr)


def poses_along(
    routes_mm: Sequence[NDArray[np.float64]], shares: NDArray[np.float64], lateral_mm: float, yaw_rad: float
) -> NDArray[np.float64]:
    """Poses (n, 3) of robots on routes.

    Parameters
    ----------
    shares : (n, 4) in [0, 1): of the routes' length, of the lateral deviations, of the deviations of the heading, and
        of the two directions.
    """
    starts = np.concatenate([route[:-1] for route in routes_mm])
    legs = np.concatenate([np.diff(route, axis=0) for route in routes_mm])
    lengths = np.hypot(*legs.T)
    reached = np.concatenate([[0.0], np.cumsum(lengths)])
    at = shares[:, 0] * reached[-1]
    k = np.clip(np.searchsorted(reached, at, side="right") - 1, 0, len(legs) - 1)
    forward = legs[k] / lengths[k, None]
    lateral = lateral_mm * (2.0 * shares[:, 1] - 1.0)
    left = np.column_stack([-forward[:, 1], forward[:, 0]])
    places = starts[k] + (at - reached[k])[:, None] * forward + lateral[:, None] * left
    heading = np.arctan2(forward[:, 1], forward[:, 0]) + math.pi * (shares[:, 3] >= 0.5)
    return np.column_stack([places, heading + yaw_rad * (2.0 * shares[:, 2] - 1.0)])


def _shares(rng: np.random.Generator) -> NDArray[np.float64]:
    return spread(N_POSES // N_BATCHES, rng.random(4))
