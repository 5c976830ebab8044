"""The geometric methods where their answer is known, against twins, and on simulated floors."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from rfiddesign.catalog import antenna
from rfiddesign.design import Design
from rfiddesign.estimators import geometric
from rfiddesign.estimators.geometric import METHODS, Geometric
from rfiddesign.estimators.start import KnownStart, UncertainStart, UnknownStart
from rfiddesign.evaluate import evaluate
from rfiddesign.floor import rectangle_floor
from rfiddesign.geometry import Disc, Rectangle, compose, cross, listed, make_pattern, single, transform_points
from rfiddesign.models.motion import OmnidirectionalMotion
from rfiddesign.models.reads import ReadModel
from rfiddesign.models.recording import Reads, Recording
from rfiddesign.models.robot import Robot
from rfiddesign.simulation import Scenario, World
from rfiddesign.simulation.scenario import Routes

BOX = UnknownStart((-1000.0, -500.0, 2000.0, 1500.0))
AT_ORIGIN = KnownStart((0.0, 0.0, 0.0))
AREA, DT = Disc(30.0), 0.05
NOISELESS = OmnidirectionalMotion(0.0, 0.0, 0.0)
CORRECTING = [method for method in METHODS if method != "odometry"]
# Every method with odometry, and those that can do without it.
VARIANTS = [(method, True) for method in METHODS] + [(method, False) for method in CORRECTING]


def ready_for(method, layout=None, area=AREA, **settings):
    return geometric.build(Geometric(method, **settings), Robot(layout or single(), area), DT)


def tracked(ready, start, recording):
    """Estimates (n_steps + 1, N_ESTIMATE) of a recording."""
    state = geometric.init(ready, start, 0)
    rows = np.empty((recording.n_steps + 1, geometric.N_ESTIMATE))
    rows[0] = state.moments
    geometric.track(ready, state, recording, recording.n_steps, rows)
    return rows


def one_step(ready, start, reads, increment=(0.0, 0.0, 0.0)):
    state = geometric.predict(ready, geometric.init(ready, start, 0), np.array(increment))
    return geometric.estimate(geometric.update(ready, state, reads))


def drive(increments, start, tags_at, age=0.0):
    """A recording without noise along `increments` (n, 3); `tags_at` (pose) gives the tags (k, 2) antenna 0 reads."""
    poses = [np.array(start, float)]
    for increment in increments:
        poses.append(compose(poses[-1], increment))
    seen = [np.asarray(tags_at(pose), float).reshape(-1, 2) for pose in poses[1:]]
    counts = [len(tags) for tags in seen]
    n = sum(counts)
    return Recording(
        DT, np.array(poses), np.asarray(increments, float), np.concatenate([[0], np.cumsum(counts)]),
        np.zeros(n, np.int32), np.zeros(n, np.int32), np.concatenate([np.empty((0, 2)), *seen]), np.full(n, age),
    )  # fmt: skip


def lattice(pitch, is_triangular=False):
    """Tags of a floor of 4 m x 4 m about (1, 1) m."""
    row = pitch * (math.sqrt(3) / 2 if is_triangular else 1.0)
    i, j = np.meshgrid(np.arange(-1000, 3000, pitch), np.arange(-1000, 3000, row), indexing="ij")
    shift = 0.5 * pitch * (np.arange(i.shape[1]) % 2) if is_triangular else 0.0
    return np.stack([i + shift, j], axis=-1).reshape(-1, 2)


def in_view(tags, reach):
    return lambda pose: tags[np.hypot(*(tags - pose[:2]).T) < reach]


def errors_mm(rows, recording):
    return np.hypot(*(rows[:, :2] - recording.true_poses[:, :2]).T)


def heading_errors(rows, recording):
    return np.abs(np.angle(np.exp(1j * (rows[:, 2] - recording.true_poses[:, 2]))))


coordinate = st.floats(-300.0, 300.0)


@given(
    st.lists(st.tuples(coordinate, coordinate), min_size=2, max_size=9),
    st.tuples(st.floats(-1e5, 1e5), st.floats(-1e5, 1e5), st.floats(-3.1, 3.1)),
    st.booleans(),
)
def test_a_rigid_fit_is_exact_where_tags_lie_under_the_antennas(places, pose, uses_odometry):
    places = np.array(places)
    assume(np.sum((places - places.mean(axis=0)) ** 2) > 60.0**2 / 2)
    ready = ready_for("rigid_fit", listed([(x, y, 0.0) for x, y in places]), uses_odometry=uses_odometry)
    reads = Reads(np.arange(len(places)), transform_points(pose, places))
    for start in (BOX, AT_ORIGIN, UncertainStart((5.0, 5.0, 1.0), tuple(map(tuple, np.eye(3))))):
        found = one_step(ready, start, reads)
        assert found.pose[:2] == pytest.approx(pose[:2], abs=1e-5)
        assert abs(math.remainder(found.pose[2] - pose[2], math.tau)) < 1e-8
        assert np.linalg.eigvalsh(found.covariance).min() > 0


@given(st.integers(0, 10_000))
def test_a_rigid_fit_is_the_least_squares_one_by_singular_values(seed):
    rng = np.random.Generator(np.random.PCG64(seed))
    layout, pose = cross(), rng.uniform([-500, -500, -3], [500, 500, 3])
    reading = rng.choice(8, size=rng.integers(2, 9), replace=False)
    places = layout.poses_mm[reading, :2]
    tags = transform_points(pose, places) + rng.normal(0, 15, (len(places), 2))
    u, _, vt = np.linalg.svd((tags - tags.mean(axis=0)).T @ (places - places.mean(axis=0)))
    turn = u @ np.diag([1.0, np.linalg.det(u @ vt)]) @ vt
    found = one_step(ready_for("rigid_fit", layout), BOX, Reads(reading, tags))
    assert found.pose[2] == pytest.approx(math.atan2(turn[1, 0], turn[0, 0]), abs=1e-9)
    assert found.pose[:2] == pytest.approx(tags.mean(axis=0) - turn @ places.mean(axis=0), abs=1e-6)


def test_the_covariance_of_a_rigid_fit_is_that_of_its_errors():
    """Tags about their antennas with the spread of the area; antennas beside the robot's centre."""
    places, pose, n = np.array([[300.0, 100.0], [150.0, -40.0], [260.0, 220.0]]), (400.0, -100.0, 0.8), 20_000
    rng = np.random.Generator(np.random.PCG64(1))
    tags = transform_points(pose, np.tile(places, (n, 1))) + rng.normal(0, AREA.radius_mm / 2, (3 * n, 2))
    recording = Recording(
        DT, np.tile(pose, (n + 1, 1)), np.zeros((n, 3)), np.arange(0, 3 * n + 1, 3),
        np.tile(np.arange(3, dtype=np.int32), n), np.zeros(3 * n, np.int32), tags, np.zeros(3 * n),
    )  # fmt: skip
    layout = listed([(x, y, 0.0) for x, y in places])
    rows = tracked(ready_for("rigid_fit", layout, uses_odometry=False), KnownStart(pose), recording)[1:]
    sampled, told = np.cov(rows[:, :3].T), rows[:, 3:9].mean(axis=0)[[0, 1, 3, 1, 2, 4, 3, 4, 5]].reshape(3, 3)
    scale = np.sqrt(np.outer(np.diag(sampled), np.diag(sampled)))
    assert np.abs((told - sampled) / scale).max() < 0.05
    assert np.abs(sampled / scale)[0, 2] > 0.5


