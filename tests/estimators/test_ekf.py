"""The Kalman filters of rssi_kalman_navifloor: equal to a Kalman filter where the problem is linear, consistent where
the model is true, and never broken by what they are fed."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from rfiddesign.catalog import antenna
from rfiddesign.design import Design
from rfiddesign.estimators import _ekf_kernels as kernels
from rfiddesign.estimators import ekf
from rfiddesign.estimators.ekf import KINDS, Ekf
from rfiddesign.estimators.start import KnownStart, UncertainStart, UnknownStart
from rfiddesign.floor import build_tag_map, rectangle_floor
from rfiddesign.geometry import Disc, Ellipse, PolygonArea, Rectangle, RoundedRectangle, compose, listed, make_pattern
from rfiddesign.models._shape_kernels import signed_distance
from rfiddesign.models.motion import MecanumMotion, OmnidirectionalMotion
from rfiddesign.models.recording import Reads, Recording
from rfiddesign.models.robot import Robot
from rfiddesign.models.shape import shape_of
from rfiddesign.simulation import Scenario, World
from rfiddesign.simulation.record import record
from rfiddesign.simulation.run import key_of, true_poses

DT = 0.05
MOTION = OmnidirectionalMotion(20.0, 15.0, 0.05)
YAWED = listed([(150.0, 0.0, 0.4), (-100.0, 120.0, -2.0), (0.0, -180.0, 0.0)])
AREAS = [
    Disc(30.0),
    Rectangle(80.0, 50.0),
    RoundedRectangle(80.0, 60.0, 15.0),
    PolygonArea(((-30.0, -20.0), (70.0, -10.0), (10.0, 50.0))),
]
RADII = (105.0, 100.0, 95.0, 90.0, 80.0, 60.0, 50.0, 40.0)


def shape_arguments(shape):
    return (shape.half_length_mm, shape.half_width_mm, shape.corner_mm), shape.segments


def mounted(mount):
    """Place of an antenna on the robot, sine and cosine of its yaw."""
    return mount[0], mount[1], math.sin(mount[2]), math.cos(mount[2])


def in_frame(pose, mount, tag):
    """Where a tag lies in the frame of an antenna mounted at `mount` on a robot at `pose`."""
    x, y, yaw = compose(np.asarray(pose), np.asarray(mount))
    c, s = math.cos(yaw), math.sin(yaw)
    return np.array([[c, s], [-s, c]]) @ (np.asarray(tag) - (x, y))


poses = st.tuples(st.floats(-500, 500), st.floats(-500, 500), st.floats(-7, 7))
mounts = st.tuples(st.floats(-300, 300), st.floats(-300, 300), st.floats(-4, 4))
points = st.tuples(st.floats(-400, 400), st.floats(-400, 400))


@given(poses, mounts, points)
def test_the_measurement_and_its_jacobian_are_those_of_rigid_motions(pose, mount, tag):
    u, v, H = kernels.in_antenna_frame(np.array(pose), np.array([0.0, 0.0, 1.0]), *mounted(mount), *tag)
    assert (u, v) == pytest.approx(tuple(in_frame(pose, mount, tag)), abs=1e-9)
    step, jacobian = 1e-4, np.array(H).reshape(2, 3)
    for k in range(3):
        ahead, behind = np.array(pose), np.array(pose)
        ahead[k] += step
        behind[k] -= step
        slope = (in_frame(ahead, mount, tag) - in_frame(behind, mount, tag)) / (2 * step)
        assert jacobian[:, k] == pytest.approx(slope, abs=1e-5)


@pytest.mark.parametrize("area", [*AREAS, Ellipse(90.0, 40.0)], ids=lambda area: type(area).__name__)
@given(point=st.tuples(st.floats(-150, 150), st.floats(-150, 150)))
def test_signed_distance_is_that_of_the_area_and_its_gradient_points_away(area, point):
    box, segments = shape_arguments(shape_of(area))
    g, gu, gv = signed_distance(*point, *box, segments)
    # Outlines of curves are drawn with corners: within 8e-5 of the size, and simplified to 0.05 mm.
    assert g == pytest.approx(float(area.signed_distance(np.array(point))), abs=0.07)
    if gu == gv == 0.0:
        assert g <= 1e-9
        return
    assert math.hypot(gu, gv) == pytest.approx(1.0, abs=1e-9)
    step = 1e-3
    further = signed_distance(point[0] + step * gu, point[1] + step * gv, *box, segments)[0]
    assert further - g == pytest.approx(step, abs=0.02 * step)


@given(st.lists(st.floats(-0.1, 0.1), max_size=200), st.floats(-3, 3))
def test_a_direction_followed_in_small_turns_stays_exact(turns, heading):
    direction = np.array([0.0, 0.0, 1.0])
    for turn in turns:
        heading = math.remainder(heading + turn, 2 * math.pi)
        s, c = kernels.direction_of(heading, direction)
        assert (s, c) == pytest.approx((math.sin(heading), math.cos(heading)), abs=1e-12)


def numpy_update(kind, pose, P, mount, tag, area, radius, variance):
    """Eqs. 5-7 and 12 as printed, in matrices."""
    z = in_frame(pose, mount, tag)
    s, c = math.sin(pose[2]), math.cos(pose[2])
    p = np.array([[c, s], [-s, c]]) @ (tag - pose[:2])
    ys, yc = math.sin(mount[2]), math.cos(mount[2])
    turned = np.array([[yc, ys], [-ys, yc]])
    H = np.column_stack([-turned @ np.array([[c, s], [-s, c]]), turned @ (p[1], -p[0])])
    distance = np.hypot(*z) - radius if radius else float(area.signed_distance(z))
    if distance <= 0:
        return pose, P
    if kind == "quantized":
        spread = np.eye(2) * radius**2 / 4 if radius else area.covariance_mm2
        mean = np.zeros(2) if radius else area.centroid_mm
        S = H @ P @ H.T + spread + variance * np.eye(2)
        K = P @ H.T @ np.linalg.inv(S)
        return pose + K @ (mean - z), (np.eye(3) - K @ H) @ P
    step = 1e-5
    if radius:
        gradient = z / np.hypot(*z)
    else:
        around = z + step * np.array([[1, 0], [-1, 0], [0, 1], [0, -1]])
        g = area.signed_distance(around)
        gradient = np.array([g[0] - g[1], g[2] - g[3]]) / (2 * step)
    G = gradient @ H
    K = P @ G / (G @ P @ G + variance)
    return pose - K * distance, P - np.outer(K, G @ P)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("area", AREAS, ids=lambda area: type(area).__name__)
@settings(max_examples=60)
@given(
    pose=poses, mount=mounts, offset=points, rssi=st.sampled_from([-1, 0, 3, 7]), seed=st.integers(0, 10_000),
)  # fmt: skip
def test_an_update_is_that_of_the_paper_in_matrices(kind, area, pose, mount, offset, rssi, seed):
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(3, 3)) * (30.0, 30.0, 0.05)
    P = root.T @ root + np.diag([10.0, 10.0, 1e-4])
    tag = compose(np.array(pose), np.array(mount))[:2] + offset
    pose = np.array([*pose[:2], math.remainder(pose[2], 2 * math.pi)])
    uses_rssi = isinstance(area, Disc) and rssi >= 0
    shape, radii = shape_of(area, RADII if uses_rssi else ()), RADII
    expected = numpy_update(kind, pose, P, mount, tag, area, radii[rssi] if uses_rssi else None, 400.0)
    found, covariance = pose.copy(), P.copy()
    box, segments = shape_arguments(shape)
    kernels.take_read(
        KINDS[kind], found, covariance, np.array([0.0, 0.0, 1.0]), *mounted(mount), *tag, rssi, shape.rssi_radii,
        box, segments, shape.mean,
        shape.covariance, 400.0, True,
    )  # fmt: skip
    assert found[:2] == pytest.approx(expected[0][:2], rel=1e-5, abs=1e-3)
    assert math.remainder(found[2] - expected[0][2], 2 * math.pi) == pytest.approx(0.0, abs=1e-5)
    assert covariance == pytest.approx(expected[1], rel=1e-4, abs=1e-3 * np.abs(P).max())
    assert np.linalg.eigvalsh(covariance).min() > 0


def test_where_the_problem_is_linear_the_quantized_filter_is_a_kalman_filter():
    """Heading known, antenna at the centre: position plus noise, measured as tag less the area's mean."""
    motion, area, variance = OmnidirectionalMotion(40.0, 25.0, 0.0), Disc(1.0), 400.0
    ready = ekf.build(Ekf("quantized", motion, read_noise_mm=20.0, patience=0), Robot(listed([(0, 0, 0.0)]), area), DT)
    heading, rng = 0.7, np.random.default_rng(5)
    turn = np.array([[math.cos(heading), -math.sin(heading)], [math.sin(heading), math.cos(heading)]])
    covariance = np.zeros((3, 3))
    state = ekf.init(ready, UncertainStart((100.0, 50.0, heading), tuple(map(tuple, covariance))), 0)
    mean, P = np.array([100.0, 50.0]), np.eye(2) * 1e-3
    Q = turn @ np.diag([(40.0 * DT) ** 2, (25.0 * DT) ** 2]) @ turn.T
    for t in range(60):
        increment = np.array([5.0, 1.0, 0.0])
        mean, P = mean + turn @ increment[:2], P + Q
        state = ekf.predict(ready, state, increment)
        if t % 3 == 0:
            tag = mean + rng.normal(0, 60.0, 2)
            S = P + (variance + 0.25) * np.eye(2)
            K = P @ np.linalg.inv(S)
            if np.hypot(*(tag - mean)) > 1.0:
                mean, P = mean + K @ (tag - mean), P - K @ P
            state = ekf.update(ready, state, Reads(np.array([0]), tag[None]))
        else:
            state = ekf.update(ready, state, Reads())
        found = ekf.estimate(state)
        assert found.pose[:2] == pytest.approx(mean, abs=2e-3)
        assert found.covariance[:2, :2] == pytest.approx(P, rel=2e-3, abs=2e-3)


