"""The filter as its readable side offers it: init, predict, update, estimate, and track for a whole recording."""

import math
from dataclasses import replace

import numpy as np
import pytest

from rfiddesign.estimators import mcl
from rfiddesign.estimators.start import KnownStart, UncertainStart, UnknownStart
from rfiddesign.geometry import Disc, PolygonArea, Rectangle, compose, cross, listed, to_local
from rfiddesign.models.likelihood import DistanceLikelihood
from rfiddesign.models.motion import OmnidirectionalMotion
from rfiddesign.models.recording import Reads, Recording
from rfiddesign.models.robot import Robot
from rfiddesign.numerics._noise_kernels import run_key

KEY = np.uint64(run_key(np.uint64(1), np.uint64(2)))
BOX = UnknownStart((-1000.0, -500.0, 2000.0, 1500.0))
LAYOUT, DT = cross(), 0.05
ROBOT = Robot(LAYOUT, Disc(30.0))


def a_recording(n_steps=120, seed=4, pitch=100.0, age=0.0):
    """A robot on a bent way over a lattice of tags; each antenna with a tag within 30 mm reads it at every step."""
    rng = np.random.Generator(np.random.PCG64(seed))
    odometry = np.column_stack([np.full(n_steps, 9.0), rng.normal(0, 2, n_steps), rng.normal(0, 0.03, n_steps)])
    poses = [np.array([203.0, -41.0, 0.6])]
    for increment in odometry:
        poses.append(compose(poses[-1], increment))
    start, antenna, tags = [0], [], []
    for pose in poses[1:]:
        places = compose(pose, LAYOUT.poses_mm)[:, :2]
        nearest = np.round(places / pitch) * pitch
        reading = np.flatnonzero(np.hypot(*(places - nearest).T) < 30.0)
        antenna.extend(reading)
        tags.extend(nearest[reading])
        start.append(len(antenna))
    return Recording(
        dt_s=DT,
        true_poses=np.array(poses),
        odometry=odometry + rng.normal(0, [1.2, 1.2, 0.002], (n_steps, 3)),
        read_start=np.array(start, np.int64),
        read_antenna=np.array(antenna, np.int32),
        read_tag=np.zeros(len(antenna), np.int32),
        read_tag_mm=np.array(tags, float).reshape(-1, 2),
        read_age_s=np.full(len(antenna), age),
    )


def stepped(ready, state, recording):
    """The filter by its single verbs; the estimate after each step (n_steps + 1, N_ESTIMATE)."""
    poses = [state.moments]
    for t in range(recording.n_steps):
        rows = slice(recording.read_start[t], recording.read_start[t + 1])
        state = mcl.predict(ready, state, recording.odometry[t])
        state = mcl.update(ready, state, Reads(recording.read_antenna[rows], recording.read_tag_mm[rows]))
        poses.append(state.moments)
    return state, np.array(poses)


def tracked(ready, state, recording, stops):
    poses = np.empty((recording.n_steps + 1, mcl.N_ESTIMATE))
    poses[0] = state.moments
    for stop in stops:
        state = mcl.track(ready, state, recording, stop, poses)
    return state, poses


@pytest.mark.parametrize("start", [KnownStart((203.0, -41.0, 0.6)), BOX], ids=["known", "unknown"])
@pytest.mark.parametrize("kind", ["gaussian", "combination", "field"])
@pytest.mark.parametrize("n_particles", [2, 333, 512])
def test_tracking_a_recording_is_its_steps_one_by_one_bit_for_bit(start, kind, n_particles):
    settings = mcl.Mcl(likelihood=DistanceLikelihood(kind=kind), n_particles=n_particles)
    ready = mcl.build(settings, ROBOT, DT)
    recording = a_recording()
    by_steps, poses_by_steps = stepped(ready, mcl.init(ready, start, KEY), recording)
    for stops in ((120,), (1, 2, 50, 50, 119, 120)):
        at_once, poses = tracked(ready, mcl.init(ready, start, KEY), recording, stops)
        assert np.array_equal(poses, poses_by_steps)
        assert np.array_equal(mcl.positions(ready, at_once), mcl.positions(ready, by_steps))
        assert np.array_equal(mcl.headings(ready, at_once), mcl.headings(ready, by_steps))
        assert at_once.step == by_steps.step == 120