@pytest.mark.parametrize(
    ("places", "reading", "tags"),
    [
        ([(100, 0), (-100, 0)], [0], [[10, 20]]),
        ([(100, 0), (-100, 0)], [0, 1], [[10, 20], [10, 20]]),
        ([(100, 0), (105, 0)], [0, 1], [[10, 20], [30, 90]]),
        ([(100, 0), (-100, 0)], [0, 0], [[10, 20], [40, 20]]),
    ],
    ids=["one read", "one tag", "antennas side by side", "one antenna"],
)
@pytest.mark.parametrize("uses_odometry", [True, False])
def test_reads_that_tell_no_heading_leave_it(places, reading, tags, uses_odometry):
    ready = ready_for("rigid_fit", listed([(x, y, 0.0) for x, y in places]), uses_odometry=uses_odometry)
    found = one_step(ready, KnownStart((0.0, 0.0, 0.7)), Reads(np.array(reading), np.array(tags)), (5.0, 0.0, 0.2))
    assert found.pose[2] == pytest.approx(0.9 if uses_odometry else 0.7)
    lever = transform_points((0, 0, found.pose[2]), np.mean(np.array(places)[reading], axis=0))
    assert found.pose[:2] == pytest.approx(np.mean(tags, axis=0) - lever, abs=1e-9)


