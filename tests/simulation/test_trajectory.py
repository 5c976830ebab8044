"""From waypoints to poses."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rfiddesign.geometry import wrap_angle
from rfiddesign.simulation.trajectory import drive, route_length_mm

CORNER = np.array([[0.0, 0.0], [1000.0, 0.0], [1000.0, 500.0]])


def test_a_robot_that_holds_its_heading_drives_at_constant_speed_and_stays_at_the_end():
    poses = drive(CORNER, 100.0, 0.3, 1.0, 2.5, 8)
    x, y = (0, 250, 500, 750, 1000, 1000, 1000, 1000, 1000), (0, 0, 0, 0, 0, 250, 500, 500, 500)
    assert poses == pytest.approx(np.column_stack([x, y, np.full(9, 0.3)]))


def test_a_robot_that_faces_its_way_turns_in_place_at_corners():
    quarter = math.pi / 2
    # Ten steps to the corner, ten of turning there, five to the end.
    poses = drive(CORNER, 100.0, None, quarter / 10, 1.0, 30)
    assert poses[[0, 5, 10, 15, 20, 22, 25, 30]] == pytest.approx(
        np.array(
            [
                (0, 0, 0), (500, 0, 0), (1000, 0, 0), (1000, 0, quarter / 2), (1000, 0, quarter), (1000, 200, quarter),
                (1000, 500, quarter), (1000, 500, quarter),
            ],
            float,
        )
    )  # fmt: skip


def test_turns_take_the_short_way():
    there_and_left = np.array([[0.0, 0.0], [-100.0, 1.0], [-200.0, -1.0]])
    poses = drive(there_and_left, 100.0, None, 1.0, 0.01, 300)
    assert np.ptp(poses[:, 2]) < 0.04


def test_a_waypoint_twice_is_one_waypoint():
    doubled = np.repeat(CORNER, 2, axis=0)
    for heading in (None, 1.0):
        assert np.array_equal(drive(doubled, 90.0, heading, 1.0, 0.3, 99), drive(CORNER, 90.0, heading, 1.0, 0.3, 99))


@settings(max_examples=100, deadline=None, derandomize=True)
@given(seed=st.integers(0, 2**32 - 1), speed=st.floats(10, 500), rate=st.floats(0.1, 3), is_constant=st.booleans())
def test_no_step_is_faster_than_the_robot(seed, speed, rate, is_constant):
    rng = np.random.Generator(np.random.PCG64(seed))
    waypoints, dt = np.cumsum(rng.normal(0, 700, (8, 2)), axis=0), 0.05
    poses = drive(waypoints, speed, 0.7 if is_constant else None, rate, dt, 1999)
    moved = np.hypot(*np.diff(poses[:, :2], axis=0).T)
    assert moved.max() <= speed * dt * (1 + 1e-9)
    assert np.abs(np.diff(poses[:, 2])).max() <= rate * dt * (1 + 1e-9)
    assert np.array_equal(poses[0, :2], waypoints[0])
    if not is_constant:
        # It drives or turns, and faces where it drives.
        is_straight = moved > 0.999 * speed * dt
        course = np.arctan2(*np.diff(poses[:, :2], axis=0)[is_straight].T[::-1])
        assert np.abs(wrap_angle(course - poses[:-1, 2][is_straight])).max(initial=0) < 0.1


@settings(max_examples=50, deadline=None, derandomize=True)
@given(seed=st.integers(0, 2**32 - 1), speed=st.floats(10, 500), rate=st.floats(0.1, 3), is_constant=st.booleans())
def test_poses_are_those_between_the_corners_instants(seed, speed, rate, is_constant):
    """The same in plain numpy: corners with their instants, and straight lines between them."""
    rng = np.random.Generator(np.random.PCG64(seed))
    corners = np.cumsum(rng.normal(0, 700, (6, 2)), axis=0)
    legs = np.diff(corners, axis=0)
    lasting = np.hypot(*legs.T) / speed
    headings = np.full(5, 0.7) if is_constant else np.unwrap(np.arctan2(legs[:, 1], legs[:, 0]))
    turning = np.concatenate([[0.0], np.abs(np.diff(headings)) / rate])
    instants = np.cumsum(np.column_stack([turning, lasting]).ravel())
    knots = np.column_stack([np.repeat(corners, 2, axis=0)[1:-1], np.repeat(headings, 2)])
    times = np.arange(1500) * 0.05
    expected = np.column_stack([np.interp(times, instants, column) for column in knots.T])
    poses = drive(corners, speed, 0.7 if is_constant else None, rate, 0.05, 1499)
    assert np.abs(poses - expected).max() < 1e-6


def test_a_route_is_never_too_short_for_its_run():
    for speed, duration in ((100.0, 60.0), (350.0, 0.1), (1 / 3, 3.3)):
        assert route_length_mm(speed, duration) / speed >= duration
