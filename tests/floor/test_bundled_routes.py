"""Stations become a network of routes that joins them all, stays on the floor and is shorter for being bundled."""

from dataclasses import replace
from itertools import combinations, pairwise
from pathlib import Path

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from rfiddesign.floor import (
    BundleRules,
    NetworkRules,
    bundled_routes,
    floor_from_map,
    floor_from_polygon,
    length_of,
    read_ros_map,
    rectangle_floor,
)
from rfiddesign.floor.bundled_paths import bundled_links
from rfiddesign.floor.bundled_routes import straightened
from rfiddesign.floor.chains import chain_mm, chains_of, spared
from rfiddesign.floor.navigation_grid import navigation_grid
from rfiddesign.floor.stations import spread_stations

WILLOW = Path(__file__).parents[2] / "studies" / "willow-office" / "floor" / "map.yaml"
HALF_WIDTH = 300.0
COARSE = NetworkRules(cell_mm=200.0)


@pytest.fixture(scope="module")
def willow_floor():
    return floor_from_map(read_ros_map(WILLOW), 320.0)


@pytest.fixture(scope="module")
def willow_network(willow_floor):
    return bundled_routes(willow_floor, 20, 320.0, seed=1)


def lines_of(network):
    return shapely.MultiLineString([edge.tolist() for edge in network.edges_mm])


@st.composite
def floors(draw):
    """Halls of up to 12 x 9 m with some pillars."""
    width, height = draw(st.integers(4, 12)) * 1e3, draw(st.integers(3, 9)) * 1e3
    corners = st.tuples(st.integers(0, 10), st.integers(0, 10), st.integers(1, 4), st.integers(1, 4))
    pillars = [
        shapely.box(x * width / 10, y * height / 10, x * width / 10 + 400 * w, y * height / 10 + 400 * h)
        for x, y, w, h in draw(st.lists(corners, max_size=5))
    ]
    outline = shapely.box(0, 0, width, height)
    if outline.difference(shapely.union_all(pillars)).buffer(-500).area < 3e6:
        return rectangle_floor(width, height, HALF_WIDTH)
    return floor_from_polygon(outline, pillars, HALF_WIDTH)


@settings(max_examples=25, deadline=None)
@given(floors(), st.integers(2, 8), st.integers(0, 99), st.sampled_from(["all", "spanning"]))
def test_every_station_is_joined_by_routes_that_keep_their_margin(floor, n, seed, joins):
    rules = NetworkRules(bundle=BundleRules(joins=joins))
    network = bundled_routes(floor, n, HALF_WIDTH, rules, seed)
    roomy = floor.navigable.buffer(-rules.margin_mm + 1e-6)
    assert roomy.covers(lines_of(network))
    assert floor.drivable.buffer(1e-6).covers(network.swath)
    for a, b in combinations(range(n), 2):
        way = network.path(a, b)
        assert np.array_equal(way[[0, -1]], network.stations_mm[[a, b]])
        assert np.array_equal(way, network.path(b, a)[::-1]) or length_of(way) == pytest.approx(
            length_of(network.path(b, a))
        )
        assert lines_of(network).buffer(1e-6).covers(shapely.LineString(way))


def test_a_path_is_the_shortest_of_the_network(willow_network):
    """Against Floyd and Warshall's algorithm, written out."""
    n = len(willow_network.nodes_mm)
    distance = np.where(np.eye(n, dtype=bool), 0.0, np.inf)
    for (a, b), edge in zip(willow_network.ends, willow_network.edges_mm, strict=True):
        distance[a, b] = distance[b, a] = min(distance[a, b], length_of(edge))
    for k in range(n):
        distance = np.minimum(distance, distance[:, k, None] + distance[k])
    for a in range(0, 20, 3):
        for b in range(20):
            if a != b:
                assert length_of(willow_network.path(a, b)) == pytest.approx(distance[a, b])


def test_the_office_is_joined_within_its_floor(willow_floor, willow_network):
    assert willow_network.n_stations == 20
    assert willow_floor.navigable.covers(lines_of(willow_network))
    # No piece twice: together the routes are as long as the set of their points.
    assert shapely.union_all(lines_of(willow_network)).length == pytest.approx(willow_network.length_mm, rel=1e-9)
    # A strip as wide as the robot along the routes, less where strips lie side by side.
    assert 0.85 * 640.0 * willow_network.length_mm < willow_network.swath.area < 640.0 * willow_network.length_mm + 1e7


