"""Each line of Algorithm 1 but the resampling, compiled, against a plain numpy twin in double precision."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from rfiddesign.estimators import _mcl_kernels as kernels
from rfiddesign.estimators import _particle_kernels as particle_kernels
from rfiddesign.estimators import _scatter_kernels as scatter_kernels
from rfiddesign.estimators import _weigh_kernels as weigh_kernels
from rfiddesign.estimators._particle_kernels import LOG
from rfiddesign.geometry import between, compose, to_local, transform_points
from rfiddesign.numerics._math_kernels import binary_angle
from tests.estimators.clouds import KEY, cloud_of, drawn_of, particles_of, poses_of, reads_of, width_of

RNG = np.random.Generator(np.random.PCG64(9))
PROPERTY = settings(max_examples=100, deadline=None, derandomize=True)
seeds = st.integers(0, 2**32 - 1)


def still_noise(deviations):
    """`Motion.noise` of a noise that is the same in every step."""
    return np.column_stack([np.square(np.array(deviations, float)), np.zeros((3, 2))])


def predicted(x, y, heading, increment, noise, step=0):
    """Particles after the step of the middle one of three increments."""
    n = x.size
    drawn, headings = drawn_of(x, y, heading)
    cloud = np.empty((particle_kernels.N_FIELDS, width_of(n)), np.float32)
    odometry = np.array([(1e3, 1e3, 1.0), increment, (-1e3, 0.0, -1.0)])
    kernels.predict(KEY, step, odometry, 1, noise, drawn, headings, cloud)
    particle_kernels.store(cloud, drawn, headings)
    return drawn[0, :n], drawn[1, :n], headings[:n]


# Line 3


@PROPERTY
@given(
    seed=seeds,
    dx=st.floats(-500, 500),
    dy=st.floats(-500, 500),
    turn=st.floats(-7, 7),
    n=st.sampled_from([2, 3, 16, 500, 501]),
)
def test_without_noise_a_step_composes_poses(seed, dx, dy, turn, n):
    """Also where the robot turns by more than half a turn in a step."""
    particles = particles_of(n, np.random.Generator(np.random.PCG64(seed)))
    moved = poses_of(*predicted(*particles, (dx, dy, turn), np.zeros((3, 3))))
    expected = compose(poses_of(*particles), np.array([dx, dy, turn]))
    assert np.abs(moved[:, :2] - expected[:, :2]).max() < 3e-4
    assert np.abs(between(expected, moved)[:, 2]).max() < 1e-8


def noise_of(n, n_steps, deviations, increment=(7.0, -3.0, 0.4)):
    """Noise (n_steps, n, 3) of steps in the robot's frame, in standard deviations."""
    still = np.zeros(n, np.float32), np.zeros(n, np.float32), np.zeros(n, np.int32)
    moved = np.array(
        [poses_of(*predicted(*still, increment, still_noise(deviations), step)) for step in range(n_steps)]
    )
    return (moved - np.array(increment)) / np.array(deviations)


@pytest.mark.parametrize("n", [500, 501])
def test_noise_of_a_step_is_normal_and_independent_between_axes_particles_and_steps(n):
    noise = noise_of(n, 1000, (10.0, 3.0, 0.05))
    limit = 4.5 / math.sqrt(noise[..., 0].size)
    for axis in range(3):
        x = noise[..., axis].ravel()
        assert abs(x.mean()) < limit
        assert abs(x.var() - 1) < math.sqrt(2) * limit
        assert stats.kstest(x, "norm").pvalue > 1e-3
        for sigmas in (3, 4):
            expected = 2 * x.size * stats.norm.sf(sigmas)
            assert abs(np.count_nonzero(np.abs(x) > sigmas) - expected) < 4.5 * math.sqrt(expected)
        # Of neighbours, of the two halves of the cloud, and of one particle from step to step.
        half = n // 2
        for a, b in (
            (noise[:, :-1, axis], noise[:, 1:, axis]),
            (noise[:, :half, axis], noise[:, -half:, axis]),
            (noise[:-1, :, axis], noise[1:, :, axis]),
        ):
            assert abs(np.corrcoef(a.ravel(), b.ravel())[0, 1]) < 1.5 * limit
            assert abs(np.corrcoef(a.ravel() ** 2, b.ravel() ** 2)[0, 1]) < 1.5 * limit
    for first, second in ((0, 1), (0, 2), (1, 2)):
        a, b = noise[..., first].ravel(), noise[..., second].ravel()
        assert abs(np.corrcoef(a, b)[0, 1]) < limit
        assert abs(np.corrcoef(a**2, b**2)[0, 1]) < limit


