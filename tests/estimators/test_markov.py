"""The grid filter's claims: starts, the heading from places, and what it knows of its own error."""

import math
from dataclasses import replace

import numpy as np
import pytest

from rfiddesign.estimators import _markov_belief_kernels as kernels
from rfiddesign.estimators import markov, registry
from rfiddesign.estimators.markov import Markov
from rfiddesign.estimators.start import KnownStart, UncertainStart, UnknownStart
from rfiddesign.geometry import Disc, compose, cross
from rfiddesign.models.motion import DifferentialMotion, MecanumMotion
from rfiddesign.models.recording import Reads, Recording
from rfiddesign.models.robot import Robot
from tests.estimators.markov_drives import DT, NO_NOISE, OWN, SINGLE, a_drive, a_recording, drawn, tracked


def test_the_direction_between_two_tags_corrects_the_heading_by_the_formula():
    """A straight way from one tag to the next, and odometry that thinks it goes 0.1 rad further left than it does."""
    error, sigma_heading, length = 0.1, 0.12, 500.0
    ready = markov.build(Markov(motion=NO_NOISE), SINGLE, DT)
    prior = np.diag([1600.0, 1600.0, sigma_heading**2])
    state = markov.init(ready, UncertainStart((0.0, 0.0, error), tuple(map(tuple, prior))), 1)
    state = markov.update(ready, state, Reads(np.array([0]), np.zeros((1, 2))))
    first = markov.estimate(state)
    for _ in range(50):
        state = markov.update(ready, markov.predict(ready, state, np.array([length / 50, 0.0, 0.0])), Reads())
    before = markov.estimate(state)
    assert before.pose == pytest.approx([length * math.cos(error), length * math.sin(error), error], abs=1e-6)
    # The same tag again tells nothing of the heading, another one does.
    for tag in ((0.0, 0.0), (length, 0.0)):
        new = markov.update(ready, state, Reads(np.array([0]), np.array([tag])))
        after = markov.estimate(new)
        if tag == (0.0, 0.0):
            assert after.pose[2] == before.pose[2]
    moved = after.pose[:2] - first.pose[:2]
    across = np.array([-moved[1], moved[0]]) / np.linalg.norm(moved)
    variances = [across @ each.covariance[:2, :2] @ across + OWN for each in (first, after)]
    sigma = math.atan(math.sqrt(sum(variances)) / np.linalg.norm(moved))
    gain = sigma_heading**2 / (sigma_heading**2 + sigma**2)
    direction = math.atan2(moved[1], moved[0]) - error
    assert direction < -0.01
    assert after.pose[2] == pytest.approx(error + gain * direction, abs=1e-6)
    assert after.covariance[2, 2] == pytest.approx((1 - gain) * sigma_heading**2, rel=1e-6)


@pytest.mark.parametrize("sideways", [False, True])
def test_places_correct_the_heading_of_any_motion(sideways):
    """The direction of displacements counts: a robot that drives sideways learns its heading as well."""
    motion, rng = MecanumMotion(3.0, 3.0, 0.002, 0.01), np.random.Generator(np.random.PCG64(5))
    step = {"forward": 0.0, "sideways": 10.0} if sideways else {}
    poses, odometry = a_drive(rng, 600, motion, **step)
    recording = a_recording(rng, poses, odometry, np.zeros((1, 3)), 15.0, share=0.2)
    robot = replace(SINGLE, area=Disc(30.0))
    wrong = UncertainStart((0.0, 0.0, 0.2), ((100.0, 0, 0), (0, 100.0, 0), (0, 0, 0.04)))
    for corrects, low, high in ((True, 0.0, 0.05), (False, 0.1, 0.3)):
        ready = markov.build(Markov(motion=motion, corrects_heading=corrects), robot, DT)
        _, rows = tracked(ready, wrong, recording)
        assert low <= abs(rows[-1, 2] - poses[-1, 2]) < high


