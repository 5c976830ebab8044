"""Floors drawn as polygons."""

import math
import pickle

import numpy as np
import pytest
import shapely

from rfiddesign.floor import Floor, floor_from_polygon, rectangle_floor


def test_a_rectangle_keeps_its_area_and_gives_the_robot_the_rest():
    floor = rectangle_floor(10_000.0, 5000.0, 300.0)
    assert floor.area_m2 == pytest.approx(50.0, rel=1e-9)
    assert floor.navigable_m2 == pytest.approx(9.4 * 4.4, rel=1e-9)
    assert floor.drivable.bounds == pytest.approx((0.0, 0.0, 10_000.0, 5000.0), abs=1e-6)


def test_keep_outs_are_cut_out_and_kept_clear_of():
    pillar = shapely.box(4000.0, 2000.0, 5000.0, 3000.0)
    floor = floor_from_polygon([(0, 0), (10_000, 0), (10_000, 5000), (0, 5000)], [pillar], 300.0)
    assert floor.area_m2 == pytest.approx(49.0, rel=1e-6)
    assert floor.navigable.distance(pillar) == pytest.approx(300.0, abs=1.0)


def test_a_part_behind_a_gap_narrower_than_the_robot_is_left_out():
    wall = shapely.union_all([shapely.box(6000, 0, 6100, 2250), shapely.box(6000, 2750, 6100, 5000)])
    outline = shapely.box(0, 0, 10_000, 5000)
    floor = floor_from_polygon(outline, [wall], 300.0)
    # the robot noses into the gap of 500 mm until it touches both ends of the wall
    assert floor.drivable.bounds[2] == pytest.approx(6000.0 - math.sqrt(300.0**2 - 250.0**2) + 300.0, abs=2.0)
    assert floor.area_m2 == pytest.approx(30.0, rel=0.01)
    assert floor_from_polygon(outline, [wall], 240.0).drivable.bounds[2] == pytest.approx(10_000.0)


def test_long_way_round_an_acute_corner_is_not_swept():
    floor = floor_from_polygon([(0, 0), (9000, 0), (9000, 1500)], [], 300.0)
    assert floor.drivable.bounds[0] > 1000.0
    assert 0.5 < floor.area_m2 < 6.75


def test_edges_of_the_navigable_part_close_every_ring():
    floor = floor_from_polygon(shapely.box(0, 0, 9000, 9000), [shapely.box(4000, 4000, 5000, 5000)], 300.0)
    edges = floor.navigable_edges
    lengths = np.hypot(edges[:, 2] - edges[:, 0], edges[:, 3] - edges[:, 1])
    assert lengths.sum() == pytest.approx(floor.navigable.length)


def test_a_floor_travels_to_other_processes():
    floor = rectangle_floor(4000.0, 3000.0, 300.0)
    assert floor.navigable_edges.shape == (4, 4)
    copy = pickle.loads(pickle.dumps(floor))
    assert copy == floor
    assert np.array_equal(copy.navigable_edges, floor.navigable_edges)


@pytest.mark.parametrize(
    ("build", "argument"),
    [
        (lambda: rectangle_floor(-1.0, 5000.0, 300.0), "length_mm"),
        (lambda: rectangle_floor(1000.0, float("nan"), 300.0), "width_mm"),
        (lambda: rectangle_floor(1e12, 5000.0, 300.0), "length_mm"),
        (lambda: rectangle_floor(5000.0, 5000.0, 0.0), "footprint_radius_mm"),
        (lambda: rectangle_floor(500.0, 5000.0, 300.0), "footprint_radius_mm"),
        (lambda: floor_from_polygon([(0, 0), (1, 1)], [], 300.0), "drivable_outline"),
        (lambda: floor_from_polygon([(0, 0), (9e3, 9e3), (9e3, 0), (0, 9e3)], [], 300.0), "drivable_outline"),
        (lambda: floor_from_polygon(shapely.Point(0, 0), [], 300.0), "drivable_outline"),
        (lambda: floor_from_polygon(shapely.box(0, 0, 9e3, 9e3), [[(0, 0)]], 300.0), r"keep_outs\[0\]"),
        (lambda: Floor("f", shapely.box(0, 0, 1, 1), shapely.Polygon(), "drawn"), "navigable"),
        (lambda: Floor("f", shapely.box(0, 0, 9e6, 1), shapely.box(0, 0, 1, 1), "drawn"), "drivable"),
    ],
)
def test_a_bad_argument_is_named(build, argument):
    with pytest.raises(ValueError, match=argument):
        build()