def test_verbs_return_new_states_and_leave_the_old_ones_alone():
    ready = mcl.build(mcl.Mcl(), ROBOT, DT)
    before = mcl.init(ready, KnownStart((0.0, 0.0, 0.0)), KEY)
    kept = replace(before, arrays=mcl.workspace(before), moments=before.moments.copy())
    mcl.predict(ready, before, np.array([10.0, 0.0, 0.1]))
    mcl.update(ready, before, Reads(np.array([3]), np.array([[40.0, 10.0]])))
    mcl.track(ready, before, a_recording(), 20, np.empty((121, mcl.N_ESTIMATE)))
    for part, kept_part in zip(before.arrays, kept.arrays, strict=True):
        assert np.array_equal(part, kept_part)
    assert np.array_equal(before.moments, kept.moments)
    assert before.step == kept.step == 0


@pytest.mark.parametrize("kind", ["gaussian", "combination"])
@pytest.mark.parametrize("area", [Disc(30.0), Rectangle(320.0, 230.0)], ids=["disc", "rectangle"])
def test_an_update_estimates_the_mean_of_eq_3_with_the_weights_of_eq_6(kind, area):
    """The estimate of one step over its particles, all by hand in double precision; distances in sigmas."""
    layout = listed([(150.0, 0.0, 0.0), (0.0, -200.0, 0.8)])
    likelihood = DistanceLikelihood(kind=kind, sigma_per_radius=1.1, beta=0.25)
    ready = mcl.build(mcl.Mcl(likelihood=likelihood, n_particles=5000), Robot(layout, area), DT)
    state = mcl.init(ready, UnknownStart((-300.0, -300.0, 300.0, 300.0)), KEY)
    antenna, tags = np.array([1, 0]), np.array([[20.0, 30.0], [100.0, -60.0]])
    pose = mcl.estimate(mcl.update(ready, state, Reads(antenna, tags))).pose
    particles = np.column_stack([mcl.positions(ready, state).T, mcl.headings(ready, state)]).astype(float)
    weights = np.ones(5000)
    for a, tag in zip(antenna, tags, strict=True):
        z = to_local(compose(particles, layout.poses_mm[a]), tag)
        sigma = 2 * 1.1 * np.sqrt(np.diag(area.covariance_mm2))
        d = np.hypot(*(z / sigma).T)
        tail = np.exp(-(d**2) / 2)
        weights *= tail if kind == "gaussian" else np.where(d < 1, 1.0, 0.25 * tail)
    assert pose[:2] == pytest.approx(np.average(particles[:, :2], axis=0, weights=weights), abs=0.01)
    direction = np.sum(weights * np.exp(1j * particles[:, 2]))
    assert abs(np.angle(np.exp(1j * pose[2]) / direction)) < 1e-3


def test_a_step_without_reads_keeps_the_particles():
    """Line 4 is skipped where nothing is read (section 3): no resampling, the mean of the particles as estimate."""
    ready = mcl.build(mcl.Mcl(), ROBOT, DT)
    state = mcl.predict(ready, mcl.init(ready, BOX, KEY), np.array([5.0, 0.0, 0.0]))
    after = mcl.update(ready, state, Reads())
    assert np.array_equal(mcl.positions(ready, after), mcl.positions(ready, state))
    assert np.array_equal(mcl.headings(ready, after), mcl.headings(ready, state))
    assert mcl.estimate(after).pose[:2] == pytest.approx(
        mcl.positions(ready, state).mean(axis=1, dtype=float), abs=1e-3
    )
    assert after.step == state.step + 1