@pytest.mark.parametrize("start", [KnownStart((0.0, 0.0, 0.0)), UnknownStart((-1e3, -1e3, 1e3, 1e3))])
def test_tracking_a_recording_is_its_steps_one_by_one_bit_for_bit(start):
    motion, rng = DifferentialMotion(), np.random.Generator(np.random.PCG64(2))
    poses, odometry = a_drive(rng, 200, motion)
    recording = a_recording(rng, poses, odometry, np.zeros((1, 3)), 0.0, pitch=400.0)
    ready = markov.build(Markov(motion=motion), SINGLE, DT)
    state = markov.init(ready, start, 1)
    by_steps = [state.moments]
    for t in range(200):
        rows = slice(recording.read_start[t], recording.read_start[t + 1])
        state = markov.predict(ready, state, odometry[t])
        state = markov.update(ready, state, Reads(recording.read_antenna[rows], recording.read_tag_mm[rows]))
        by_steps.append(state.moments)
    for stops in ((), (1, 50, 50, 199)):
        end, rows = tracked(ready, start, recording, stops)
        assert np.array_equal(rows, by_steps)
        assert end.step == state.step == 200
        for mine, other in zip(end.arrays, state.arrays, strict=True):
            which = int(end.arrays[0][kernels.WHICH])
            assert np.array_equal(mine[which] if mine.ndim == 3 else mine, other[which] if mine.ndim == 3 else other)


def test_verbs_leave_old_beliefs_alone():
    ready, before = drawn(((900.0, 0.0, 0.0), (0.0, 900.0, 0.0), (0.0, 0.0, 0.01)))
    kept = [part.copy() for part in before.arrays]
    after = markov.predict(ready, before, np.array([10.0, 0.0, 0.1]))
    markov.update(ready, after, Reads(np.array([0]), np.array([[40.0, 10.0]])))
    assert all(np.array_equal(old, now) for old, now in zip(kept, before.arrays, strict=True))


def test_starts_are_what_they_say():
    ready = markov.build(Markov(), SINGLE, DT)
    known = markov.init(ready, KnownStart((10.0, 20.0, 0.4)), 1)
    assert markov.estimate(known).pose == pytest.approx((10.0, 20.0, 0.4))
    assert markov.estimate(known).covariance == pytest.approx(np.zeros((3, 3)))
    covariance = np.array([[900.0, 500.0, 0.5], [500.0, 1600.0, 0.0], [0.5, 0.0, 0.01]])
    vague = markov.init(ready, UncertainStart((10.0, 20.0, 0.4), tuple(map(tuple, covariance))), 1)
    told = markov.estimate(markov.update(ready, vague, Reads()))
    assert told.pose == pytest.approx((10.0, 20.0, 0.4))
    assert told.covariance == pytest.approx(covariance, rel=1e-4)
    unknown = markov.init(ready, UnknownStart((0.0, 0.0, 1200.0, 600.0)), 1)
    told = markov.estimate(markov.update(ready, markov.predict(ready, unknown, np.array([5.0, 0, 0])), Reads()))
    assert told.pose == pytest.approx((600.0, 300.0, 0.0))
    assert np.diag(told.covariance) == pytest.approx((120_000.0, 30_000.0, math.pi**2 / 3))


def test_two_tags_tell_a_robot_that_was_told_nothing():
    """Over many headings; what it then believes covers its error, and later reads leave no more than is usual."""
    rng, settled, first = np.random.Generator(np.random.PCG64(3)), [], []
    motion = DifferentialMotion()
    ready = markov.build(Markov(motion=motion), SINGLE, DT)
    for _ in range(20):
        start = (*rng.uniform(-200.0, 200.0, 2), rng.uniform(-math.pi, math.pi))
        poses, odometry = a_drive(rng, 900, motion, start)
        recording = a_recording(rng, poses, odometry, np.zeros((1, 3)), 0.0, pitch=400.0)
        _, rows = tracked(ready, UnknownStart((-500.0, -500.0, 500.0, 500.0)), recording)
        is_found = rows[:, 8] < 0.9 * math.pi**2 / 3
        assert is_found[-1]
        t = int(np.argmax(is_found))
        first.append(np.hypot(*(rows[t, :2] - poses[t, :2])) / math.sqrt(rows[t, 3] + rows[t, 5]))
        settled.append(np.hypot(*(rows[600:, :2] - poses[600:, :2]).T).mean())
    assert np.median(first) < 1.2
    assert np.median(settled) < 80.0