def a_run(kind, run, uses_rssi=False, learns=None):
    floor = rectangle_floor(6000.0, 6000.0, 100.0)
    design = Design(listed([(0.0, 0.0, 0.0)]), antenna("navifloor"), make_pattern("square", pitch_mm=250.0))
    scenario = Scenario(floor, world=World(MOTION), duration_s=20.0, dt_s=DT)
    tags, drive = build_tag_map(design.pattern.lay(floor.drivable)), true_poses(scenario, 4, run)
    recording = record(design, tags, drive, DT, scenario.world, key_of(4, run))
    robot = Robot.of(design, scenario.world.reads)
    ready = ekf.build(Ekf(kind, MOTION, uses_rssi=uses_rssi), robot, DT)
    estimates = np.empty((recording.n_steps + 1, ekf.N_ESTIMATE))
    state = ekf.init(ready, KnownStart(tuple(drive[0])), 0)
    return ready, state, recording, estimates


def test_step_by_step_is_the_same_as_at_once():
    for kind in KINDS:
        ready, state, recording, estimates = a_run(kind, 0, uses_rssi=True)
        ekf.track(ready, state, recording, recording.n_steps, estimates)
        for t in range(recording.n_steps):
            rows = slice(recording.read_start[t], recording.read_start[t + 1])
            reads = Reads(
                recording.read_antenna[rows], recording.read_tag_mm[rows], recording.read_rssi[rows],
                recording.read_age_s[rows],
            )  # fmt: skip
            state = ekf.update(ready, ekf.predict(ready, state, recording.odometry[t]), reads)
            assert np.array_equal(state.moments, estimates[t + 1])


