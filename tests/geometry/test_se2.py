import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from rfiddesign.geometry import se2

metres = st.floats(-5e4, 5e4)
poses = st.tuples(metres, metres, st.floats(-10, 10)).map(np.array)
points = st.tuples(metres, metres).map(np.array)


def as_matrix(pose):
    cosine, sine = math.cos(pose[2]), math.sin(pose[2])
    return np.array([[cosine, -sine, pose[0]], [sine, cosine, pose[1]], [0, 0, 1]])


def same_pose(a, b):
    # Comparing headings as unit vectors: pi and -pi are the same heading.
    return np.allclose(as_matrix(a), as_matrix(b), rtol=0, atol=1e-9 * 1e5)


@given(poses, poses)
def test_composing_poses_multiplies_their_matrices(a, b):
    assert same_pose(se2.compose(a, b), pose_of(as_matrix(a) @ as_matrix(b)))


@given(poses)
def test_a_pose_and_its_inverse_cancel(a):
    assert same_pose(se2.compose(a, se2.inverse(a)), np.zeros(3))
    assert same_pose(se2.compose(se2.inverse(a), a), np.zeros(3))


@given(poses, poses)
def test_the_increment_between_two_poses_leads_from_one_to_the_other(a, b):
    assert same_pose(se2.compose(a, se2.between(a, b)), b)
    assert same_pose(se2.between(a, b), se2.compose(se2.inverse(a), b))


@given(poses, points)
def test_a_point_survives_the_way_into_the_robots_frame_and_back(pose, point):
    np.testing.assert_allclose(se2.transform_points(pose, se2.to_local(pose, point)), point, rtol=0, atol=1e-9 * 1e5)


def test_a_reader_ahead_of_a_robot_that_looks_left_is_left_of_it_in_the_world():
    robot = (1000.0, 2000.0, math.pi / 2)
    np.testing.assert_allclose(se2.transform_points(robot, (150.0, 0.0)), (1000.0, 2150.0), atol=1e-9)
    np.testing.assert_allclose(se2.to_local(robot, (1000.0, 2150.0)), (150.0, 0.0), atol=1e-9)


def test_many_robots_times_many_readers_broadcast():
    robots = np.random.Generator(np.random.PCG64(1)).normal(size=(5, 1, 3))
    readers = np.random.Generator(np.random.PCG64(2)).normal(size=(4, 3))
    together = se2.compose(robots, readers)
    assert together.shape == (5, 4, 3)
    np.testing.assert_array_equal(together[3, 2], se2.compose(robots[3, 0], readers[2]))
    assert se2.transform_points(robots, readers[:, :2]).shape == (5, 4, 2)
    assert se2.between(robots, readers).shape == (5, 4, 3)


@given(st.floats(-1e4, 1e4))
def test_a_wrapped_angle_is_the_same_direction_in_the_half_open_range(theta):
    wrapped = float(se2.wrap_angle(theta))
    assert -math.pi <= wrapped < math.pi
    assert math.isclose(math.cos(wrapped - theta), 1, abs_tol=1e-12)


def test_angles_at_the_ends_of_the_range():
    assert se2.wrap_angle(math.pi) == -math.pi
    assert se2.wrap_angle(-math.pi) == -math.pi
    below, above = np.nextafter(-math.pi, -4), np.nextafter(math.pi, 0)
    assert -math.pi <= se2.wrap_angle(below) < math.pi
    assert se2.wrap_angle(above) == above
    assert se2.wrap_angle(1e-300) == 1e-300


def pose_of(matrix):
    return np.array([matrix[0, 2], matrix[1, 2], math.atan2(matrix[1, 0], matrix[0, 0])])