@pytest.mark.parametrize("uses_odometry", [True, False])
@pytest.mark.parametrize("way", [0.3, 2.0, -1.2])
def test_a_robot_that_drives_ahead_faces_from_tag_to_tag(uses_odometry, way):
    """Whatever it was told: heading = atan2 between successive tags."""
    tags = np.outer(np.arange(10), 150 * np.array([math.cos(way), math.sin(way)]))
    recording = drive(np.tile([5.0, 0.0, 0.0], (250, 1)), (0, 0, way), in_view(tags, 30.0))
    for start in (BOX, KnownStart((0.0, 0.0, way + 0.4))):
        rows = tracked(ready_for("trigonometric", motion=NOISELESS, uses_odometry=uses_odometry), start, recording)
        assert rows[-1, 2] == pytest.approx(way, abs=1e-9)
        assert (rows[-1, 3] + rows[-1, 5]) ** 0.5 < 1000


@pytest.mark.parametrize("method", ["trigonometric", "motion_continuity", "weighted_centre"])
def test_odometry_tells_how_a_robot_faces_its_way(method):
    """It drives sideways, over tags right on its way."""
    tags = np.outer(np.arange(14), [0.0, 100.0])
    recording = drive(np.tile([0.0, 5.0, 0.0], (260, 1)), (0, 0, 0), in_view(tags, 30.0))
    ready = ready_for(method, motion=NOISELESS, heading_gain=1.0)
    rows = tracked(ready, KnownStart((0.0, 0.0, -0.3)), recording)
    assert heading_errors(rows, recording)[-50:].max() < 0.02
    unknowing = tracked(ready_for(method, uses_odometry=False), AT_ORIGIN, recording)
    assert unknowing[-1, 2] == pytest.approx(math.pi / 2, abs=0.02)


@pytest.mark.parametrize("uses_odometry", [True, False])
@pytest.mark.parametrize("way", [0.1, 0.37, 0.8])
def test_a_line_through_a_triangular_pattern_is_better_than_its_tags(way, uses_odometry):
    tags = lattice(50.0, is_triangular=True)
    recording = drive(np.tile([5.0, 0.0, 0.0], (300, 1)), (0, 0, way), in_view(tags, 40.0))
    ready = ready_for("motion_continuity", area=Disc(40.0), motion=NOISELESS, uses_odometry=uses_odometry)
    rows = tracked(ready, KnownStart((0.0, 0.0, way)), recording)
    raw = [tags[np.hypot(*(tags - pose[:2]).T) < 40.0].mean(axis=0) - pose[:2] for pose in recording.true_poses]
    assert errors_mm(rows, recording)[50:].mean() < 0.9 * np.hypot(*np.array(raw).T)[50:].mean()
    assert heading_errors(rows, recording)[100:].mean() < 0.05


