"""Patterns on routes lay tags on the strip along the routes and nowhere else."""

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from rfiddesign.geometry import (
    ON_ROUTES,
    Disc,
    PlacedPattern,
    PlannedPattern,
    RouteStrip,
    TagPattern,
    coverage,
    coverage_along,
    coverage_on_way,
    cross,
    make_pattern,
    on_routes,
    pattern_beneath,
    single,
    tagged_mm2,
)
from rfiddesign.geometry.route_coverage import poses_along

HALL = shapely.box(0, 0, 12_000, 9_000)
ROUTE = np.array([(1_000.0, 1_000.0), (8_000.0, 1_000.0), (8_000.0, 7_000.0)])
SWATH = shapely.LineString(ROUTE).buffer(300.0)
STRIP = RouteStrip(SWATH, (ROUTE,), 50.0, 0.05)


@pytest.mark.parametrize("kind", ON_ROUTES)
def test_tags_on_routes_are_those_of_the_whole_floor_that_lie_on_the_strip(kind):
    pattern = on_routes(kind, 60.0, 3, STRIP)
    assert isinstance(pattern, TagPattern)
    assert pattern.name == kind
    assert pattern.tags_per_m2 == pytest.approx(60.0)
    tags = pattern.lay(HALL)
    everywhere = pattern_beneath(pattern).lay(HALL)
    expected = everywhere[shapely.contains_xy(SWATH, everywhere)]
    np.testing.assert_allclose(tags, expected)
    assert 0 < len(tags) < 0.2 * len(everywhere)
    assert len(tags) == pytest.approx(60.0 * SWATH.area / 1e6, rel=0.1)


@given(st.integers(0, 1000), st.floats(0.0, 12_000.0), st.floats(0.0, 9_000.0))
def test_a_region_holds_what_the_whole_floor_has_there(seed, x, y):
    pattern = on_routes("random-on-routes", 40.0, seed, STRIP)
    region = shapely.box(0, 0, x + 10.0, y + 10.0)
    everywhere = pattern.lay(HALL)
    np.testing.assert_array_equal(pattern.lay(region), everywhere[shapely.contains_xy(region, everywhere)])


def test_the_tagged_area_is_the_strip_or_the_whole_floor():
    points = [(2_000.0, 1_000.0), (3_000.0, 1_100.0)]
    assert tagged_mm2(on_routes("square-on-routes", 50.0, 0, STRIP), HALL.area) == SWATH.area
    assert tagged_mm2(PlacedPattern(points, 500.0, STRIP), HALL.area) == SWATH.area
    assert tagged_mm2(make_pattern("square", tags_per_m2=50.0), HALL.area) == HALL.area


def test_placed_tags_are_a_pattern_with_their_own_density():
    points = np.array([(2_000.0, 1_000.0), (3_000.0, 1_100.0), (3_000.0, 1_020.0)])
    pattern = PlacedPattern(points, 500.0, STRIP)
    assert isinstance(pattern, TagPattern)
    assert pattern.name == "routes-500"
    assert pattern.lattice is None
    assert pattern.min_distance_mm == pytest.approx(80.0)
    assert pattern.tags_per_m2 == pytest.approx(3e6 / SWATH.area)
    np.testing.assert_array_equal(pattern.lay(HALL), points[[0, 2, 1]])
    np.testing.assert_array_equal(pattern.lay(shapely.box(0, 0, 2_500, 9_000)), points[:1])


@pytest.mark.parametrize(
    ("points", "distance", "words"),
    [
        (np.empty((0, 2)), 500.0, "must be at least one finite position"),
        ([(0.0, np.nan)], 500.0, "must be at least one finite position"),
        ([(0.0, 0.0)], 0.0, "distance_mm = 0.0"),
    ],
)
def test_placed_tags_out_of_bounds_are_refused(points, distance, words):
    with pytest.raises(ValueError, match=words):
        PlacedPattern(points, distance, STRIP)


def test_an_unknown_kind_on_routes_is_refused():
    with pytest.raises(ValueError, match=r"striped-on-routes.*must be one of square-on-routes"):
        on_routes("striped-on-routes", 10.0, 0, STRIP)


def test_tags_that_are_not_placed_yet_cannot_be_laid():
    planned = PlannedPattern(300.0)
    assert isinstance(planned, TagPattern)
    assert planned.name == PlacedPattern([(0.0, 0.0)], 300.0, STRIP).name
    with pytest.raises(ValueError, match=r"routes-300.*must be placed"):
        planned.lay(HALL)


def test_a_lattice_on_routes_is_seen_there_as_it_would_be_everywhere():
    seen = (cross(readers_per_arm=2), Disc(40.0))
    pattern = on_routes("triangular-on-routes", 50.0, 0, STRIP)
    assert coverage_on_way(*seen, pattern) == coverage(*seen, pattern.base)


def test_poses_along_routes_lie_on_them_within_the_deviations():
    shares = np.random.default_rng(2).random((4000, 4))
    poses = poses_along([ROUTE], shares, 40.0, 0.1)
    line = shapely.LineString(ROUTE)
    off = shapely.distance(line, shapely.points(poses[:, :2]))
    assert off.max() <= 40.0
    assert off.mean() == pytest.approx(20.0, abs=1.0)
    # 7 of 13 m lead along x, in both directions.
    along_x = np.abs(np.sin(poses[:, 2])) < np.sin(0.1) + 1e-9
    assert along_x.mean() == pytest.approx(7 / 13, abs=0.03)
    assert (np.cos(poses[along_x, 2]) > 0).mean() == pytest.approx(0.5, abs=0.04)


def test_along_routes_a_dense_lattice_is_seen_as_everywhere():
    """With many oblique legs all phases and headings come about, so that both averages are the same."""
    angles = np.linspace(0.0, np.pi, 60)
    routes = [np.array([(0.0, 0.0), 3_000.0 * np.array([np.cos(a), np.sin(a)])]) for a in angles]
    pattern = make_pattern("square", tags_per_m2=40.0)
    tags = pattern.lay(shapely.box(-3_600, -600, 3_600, 3_600))
    seen = (cross(readers_per_arm=2), Disc(30.0))
    along, everywhere = (
        coverage_along(*seen, tags, RouteStrip(SWATH, tuple(routes), 50.0, 0.05)),
        coverage(*seen, pattern),
    )
    assert along.method == "sampled on routes"
    assert along.expected_reads == pytest.approx(everywhere.expected_reads, abs=5 * along.stderr)
    assert along.k_coverage == pytest.approx(everywhere.k_coverage, abs=5 * along.stderr)


def test_a_row_of_tags_under_the_antenna_is_seen_as_far_as_its_discs_reach():
    """Tags every 500 mm under an antenna of 60 mm radius: 120 of 500 mm."""
    tags = np.column_stack([np.arange(250.0, 10_000.0, 500.0), np.zeros(20)])
    strip = RouteStrip(SWATH, (np.array([(0.0, 0.0), (10_000.0, 0.0)]),), 0.0, 0.0)
    along = coverage_along(single(), Disc(60.0), tags, strip)
    assert along == coverage_on_way(single(), Disc(60.0), PlacedPattern(tags, 500.0, strip))
    assert along.expected_reads == pytest.approx(0.24, abs=0.01)
    assert along.two_tags_share == 0.0


def test_coverage_along_nothing_is_refused():
    with pytest.raises(ValueError, match="at least one tag and one route"):
        coverage_along(single(), Disc(60.0), np.empty((0, 2)), STRIP)