def test_noise_of_a_particle_does_not_depend_on_how_many_there_are():
    few, many = noise_of(3, 20, (10.0, 3.0, 0.05)), noise_of(500, 20, (10.0, 3.0, 0.05))
    assert np.array_equal(few, many[:, :3])


def test_noise_follows_the_robots_axes_not_the_worlds():
    quarter = np.full(20_000, binary_angle(math.pi / 2), np.int32)
    zero = np.zeros(20_000, np.float32)
    x, y, _ = predicted(zero, zero, quarter, (0, 0, 0), still_noise((10.0, 1.0, 0.0)))
    assert x.std() == pytest.approx(1.0, rel=0.03)
    assert y.std() == pytest.approx(10.0, rel=0.03)


def test_moved_particles_are_ready_to_be_weighed():
    """With sine and cosine of the new heading and weight 1, as if they had been drawn there."""
    drawn, headings = drawn_of(*particles_of(501, RNG))
    cloud, loaded = np.full((2, particle_kernels.N_FIELDS, width_of(501)), np.nan, np.float32)
    kernels.predict(KEY, 0, np.array([[5.0, 2.0, 0.3]]), 0, still_noise((1.0, 1.0, 0.1)), drawn, headings, cloud)
    particle_kernels.store(cloud, drawn, headings)
    particle_kernels.load(drawn, headings, loaded)
    assert np.array_equal(cloud[: LOG + 1].view(np.int32), loaded[: LOG + 1].view(np.int32))


# Line 4


def log_weights_of(particles, reads, *rules):
    """Log weights after these reads, each by eq. 6."""
    cloud = cloud_of(*particles)
    for k in range(len(reads)):
        weigh_kernels.weigh_by_distance(reads, k, *rules, cloud)
    return cloud[LOG, : particles[0].size]


def turned(angle):
    return np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])


@PROPERTY
@given(
    seed=seeds,
    sigma=st.floats(5, 200),
    beta=st.floats(0.01, 1.0),
    antenna=st.tuples(st.floats(-400, 400), st.floats(-400, 400)),
    is_combination=st.booleans(),
    whitening_turn=st.sampled_from([0.0, 0.7]),
)
def test_weight_of_a_disc_is_eq_6_to_the_letter(seed, sigma, beta, antenna, is_combination, whitening_turn):
    """Eq. 6 with the antenna where eq. 2 puts it; the Gaussian model is its second line with beta = 1.

    A whitening that turns is not a multiple of the identity, but leaves the distance.
    """
    rng = np.random.Generator(np.random.PCG64(seed))
    particles, tag = particles_of(300, rng), rng.uniform(-300, 300, 2)
    reader = transform_points(poses_of(*particles), np.array(antenna))
    distance = np.hypot(*(tag - reader).T)
    if is_combination:
        expected = np.where(distance < sigma, 0.0, math.log(beta) - distance**2 / (2 * sigma**2))
        rules = (1.0, math.log(beta))
    else:
        expected, rules = -(distance**2) / (2 * sigma**2), (0.0, 0.0)
    log_weights = log_weights_of(particles, reads_of(tag, antenna, turned(whitening_turn) / sigma), *rules)
    is_clear = np.abs(distance - sigma) > 1e-3
    assert np.allclose(log_weights[is_clear], expected[is_clear], rtol=2e-5, atol=2e-5)


