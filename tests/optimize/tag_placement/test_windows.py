"""Windows of travel against drives on random ways through small networks of routes."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rfiddesign.optimize.tag_placement.windows import checked_routes, joints, route_length, ways_on, windows_along

STAR = tuple(
    np.array([[0.0, 0.0], [size * math.cos(angle), size * math.sin(angle)]])
    for size, angle in ((2000, 0.1), (130, 2.0), (90, 4.0))
)
#: Two short routes behind each other lead from the star's second arm to a long one.
CHAIN = (
    *STAR,
    np.array([STAR[1][1], STAR[1][1] + (60.0, 40.0)]),
    np.array([STAR[1][1] + (60.0, 40.0), STAR[1][1] + (60.0, 1500.0), STAR[1][1] + (900.0, 1500.0)]),
)


def on_road(piece, distance):
    x, y, cosine, sine, at, _ = piece
    return np.array([x + cosine * (distance - at), y + sine * (distance - at)])


def ends(windows, w):
    """The two end points and the middle of window w, from the pieces of its stretch."""
    mine = windows.pieces[(windows.first <= w) & (w < windows.first + windows.count)]
    found = []
    for distance in windows.begins[w] + np.array([0.0, 0.5, 1.0]) * windows.length:
        piece = next(p for p in mine if p[4] - 1e-6 <= distance <= p[4] + p[5] + 1e-6)
        found.append(on_road(piece, distance))
    return np.array(found)


def random_way(routes, rng, n_routes):
    """Drive through routes that follow each other at random, never back the way one came."""
    at = [(number, turned) for number in range(len(routes)) for turned in (False, True)]
    way = [at[rng.integers(len(at))]]
    while len(way) < n_routes:
        last, turned = way[-1]
        end = routes[last][0] if turned else routes[last][-1]
        following = [
            (n, t) for n, t in at if (n, t) != (last, not turned) and np.allclose(routes[n][-1 if t else 0], end)
        ]
        if not following:
            break
        way.append(following[rng.integers(len(following))])
    roads = [routes[n][::-1] if t else routes[n] for n, t in way]
    return np.concatenate([roads[0], *[road[1:] for road in roads[1:]]])


def along(road, distances):
    reached = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(road, axis=0).T))])
    return np.stack([np.interp(distances, reached, road[:, axis]) for axis in (0, 1)], axis=-1)


@pytest.mark.parametrize("routes", [STAR, CHAIN, CHAIN[3:]])
def test_every_drive_of_the_distance_holds_a_whole_window(routes):
    rng = np.random.default_rng(1)
    windows = windows_along(routes, 50.0, 450.0)
    points = np.array([ends(windows, w) for w in range(windows.n_windows)])
    n_drives = 0
    for _ in range(300):
        road = random_way(routes, rng, 6)
        if (size := route_length(road)) < 500:
            continue
        start = rng.uniform(0, size - 500)
        shifts = np.arange(0.0, 50.01, 0.25)
        inside = np.stack([along(road, start + shifts + part * 450) for part in (0.0, 0.5, 1.0)], axis=1)
        apart = np.abs(inside[:, None] - points[None]).max(axis=(2, 3))
        apart_turned = np.abs(inside[:, None, ::-1] - points[None]).max(axis=(2, 3))
        assert min(apart.min(), apart_turned.min()) < 0.3
        n_drives += 1
    assert n_drives > 100


@given(st.floats(500, 30_000), st.floats(20, 200))
@settings(max_examples=40, deadline=None)
def test_a_lone_route_has_its_windows_evenly_from_end_to_end(size, delta):
    windows = windows_along((np.array([[0.0, 0.0], [size, 0.0]]),), delta, 450.0)
    assert (windows.begins >= 0).all()
    assert (windows.begins + 450 <= size + 1e-6).all()
    assert np.diff(windows.begins).max(initial=0) <= delta + 1e-6
    # A drive of 450 + delta cannot lie beside the first or the last of them.
    assert windows.n_windows == 0 or windows.begins[0] <= delta + 1e-6
    assert windows.n_windows == 0 or size - 450 - windows.begins[-1] <= delta + 1e-6
    assert windows.n_windows or size < 450 + delta
    assert windows.poses[:, 0] == pytest.approx(windows.begins + 225)


def test_routes_that_end_within_a_millimetre_are_joined():
    routes = (np.array([[0.0, 0], [1000, 0]]), np.array([[2000.0, 0], [1000.4, 0.4]]), np.array([[1005.0, 0], [1, 1]]))
    places = joints(routes)
    assert places[0, 1] == places[1, 1]
    assert len(set(places.ravel().tolist())) == 5


def test_ways_on_follow_every_branch_and_never_turn_back():
    ways = ways_on(CHAIN, joints(CHAIN), 0, False, 225.0)
    # From the long arm's start: the arm of 90 mm is a dead end; the other leads on through two short routes.
    assert sorted(route_length(way) > 225 for way in ways) == [False, True]
    assert min(route_length(way) for way in ways) == pytest.approx(90)
    (nowhere,) = ways_on(CHAIN, joints(CHAIN), 0, True, 225.0)
    assert nowhere.tolist() == [STAR[0][-1].tolist()]


@pytest.mark.parametrize(
    ("routes", "message"),
    [
        ((), "routes is empty"),
        ((np.zeros((3, 2)),), "route 1: must have at least two different points"),
        ((np.array([[0.0, math.nan], [1, 1]]),), "route 1: must be finite points"),
        ((np.zeros(4),), "found shape"),
    ],
)
def test_routes_that_are_none_are_refused(routes, message):
    with pytest.raises(ValueError, match=message):
        checked_routes(routes)
