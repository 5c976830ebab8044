"""A route that every run drives, and the starts that go with it: from two tags, or off the true pose."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rfiddesign.catalog import antenna
from rfiddesign.design import Design
from rfiddesign.estimators.acquisition import start_by_two_tags
from rfiddesign.estimators.ekf import Ekf
from rfiddesign.floor import build_tag_map, rectangle_floor
from rfiddesign.geometry import make_pattern, single
from rfiddesign.models.motion import MecanumMotion, OmnidirectionalMotion
from rfiddesign.models.robot import Robot
from rfiddesign.simulation.fixed_route import FixedRoute, circle
from rfiddesign.simulation.monte_carlo import Job, Simulator
from rfiddesign.simulation.record import record
from rfiddesign.simulation.run import key_of, score, true_poses
from rfiddesign.simulation.scenario import Scenario, World

CORNERS = ((1000.0, 1000.0), (3000.0, 1000.0), (3000.0, 2500.0), (3000.0, 2500.0), (2000.0, 1500.0))
LENGTH_MM = 2000.0 + 1500.0 + 1000.0 * math.sqrt(2.0)
# A quarter turn left, then three eighths more.
TURNED_RAD = math.pi / 2 + 3 * math.pi / 4
DT = 0.05


def poses_of(route, run=0, n_steps=None, dt_s=DT):
    """Poses of a run, to the end of the route unless told otherwise."""
    n_steps = math.ceil(route.duration_s / dt_s) if n_steps is None else n_steps
    return route.poses(key_of(1, run), dt_s, n_steps)


def distance_to_polyline(points, corners):
    """Distance (n,) of points (n, 2) to the nearest leg."""
    found = []
    for begin, end in zip(np.array(corners[:-1]), np.array(corners[1:]), strict=True):
        leg = end - begin
        along = np.clip((points - begin) @ leg / max(leg @ leg, 1e-12), 0.0, 1.0)
        found.append(np.hypot(*(points - begin - along[:, None] * leg).T))
    return np.min(found, axis=0)


routes = st.builds(
    FixedRoute,
    waypoints_mm=st.lists(st.tuples(*[st.integers(-5000, 5000).map(float)] * 2), min_size=2, max_size=6).map(tuple),
    speed_mm_per_s=st.floats(20.0, 2000.0),
    heading_rad=st.none() | st.floats(-7.0, 7.0),
    turn_rate_rad_per_s=st.floats(0.1, 10.0),
    stay_s=st.sampled_from([0.0, 1e-9, 0.3, 2.0]),
)


@given(routes, st.sampled_from([0.01, 0.05, 0.3]))
def test_the_robot_keeps_to_the_legs_and_to_its_speeds_and_ends_in_time(route, dt_s):
    n_steps = min(math.ceil(route.duration_s / dt_s) + 2, 3000)
    poses = poses_of(route, n_steps=n_steps, dt_s=dt_s)
    assert poses.shape == (n_steps + 1, 3)
    assert distance_to_polyline(poses[:, :2], route.waypoints_mm).max() < 1e-6
    moved, turned = np.hypot(*np.diff(poses[:, :2], axis=0).T), np.abs(np.diff(poses[:, 2]))
    assert moved.max() <= route.speed_mm_per_s * dt_s * (1 + 1e-9)
    if route.heading_rad is None:
        assert turned.max() <= route.turn_rate_rad_per_s * dt_s * (1 + 1e-9)
    else:
        assert np.all(poses[:, 2] == route.heading_rad)
    np.testing.assert_array_equal(poses[0, :2], route.waypoints_mm[0])
    if n_steps < 3000:
        np.testing.assert_allclose(poses[-1, :2], route.waypoints_mm[-1], atol=1e-6)


@pytest.mark.parametrize("stay_s", [0.0, 0.7])
@pytest.mark.parametrize("heading_rad", [None, 0.4])
def test_duration_is_when_the_drive_ends(stay_s, heading_rad):
    """Ways, turns in place and stays at all five corners, the one named twice included."""
    route = FixedRoute(CORNERS, 200.0, heading_rad, 0.5, stay_s)
    turns_s = 0.0 if heading_rad is not None else TURNED_RAD / 0.5
    assert route.duration_s == pytest.approx(LENGTH_MM / 200.0 + turns_s + 5 * stay_s)
    poses = poses_of(route, n_steps=20_000, dt_s=0.01)
    moves = np.abs(np.diff(poses, axis=0)).max(axis=1) > 1e-9
    last_move_s = 0.01 * (np.flatnonzero(moves)[-1] + 1)
    assert last_move_s == pytest.approx(route.duration_s - stay_s, abs=0.02)
    np.testing.assert_allclose(poses[-1, :2], CORNERS[-1])


@pytest.mark.parametrize("stay_s", [0.0, 0.5])
def test_a_robot_that_faces_where_it_drives_turns_in_place_at_corners_the_short_way_round(stay_s):
    square = ((0.0, 0.0), (500.0, 0.0), (500.0, 500.0), (0.0, 500.0), (0.0, 0.0), (500.0, 0.0))
    poses = poses_of(FixedRoute(square, 100.0, None, 1.0, stay_s))
    steps = np.diff(poses, axis=0)
    moved = np.hypot(*steps[:, :2].T)
    is_driving = moved > 0.99 * 100.0 * DT
    ways = np.arctan2(steps[is_driving, 1], steps[is_driving, 0])
    off = (poses[:-1][is_driving, 2] - ways + math.pi) % (2 * math.pi) - math.pi
    assert np.abs(off).max() < 1e-9
    # Four quarter turns to the left, unwrapped.
    assert poses[0, 2] == 0.0
    assert poses[-1, 2] == pytest.approx(2 * math.pi)
    assert np.all(steps[:, 2] >= 0)


@pytest.mark.parametrize("heading_rad", [None, 1.0])
def test_stays_last_their_time_at_each_corner(heading_rad):
    route = FixedRoute(CORNERS, 200.0, heading_rad, 2.0, 1.5)
    poses = poses_of(route, dt_s=0.01)
    stands = np.all(np.abs(np.diff(poses, axis=0)) < 1e-9, axis=1)
    borders = np.flatnonzero(np.diff(np.concatenate([[0], stands.astype(int), [0]])))
    begins, ends = borders[::2], borders[1::2]
    places = [poses[begin, :2] for begin in begins]
    np.testing.assert_allclose(places, [CORNERS[0], CORNERS[1], CORNERS[2], CORNERS[4]], atol=1e-6)
    # The third corner is named twice.
    np.testing.assert_allclose(0.01 * (ends - begins), [1.5, 1.5, 3.0, 1.5], atol=0.021)


def test_stays_change_neither_ways_nor_turns():
    """With them taken out, the drive is the one without."""
    plain, with_stays = (poses_of(FixedRoute(CORNERS, 200.0, None, 0.5, stay_s)) for stay_s in (0.0, 2.0))
    stands = np.all(np.abs(np.diff(with_stays, axis=0)) < 1e-9, axis=1)
    driven = with_stays[1:][~stands]
    distance = np.min(np.abs(driven[:, None] - plain).sum(axis=2), axis=1)
    # Steps of 10 mm or 0.025 rad, cut elsewhere.
    assert distance.max() < 2 * 200.0 * DT


def test_the_shift_is_uniform_and_the_same_for_all_of_a_run():
    route = FixedRoute(CORNERS, 200.0, None, 1.0, shift_mm=300.0)
    plain = poses_of(FixedRoute(CORNERS, 200.0, None, 1.0))
    shifts = []
    for run in range(1000):
        off = poses_of(route, run, n_steps=20) - plain[:21]
        assert np.ptp(off, axis=0).max() < 1e-9
        shifts.append(off[0])
    shifts = np.array(shifts)
    assert np.all(shifts[:, 2] == 0)
    assert np.abs(shifts[:, :2]).max() <= 150.0
    for axis in (0, 1):
        # Kolmogorov's distance exceeds 1.95 / sqrt(n) once in a thousand.
        share = np.sort(shifts[:, axis]) / 300.0 + 0.5
        assert np.abs(share - (np.arange(1000) + 0.5) / 1000).max() < 1.95 / math.sqrt(1000)
    assert abs(np.corrcoef(shifts[:, 0], shifts[:, 1])[0, 1]) < 0.1


@pytest.mark.parametrize("stay_s", [0.0, 1.0])
def test_turning_keeps_distances_and_takes_the_heading_along(stay_s):
    plain = poses_of(FixedRoute(CORNERS, 200.0, 0.3, 1.0, stay_s))
    middle = (np.min(CORNERS, axis=0) + np.max(CORNERS, axis=0)) / 2
    turns = []
    for run in range(300):
        route = FixedRoute(CORNERS, 200.0, 0.3, 1.0, stay_s, is_turned=True)
        poses = poses_of(route, run)
        turn = poses[0, 2] - 0.3
        turns.append(turn)
        c, s = math.cos(turn), math.sin(turn)
        expected = (plain[:, :2] - middle) @ np.array([[c, s], [-s, c]]) + middle
        np.testing.assert_allclose(poses[:, :2], expected, atol=1e-6)
        assert np.all(poses[:, 2] == poses[0, 2])
    share = np.sort(turns) / (2 * math.pi)
    assert 0 <= share[0] < share[-1] < 1
    assert np.abs(share - (np.arange(300) + 0.5) / 300).max() < 1.95 / math.sqrt(300)


@pytest.mark.parametrize("stay_s", [0.0, 0.4])
def test_the_same_key_gives_the_same_poses_and_another_key_others(stay_s):
    route = FixedRoute(CORNERS, stay_s=stay_s, shift_mm=100.0, is_turned=True)
    np.testing.assert_array_equal(poses_of(route, 3), poses_of(route, 3))
    assert np.abs(poses_of(route, 3) - poses_of(route, 4)).max() > 1.0


def test_a_circle_has_its_radius_its_length_and_its_begin():
    corners = np.array(circle((2000.0, 3000.0), 800.0, 1.5, math.radians(90)))
    np.testing.assert_allclose(np.hypot(*(corners - (2000.0, 3000.0)).T), 800.0)
    np.testing.assert_allclose(corners[0], (2000.0, 3800.0), atol=1e-9)
    np.testing.assert_allclose(corners[-1], (2000.0, 2200.0), atol=1e-9)
    # Anticlockwise.
    assert corners[1, 0] < 2000.0
    length = np.hypot(*np.diff(corners, axis=0).T).sum()
    assert length == pytest.approx(1.5 * 2 * math.pi * 800.0, rel=1e-4)
    poses = poses_of(FixedRoute(circle((2000.0, 3000.0), 800.0), 100.0, 0.0))
    np.testing.assert_allclose(np.hypot(*(poses[:, :2] - (2000.0, 3000.0)).T), 800.0, rtol=1e-4)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: FixedRoute(((0.0, 0.0),)), ("waypoints_mm", "1", "2", "100,000")),
        (lambda: FixedRoute(((0.0, 0.0), (1.0,))), ("waypoints_mm", "(1.0,)", "two numbers")),
        (lambda: FixedRoute(((0.0, 0.0), (1.0, math.nan))), ("waypoints_mm", "nan")),
        (lambda: FixedRoute(((0.0, 0.0), (1.0, 1e12))), ("waypoints_mm", "1000000000000.0")),
        (lambda: FixedRoute(CORNERS, 0.0), ("speed_mm_per_s", "0.0", "above 0", "10000")),
        (lambda: FixedRoute(CORNERS, heading_rad=math.inf), ("heading_rad", "inf", "1000")),
        (lambda: FixedRoute(CORNERS, turn_rate_rad_per_s=0.0), ("turn_rate_rad_per_s", "0.0", "0.001")),
        (lambda: FixedRoute(CORNERS, stay_s=-1.0), ("stay_s", "-1.0", "0")),
        (lambda: FixedRoute(CORNERS, shift_mm=1e6), ("shift_mm", "1000000.0", "100000")),
        (lambda: circle((0.0, 0.0), 0.0), ("radius_mm", "0.0", "1")),
        (lambda: circle((0.0, 0.0), 100.0, 0.0), ("laps", "0.0", "0.01")),
    ],
)
def test_a_bad_argument_is_named_with_its_value_and_bound(make, words):
    with pytest.raises(ValueError, match=words[0]) as error:
        make()
    assert all(word in str(error.value) for word in words)
    assert "\n" not in str(error.value)


# Starts

FLOOR = rectangle_floor(5000.0, 4000.0, 300.0)
ROUTE = FixedRoute(((1010.0, 1010.0), (1010.0, 3000.0)), 200.0, math.pi / 2, shift_mm=200.0)
DESIGN = Design(single(), antenna("navifloor"), make_pattern("square", pitch_mm=250.0))
SCENARIO = Scenario(
    FLOOR, ROUTE, World(MecanumMotion(4.0, 4.0, 0.004, 0.0)), Ekf(kind="constrained", motion=MecanumMotion()),
    "two_tags", duration_s=9.0,
)  # fmt: skip
TAGS = build_tag_map(DESIGN.pattern.lay(FLOOR.drivable))


def trace_of(scenario, run):
    with Simulator(scenario, 5, 1) as simulator:
        return simulator.trace(Job(DESIGN, run))


@pytest.mark.parametrize("run", range(4))
def test_from_two_tags_a_trace_begins_with_the_step_that_brings_the_second(run):
    trace = trace_of(SCENARIO, run)
    poses, key = true_poses(SCENARIO, 5, run), key_of(5, run)
    recording = record(DESIGN, TAGS, poses, DT, SCENARIO.world, key)
    step, start = start_by_two_tags(recording, Robot.of(DESIGN, SCENARIO.world.reads))
    assert trace.n_before == step + 1 > 5
    read_until = {tuple(tag) for tag in recording.read_tag_mm[: recording.read_start[step]]}
    read_then = {
        tuple(tag) for tag in recording.read_tag_mm[recording.read_start[step] : recording.read_start[step + 1]]
    }
    assert read_then - read_until
    np.testing.assert_array_equal(trace.true_poses, poses[step + 1 :])
    np.testing.assert_allclose(trace.poses[0], start.pose)
    # Of what was before nothing counts.
    n = SCENARIO.n_steps - trace.n_before
    assert trace.position_error_mm.shape == trace.heading_error_rad.shape == (n,)
    off = trace.poses[1:] - trace.true_poses[1:]
    np.testing.assert_allclose(trace.position_error_mm, np.hypot(off[:, 0], off[:, 1]))
    metrics = score(trace, SCENARIO)
    assert metrics.is_complete
    assert metrics.n_steps == n
    assert metrics.position_mean_mm == pytest.approx(trace.position_error_mm.mean())


def test_a_drive_that_meets_no_two_tags_is_scored_from_its_first_step_told_nothing():
    aside = replace(SCENARIO, routes=FixedRoute(((1125.0, 1010.0), (1125.0, 3000.0)), 200.0, math.pi / 2))
    trace = trace_of(replace(aside, estimator=SCENARIO.estimator), 0)
    assert trace.n_before == 0
    assert trace.position_error_mm.shape == (SCENARIO.n_steps,)
    # The middle of where it may be.
    assert np.allclose(trace.poses[0, :2], (2500.0, 2000.0))
    assert score(trace, aside).is_complete


def test_an_offset_shifts_a_known_start():
    offset = (165.0, -135.0, 1.5)
    quiet = OmnidirectionalMotion(0.0, 0.0, 0.0)
    scenario = replace(
        SCENARIO, start="known", start_offset=offset, world=World(quiet), routes=replace(ROUTE, shift_mm=0.0),
        estimator=Ekf(kind="constrained", motion=quiet),
    )  # fmt: skip
    trace = trace_of(scenario, 0)
    np.testing.assert_allclose(trace.poses[0] - trace.true_poses[0], offset)
    assert trace_of(replace(scenario, start_offset=(0.0, 0.0, 0.0)), 0).position_error_mm[0] == pytest.approx(
        0, abs=1e-6
    )


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"start": "three_tags"}, ("start", "'three_tags'", "two_tags")),
        ({"start_offset": (0.0, 2e5, 0.0)}, ("start_offset, y", "200000.0")),
        ({"start_offset": (0.0, 0.0, math.nan)}, ("start_offset, heading", "nan")),
    ],
)
def test_a_bad_start_is_named_with_its_value(changes, words):
    with pytest.raises(ValueError, match="start") as error:
        replace(SCENARIO, **changes)
    assert all(word in str(error.value) for word in words)
