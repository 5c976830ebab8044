"""Robots on a network of routes keep to them, within the deviations that were declared."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from rfiddesign.floor import bundled_routes, floor_from_polygon
from rfiddesign.simulation import NetworkDrive
from rfiddesign.simulation._network_drive_kernels import poses_between
from rfiddesign.simulation.network_drive import cut_before
from rfiddesign.simulation.run import key_of, true_poses
from rfiddesign.simulation.scenario import Routes, Scenario

DT = 0.05
PILLAR = shapely.box(3_000, 2_000, 6_000, 4_000)
FLOOR = floor_from_polygon(shapely.box(0, 0, 9_000, 6_000), [PILLAR], 300.0)
NETWORK = bundled_routes(FLOOR, 5, 300.0, seed=2)
LINES = shapely.MultiLineString([edge.tolist() for edge in NETWORK.edges_mm])

drives = st.builds(
    NetworkDrive,
    network=st.just(NETWORK),
    speeds_mm_per_s=st.sampled_from([(100.0,), (50.0, 400.0), (1000.0,)]),
    headings=st.sampled_from([("along",), ("constant",), ("along", "constant")]),
    turn_rate_rad_per_s=st.sampled_from([0.3, 1.0, 5.0]),
    lateral_mm=st.sampled_from([0.0, 20.0, 50.0]),
    yaw_rad=st.sampled_from([0.0, 0.05, 0.2]),
)


def directions_of(lines):
    """Directions of all legs (n,) [rad]."""
    legs = np.concatenate([np.diff(shapely.get_coordinates(line), axis=0) for line in lines.geoms])
    return np.arctan2(legs[:, 1], legs[:, 0])


@settings(max_examples=60, deadline=None)
@given(drives, st.integers(0, 10_000))
def test_a_robot_keeps_to_the_routes_and_to_its_speeds(drive, run):
    poses = drive.poses(key_of(1, run), DT, 600)
    assert poses.shape == (601, 3)
    places = shapely.points(poses[:, :2])
    assert shapely.distance(LINES, places).max() <= drive.lateral_mm + 1e-6
    assert FLOOR.navigable.buffer(1e-6).covers(shapely.MultiPoint(poses[:, :2]))
    steps = np.diff(poses, axis=0)
    assert np.hypot(steps[:, 0], steps[:, 1]).max() <= max(drive.speeds_mm_per_s) * DT * (1 + 1e-9)
    assert np.abs(steps[:, 2]).max() <= drive.turn_rate_rad_per_s * DT * (1 + 1e-9)


@settings(max_examples=40, deadline=None)
@given(drives, st.integers(0, 10_000))
def test_headings_are_those_of_the_manner_within_the_deviation(drive, run):
    """Where a robot moves, it faces a leg of the network, or holds one heading through the run."""
    poses = drive.poses(key_of(1, run), DT, 600)
    if drive.headings == ("constant",):
        assert np.ptp(poses[:, 2]) <= 2 * drive.yaw_rad + 1e-9
    if drive.headings == ("along",):
        steps = np.diff(poses, axis=0)
        speed = np.hypot(steps[:, 0], steps[:, 1]) / DT
        # Turns are slower than the drive or turn the heading: what is left are the legs.
        is_leg = (np.abs(steps[:, 2]) < 1e-9) & (speed > 0.999 * min(drive.speeds_mm_per_s))
        apart = poses[:-1][is_leg, 2][:, None] - directions_of(LINES)
        # Legs are driven in both directions.
        off = np.abs((apart + math.pi / 2) % math.pi - math.pi / 2).min(axis=1)
        assert is_leg.any()
        assert off.max() <= drive.yaw_rad + 1e-9


def test_a_run_is_a_function_of_seed_and_number_alone():
    drive = NetworkDrive(NETWORK)
    poses = [drive.poses(key_of(7, run), DT, 400) for run in range(20)]
    again = [drive.poses(key_of(7, run), DT, 400) for run in reversed(range(20))]
    assert all(np.array_equal(one, other) for one, other in zip(poses, reversed(again), strict=True))
    # A longer run begins as the shorter one does.
    assert np.array_equal(drive.poses(key_of(7, 3), DT, 900)[:401], poses[3])
    assert len({pose[0].tobytes() for pose in poses}) == 20


def test_runs_begin_and_lead_all_over_the_network():
    drive = NetworkDrive(NETWORK, lateral_mm=0.0)
    poses = [drive.poses(key_of(3, run), 0.5, 240)[:, :2] for run in range(150)]
    pieces = shapely.get_parts(shapely.segmentize(LINES, 500.0))
    nodes = shapely.points(np.concatenate([shapely.get_coordinates(piece) for piece in pieces]))
    driven = shapely.MultiPoint(np.concatenate(poses))
    used = shapely.union_all([shapely.LineString(NETWORK.path(a, b)) for a in range(5) for b in range(a)])
    on_ways = nodes[shapely.distance(used, nodes) < 1.0]
    assert shapely.distance(driven, on_ways).max() < 200.0
    starts = np.array([run[0] for run in poses])
    assert (np.hypot(*(starts[:, None] - NETWORK.stations_mm).T).min(axis=0) > 500.0).mean() > 0.5


def test_deviations_are_spread_up_to_their_limits():
    drive = NetworkDrive(NETWORK, lateral_mm=50.0, yaw_rad=0.1)
    off = np.array(
        [shapely.distance(LINES, shapely.Point(drive.poses(key_of(9, run), DT, 1)[0, :2])) for run in range(200)]
    )
    # Uniform from 0 to 50: mean 25, standard error 1.
    assert off.max() > 45.0
    assert off.mean() == pytest.approx(25.0, abs=4.0)


def test_a_scenario_drives_the_network():
    scenario = Scenario(FLOOR, routes=NetworkDrive(NETWORK), duration_s=5.0)
    assert np.array_equal(true_poses(scenario, 4, 2), NetworkDrive(NETWORK).poses(key_of(4, 2), 0.05, 100))
    assert not np.array_equal(
        true_poses(scenario, 4, 2), true_poses(Scenario(FLOOR, routes=Routes(), duration_s=5.0), 4, 2)
    )


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.tuples(*[st.floats(-3.0, 3.0)] * 5, st.floats(0.0, 2.0)), min_size=1, max_size=8),
    st.none() | st.floats(-3.0, 3.0),
)
def test_poses_between_milestones_are_those_of_numpy(rows, held):
    milestones = np.array([(sum(row[5] for row in rows[: i + 1]), *row[:5]) for i, row in enumerate(rows)])
    poses = np.empty((40, 3))
    poses_between(milestones, math.nan if held is None else held, 0.21, poses)
    times = 0.21 * np.arange(40)
    if np.min(np.abs(times[:, None] - milestones[:, 0])) < 1e-9:
        return
    begun = times >= milestones[0, 0]
    # Before the first milestone the motion between the first two is drawn out; drives begin at time 0.
    x, y, direction, lateral, yaw = (np.interp(times, milestones[:, 0], column) for column in milestones[:, 1:].T)
    expected = np.column_stack([x - lateral * np.sin(direction), y + lateral * np.cos(direction), yaw])
    expected[:, 2] += direction if held is None else held
    assert poses[begun] == pytest.approx(expected[begun], abs=1e-9)


@given(st.floats(0.0, 1.0, exclude_max=True))
def test_a_line_is_cut_by_its_length(share):
    line = np.array([(0.0, 0.0), (3.0, 0.0), (3.0, 0.0), (3.0, 4.0)])
    left = cut_before(line, share)
    assert np.hypot(*np.diff(left, axis=0).T).sum() == pytest.approx(7.0 * (1.0 - share))
    assert np.array_equal(left[-1], line[-1])
    assert shapely.LineString(line).distance(shapely.Point(left[0])) < 1e-9


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"speeds_mm_per_s": ()}, "speeds_mm_per_s is empty"),
        ({"speeds_mm_per_s": (0.0,)}, "speeds_mm_per_s is 0.0"),
        ({"headings": ("sideways",)}, "headings are"),
        ({"turn_rate_rad_per_s": 0.0}, "turn_rate_rad_per_s is 0.0"),
        ({"lateral_mm": -1.0}, "lateral_mm is -1.0"),
        ({"yaw_rad": 4.0}, "yaw_rad is 4.0"),
    ],
)
def test_a_drive_out_of_bounds_is_refused(wrong, words):
    with pytest.raises(ValueError, match=words):
        NetworkDrive(NETWORK, **wrong)