@pytest.mark.parametrize("whitening", [np.eye(2) / 50, np.array([[0.02, 0.005], [0.0, 0.05]])])
def test_weights_of_several_reads_multiply(whitening):
    particles = particles_of(100, RNG)
    reads = reads_of(*RNG.uniform(-100, 100, (2, 3, 2)), whitening)
    once = [log_weights_of(particles, reads[k : k + 1], 1.0, -1.0) for k in range(3)]
    assert np.allclose(log_weights_of(particles, reads, 1.0, -1.0), np.sum(once, axis=0), atol=1e-4)


def test_whitening_acts_on_the_tag_as_the_robot_sees_it():
    particles, tag, antenna = particles_of(500, RNG), np.array([40.0, 10.0]), np.array([150.0, -20.0])
    whitening = np.array([[0.02, 0.005], [0.0, 0.05]])
    z = to_local(poses_of(*particles), tag) - antenna
    expected = -0.5 * np.sum((z @ whitening.T) ** 2, axis=-1)
    log_weights = log_weights_of(particles, reads_of(tag, antenna, whitening), 0.0, 0.0)
    assert np.allclose(log_weights, expected, rtol=2e-5, atol=2e-5)


@pytest.mark.parametrize("whitening_turn", [0.0, 0.7])
def test_weights_far_from_the_origin_keep_their_meaning(whitening_turn):
    """100 m off, a float32 millimetre is good to 1/256: weights move by less than that over sigma."""
    centre = np.array([80_000.0, 60_000.0])
    particles = particles_of(2000, RNG, extent=60.0, centre=centre)
    distance = np.hypot(*(centre - poses_of(*particles)[:, :2]).T)
    log_weights = log_weights_of(particles, reads_of(centre, (0.0, 0.0), turned(whitening_turn) / 30), 0.0, 0.0)
    assert np.abs(log_weights + distance**2 / 1800).max() < 0.01


@pytest.mark.parametrize("yaw", [0.0, 0.7])
def test_weight_of_a_field_is_the_cell_that_the_tag_lies_in(yaw):
    """Looked up in the antenna's frame; any place beyond the table has its border's value; a read names its table."""
    particles, tag, antenna = particles_of(5000, RNG, extent=80.0), np.array([10.0, 5.0]), np.array([20.0, -10.0])
    tables = np.full((3, 12, 10), -6.0, np.float32)
    tables[:, 1:-1, 1:-1] = RNG.uniform(-3, 0, (3, 10, 8))
    place = (to_local(poses_of(*particles), tag) - antenna) @ turned(yaw).T / 8.0 + np.array([6.0, 5.0])
    cell = np.clip(np.floor(place).astype(int), 0, [11, 9])
    is_clear = (np.abs(place - np.round(place)) > 1e-3).all(axis=1)
    for number, table in enumerate(tables):
        cloud = cloud_of(*particles)
        weigh_kernels.weigh_by_field(reads_of(tag, antenna, turned(yaw), number), 0, tables, 8.0, cloud)
        found = cloud[LOG, :5000]
        assert np.array_equal(found[is_clear], table[cell[:, 0], cell[:, 1]][is_clear])
        assert np.unique(found).size > 50


@pytest.mark.parametrize("n", [1, 7, 8, 20])
def test_weights_of_discs_are_the_products_of_what_each_row_says(n):
    """a + b (S(outer) - S(inner)) of a row's disc, at least 0.001; S a cubic between 0 and 1 about its radius."""
    particles, rng = particles_of(5000, RNG, extent=80.0), np.random.Generator(np.random.PCG64(n))
    tags, antennas, numbers = rng.uniform(-40, 40, (n, 2)), rng.uniform(-30, 30, (n, 2)), rng.integers(0, 4, n)
    discs = np.array([[60, -1e9, 0, 0.9], [60, 40, 0, 0.9], [40, -1e9, 0, 0.9], [60, -1e9, 1, -0.9]], np.float32)
    width = 20.0
    z = to_local(poses_of(*particles)[:, None], tags) - antennas
    distance, expected = np.hypot(*np.moveaxis(z, -1, 0)), np.zeros(5000)
    for k, (outer, inner, a, b) in enumerate(discs[numbers].astype(float)):
        t = np.clip((np.array([outer, inner])[:, None] - distance[:, k]) / width + 0.5, 0, 1)
        within = t * t * (3 - 2 * t)
        expected += np.log(np.maximum(a + b * (within[0] - within[1]), 1e-3))
    cloud = cloud_of(*particles)
    weigh_kernels.weigh_by_discs(reads_of(tags, antennas, turned(0.7), numbers), n, discs[:, :, None], 1 / width, cloud)
    # In single precision what is left of 1 - 0.9 is good to a millionth.
    assert np.abs(cloud[LOG, :5000] - expected).max() < 3e-4