def test_the_same_floor_gives_the_same_network(willow_floor):
    one, again, other = (bundled_routes(willow_floor, 8, 320.0, COARSE, seed) for seed in (1, 1, 2))
    assert again.nodes_mm.tobytes() == one.nodes_mm.tobytes()
    assert [edge.tobytes() for edge in again.edges_mm] == [edge.tobytes() for edge in one.edges_mm]
    assert not np.array_equal(other.stations_mm, one.stations_mm)


def test_bundling_shortens_the_routes_and_leaving_pairs_out_does_more(willow_floor):
    """Ways of 20 stations that do not know of each other use nearly twice the links."""
    grid = navigation_grid(willow_floor.navigable, 200.0)
    stations = spread_stations(grid, 20, 1, 300.0)

    def used_mm(**rules):
        return grid.link_mm[bundled_links(grid, stations, BundleRules(**rules))].sum()

    apart, bundled, spanning = used_mm(used_factor=1.0), used_mm(), used_mm(joins="spanning")
    assert spanning < 0.7 * bundled
    assert bundled < 0.6 * apart


def test_pieces_whose_way_round_is_hardly_longer_are_left_out(willow_floor):
    lengths = [
        bundled_routes(willow_floor, 20, 320.0, replace(COARSE, detour=detour), seed=1).length_mm
        for detour in (1.0, 1.25, 2.0)
    ]
    assert lengths[2] < lengths[1] < lengths[0]


def test_routes_keep_away_from_walls_where_there_is_room():
    floor = rectangle_floor(10_000.0, 6_000.0, HALF_WIDTH)
    corners = [(400.0, 400.0), (9_600.0, 400.0)]
    wall = floor.navigable.boundary

    def mean_clearance(**bundle):
        way = bundled_routes(floor, corners, HALF_WIDTH, NetworkRules(bundle=BundleRules(**bundle))).path(0, 1)
        places = shapely.line_interpolate_point(shapely.LineString(way), np.linspace(0, length_of(way), 200))
        return shapely.distance(wall, places).mean()

    assert mean_clearance(clearance_mm=0.0) < 150.0
    assert mean_clearance(clearance_mm=500.0) > 300.0


@settings(max_examples=20, deadline=None)
@given(floors(), st.integers(2, 12), st.integers(0, 99), st.sampled_from([0.0, 200.0]))
def test_stations_are_spread_as_farthest_points_are(floor, n, seed, clearance):
    """No two are closer, by way to drive, than any place with their room is to the nearest of them (Gonzalez)."""
    grid = navigation_grid(floor.navigable, 170.0)
    stations = spread_stations(grid, n, seed, clearance)
    graph = csr_array((grid.link_mm, tuple(grid.links.T)), shape=(len(grid.points_mm),) * 2)
    ways = dijkstra(graph, directed=False, indices=stations)
    has_room = grid.clearance_mm >= clearance
    assert len(set(stations.tolist())) == n
    if has_room.sum() >= n:
        assert has_room[stations].all()
        between = ways[:, stations] + np.diag(np.full(n, np.inf))
        assert between.min() >= ways.min(axis=0)[has_room].max() - 1e-6


def test_given_stations_stay_where_they_are_given_to_within_a_cell():
    floor = rectangle_floor(8_000.0, 5_000.0, HALF_WIDTH)
    given_mm = [(500.0, 600.0), (7_420.0, 4_444.0), (4_000.0, 2_500.0)]
    network = bundled_routes(floor, given_mm, HALF_WIDTH)
    assert np.hypot(*(network.stations_mm - given_mm).T).max() <= 100.0 / np.sqrt(2.0) + 1e-9


@pytest.mark.parametrize(
    ("stations", "words"),
    [
        ([(500.0, 500.0), (50.0, 500.0)], r"stations\[1\] is \(50, 500\) mm, .* a robot's centre can get to"),
        ([(500.0, 500.0), (510.0, 500.0)], r"stations\[1\] .* must be farther from stations\[0\]"),
        ([(500.0, 500.0)], "stations is 1, must be from 2 to 200"),
        (1, "stations is 1, must be from 2 to 200"),
        (201, "stations is 201"),
    ],
)
def test_stations_where_no_robot_gets_to_are_refused(stations, words):
    with pytest.raises(ValueError, match=words):
        bundled_routes(rectangle_floor(5_000.0, 5_000.0, HALF_WIDTH), stations, HALF_WIDTH)