def test_a_bent_way_is_followed_as_odometry_bends_it():
    """Tags are exactly where the antenna is: the places make no line, and yet their method gives every pose."""
    increments = np.tile([8.0, 0.0, 0.02], (200, 1))
    recording = drive(increments, (0, 0, 0), lambda pose: [pose[:2]])
    rows = tracked(ready_for("motion_continuity", motion=NOISELESS, window=30), KnownStart((0.0, 0.0, -0.5)), recording)
    assert errors_mm(rows, recording)[40:].max() < 1e-6
    assert heading_errors(rows, recording)[40:].max() < 1e-9


@pytest.mark.parametrize("uses_odometry", [True, False])
@pytest.mark.parametrize("method", ["motion_continuity", "weighted_centre"])
def test_a_standing_robot_tends_to_the_centre_of_the_tags_in_view(method, uses_odometry):
    """A large antenna that reads one of the tags in view at random."""
    rng = np.random.Generator(np.random.PCG64(3))
    tags = lattice(100.0)
    in_sight = tags[(np.abs(tags - [1020.0, 990.0]) < [160, 115]).all(axis=1)]
    recording = drive(np.zeros((3000, 3)), (1020, 990, 0), lambda pose: in_sight[rng.integers(len(in_sight))])
    ready = ready_for(method, area=Rectangle(320, 230), motion=NOISELESS, uses_odometry=uses_odometry, window=2500)
    rows = tracked(ready, KnownStart((1020.0, 990.0, 0.0)), recording)
    if method == "weighted_centre":
        assert rows[-1, :2] == pytest.approx(in_sight.mean(axis=0), abs=6.0)
    assert np.isfinite(rows).all()
    assert rows[-1, 2] == 0.0


@pytest.mark.parametrize("method", CORRECTING)
def test_without_odometry_a_pose_is_held_and_grows_uncertain_as_a_robot_may_drive(method):
    ready = ready_for(method, uses_odometry=False, held_speed_mm_per_s=100.0, held_turn_rate_rad_per_s=0.1)
    rows = tracked(ready, AT_ORIGIN, drive(np.tile([9.0, 1.0, 0.1], (40, 1)), (0, 0, 0), lambda pose: []))
    assert (rows[:, :3] == 0).all()
    assert np.sqrt(rows[40, [3, 5]] - rows[0, [3, 5]]) == pytest.approx(40 * DT * 100)
    assert math.sqrt(rows[40, 8] - rows[0, 8]) == pytest.approx(40 * DT * 0.1)


@given(st.integers(0, 10_000))
def test_odometry_without_noise_is_exact(seed):
    rng = np.random.Generator(np.random.PCG64(seed))
    recording = drive(rng.normal(0, [10, 10, 0.3], (300, 3)), rng.normal(0, [500, 500, 2]), lambda pose: [[9e3, 9e3]])
    rows = tracked(ready_for("odometry", motion=NOISELESS), KnownStart(tuple(recording.true_poses[0])), recording)
    assert errors_mm(rows, recording).max() < 1e-8
    assert heading_errors(rows, recording).max() < 1e-10


def test_the_covariance_of_dead_reckoning_is_that_of_its_errors():
    motion, n = OmnidirectionalMotion(40.0, 20.0, 0.1), 120
    rng = np.random.Generator(np.random.PCG64(8))
    increments = np.tile([8.0, 0.0, 0.01], (n, 1))
    exact = tracked(ready_for("odometry", motion=motion), AT_ORIGIN, drive(increments, (0, 0, 0), lambda pose: []))
    ends = []
    for _ in range(1500):
        noisy = increments + rng.normal(0, [40 * DT, 20 * DT, 0.1 * DT], (n, 3))
        heading = np.concatenate([[0], np.cumsum(noisy[:-1, 2])])
        ends.append([
            np.sum(np.cos(heading) * noisy[:, 0] - np.sin(heading) * noisy[:, 1]),
            np.sum(np.sin(heading) * noisy[:, 0] + np.cos(heading) * noisy[:, 1]),
            np.sum(noisy[:, 2]),
        ])  # fmt: skip
    sampled = np.cov(np.array(ends).T)[[0, 0, 1, 0, 1, 2], [0, 1, 1, 2, 2, 2]]
    scale = np.sqrt(sampled[[0, 0, 2, 0, 2, 5]] * sampled[[0, 2, 2, 5, 5, 5]])
    assert np.abs((exact[-1, 3:9] - sampled) / scale).max() < 0.12