def test_a_known_start_is_where_it_says_and_an_unknown_one_anywhere_in_its_box():
    ready = mcl.build(mcl.Mcl(), ROBOT, DT)
    known = mcl.estimate(mcl.init(ready, KnownStart((10.0, 20.0, 4.0)), KEY))
    assert known.pose == pytest.approx((10.0, 20.0, 4.0))
    assert np.abs(known.covariance).max() < 1e-12
    unknown = mcl.init(ready, BOX, KEY)
    places = mcl.positions(ready, unknown)
    assert (places.min(axis=1) >= (-1000, -500)).all()
    assert (places.max(axis=1) <= (2000, 1500)).all()
    assert mcl.estimate(unknown).pose == pytest.approx((500.0, 500.0, 0.0))


def test_an_uncertain_start_has_the_mean_and_covariance_that_it_says():
    """Particles and estimate alike; variances within their chi-square spread, correlations within theirs."""
    n, deviations = 50_000, np.array([40.0, 20.0, 0.1])
    correlation = np.array([[1.0, -0.4, 0.7], [-0.4, 1.0, 0.2], [0.7, 0.2, 1.0]])
    covariance = correlation * np.outer(deviations, deviations)
    start = UncertainStart((500.0, -300.0, 3.1), covariance.tolist())
    ready = mcl.build(mcl.Mcl(n_particles=n), ROBOT, DT)
    state = mcl.init(ready, start, KEY)
    assert mcl.estimate(state).pose == pytest.approx(start.pose)
    assert mcl.estimate(state).covariance == pytest.approx(covariance)
    turn = np.angle(np.exp(1j * (mcl.headings(ready, state) - 3.1)))
    errors = np.column_stack([(mcl.positions(ready, state).T - [500.0, -300.0]), turn]) / deviations
    limit = 4.5 / math.sqrt(n)
    assert np.abs(errors.mean(axis=0)).max() < limit
    assert np.abs(np.cov(errors.T) - correlation).max() < math.sqrt(2) * limit


def test_covariance_is_that_of_the_particles_about_the_estimate():
    motion = OmnidirectionalMotion(200.0, 100.0, 0.4)
    ready = mcl.build(mcl.Mcl(motion=motion, n_particles=50_000), ROBOT, DT)
    state = mcl.init(ready, KnownStart((0.0, 0.0, 3.1)), KEY)
    state = mcl.predict(ready, state, np.zeros(3))
    covariance = mcl.estimate(mcl.update(ready, state, Reads())).covariance
    cosine, sine = math.cos(3.1), math.sin(3.1)
    turn = np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]])
    exact = turn @ np.diag([10.0, 5.0, 0.02]) ** 2 @ turn.T
    scale = np.sqrt(np.outer(np.diag(exact), np.diag(exact)))
    assert np.abs((covariance - exact) / scale).max() < 0.03


def test_reinitialization_can_be_turned_off():
    far_tag = np.array([[100_000.0, 0.0]])
    for is_on in (True, False):
        ready = mcl.build(mcl.Mcl(reinitialize=is_on), ROBOT, DT)
        state = mcl.init(ready, KnownStart((0.0, 0.0, 0.0)), KEY)
        after = mcl.update(ready, state, Reads(np.array([0]), far_tag))
        x, _ = mcl.positions(ready, after)
        assert (np.abs(x - 100_000) < 1000).all() == is_on
        assert (x == 0).all() != is_on


def test_antennas_that_see_off_their_centre_are_measured_from_what_they_see():
    """A tag right in the middle of what the antenna sees is the likeliest, wherever the antenna points."""
    area = PolygonArea(((0.0, -30.0), (90.0, -30.0), (90.0, 30.0), (0.0, 30.0)))
    layout = listed([(100.0, 50.0, 1.2)])
    ready = mcl.build(mcl.Mcl(), Robot(layout, area), DT)
    positions = ready.model[1]
    assert positions[0] == pytest.approx((100 + 45 * math.cos(1.2), 50 + 45 * math.sin(1.2)))