def test_a_floor_without_room_and_a_grid_too_fine_are_refused():
    floor = rectangle_floor(1_000.0, 700.0, HALF_WIDTH)
    with pytest.raises(ValueError, match="margin_mm is 50"):
        bundled_routes(floor, 2, HALF_WIDTH)
    with pytest.raises(ValueError, match="no two neighbouring cells"):
        bundled_routes(floor, 2, HALF_WIDTH, NetworkRules(cell_mm=1_000.0, margin_mm=0.0))
    with pytest.raises(ValueError, match="at most 4,000,000"):
        bundled_routes(rectangle_floor(9e4, 9e4, HALF_WIDTH), 2, HALF_WIDTH, NetworkRules(cell_mm=10.0))
    with pytest.raises(ValueError, match="room for"):
        bundled_routes(floor, 30, HALF_WIDTH, NetworkRules(margin_mm=0.0))


@settings(max_examples=10, deadline=None)
@given(floors(), st.sampled_from([80.0, 100.0, 170.0]))
def test_a_grid_links_only_where_the_floor_covers_the_way(floor, cell_mm):
    """Each link is held against shapely; each pair of neighbours that is not linked is not covered."""
    grid = navigation_grid(floor.navigable, cell_mm)
    lines = shapely.linestrings(grid.points_mm[grid.links])
    assert floor.navigable.covers(lines).all()
    linked = {frozenset(pair) for pair in grid.links.tolist()}
    near = shapely.STRtree(shapely.points(grid.points_mm))
    pairs = near.query(shapely.points(grid.points_mm), predicate="dwithin", distance=1.5 * cell_mm).T
    unlinked = np.array([pair for pair in pairs.tolist() if pair[0] < pair[1] and frozenset(pair) not in linked])
    if len(unlinked):
        assert not shapely.covers(floor.navigable, shapely.linestrings(grid.points_mm[unlinked])).any()


def test_chains_hold_every_link_once_and_end_at_nodes(willow_floor):
    grid = navigation_grid(willow_floor.navigable, 200.0)
    stations = spread_stations(grid, 5, 3)
    rng = np.random.default_rng(5)
    links = np.unique(np.sort(grid.links[rng.permutation(len(grid.links))[: len(grid.links) // 2]], axis=1), axis=0)
    chains = chains_of(links, stations)
    pairs = sorted(tuple(sorted(pair)) for chain in chains for pair in pairwise(chain))
    degree = np.bincount(links.ravel(), minlength=len(grid.points_mm))
    is_node = degree != 2
    is_node[stations] = True
    for chain in chains:
        assert is_node[[chain[0], chain[-1]]].all()
        assert not is_node[list(chain[1:-1])].any()
    all_links = {tuple(pair) for pair in links.tolist()}
    assert set(pairs) <= all_links
    assert len(set(pairs)) == len(pairs)
    # What is in no chain are rings without any node: nothing leads there.
    left = all_links - set(pairs)
    assert not is_node[np.array(sorted(left), int).reshape(-1, 2)].any()


def test_of_two_ways_side_by_side_the_longer_is_spared():
    """A ring with two stations, one way round 1.3 m, the other 1.5 m, and a spur to a third station."""
    grid = navigation_grid(shapely.box(0, 0, 2_000, 2_000), 100.0)

    def cells(points):
        return grid.nearest(np.array(points, float)).tolist()

    low = cells([(50 + 100 * i, 50) for i in range(14)])
    high = cells([(50, 50), (50, 150)] + [(50 + 100 * i, 150) for i in range(1, 14)] + [(1350, 50)])
    spur = cells([(1350, 50 + 100 * i) for i in range(2, 9)])
    spur = [high[-2], *spur]
    links = np.array([pair for way in (low, high, spur) for pair in pairwise(way)])
    stations = np.array([low[0], low[-1], spur[-1]])
    left = spared(grid, links, stations, 1.25)
    assert sum(chain_mm(grid, chain) for chain in chains_of(left, stations)) == pytest.approx(1_300 + 100 + 700)
    assert {tuple(sorted(pair)) for pair in left.tolist()} < {tuple(sorted(pair)) for pair in links.tolist()}


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.tuples(st.integers(0, 40), st.integers(0, 40)), min_size=2, max_size=30, unique=True),
    st.floats(1.0, 20.0),
)
def test_a_straightened_line_stays_within_its_tolerance_and_region(points, tolerance):
    line = np.array(points, float)
    region = shapely.LineString(line).buffer(3.0)
    drawn = straightened(line, region, tolerance)
    assert np.array_equal(drawn[[0, -1]], line[[0, -1]])
    assert region.covers(shapely.LineString(drawn))
    assert shapely.distance(shapely.LineString(drawn), shapely.points(line)).max() <= tolerance + 1e-9