@pytest.mark.parametrize(("method", "uses_odometry"), VARIANTS)
def test_told_nothing_a_method_waits_in_the_middle_of_the_box_for_two_tags(method, uses_odometry):
    tags = np.array([[200.0 + 150.0 * k, 100.0] for k in range(12)])
    recording = drive(np.tile([5.0, 0.0, 0.0], (300, 1)), (0, 100, 0), in_view(tags, 30.0))
    rows = tracked(ready_for(method, motion=NOISELESS, uses_odometry=uses_odometry), BOX, recording)
    until = 64
    assert rows[:until, :3] == pytest.approx(np.tile([500, 500, 0], (until, 1)))
    assert rows[:until, 3] == pytest.approx(3000**2 / 12)
    assert errors_mm(rows, recording)[70:].max() < (40 if uses_odometry else 200)
    assert heading_errors(rows, recording)[70:].max() < 1e-9


def random_recording(n, seed, n_antennas):
    """Steps and reads without any sense, some beyond all bounds."""
    rng = np.random.Generator(np.random.PCG64(seed))
    odometry = rng.normal(0, [20, 20, 0.4], (n, 3)) * rng.choice([0.0, 1.0, 1.0, 1e3], (n, 1))
    counts = rng.choice([0, 0, 1, 2, 7], n)
    r = int(counts.sum())
    tags = np.round(rng.uniform(-2000, 2000, (r, 2)) / 100) * 100
    tags[rng.uniform(size=r) < 0.01] *= 1e4
    return Recording(
        DT, np.zeros((n + 1, 3)), odometry, np.concatenate([[0], np.cumsum(counts)]),
        rng.integers(0, n_antennas, r).astype(np.int32), np.zeros(r, np.int32), tags, rng.choice([0, 0.02, 50.0], r),
    )  # fmt: skip


@pytest.mark.parametrize("start", [AT_ORIGIN, BOX], ids=["known", "unknown"])
@pytest.mark.parametrize(("method", "uses_odometry"), VARIANTS)
def test_nonsense_leaves_numbers_and_a_positive_definite_covariance(method, uses_odometry, start):
    recording = random_recording(100_000, 5, 8)
    rows = tracked(ready_for(method, cross(), uses_odometry=uses_odometry, window=12), start, recording)
    assert np.isfinite(rows).all()
    assert (np.abs(rows[:, 2]) <= math.pi + 1e-12).all()
    assert (rows[:, 9] == 1.0).all()
    deviations = np.sqrt(rows[:, [3, 5, 8]])
    scaled = rows[:, 3:9][:, [0, 1, 3, 1, 2, 4, 3, 4, 5]].reshape(-1, 3, 3)
    scaled = scaled / (deviations[:, :, None] * deviations[:, None, :])
    assert np.linalg.eigvalsh(scaled).min() > 0


