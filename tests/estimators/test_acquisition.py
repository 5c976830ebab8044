"""The pose from two tags: exact where they lie under the antennas, and as uncertain as it says."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy import stats

from rfiddesign.estimators.acquisition import start_by_two_tags
from rfiddesign.geometry import Disc, Rectangle, compose, listed, transform_points, wrap_angle
from rfiddesign.models.recording import Recording
from rfiddesign.models.robot import Robot
from rfiddesign.models.shape import radius_of

LAYOUT = listed([(150.0, 0.0, 0.0), (0.0, -200.0, 0.8), (-90.0, 60.0, 2.0)])
RADIUS = 30.0
ROBOT = Robot(LAYOUT, Disc(RADIUS))
# Mean depth of a place on the entry border of a disc, in radii: chords at offsets that are all alike.
ENTRY_DEPTH = math.pi / 4
coordinates = st.floats(-500, 500)
angles = st.floats(-math.pi, math.pi)


def recording_of(poses, reads):
    """A drive along poses (n + 1, 3) without odometry errors; `reads` by step: (antenna, tag on the map)."""
    poses = np.asarray(poses, float)
    dx, dy = np.diff(poses[:, :2], axis=0).T
    c, s = np.cos(poses[:-1, 2]), np.sin(poses[:-1, 2])
    odometry = np.column_stack([c * dx + s * dy, c * dy - s * dx, np.diff(poses[:, 2])])
    antenna = [a for step in reads for a, _ in step]
    tags = [tag for step in reads for _, tag in step]
    return Recording(
        dt_s=0.05,
        true_poses=poses,
        odometry=odometry,
        read_start=np.cumsum([0, *map(len, reads)]),
        read_antenna=np.array(antenna, np.int32),
        read_tag=np.zeros(len(antenna), np.int32),
        read_tag_mm=np.array(tags, float).reshape(-1, 2),
        read_age_s=np.zeros(len(antenna)),
    )


def error_of(start, pose):
    difference = np.asarray(pose) - start.pose
    return np.array([*difference[:2], wrap_angle(difference[2])])


# Eq. 13


@given(start=st.tuples(coordinates, coordinates, angles), steps=st.lists(st.tuples(coordinates, coordinates, angles),
       min_size=2, max_size=5), antennas=st.permutations(range(3)))  # fmt: skip
def test_tags_right_under_two_antennas_give_the_pose_exactly(start, steps, antennas):
    """On any way between the two reads, also by odometry that begins elsewhere than where the first tag is read."""
    poses = [np.array(start)]
    for step in steps:
        poses.append(compose(poses[-1], step))
    at = [transform_points(poses[k], LAYOUT.poses_mm[a, :2]) for k, a in ((1, antennas[0]), (-1, antennas[1]))]
    assume(math.dist(*at) > 1.0)
    reads = [[] for _ in steps]
    reads[0].append((antennas[0], at[0]))
    reads[-1].append((antennas[1], at[1]))
    step, found = start_by_two_tags(recording_of(poses, reads), ROBOT)
    assert step == len(steps) - 1
    assert np.abs(error_of(found, poses[-1])).max() < 1e-6


@given(heading=angles, way=st.floats(100, 2000), a=st.sampled_from(range(3)), direction=angles)
def test_one_antenna_over_two_tags_gives_the_heading_exactly_and_stands_where_discs_are_entered(
    heading, way, a, direction
):
    """The place on the way is that of the entry border on average, short of the tag."""
    poses = [(0.0, 0.0, heading)] * 2 + [(way * math.cos(direction), way * math.sin(direction), heading)]
    tags = [transform_points(np.array(pose), LAYOUT.poses_mm[a, :2]) for pose in (poses[1], poses[2])]
    _, found = start_by_two_tags(recording_of(poses, [[(a, tags[0])], [(a, tags[1])]]), ROBOT)
    error = error_of(found, poses[-1])
    assert abs(error[2]) < 1e-6
    short = ENTRY_DEPTH * RADIUS * np.array([math.cos(direction), math.sin(direction)])
    assert error[:2] == pytest.approx(short, abs=1e-6)


def test_two_antennas_that_read_two_tags_at_once_need_not_drive():
    pose = np.array([40.0, -70.0, 2.0])
    tags = [transform_points(pose, LAYOUT.poses_mm[a, :2]) for a in (0, 1)]
    step, found = start_by_two_tags(recording_of([pose, pose], [[(0, tags[0]), (1, tags[1])]]), ROBOT)
    assert step == 0
    assert np.abs(error_of(found, pose)).max() < 1e-9


# What it says of its error


def entry(rng, base, antenna, radius):
    """A straight drive of the antenna over a tag and then another: the pose found and the true one.

    Any line that meets both discs is as likely as any other; a disc is entered within half a mm of its border.
    """
    at = np.array(antenna)
    while True:
        bearing, heading = rng.uniform(-np.pi, np.pi, 2)
        tags = np.array([[0.0, 0.0], [base * math.cos(bearing), base * math.sin(bearing)]])
        ahead, left = (
            np.array([math.cos(heading), math.sin(heading)]),
            np.array([-math.sin(heading), math.cos(heading)]),
        )
        offset = rng.uniform(-radius, radius)
        offsets = offset - tags @ left
        if np.abs(offsets).max() < radius:
            break
    places = tags @ ahead - np.sqrt(radius**2 - offsets**2)
    order = places.argsort()
    places = places[order] + rng.uniform(0, 0.5, 2)
    arm = math.cos(heading) * at + math.sin(heading) * np.array([-at[1], at[0]])
    poses = [(*(offset * left + x * ahead - arm), heading) for x in (places[0] - 20, *places)]
    recording = recording_of(poses, [[(0, tags[order[0]])], [(0, tags[order[1]])]])
    found = start_by_two_tags(recording, Robot(listed([(*antenna, 0.0)]), Disc(radius)))
    return found, poses[-1]


@pytest.mark.parametrize(
    ("radius", "base", "antenna"),
    [
        (30.0, 250.0, (0.0, 0.0)),
        (30.0, 250.0, (150.0, -80.0)),
        (105.0, 500.0, (0.0, 0.0)),
        (105.0, 500.0, (100.0, 50.0)),
        # Discs that overlap: much may be wrong with the heading, and it says so.
        (100.0, 150.0, (0.0, 0.0)),
        (60.0, 80.0, (0.0, 0.0)),
    ],
)
def test_the_covariance_is_consistent_over_straight_entries(radius, base, antenna):
    """Mean normalized estimation error squared within its chi-square band; and no axis is far off on average."""
    rng, n = np.random.Generator(np.random.PCG64(8)), 150
    squared, errors, deviations = [], [], []
    while len(squared) < n:
        found, pose = entry(rng, base, antenna, radius)
        if found is None:
            continue
        error, covariance = error_of(found[1], pose), np.array(found[1].covariance)
        squared.append(error @ np.linalg.solve(covariance, error))
        errors.append(error)
        deviations.append(np.sqrt(np.diag(covariance)))
    low, high = stats.chi2.ppf([5e-4, 1 - 5e-4], 3 * n)
    assert low < np.sum(squared) < high
    bias = np.mean(np.array(errors) / deviations, axis=0)
    assert np.abs(bias).max() < 4.5 / math.sqrt(n)


@given(start=st.tuples(coordinates, coordinates, angles), way=st.floats(1e-6, 1e3), turn=angles,
       offset=st.tuples(st.floats(-60, 60), st.floats(-60, 60)))  # fmt: skip
def test_a_covariance_is_always_one(start, way, turn, offset):
    """However near the tags lie to each other: symmetric, finite, not negative, surer of a heading than of any."""
    poses = [np.array(start)] * 2
    poses.append(compose(poses[-1], (way, 0.0, turn)))
    tags = [transform_points(pose, LAYOUT.poses_mm[0, :2]) for pose in poses[1:]]
    found = start_by_two_tags(recording_of(poses, [[(0, tags[0])], [(0, tags[1] + np.array(offset))]]), ROBOT)
    assume(found is not None)
    covariance = np.array(found[1].covariance)
    assert np.array_equal(covariance, covariance.T)
    assert np.linalg.eigvalsh(covariance).min() > -1e-9 * np.abs(covariance).max()
    assert math.sqrt(covariance[2, 2]) < math.pi / math.sqrt(3)


def test_a_heading_from_a_longer_way_is_surer():
    sigmas = []
    for way in (100.0, 400.0, 1600.0):
        poses = [(0.0, 0.0, 0.0)] * 2 + [(way, 0.0, 0.0)]
        tags = [transform_points(np.array(pose), LAYOUT.poses_mm[0, :2]) for pose in poses[1:]]
        _, found = start_by_two_tags(recording_of(poses, [[(0, tags[0])], [(0, tags[1])]]), ROBOT)
        sigmas.append(math.sqrt(found.covariance[2][2]))
    assert sigmas[0] / sigmas[1] == pytest.approx(4)
    assert sigmas[1] / sigmas[2] == pytest.approx(4)


# Pairs that cannot be


@given(way=st.floats(100, 2000), error=st.floats(0, 2000), sign=st.sampled_from([-1, 1]))
def test_tags_further_apart_than_the_way_allows_or_nearer_are_refused(way, error, sign):
    """By more than a diameter and a fifth of the way; the second tag is then the first of the next pair."""
    base, allowed = way + sign * error, 2 * RADIUS + 0.2 * way
    assume(base > 40.0 and abs(error - allowed) > 1e-6)
    poses = [(0.0, 0.0, 0.0)] * 2 + [(way, 0.0, 0.0), (way, 500.0, 0.0)]
    tags = [(150.0, 0.0), (150.0 + base, 0.0), (150.0 + base, 500.0)]
    recording = recording_of(poses, [[(0, tags[0])], [(0, tags[1])], [(0, tags[2])]])
    step, found = start_by_two_tags(recording, ROBOT)
    assert step == (1 if error < allowed else 2)
    assert abs(wrap_angle(found.pose[2])) < 1e-6


def test_tags_read_soon_after_each_other_tell_no_direction_and_the_first_waits_for_another():
    """Two tags side by side in one field, 5 mm of way between them; then a third, 400 mm ahead."""
    poses = [(0.0, 0.0, 0.0)] * 2 + [(5.0, 0.0, 0.0), (400.0, 0.0, 0.0)]
    tags = [(150.0, 0.0), (150.0, 50.0), (550.0, 0.0)]
    step, found = start_by_two_tags(recording_of(poses, [[(0, tags[0])], [(0, tags[1])], [(0, tags[2])]]), ROBOT)
    assert step == 2
    assert abs(wrap_angle(found.pose[2])) < 1e-9


def test_one_tag_read_again_and_again_is_no_pair():
    poses = [(10.0 * t, 0.0, 0.0) for t in range(6)]
    assert start_by_two_tags(recording_of(poses, [[(0, (150.0, 0.0))]] * 5), ROBOT) is None
    assert start_by_two_tags(recording_of(poses, [[]] * 5), ROBOT) is None


def test_a_robot_that_has_not_moved_at_all_knows_no_heading():
    """An inventory of one antenna: two tags at once, and no way between them."""
    poses = [(0.0, 0.0, 0.0)] * 2
    assert start_by_two_tags(recording_of(poses, [[(0, (150.0, 0.0)), (0, (150.0, 20.0))]]), ROBOT) is None


def test_the_radius_of_an_area_is_that_of_the_disc_with_its_spread():
    assert radius_of(Disc(42.0)) == pytest.approx(42.0)
    # A uniform rectangle has the variance of (l^2 + w^2) / 12 in all, a disc that of r^2 / 2.
    assert radius_of(Rectangle(60.0, 80.0)) == pytest.approx(math.sqrt((60**2 + 80**2) / 6))