# Lines 11 to 13


def restarted(particles, log_weights, log_alpha, reads, n_reads, step=0):
    """Particles after the restart of those that weigh too little, and how many restarted."""
    n = particles[0].size
    drawn, headings = drawn_of(*particles)
    drawn[2, :n] = log_weights
    drawn[2, n:] = -1e3
    n_restarted = scatter_kernels.reinitialize(KEY, step, np.float32(log_alpha), reads, n_reads, n, drawn, headings)
    # What lies beyond the last particle is none.
    assert (drawn[:2, n:] == -7).all()
    assert (headings[n:] == -7).all()
    return (drawn[0, :n], drawn[1, :n], headings[:n]), n_restarted


def test_a_restarted_particle_has_the_reading_antenna_exactly_over_the_read_tag():
    """Eq. 4, with any heading alike, the reads dealt evenly, and none but the step's own."""
    n, n_reads = 30_000, 3
    tags = np.array([[1000.0, 2000.0], [-40.0, 7.0], [300.0, 0.0]])
    antennas = np.array([[150.0, 0.0], [0.0, -250.0], [70.0, 30.0]])
    reads = np.vstack([reads_of(tags, antennas, np.eye(2)), np.full((2, kernels.N_READ), 9e9, np.float32)])
    particles, n_restarted = restarted(particles_of(n, RNG), -20.0, -13.8, reads, n_reads, step=4)
    assert n_restarted == n
    over = transform_points(poses_of(*particles)[:, None], antennas)
    distance = np.hypot(*np.moveaxis(over - tags, -1, 0))
    assert np.bincount(distance.argmin(axis=1)).tolist() == [n // n_reads] * n_reads
    assert distance.min(axis=1).max() < 1e-3
    for read in range(n_reads):
        turns = particles[2][distance.argmin(axis=1) == read] / 2.0**32 + 0.5
        assert stats.kstest(turns, "uniform").pvalue > 1e-3


NO_ARM = reads_of((0.0, 0.0), (0.0, 0.0), np.eye(2))


def test_only_particles_whose_weight_is_below_alpha_restart():
    particles = particles_of(1000, RNG)
    log_weights = RNG.uniform(-20, 0, 1000).astype(np.float32)
    log_weights[:3] = np.float32(-13.8), np.nextafter(np.float32(-13.8), np.float32(-20)), 0.0
    after, n_restarted = restarted(particles, log_weights, -13.8, NO_ARM, 1)
    is_kept = log_weights >= np.float32(-13.8)
    assert n_restarted == np.count_nonzero(~is_kept) > 0
    assert is_kept[0]
    assert not is_kept[1]
    for part, before in zip(after, particles, strict=True):
        assert np.array_equal(part[is_kept], before[is_kept])
        assert (part[~is_kept] != before[~is_kept]).all()


def test_restarts_of_different_steps_differ():
    first, second = (restarted(particles_of(100, RNG), -20.0, -13.8, NO_ARM, 1, step)[0][2] for step in (0, 1))
    assert not np.isin(first, second).any()


def test_a_start_anywhere_fills_the_box_evenly_with_every_heading():
    n = 20_000
    x, y, heading = np.empty(n, np.float32), np.empty(n, np.float32), np.empty(n, np.int32)
    scatter_kernels.scatter(KEY, -100.0, 50.0, 300.0, 60.0, x, y, heading)
    parts = (x.astype(float) + 100) / 400, (y.astype(float) - 50) / 10, heading / 2.0**32 + 0.5
    for part in parts:
        assert stats.kstest(part, "uniform").pvalue > 1e-3
    assert np.abs(np.corrcoef(parts) - np.eye(3)).max() < 4.5 / math.sqrt(n)