@pytest.mark.parametrize("uses_rssi", [False, True])
def test_the_quantized_filter_is_consistent_where_the_model_is_true(uses_rssi):
    """Mean NEES over runs, late in each: between a filter that is too sure (3 is the mean of a true Gaussian's) and
    one that claims to know nothing.  A read only shrinks the covariance by the whole area, so that it is cautious."""
    nees = []
    for run in range(120):
        ready, state, recording, estimates = a_run("quantized", run, uses_rssi)
        ekf.track(ready, state, recording, recording.n_steps, estimates)
        row = estimates[-1]
        P = row[[3, 4, 6, 4, 5, 7, 6, 7, 8]].reshape(3, 3)
        error = row[:3] - recording.true_poses[-1]
        error[2] = math.remainder(error[2], 2 * math.pi)
        nees.append(error @ np.linalg.solve(P, error))
    high = stats.chi2.ppf(0.999, 3 * len(nees)) / len(nees)
    assert 0.5 < np.mean(nees) < high


def test_without_reads_the_covariance_is_that_of_the_odometry():
    """NEES of dead reckoning over independent drives within its chi-square band."""
    motion = MecanumMotion(10.0, 15.0, 0.02, 0.03)
    ready = ekf.build(Ekf(motion=motion), Robot(listed([(0, 0, 0.0)]), Disc(30.0)), DT)
    noise, rng, nees = motion.noise(DT), np.random.default_rng(8), []
    for _ in range(300):
        state, pose = ekf.init(ready, UncertainStart((0.0, 0.0, 0.3), ((0.0,) * 3,) * 3), 0), np.array([0.0, 0.0, 0.3])
        for _ in range(40):
            true = np.array([20.0, 4.0, 0.02])
            way = math.hypot(*true[:2])
            measured = true + rng.normal(size=3) * np.sqrt(noise[:, 0] + noise[:, 1] * way + noise[:, 2] * abs(true[2]))
            pose = compose(pose, true)
            state = ekf.update(ready, ekf.predict(ready, state, measured), Reads())
        found = ekf.estimate(state)
        error = found.pose - pose
        error[2] = math.remainder(error[2], 2 * math.pi)
        nees.append(error @ np.linalg.solve(found.covariance, error))
    low, high = (stats.chi2.ppf(q, 3 * len(nees)) / len(nees) for q in (0.001, 0.999))
    assert low < np.mean(nees) < high


