"""Routes stay where the robot's centre may be, and end."""

import math
from pathlib import Path

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from rfiddesign.floor import (
    Floor,
    floor_from_map,
    floor_from_polygon,
    random_route,
    read_ros_map,
    rectangle_floor,
)
from rfiddesign.floor._route_kernels import is_inside, ray_distance
from rfiddesign.numerics._noise_kernels import run_key

WILLOW = Path(__file__).parents[2] / "studies" / "willow-office" / "floor" / "map.yaml"


@pytest.fixture(scope="module")
def willow_floor():
    return floor_from_map(read_ros_map(WILLOW), 300.0)


def stream(seed, run=0):
    return np.uint64(run_key(np.uint64(seed), np.uint64(run)))


def lengths_of(waypoints):
    return np.hypot(*np.diff(waypoints, axis=0).T)


@pytest.mark.parametrize("is_aligned", [True, False])
def test_routes_stay_inside_and_are_long_enough(willow_floor, is_aligned):
    for run in range(100):
        waypoints = random_route(willow_floor, stream(1, run), 20_000.0, is_aligned=is_aligned)
        assert willow_floor.navigable.covers(shapely.LineString(waypoints))
        assert 20_000.0 <= lengths_of(waypoints).sum() < 28_000.0
        assert lengths_of(waypoints).max() <= 8000.0


def test_aligned_legs_follow_the_lattice(willow_floor):
    for angle in (0.0, 0.3, math.pi / 4.0):
        legs = np.diff(random_route(willow_floor, stream(2), 100_000.0, is_aligned=True, lattice_angle=angle), axis=0)
        quarter_turns = (np.arctan2(legs[:, 1], legs[:, 0]) - angle) / (math.pi / 2.0)
        assert np.abs(quarter_turns - np.round(quarter_turns)).max() < 1e-6
        assert len(set(np.round(quarter_turns) % 4)) == 4


def test_oblique_legs_take_all_directions():
    legs = np.diff(random_route(rectangle_floor(9e5, 9e5, 300.0), stream(3), 5e6, is_aligned=False), axis=0)
    counts, _ = np.histogram(np.arctan2(legs[:, 1], legs[:, 0]), bins=8, range=(-math.pi, math.pi))
    assert len(legs) > 1000
    # uniform: a bin of n / 8 legs, standard deviation sqrt(7 n / 64); five of them
    assert np.abs(counts - len(legs) / 8).max() < 5.0 * math.sqrt(7.0 * len(legs) / 64.0)


def test_starts_are_uniform_over_the_floor():
    floor = rectangle_floor(4600.0, 2600.0, 300.0)
    starts = np.array([random_route(floor, stream(4, i), 1.0, is_aligned=True)[0] for i in range(800)])
    cell = (starts[:, 0] > 2300.0) * 2 + (starts[:, 1] > 1300.0)
    assert np.abs(np.bincount(cell) - 200).max() < 5.0 * math.sqrt(800 * 3 / 16)


def test_legs_are_at_least_the_least_length_where_there_is_room():
    floor = rectangle_floor(20_000.0, 20_000.0, 300.0)
    for is_aligned in (True, False):
        lengths = lengths_of(random_route(floor, stream(5), 500_000.0, is_aligned=is_aligned, max_leg_mm=3000.0))
        assert lengths.min() >= 1000.0 - 1e-6
        assert lengths.max() <= 3000.0 + 1e-6


def test_the_same_stream_gives_the_same_route(willow_floor):
    first, second = (random_route(willow_floor, stream(6), 30_000.0, is_aligned=False) for _ in range(2))
    assert np.array_equal(first, second)


@settings(max_examples=60, deadline=None)
@given(
    width=st.floats(600.5, 3000.0),
    height=st.floats(600.5, 3000.0),
    turn=st.floats(0.0, 360.0),
    is_aligned=st.booleans(),
    seed=st.integers(0, 1000),
)
def test_tight_rooms_end_with_short_legs(width, height, turn, is_aligned, seed):
    outline = shapely.affinity.rotate(shapely.box(0, 0, width, height), turn)
    floor = floor_from_polygon(outline, [], 300.0)
    waypoints = random_route(floor, stream(seed), 500.0, is_aligned=is_aligned)
    assert lengths_of(waypoints).sum() >= 500.0
    assert floor.navigable.covers(shapely.LineString(waypoints))


def test_a_hopelessly_small_floor_is_an_error_and_not_an_endless_loop():
    floor = Floor("closet", shapely.box(0, 0, 600.01, 600.01), shapely.box(300, 300, 300.01, 300.01), "drawn")
    with pytest.raises(ValueError, match="floor is too small"):
        random_route(floor, stream(7), 20_000.0, is_aligned=False)


def test_the_free_way_is_shapelys(willow_floor):
    boundary = willow_floor.navigable.boundary
    for run in range(40):
        start = random_route(willow_floor, stream(8, run), 1.0, is_aligned=False)[0]
        angle = 2.0 * math.pi * np.random.Generator(np.random.PCG64(run)).random()
        direction = np.array([math.cos(angle), math.sin(angle)])
        ray = shapely.LineString([start, start + 2e5 * direction])
        expected = shapely.Point(start).distance(ray.intersection(boundary))
        assert ray_distance(willow_floor.navigable_edges, *start, *direction) == pytest.approx(expected, abs=1e-6)
    assert ray_distance(willow_floor.navigable_edges, -1e6, -1e6, -1.0, 0.0) == math.inf


def test_a_point_is_inside_where_shapely_says_so(willow_floor):
    low_x, low_y, high_x, high_y = willow_floor.navigable.bounds
    points = np.random.Generator(np.random.PCG64(9)).uniform((low_x, low_y), (high_x, high_y), (3000, 2))
    expected = shapely.contains_xy(willow_floor.navigable, points)
    assert 0.2 < expected.mean() < 0.8
    assert [is_inside(willow_floor.navigable_edges, *point) for point in points] == expected.tolist()


@pytest.mark.parametrize(
    ("change", "argument"),
    [
        ({"length_mm": 0.0}, "length_mm"),
        ({"length_mm": math.inf}, "length_mm"),
        ({"min_leg_mm": -1.0}, "min_leg_mm"),
        ({"max_leg_mm": 10.0}, "max_leg_mm"),
        ({"lattice_angle": math.nan}, "lattice_angle"),
    ],
)
def test_a_bad_argument_is_named(change, argument):
    floor = rectangle_floor(5000.0, 5000.0, 300.0)
    with pytest.raises(ValueError, match=argument):
        random_route(floor, stream(10), **({"length_mm": 1000.0, "is_aligned": True} | change))
