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
    poses = drive(CORNER, 100.0, 0.3, 1.0, np.array([0.0, 5.0, 10.0, 12.0, 15.0, 100.0]))
    expected = [(0, 0), (500, 0), (1000, 0), (1000, 200), (1000, 500), (1000, 500)]
    assert poses[:, :2] == pytest.approx(np.array(expected, float))
    assert poses[:, 2] == pytest.approx(np.full(6, 0.3))


def test_a_robot_that_faces_its_way_turns_in_place_at_corners():
    quarter = math.pi / 2
    poses = drive(CORNER, 100.0, None, 0.5, np.array([0.0, 10.0, 10.0 + quarter, 10.0 + 2 * quarter, 15 + math.pi]))
    assert poses[:, :2] == pytest.approx(np.array([(0, 0), (1000, 0), (1000, 0), (1000, 0), (1000, 500)], float))
    assert poses[:, 2] == pytest.approx(np.array([0, 0, quarter / 2, quarter, quarter]))


def test_turns_take_the_short_way():
    there_and_left = np.array([[0.0, 0.0], [-100.0, 1.0], [-200.0, -1.0]])
    poses = drive(there_and_left, 100.0, None, 1.0, np.linspace(0, 3, 301))
    assert np.ptp(poses[:, 2]) < 0.04


def test_a_waypoint_twice_is_one_waypoint():
    doubled = np.repeat(CORNER, 2, axis=0)
    times = np.linspace(0, 30, 100)
    for heading in (None, 1.0):
        assert np.array_equal(drive(doubled, 90.0, heading, 1.0, times), drive(CORNER, 90.0, heading, 1.0, times))


@settings(max_examples=100, deadline=None, derandomize=True)
@given(seed=st.integers(0, 2**32 - 1), speed=st.floats(10, 500), rate=st.floats(0.1, 3), is_constant=st.booleans())
def test_no_step_is_faster_than_the_robot(seed, speed, rate, is_constant):
    rng = np.random.Generator(np.random.PCG64(seed))
    waypoints, dt = np.cumsum(rng.normal(0, 700, (8, 2)), axis=0), 0.05
    poses = drive(waypoints, speed, 0.7 if is_constant else None, rate, np.arange(2000) * dt)
    moved = np.hypot(*np.diff(poses[:, :2], axis=0).T)
    assert moved.max() <= speed * dt * (1 + 1e-9)
    assert np.abs(np.diff(poses[:, 2])).max() <= rate * dt * (1 + 1e-9)
    assert np.array_equal(poses[0, :2], waypoints[0])
    if not is_constant:
        # It drives or turns, and faces where it drives.
        is_straight = moved > 0.999 * speed * dt
        course = np.arctan2(*np.diff(poses[:, :2], axis=0)[is_straight].T[::-1])
        assert np.abs(wrap_angle(course - poses[:-1, 2][is_straight])).max(initial=0) < 0.1


def test_a_route_is_never_too_short_for_its_run():
    for speed, duration in ((100.0, 60.0), (350.0, 0.1), (1 / 3, 3.3)):
        assert route_length_mm(speed, duration) / speed >= duration