def test_a_tag_where_it_may_be_tells_nothing_and_one_beyond_moves_the_pose_to_the_border():
    area = Disc(30.0)
    ready = ekf.build(Ekf(motion=MOTION, read_noise_mm=0.1), Robot(listed([(0, 0, 0.0)]), area), DT)
    wide = ((1e4, 0.0, 0.0), (0.0, 1e4, 0.0), (0.0, 0.0, 1e-4))
    state = ekf.predict(ready, ekf.init(ready, UncertainStart((0.0, 0.0, 0.0), wide), 0), np.zeros(3))
    inside = ekf.update(ready, state, Reads(np.array([0]), np.array([[20.0, 10.0]])))
    assert np.array_equal(inside.arrays[0], state.arrays[0])
    beyond = ekf.update(ready, state, Reads(np.array([0]), np.array([[100.0, 0.0]])))
    assert beyond.arrays[0][:2] == pytest.approx((70.0, 0.0), abs=0.1)


def test_rule_3_pushes_a_tag_no_longer_read_to_the_border():
    robot = Robot(listed([(0, 0, 0.0)]), Disc(30.0))
    for pushes_out in (False, True):
        ready = ekf.build(Ekf(motion=MOTION, read_noise_mm=0.1, pushes_out=pushes_out), robot, DT)
        state = ekf.init(ready, UncertainStart((0.0, 0.0, 0.0), ((400.0, 0, 0), (0, 400.0, 0), (0, 0, 1e-4))), 0)
        state = ekf.update(ready, ekf.predict(ready, state, np.zeros(3)), Reads(np.array([0]), np.array([[10.0, 0.0]])))
        after = ekf.update(ready, ekf.predict(ready, state, np.zeros(3)), Reads())
        distance = np.hypot(*(after.arrays[0][:2] - (10.0, 0.0)))
        assert distance == pytest.approx(30.0 if pushes_out else 10.0, abs=0.2)


