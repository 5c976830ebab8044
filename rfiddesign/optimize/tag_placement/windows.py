"""Windows of travel: the stretches of road that each have to be served by tags.

Routes that end at one point are joined there. The middles of windows lie at most `delta` apart along every route, and
a window whose middle is near a route's end runs on into each of the other routes that end there; only turning back is
left out. A drive of `length` + `delta` on any way through the network has its middle within `delta` / 2 of the middle
of a window on that same way, and so holds that window. What is seen along a window is a matter of the poses there, so
that one window stands for both directions of travel.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

#: Route ends nearer than this [mm] are one place.
SAME_PLACE_MM = 1.0
#: Legs are cut into pieces no longer than this [mm], so that few tag places are far from a piece's middle.
PIECE_MM = 1000.0
#: A stretch has at most so many windows.
STRETCH = 400
MAX_WINDOWS = 20_000_000
MAX_WAYS = 1000


@dataclass(frozen=True, eq=False)
class Windows:
    """Windows of travel, and the straight pieces of road they consist of.

    Parameters
    ----------
    pieces : (n_pieces, 6) start x, y [mm], direction's cosine and sine, distance of the start along its stretch [mm]
        and length [mm]. A stretch is a piece of road with windows of its own.
    first, count : (n_pieces,) number of the first window of the piece's stretch, and how many it has.
    begins : (n_windows,) where windows begin, as a distance along their stretch [mm], rising in each stretch.
    poses : (n_windows, 3) the middles of the windows: x, y [mm] and direction of the road [rad].
    length : length of a window [mm].
    """

    pieces: NDArray[np.float64]
    first: NDArray[np.int64]
    count: NDArray[np.int64]
    begins: NDArray[np.float64]
    poses: NDArray[np.float64]
    length: float

    @property
    def n_windows(self) -> int:
        """Number of windows."""
        return len(self.begins)


def parts(windows: Windows, n_at_most: int) -> list[Windows]:
    """Group windows by where they are, stretches whole, into parts of `n_at_most` windows or of one stretch."""
    first, begin_of = np.unique(windows.first, return_index=True)
    size = windows.count[begin_of]
    middle = windows.poses[first + size // 2, :2] if len(first) else np.empty((0, 2))
    groups, pending = [], [np.arange(len(first))] if len(first) else []
    while pending:
        group = pending.pop()
        if size[group].sum() <= n_at_most or len(group) == 1:
            groups.append(_part(windows, first[group], size[group]))
            continue
        axis = int(np.argmax(np.ptp(middle[group], axis=0)))
        ordered = group[np.argsort(middle[group, axis], kind="stable")]
        cut = int(np.searchsorted(np.cumsum(size[ordered]), size[group].sum() / 2))
        cut = min(max(cut, 1), len(ordered) - 1)
        pending += [ordered[cut:], ordered[:cut]]
    return groups


def _part(windows: Windows, first: NDArray, size: NDArray) -> Windows:
    chosen = np.concatenate([np.arange(at, at + n) for at, n in zip(first, size, strict=True)])
    new_first = dict(zip(first.tolist(), (np.cumsum(size) - size).tolist(), strict=True))
    mine = np.flatnonzero(np.isin(windows.first, first))
    return Windows(
        windows.pieces[mine], np.array([new_first[at] for at in windows.first[mine].tolist()], np.int64),
        windows.count[mine], windows.begins[chosen], windows.poses[chosen], windows.length,
    )  # fmt: skip


def checked_routes(routes: Sequence[NDArray]) -> tuple[NDArray[np.float64], ...]:
    """Return the routes as arrays without repeated points.

    Raises
    ------
    ValueError : if a route is not a row of at least two different finite points, or there is none.
    """
    checked = []
    for number, route in enumerate(routes, start=1):
        points = np.array(route, dtype=np.float64)
        if points.ndim != 2 or points.shape[1] != 2 or not np.isfinite(points).all():
            raise ValueError(f"routes, route {number}: must be finite points (k, 2), found shape {points.shape}")
        points = points[np.append(True, np.hypot(*np.diff(points, axis=0).T) > 1e-6)] if len(points) else points
        if len(points) < 2:
            raise ValueError(f"routes, route {number}: must have at least two different points")
        checked.append(points)
    if not checked:
        raise ValueError("routes is empty: must hold at least one route")
    return tuple(checked)


def windows_along(routes: Sequence[NDArray], delta: float, length: float) -> Windows:
    """List the windows of `length` [mm] along routes and across their joints, their middles `delta` [mm] apart.

    Raises
    ------
    ValueError : if there are too many windows, or too many ways through joints, for any memory.
    """
    total = sum(route_length(route) for route in routes)
    if total / delta > MAX_WINDOWS:
        raise ValueError(f"delta_mm = {delta:g}: more than {MAX_WINDOWS} windows on {total / 1e3:.0f} m of routes")
    places = joints(routes)
    pieces, first, count, begins, poses = [np.empty((0, 6))], [], [], [np.empty(0)], [np.empty((0, 3))]
    n_windows = 0
    for number in range(len(routes)):
        for road, middles in _stretches(routes, places, number, delta, length / 2):
            cut = _pieces(road, middles[0] - length / 2, middles[-1] + length / 2)
            pieces.append(cut)
            first += [n_windows] * len(cut)
            count += [len(middles)] * len(cut)
            begins.append(middles - length / 2)
            poses.append(_poses(road, middles))
            n_windows += len(middles)
            if n_windows > MAX_WINDOWS:
                raise ValueError(f"routes: more than {MAX_WINDOWS} windows; merge short routes")
    return Windows(
        np.concatenate(pieces), np.array(first, np.int64), np.array(count, np.int64), np.concatenate(begins),
        np.concatenate(poses), float(length),
    )  # fmt: skip


def joints(routes: Sequence[NDArray]) -> NDArray[np.int64]:
    """Return for every route (n, 2) the numbers of the places at which it starts and ends."""
    places: list[NDArray] = []
    cells: dict[tuple[int, int], list[int]] = {}
    numbers = []
    for end in (end for route in routes for end in (route[0], route[-1])):
        column, row = (int(at) for at in np.floor(end / SAME_PLACE_MM))
        near = [n for dx in (-1, 0, 1) for dy in (-1, 0, 1) for n in cells.get((column + dx, row + dy), ())]
        number = next((n for n in near if np.hypot(*(places[n] - end)) <= SAME_PLACE_MM), len(places))
        if number == len(places):
            places.append(end)
            cells.setdefault((column, row), []).append(number)
        numbers.append(number)
    return np.array(numbers, np.int64).reshape(-1, 2)


def ways_on(routes: Sequence[NDArray], places: NDArray, number: int, is_from_end: bool, reach: float) -> list[NDArray]:
    """Return all roads (k, 2) that lead on from one end of a route for `reach` [mm] or to a dead end before that.

    They begin with that end's point and never turn back. They are whole routes, so that they may be longer.

    Parameters
    ----------
    places : as `joints` gives them.
    number, is_from_end : the route, and whether its last point is meant or its first.

    Raises
    ------
    ValueError : if there are more than `MAX_WAYS`.
    """
    found, pending = [], [((number, not is_from_end), routes[number][None, -1 if is_from_end else 0], 0.0)]
    while pending:
        (last, is_reversed), road, driven = pending.pop()
        if driven >= reach:
            found.append(road)
            continue
        place = places[last, 0 if is_reversed else 1]
        # A route that starts here is driven as it is listed, one that ends here in reverse.
        onward = [(n, end == 1) for n, end in np.argwhere(places == place).tolist()]
        onward = [following for following in onward if following != (last, not is_reversed)]
        if not onward:
            found.append(road)
        for following, is_turned in onward:
            route = routes[following][::-1] if is_turned else routes[following]
            far = driven + route_length(route)
            pending.append(((following, is_turned), np.concatenate([road, route[1:]]), far))
        if len(found) + len(pending) > MAX_WAYS:
            raise ValueError(f"routes: more than {MAX_WAYS} ways within {reach:g} mm of one end; merge short routes")
    return found


def route_length(route: NDArray) -> float:
    """Return the length [mm] of a polyline."""
    return float(np.hypot(*np.diff(route, axis=0).T).sum())


def _stretches(routes, places, number: int, delta: float, half: float) -> list[tuple[NDArray, NDArray]]:
    """Return the roads on which windows have their middles on one route, with where these are on them."""
    route = routes[number]
    size = route_length(route)
    n = math.ceil(size / delta - 1e-9)
    middles = (np.arange(n) + 0.5) * (size / n)
    is_over_start, is_over_end = middles - half < 0, middles + half > size
    stretches = [(route, middles[~is_over_start & ~is_over_end])]
    before = after = [route[:0]]
    if is_over_start.any():
        before = [way[:0:-1] for way in ways_on(routes, places, number, False, half)]
    if is_over_end.any():
        after = [way[1:] for way in ways_on(routes, places, number, True, half)]
    for way in before:
        lead = route_length(np.concatenate([way, route[:1]]))
        road = np.concatenate([way, route])
        stretches.append((road, lead + middles[is_over_start & ~is_over_end]))
        for onward in after:
            stretches.append((np.concatenate([road, onward]), lead + middles[is_over_start & is_over_end]))
    for onward in after:
        stretches.append((np.concatenate([route, onward]), middles[~is_over_start & is_over_end]))
    # Before a dead end windows end with the road.
    fitting = [(road, at[(at >= half - 1e-6) & (at <= route_length(road) - half + 1e-6)]) for road, at in stretches]
    return [
        (road, some) for road, at in fitting for some in np.split(at, range(STRETCH, len(at), STRETCH)) if len(some)
    ]


def _pieces(road: NDArray, begin: float, end: float) -> NDArray[np.float64]:
    """Cut what lies of a road between two distances into straight pieces, see `Windows.pieces`."""
    vectors = np.diff(road, axis=0)
    lengths = np.hypot(*vectors.T)
    starts = np.concatenate([[0.0], np.cumsum(lengths)])
    cut = []
    for leg, (cosine, sine) in enumerate(vectors / lengths[:, None]):
        low, high = max(starts[leg], begin), min(starts[leg + 1], end)
        if high <= low:
            continue
        n = math.ceil((high - low) / PIECE_MM)
        for at in low + (high - low) * np.arange(n) / n:
            ahead = at - starts[leg]
            x, y = road[leg] + ahead * np.array([cosine, sine])
            cut.append((x, y, cosine, sine, at, (high - low) / n))
    return np.array(cut).reshape(-1, 6)


def _poses(road: NDArray, middles: NDArray) -> NDArray[np.float64]:
    vectors = np.diff(road, axis=0)
    starts = np.concatenate([[0.0], np.cumsum(np.hypot(*vectors.T))])
    leg = np.clip(np.searchsorted(starts, middles, side="right") - 1, 0, len(vectors) - 1)
    direction = np.arctan2(vectors[leg, 1], vectors[leg, 0])
    ahead = (middles - starts[leg])[:, None] * np.stack([np.cos(direction), np.sin(direction)], axis=-1)
    return np.column_stack([road[leg] + ahead, direction])