def test_compensation_takes_old_reads_for_what_they_are():
    """A robot that turns on the spot: the antenna that read half a step ago was half a step of turn behind."""
    n, turn, arm = 200, 0.05, 250.0
    truth = np.column_stack([np.zeros((n + 1, 2)), np.arange(n + 1) * turn])
    at_poll = truth[:-1] + np.array([0, 0, turn / 2])
    tags = np.ascontiguousarray(compose(at_poll, np.array([arm, 0.0, 0.0]))[:, :2])
    odometry, none = np.tile([0.0, 0.0, turn], (n, 1)), np.zeros(n, np.int32)
    recording = Recording(DT, truth, odometry, np.arange(n + 1), none, none, tags, np.full(n, DT / 2))
    lag = {}
    for is_compensated in (True, False):
        gaussian = DistanceLikelihood(kind="gaussian", sigma_per_radius=0.5)
        settings = mcl.Mcl(gaussian, is_age_compensated=is_compensated, n_particles=5000)
        ready = mcl.build(settings, Robot(listed([(arm, 0.0, 0.0)]), Disc(30.0)), DT)
        _, poses = tracked(ready, mcl.init(ready, KnownStart((0.0, 0.0, 0.0)), KEY), recording, (n,))
        places = compose(poses[:, :3], np.array([arm, 0.0, 0.0]))[:, :2]
        lag[is_compensated] = -to_local(truth, places)[n // 2 :, 1].mean()
    assert lag[False] == pytest.approx(arm * turn / 2, rel=0.15)
    assert abs(lag[True]) < 0.1 * lag[False]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"n_particles": 1}, ("n_particles", "1", "2", "1,000,000")),
        ({"n_particles": 2_000_000}, ("n_particles", "2000000", "1,000,000")),
        ({"n_particles": 2.5}, ("n_particles", "2.5")),
        ({"alpha": 0.0}, ("alpha", "0.0", "above 0")),
        ({"alpha": math.nan}, ("alpha", "nan")),
    ],
)
def test_a_bad_setting_is_named_with_its_value_and_bound(arguments, words):
    with pytest.raises(ValueError, match=words[0]) as error:
        mcl.Mcl(**arguments)
    assert all(word in str(error.value) for word in words)


def test_noise_that_could_turn_the_robot_about_within_a_step_is_refused():
    with pytest.raises(ValueError, match=r"noise of the heading.* is 1.0, .*0.49"):
        mcl.build(mcl.Mcl(motion=OmnidirectionalMotion(noise_heading_rad_per_s=20.0)), ROBOT, DT)


def test_a_recording_that_does_not_fit_is_refused_before_compiled_code_sees_it():
    ready = mcl.build(mcl.Mcl(), ROBOT, DT)
    state, recording, room = mcl.init(ready, BOX, KEY), a_recording(), np.empty((121, mcl.N_ESTIMATE))
    with pytest.raises(ValueError, match="last is 121, must be from 0 to 120"):
        mcl.track(ready, state, recording, 121, room)
    with pytest.raises(ValueError, match=r"estimates has shape \(100, 10\), must have more than 120 rows of 10"):
        mcl.track(ready, state, recording, 120, room[:100])
    wrong = replace(recording, read_antenna=recording.read_antenna + 8)
    with pytest.raises(ValueError, match="read_antenna has an index outside 0 to 7"):
        mcl.track(ready, state, wrong, 120, room)


def test_a_reader_may_return_several_tags_in_a_step():
    """More reads than antennas, as in recorded logs."""
    tags = np.tile([[10.0, 0.0]], (40, 1))
    log = Recording(
        DT, np.zeros((3, 3)), np.zeros((2, 3)), np.array([0, 40, 40]), np.zeros(40, np.int32),
        np.zeros(40, np.int32), tags, np.zeros(40),
    )  # fmt: skip
    ready = mcl.build(mcl.Mcl(), Robot(listed([(0.0, 0.0, 0.0)]), Disc(30.0)), DT)
    poses = np.empty((3, mcl.N_ESTIMATE))
    state = mcl.track(ready, mcl.init(ready, KnownStart((0.0, 0.0, 0.0)), KEY), log, 2, poses)
    _, by_steps = stepped(ready, mcl.init(ready, KnownStart((0.0, 0.0, 0.0)), KEY), log)
    assert np.array_equal(poses[1:], by_steps[1:])
    assert state.step == 2