def test_told_nothing_it_starts_from_two_tags_and_after_a_kidnapping_again():
    design = Design(listed([(0.0, 0.0, 0.0)]), antenna("60x60"), make_pattern("square", tags_per_m2=100.0))
    floor = rectangle_floor(6000.0, 6000.0, 100.0)
    scenario = Scenario(floor, world=World(MOTION), duration_s=20.0)
    tags = build_tag_map(design.pattern.lay(floor.drivable))
    for run in range(4):
        drive = true_poses(scenario, 9, run)
        recording = record(design, tags, drive, DT, scenario.world, key_of(9, run))
        ready = ekf.build(Ekf("quantized", MOTION, read_noise_mm=5.0), Robot.of(design, scenario.world.reads), DT)
        for start in (UnknownStart((0.0, 0.0, 6000.0, 6000.0)), KnownStart((50.0, 5900.0, 2.0))):
            estimates = np.empty((recording.n_steps + 1, ekf.N_ESTIMATE))
            ekf.track(ready, ekf.init(ready, start, 0), recording, recording.n_steps, estimates)
            off = np.hypot(*(estimates[-50:, :2] - drive[-50:, :2]).T)
            if recording.n_reads > 20:
                assert off.max() < 100.0


@pytest.mark.parametrize("settings_", [Ekf(kind, MOTION, pushes_out=True) for kind in KINDS], ids=list(KINDS))
def test_nothing_that_it_is_fed_breaks_it(settings_):
    """10^5 steps of random motion, reads of random tags by random antennas, absurd ones among them."""
    n, rng = 100_000, np.random.default_rng(3)
    robot = Robot(YAWED, Disc(105.0), RADII)
    ready = ekf.build(settings_, robot, DT)
    counts = rng.integers(0, 3, n)
    read_start = np.concatenate([[0], np.cumsum(counts)])
    r = read_start[-1]
    scale = rng.choice([1.0, 1e3, 1e7], (r, 1), p=[0.6, 0.3, 0.1])
    recording = Recording(
        DT, np.zeros((n + 1, 3)), rng.normal(0, (20, 20, 0.3), (n, 3)) * rng.choice([0, 1, 30], (n, 1)), read_start,
        rng.integers(0, 3, r).astype(np.int32), np.zeros(r, np.int64), rng.normal(0, 100, (r, 2)) * scale,
        rng.uniform(0, DT, r), rng.integers(-1, 9, r).astype(np.int32),
    )  # fmt: skip
    for start in (KnownStart((0.0, 0.0, 0.0)), UnknownStart((-1e4, -1e4, 1e4, 1e4))):
        estimates = np.empty((n + 1, ekf.N_ESTIMATE))
        ekf.track(ready, ekf.init(ready, start, 0), recording, n, estimates)
        assert np.isfinite(estimates[1:]).all()
        assert (estimates[1:, [3, 5, 8]] > 0).all()


def test_bounds_are_refused_by_name():
    for build, words in (
        (lambda: Ekf("unscented"), ("kind", "unscented", "quantized, constrained")),
        (lambda: Ekf(read_noise_mm=0.0), ("read_noise_mm", "0.1")),
        (lambda: Ekf(gate_sigmas=0.1), ("gate_sigmas",)),
        (lambda: Ekf(patience=-1), ("patience", "-1")),
    ):
        with pytest.raises(ValueError, match=words[0]) as error:
            build()
        for word in words:
            assert word in str(error.value)
