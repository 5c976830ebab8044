"""Tags in lines that an installer can lay: rows along a leg at fixed rhythm.

Over a straight road rows and rhythm are chosen so that every window is served however long the road is: few places of
one period, repeated. On each leg of the routes the tags begin at its start and repeat to its end. Windows over
bends, joints and legs too short for a period get single tags besides.
"""

import math
from collections.abc import Sequence
from itertools import pairwise

import highspy
import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.spatial import cKDTree
from shapely.geometry.base import BaseGeometry

from rfiddesign.optimize.quiet_highs import quiet_highs
from rfiddesign.optimize.tag_placement.bound import cover_model, relaxed_weights
from rfiddesign.optimize.tag_placement.cover import Sight, cover_of, half_width
from rfiddesign.optimize.tag_placement.places import apart, tag_places
from rfiddesign.optimize.tag_placement.rules import PlacementRules
from rfiddesign.optimize.tag_placement.windows import windows_along

#: Nodes of the search for the best rows of one period.
RHYTHM_NODES = 20
#: Legs get a line from so many periods on.
LEAST_PERIODS = 2.0


def line_tags(
    routes: Sequence[NDArray], sight: Sight, rules: PlacementRules, allowed: BaseGeometry | None
) -> NDArray[np.float64]:
    """Return the tags (n, 2) [mm] of the lines along the legs of the routes, in order, without those not allowed.

    Where legs meet or overlap, tags closer than `rules.min_tag_distance_mm` to one of an earlier leg are left out.
    """
    period, places = rhythm(sight, rules)
    legs = [leg for route in routes for leg in pairwise(route)]
    laid = [np.empty((0, 2))]
    for start, end in legs:
        size = math.dist(start, end)
        if size < LEAST_PERIODS * period:
            continue
        forward = (end - start) / size
        left = np.array([-forward[1], forward[0]])
        turns = np.arange(math.floor(size / period) + 1) * period
        along = (turns[:, None] + places[None, :, 0]).ravel()
        across = np.broadcast_to(places[None, :, 1], (len(turns), len(places))).ravel()
        is_on_leg = along <= size
        laid.append(start + along[is_on_leg, None] * forward + across[is_on_leg, None] * left)
    tags = np.concatenate(laid)
    if allowed is not None:
        tags = tags[shapely.contains_xy(allowed, tags)]
    return tags[apart(tags, max(rules.min_tag_distance_mm, 1.0))]


def rhythm(sight: Sight, rules: PlacementRules) -> tuple[float, NDArray[np.float64]]:
    """Return the period [mm] and the places (n, 2) [mm] along and across of one period, fewest tags per metre.

    Periods are whole multiples of `rules.delta_mm` up to a window. A place counts for a window once for every period in
    which it is seen there.

    Raises
    ------
    ValueError : if the antennas leave windows of a straight road unserved at any rhythm.
    """
    best: tuple[float, float, NDArray] | None = None
    for n in range(1, math.floor(rules.window_mm / rules.delta_mm + 1e-9) + 1):
        period = n * rules.delta_mm
        fewer_than = math.inf if best is None else best[0] * period
        places = _one_period(sight, rules, period, fewer_than)
        if places is not None and len(places) < fewer_than - 1e-9:
            best = len(places) / period, period, places
    if best is None:
        raise ValueError("is_in_lines: no rhythm serves all windows of a straight road; take a finer across_mm")
    return best[1], best[2]


def _one_period(sight: Sight, rules: PlacementRules, period: float, fewer_than: float) -> NDArray[np.float64] | None:
    """Return few places of a period that serve a straight road; None if HiGHS finds none or needs too many."""
    size = rules.window_mm + period
    road = (np.array([[0.0, 0.0], [size, 0.0]]),)
    along = period / math.ceil(period / rules.along_mm - 1e-9)
    # Windows begin all over one period, at twice the density, since where they begin on a leg is not known.
    windows = windows_along(road, rules.delta_mm / 2, rules.window_mm)
    places = tag_places(road, half_width(sight), along, rules.across_mm)
    cover = cover_of(windows, cKDTree(places), sight, rules.n_cover)
    if cover.n_unserved:
        return None
    cell = np.round(np.stack([np.mod(places[cover.number, 0], period), places[cover.number, 1]], axis=-1), 6)
    cell[np.isclose(cell[:, 0], period), 0] = 0.0
    alike, group = np.unique(cell, axis=0, return_inverse=True)
    fold = csr_array((np.ones(len(cell)), (np.arange(len(cell)), group.ravel())), shape=(len(cell), len(alike)))
    rows = (cover.rows.astype(np.float64) @ fold).tocsr()
    rows = csr_array(np.unique(rows.toarray(), axis=0))
    need = np.full(rows.shape[0], rules.n_cover)
    cost = np.ones(len(alike))
    if math.ceil(need @ relaxed_weights(rows, cost, need) - 1e-3) >= fewer_than - 1e-9:
        return None
    model = cover_model(rows, cost, need)
    model.integrality_ = [highspy.HighsVarType.kInteger] * len(alike)
    solver = quiet_highs(mip_max_nodes=RHYTHM_NODES)
    solver.passModel(model)
    solver.run()
    chosen = np.array(solver.getSolution().col_value) > 0.5
    is_served = len(chosen) == len(alike) and bool((rows @ chosen.astype(np.float64) >= need).all())
    return alike[chosen] if is_served else None
