"""Errands stay where the robot's centre may be, are short, and come everywhere."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from rfiddesign.floor import Floor, prepared_copy, rectangle_floor
from rfiddesign.floor.errands import _cells_between, _straightened, _ways, errands
from rfiddesign.floor.scenes import laboratory, warehouse
from rfiddesign.numerics._noise_kernels import run_key

LAB, WAREHOUSE = laboratory().floor, warehouse(20_000.0, 14_000.0).floor
FLOORS = {"laboratory": LAB, "warehouse": WAREHOUSE, "rectangle": rectangle_floor(5_000, 3_000, 300)}


def route(floor, number, length_mm=60_000.0):
    return errands(floor, np.uint64(run_key(np.uint64(3), np.uint64(number))), length_mm)


@pytest.mark.parametrize("floor", FLOORS.values(), ids=FLOORS)
def test_errands_stay_where_the_robots_centre_may_be(floor):
    region = prepared_copy(floor.navigable.buffer(1e-6))
    for number in range(20):
        waypoints = route(floor, number)
        legs = shapely.linestrings(np.stack([waypoints[:-1], waypoints[1:]], axis=1))
        assert shapely.covers(region, legs).all()
        assert np.hypot(*np.diff(waypoints, axis=0).T).sum() >= 60_000.0


@given(st.integers(0, 2**40))
@settings(max_examples=10, deadline=None)
def test_an_empty_rectangle_is_crossed_straight(number):
    # Each errand is one leg: no two legs on end could be one, since their ends are drawn.
    floor = FLOORS["rectangle"]
    waypoints = route(floor, number, 20_000.0)
    inside = np.array(floor.navigable.bounds).reshape(2, 2)
    assert (waypoints >= inside[0]).all()
    assert (waypoints <= inside[1]).all()
    lengths = np.hypot(*np.diff(waypoints, axis=0).T)
    # The mean distance of two random places in 4.4 x 2.4 m is 1.8 m; a way along grid cells would be longer and bent.
    assert 900 < lengths.mean() < 3_000


def shortest_mm(region, corners, begin, end):
    """Length of the shortest way: over the graph of what sees what, corners of the obstacle included."""
    points = np.vstack([begin, end, corners])
    pairs = np.array([(i, j) for i in range(len(points)) for j in range(i)])
    legs = shapely.linestrings(points[pairs])
    is_seen = shapely.covers(region.buffer(1e-6), legs)
    graph = csr_array((shapely.length(legs[is_seen]), tuple(pairs[is_seen].T)), shape=(len(points),) * 2)
    return dijkstra(graph, directed=False, indices=0)[1]


def test_ways_about_an_obstacle_are_little_longer_than_the_shortest():
    corners = np.array([[1_000, 1_000], [1_000, 5_000], [5_000, 1_000], [5_000, 5_000]], float)
    ring = shapely.box(0, 0, 6_000, 6_000).difference(shapely.box(1_000, 1_000, 5_000, 5_000))
    floor = Floor("ring", ring, ring, "test")
    ways = _ways(floor)
    rng = np.random.default_rng(1)
    ratios = []
    for cell, to in zip(rng.choice(ways.places, 60), rng.integers(len(ways.places), size=60), strict=True):
        begin, end = ways.grid.points_mm[cell], ways.grid.points_mm[ways.places[to]]
        way = _straightened(floor, _cells_between(ways, cell, to))
        assert np.array_equal(way[[0, -1]], [begin, end])
        length, least = np.hypot(*np.diff(way, axis=0).T).sum(), shortest_mm(ring, corners, begin, end)
        assert least - 1e-6 <= length <= 1.1 * least + 2 * ways.grid.cell_mm
        ratios.append(length / least if least > 0 else 1.0)
    assert np.mean(ratios) < 1.05


def test_drives_come_everywhere():
    for floor, length_mm in ((LAB, 120_000.0), (WAREHOUSE, 400_000.0)):
        driven = shapely.LineString(route(floor, 1, length_mm)).buffer(1_000.0)
        assert driven.intersection(floor.navigable).area > 0.8 * floor.navigable.area


def test_errands_depend_on_their_key_alone():
    assert np.array_equal(route(LAB, 5), route(LAB, 5))
    assert not np.array_equal(route(LAB, 5)[:3], route(LAB, 6)[:3])
    # A longer route begins like a shorter one.
    short, long = route(LAB, 5), route(LAB, 5, 90_000.0)
    assert np.array_equal(long[: len(short)], short)


def test_a_length_that_is_none_is_refused():
    for length in (0.0, -1.0, math.nan):
        with pytest.raises(ValueError, match="length_mm"):
            route(LAB, 1, length)