def test_a_robot_that_was_carried_away_is_found_again():
    rng, motion = np.random.Generator(np.random.PCG64(6)), DifferentialMotion()
    poses, odometry = a_drive(rng, 800, motion)
    recording = a_recording(rng, poses + np.array([5000.0, 3000.0, 0.0]), odometry, np.zeros((1, 3)), 0.0, pitch=400.0)
    ready = markov.build(Markov(motion=motion), SINGLE, DT)
    _, rows = tracked(ready, KnownStart((0.0, 0.0, 0.0)), recording)
    assert np.hypot(*(rows[-200:, :2] - poses[-200:, :2] - (5000.0, 3000.0)).T).mean() < 100.0


def test_a_robot_without_reads_for_long_knows_that_it_may_be_anywhere_and_is_found_by_two_tags():
    motion, rng = DifferentialMotion(wheel_noise_mm_per_sqrt_m=30.0), np.random.Generator(np.random.PCG64(10))
    poses, odometry = a_drive(rng, 4000, motion)
    recording = a_recording(rng, poses, odometry, np.zeros((1, 3)), 0.0, pitch=400.0)
    first = recording.read_start[3000]
    silent = replace(
        recording, read_start=np.maximum(recording.read_start - first, 0), read_antenna=recording.read_antenna[first:],
        read_tag_mm=recording.read_tag_mm[first:], read_age_s=recording.read_age_s[first:],
        read_tag=recording.read_tag[first:], read_rssi=recording.read_rssi[first:],
    )  # fmt: skip
    ready = markov.build(Markov(motion=motion), SINGLE, DT)
    _, rows = tracked(ready, KnownStart((0.0, 0.0, 0.0)), silent)
    assert math.sqrt(rows[3000, 3] + rows[3000, 5]) > 2000.0
    assert np.hypot(*(rows[-100:, :2] - poses[-100:, :2]).T).mean() < 150.0


@pytest.mark.parametrize("corrects_heading", [False, True])
def test_errors_stay_within_what_the_filter_believes_of_them_where_its_model_is_true(corrects_heading):
    """Mean of squared errors over variances: 1 if all is right; some reads, Gaussian as eq. 10 has them.

    Places that correct the heading already rest on it, so that its variance comes out somewhat small.
    """
    rng, motion = np.random.Generator(np.random.PCG64(4)), DifferentialMotion()
    ready = markov.build(Markov(motion=motion, corrects_heading=corrects_heading), SINGLE, DT)
    position, heading = [], []
    for _ in range(60):
        start = rng.multivariate_normal(np.zeros(3), np.diag([900.0, 900.0, 0.0025]))
        poses, odometry = a_drive(rng, 600, motion, start)
        recording = a_recording(rng, poses, odometry, np.zeros((1, 3)), 50.0, share=0.02)
        told = UncertainStart((0.0, 0.0, 0.0), ((900.0, 0, 0), (0, 900.0, 0), (0, 0, 0.0025)))
        _, rows = tracked(ready, told, recording)
        for t in range(100, 601, 50):
            error = rows[t, :2] - poses[t, :2]
            position.append(error @ np.linalg.solve(rows[t, [3, 4, 4, 5]].reshape(2, 2), error) / 2)
            heading.append((rows[t, 2] - poses[t, 2]) ** 2 / rows[t, 8])
    assert 0.75 < np.mean(position) < 1.3
    assert 0.7 < np.mean(heading) < (1.8 if corrects_heading else 1.3)