@pytest.mark.parametrize("start", [AT_ORIGIN, BOX], ids=["known", "unknown"])
@pytest.mark.parametrize(("method", "uses_odometry"), VARIANTS)
def test_tracking_a_recording_is_its_steps_one_by_one(method, uses_odometry, start):
    recording = random_recording(300, 6, 8)
    ready = ready_for(method, cross(), uses_odometry=uses_odometry, window=12)
    rows = tracked(ready, start, recording)
    state = geometric.init(ready, start, 0)
    for t in range(recording.n_steps):
        of_step = slice(recording.read_start[t], recording.read_start[t + 1])
        before = [part.copy() for part in state.arrays]
        moved = geometric.predict(ready, state, recording.odometry[t])
        assert all(map(np.array_equal, before, state.arrays))
        state = geometric.update(
            ready, moved,
            Reads(
                recording.read_antenna[of_step], recording.read_tag_mm[of_step], age_s=recording.read_age_s[of_step]
            ),
        )  # fmt: skip
        assert np.array_equal(state.moments, rows[t + 1])


@pytest.mark.parametrize("is_compensated", [True, False])
def test_an_old_read_is_applied_to_where_its_antenna_was(is_compensated):
    increments = np.tile([10.0, 0.0, 0.0], (100, 1))
    recording = drive(increments, (0, 0, 0), lambda pose: [pose[:2] - [5.0, 0.0]], age=DT / 2)
    ready = ready_for("rigid_fit", motion=NOISELESS, is_age_compensated=is_compensated)
    errors = errors_mm(tracked(ready, AT_ORIGIN, recording), recording)[1:]
    assert errors == pytest.approx(0.0 if is_compensated else 5.0, abs=1e-9)


ALL_ANSWER = ReadModel(answers="all")
# Each method on the hardware that it was made for; mean error [mm] and [rad] that it stays below on 100 tags/m2.
HARDWARE = {
    "odometry": (single(), "60x60", "square", ReadModel(), 600.0, 0.2),
    "rigid_fit": (cross(), "60x60", "square", ReadModel(), 30.0, 0.06),
    "trigonometric": (single(), "60x60", "square", ReadModel(), 90.0, 0.3),
    "motion_continuity": (single(), "navifloor", "triangular", ALL_ANSWER, 30.0, 0.12),
    "weighted_centre": (single(), "660x300", "square", ALL_ANSWER, 30.0, 0.08),
}


@pytest.mark.parametrize("method", METHODS)
def test_every_method_localizes_on_its_own_hardware(method):
    layout, name, kind, reads, most_mm, most_rad = HARDWARE[method]
    design = Design(layout, antenna(name), make_pattern(kind, tags_per_m2=100))
    floor = rectangle_floor(12_000, 10_000, footprint_radius_mm=320)
    scenario = Scenario(floor, world=World(reads=reads), estimator=Geometric(method), duration_s=40.0)
    metrics = evaluate(design, scenario, 10, seed=2).metrics()
    assert metrics["position_mean_mm"].mean < most_mm
    assert metrics["heading_mean_rad"].mean < most_rad
    ahead = Scenario(floor, routes=Routes(headings=("along",)), world=World(reads=reads), duration_s=20.0,
                     estimator=Geometric(method, uses_odometry=method == "odometry"))  # fmt: skip
    assert math.isfinite(evaluate(design, ahead, 4, seed=2).metrics()["position_mean_mm"].mean)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"method": "kinematics"}, ("method", "kinematics", *METHODS)),
        ({"method": "odometry", "uses_odometry": False}, ("uses_odometry", "odometry")),
        ({"method": "rigid_fit", "window": 0}, ("window", "0", "1", "100,000")),
        ({"method": "rigid_fit", "baseline_mm": 0.0}, ("baseline_mm", "above 0")),
        ({"method": "rigid_fit", "heading_gain": 1.5}, ("heading_gain", "1.5", "at most 1")),
        ({"method": "rigid_fit", "held_speed_mm_per_s": -1.0}, ("held_speed_mm_per_s", "-1.0", "at least 0")),
    ],
)
def test_a_bad_setting_is_named_with_its_value_and_bound(arguments, words):
    with pytest.raises(ValueError, match=words[0]) as error:
        Geometric(**arguments)
    assert all(word in str(error.value) for word in words)