@pytest.mark.slow
def test_places_make_odometry_better_and_headings_make_places_better():
    """The paper's figure 5: tags 500 mm apart, an antenna of 100 mm radius at the centre of a robot with two wheels."""
    rng, motion, errors = np.random.Generator(np.random.PCG64(9)), DifferentialMotion(), []
    filters = [markov.build(Markov(motion=motion, corrects_heading=on), SINGLE, DT) for on in (False, True)]
    for _ in range(40):
        start = np.array([*rng.uniform(0.0, 500.0, 2), rng.uniform(-math.pi, math.pi)])
        poses, odometry = a_drive(rng, 1500, motion, start)
        recording = a_recording(rng, poses, odometry, np.zeros((1, 3)), 0.0, pitch=500.0)
        by_odometry = [poses[0]]
        for increment in odometry:
            by_odometry.append(compose(by_odometry[-1], increment))
        ways = [np.array(by_odometry), *(tracked(ready, KnownStart(tuple(start)), recording)[1] for ready in filters)]
        errors.append([np.hypot(*(way[:, :2] - poses[:, :2]).T).mean() for way in ways])
    odometry, xy, xy_theta = np.array(errors).T
    assert np.mean(xy < odometry) > 0.8
    assert np.mean(xy_theta < xy) > 0.6
    assert xy_theta.mean() < xy.mean() < odometry.mean()


@pytest.mark.parametrize("start", [KnownStart((0.0, 0.0, 0.0)), UnknownStart((-1e3, -1e3, 1e3, 1e3))])
@pytest.mark.parametrize("size", [1.0, 1e3])
def test_whatever_happens_the_estimate_stays_finite(start, size):
    n, rng = 100_000, np.random.Generator(np.random.PCG64(11))
    odometry = rng.normal(size=(n, 3)) * [8.0 * size, 5.0 * size, 0.05 * size]
    odometry[rng.random(n) < 0.3] = 0.0
    read_start = np.concatenate([[0], np.cumsum(rng.random(n) < 0.3)])
    n_reads = read_start[-1]
    tags = np.round(rng.normal(0.0, 300.0 * size, (n_reads, 2)) / 100.0) * 100.0
    tags[rng.random(n_reads) < 0.01] = 1e7
    recording = Recording(
        DT, np.zeros((n + 1, 3)), odometry, read_start, rng.integers(0, 8, n_reads).astype(np.int32),
        np.zeros(n_reads, np.int32), tags, rng.uniform(0.0, 10.0, n_reads),
    )  # fmt: skip
    settings = Markov(motion=MecanumMotion(), n_cells=31, baseline_mm=100.0)
    ready = markov.build(settings, Robot(cross(), Disc(30.0)), DT)
    _, rows = tracked(ready, start, recording)
    assert np.isfinite(rows).all()
    assert rows[1:, [3, 5, 8]].min() >= 0.0
    assert (rows[:, 3] * rows[:, 5] >= rows[:, 4] ** 2).all()


def test_the_registry_knows_the_filter():
    ready = registry.build(Markov(), SINGLE, DT)
    assert registry.init(ready, KnownStart((1.0, 2.0, 3.0)), 1).moments[:3] == pytest.approx((1.0, 2.0, 3.0))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"n_cells": 140}, ("n_cells", "140", "odd", "1001")),
        ({"n_cells": 1}, ("n_cells", "1", "3")),
        ({"n_cells": 1003}, ("n_cells", "1003", "1001")),
        ({"n_cells": 141.0}, ("n_cells", "141.0")),
        ({"cell_mm": 0.0}, ("cell_mm", "0.0", "0.1")),
        ({"sigma_per_radius": math.nan}, ("sigma_per_radius", "nan")),
        ({"baseline_mm": -1.0}, ("baseline_mm", "-1.0")),
    ],
)
def test_a_bad_setting_is_named_with_its_value_and_bound(arguments, words):
    with pytest.raises(ValueError, match=words[0]) as error:
        Markov(**arguments)
    assert all(word in str(error.value) for word in words)
