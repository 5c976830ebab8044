"""Each line of Algorithm 1, compiled, against a plain numpy twin in double precision."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from rfiddesign.estimators import _mcl_kernels as kernels
from rfiddesign.geometry import between, compose, to_local, transform_points
from rfiddesign.models._math_kernels import RADIANS_PER_BINARY_UNIT, binary_angle
from rfiddesign.models._noise_kernels import STREAM_RESAMPLE, fill_uniform, run_key, step_key

KEY = np.uint64(run_key(np.uint64(5), np.uint64(3)))
RNG = np.random.Generator(np.random.PCG64(9))
PROPERTY = settings(max_examples=100, deadline=None, derandomize=True)
seeds = st.integers(0, 2**32 - 1)


def cloud(n, rng=RNG, extent=200.0, centre=(0.0, 0.0)):
    """x, y (float32) and binary headings of n particles."""
    x, y = (rng.uniform(-extent, extent, (2, n)) + np.array(centre)[:, None]).astype(np.float32)
    return x, y, rng.integers(-(2**31), 2**31, n).astype(np.int32)


def poses_of(x, y, heading):
    return np.stack([x, y, heading * RADIANS_PER_BINARY_UNIT], axis=-1).astype(float)


LANES = kernels.LANES


def room_for(n):
    """Arrays of the compiled filter for n particles: cloud, drawn, headings."""
    n_blocks = -(-n // LANES)
    room = n_blocks * LANES + kernels.COPIES
    return (
        np.zeros((n_blocks, kernels.BLOCK_SIZE), np.float32), np.zeros((3, room), np.float32), np.zeros(room, np.int32),
    )  # fmt: skip


def field_of(blocks, k, n):
    """Field k of the n particles of a cloud, float32."""
    return blocks.reshape(len(blocks), 7, LANES)[:, k].ravel()[:n]


def blocks_of(x, y, heading, **fields):
    """A cloud of these particles with their sines and cosines; `log` and `weight` are set where given."""
    blocks, drawn, headings = room_for(x.size)
    drawn[0, : x.size], drawn[1, : x.size], headings[: x.size] = x, y, heading
    kernels.load(drawn, headings, blocks)
    kernels.begin_weights(blocks)
    for name, k in (("log", 5), ("weight", 6)):
        if name in fields:
            values = np.zeros(len(blocks) * LANES, np.float32)
            values[: x.size] = fields[name]
            blocks.reshape(len(blocks), 7, LANES)[:, k] = values.reshape(-1, LANES)
    return blocks


def predicted(x, y, heading, increment, deviations, step=0):
    n = x.size
    blocks, drawn, headings = room_for(n)
    drawn[0, :n], drawn[1, :n], headings[:n] = x, y, heading
    kernels.predict(KEY, step, n, np.array(increment, float), np.array(deviations, float), drawn, headings, blocks)
    kernels.store(blocks, drawn, headings)
    return drawn[0, :n], drawn[1, :n], headings[:n]


# Line 3


@PROPERTY
@given(
    seed=seeds,
    dx=st.floats(-500, 500),
    dy=st.floats(-500, 500),
    turn=st.floats(-7, 7),
    n=st.sampled_from([2, 3, 500, 501]),
)
def test_without_noise_a_step_composes_poses(seed, dx, dy, turn, n):
    """Also where the robot turns by more than half a turn in a step."""
    particles = cloud(n, np.random.Generator(np.random.PCG64(seed)))
    moved = poses_of(*predicted(*particles, (dx, dy, turn), (0, 0, 0)))
    expected = compose(poses_of(*particles), np.array([dx, dy, turn]))
    assert np.abs(moved[:, :2] - expected[:, :2]).max() < 3e-4
    assert np.abs(between(expected, moved)[:, 2]).max() < 1e-8


def noise_of(n, n_steps, deviations, increment=(7.0, -3.0, 0.4)):
    """Noise (n_steps, n, 3) of steps in the robot's frame, in standard deviations."""
    still = np.zeros(n, np.float32), np.zeros(n, np.float32), np.zeros(n, np.int32)
    moved = np.array([poses_of(*predicted(*still, increment, deviations, step)) for step in range(n_steps)])
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


def test_noise_follows_the_robots_axes_not_the_worlds():
    quarter = np.full(20_000, binary_angle(math.pi / 2), np.int32)
    zero = np.zeros(20_000, np.float32)
    x, y, _ = predicted(zero, zero, quarter, (0, 0, 0), (10.0, 1.0, 0.0))
    assert x.std() == pytest.approx(1.0, rel=0.03)
    assert y.std() == pytest.approx(10.0, rel=0.03)


# Line 4


def log_weights_of(particles, tag, antenna, whitening, inner_radius, log_tail):
    blocks = blocks_of(*particles)
    kernels.weigh_by_distance(
        np.array(tag, float), np.array(antenna, float), whitening.astype(np.float32), inner_radius, log_tail, blocks
    )
    return field_of(blocks, 5, particles[0].size)


@PROPERTY
@given(
    seed=seeds,
    sigma=st.floats(5, 200),
    beta=st.floats(0.01, 1.0),
    antenna=st.tuples(st.floats(-400, 400), st.floats(-400, 400)),
    is_combination=st.booleans(),
)
def test_weight_of_a_disc_is_eq_6_to_the_letter(seed, sigma, beta, antenna, is_combination):
    """Eq. 6 with the antenna where eq. 2 puts it; the Gaussian model is its second line with beta = 1."""
    rng = np.random.Generator(np.random.PCG64(seed))
    particles, tag = cloud(300, rng), rng.uniform(-300, 300, 2)
    reader = transform_points(poses_of(*particles), np.array(antenna))
    distance = np.hypot(*(tag - reader).T)
    if is_combination:
        expected = np.where(distance < sigma, 0.0, math.log(beta) - distance**2 / (2 * sigma**2))
        rules = (1.0, math.log(beta))
    else:
        expected, rules = -(distance**2) / (2 * sigma**2), (0.0, 0.0)
    log_weights = log_weights_of(particles, tag, antenna, np.eye(2) / sigma, *rules)
    is_clear = np.abs(distance - sigma) > 1e-3
    assert np.allclose(log_weights[is_clear], expected[is_clear], rtol=2e-5, atol=2e-5)


def test_weights_of_several_reads_multiply():
    particles = cloud(100)
    tags, antennas = RNG.uniform(-100, 100, (2, 3, 2))
    once = [log_weights_of(particles, t, a, np.eye(2) / 50, 1.0, -1.0) for t, a in zip(tags, antennas, strict=True)]
    blocks = blocks_of(*particles)
    for tag, antenna in zip(tags, antennas, strict=True):
        kernels.weigh_by_distance(tag, antenna, (np.eye(2) / 50).astype(np.float32), 1.0, -1.0, blocks)
    total = field_of(blocks, 5, 100)
    assert np.allclose(total, np.sum(once, axis=0), atol=1e-4)


def test_whitening_acts_on_the_tag_as_the_robot_sees_it():
    particles, tag, antenna = cloud(500), np.array([40.0, 10.0]), np.array([150.0, -20.0])
    whitening = np.array([[0.02, 0.005], [0.0, 0.05]])
    z = to_local(poses_of(*particles), tag) - antenna
    expected = -0.5 * np.sum((z @ whitening.T) ** 2, axis=-1)
    assert np.allclose(log_weights_of(particles, tag, antenna, whitening, 0.0, 0.0), expected, rtol=2e-5, atol=2e-5)


def test_weights_far_from_the_origin_keep_their_meaning():
    """100 m off, a float32 millimetre is good to 1/256: weights move by less than that over sigma."""
    centre = np.array([80_000.0, 60_000.0])
    particles = cloud(2000, extent=60.0, centre=centre)
    distance = np.hypot(*(centre - poses_of(*particles)[:, :2]).T)
    log_weights = log_weights_of(particles, centre, (0.0, 0.0), np.eye(2) / 30, 0.0, 0.0)
    assert np.abs(log_weights + distance**2 / 1800).max() < 0.01


def test_weight_of_a_field_is_the_cell_that_the_tag_lies_in():
    """Looked up in the antenna's frame; every place beyond the table has its border's value."""
    particles, tag, antenna, yaw = cloud(5000, extent=80.0), np.array([10.0, 5.0]), np.array([20.0, -10.0]), 0.7
    table = np.full((12, 10), -6.0, np.float32)
    table[1:-1, 1:-1] = RNG.uniform(-3, 0, (10, 8))
    rotation = np.array([[math.cos(yaw), math.sin(yaw)], [-math.sin(yaw), math.cos(yaw)]])
    blocks = blocks_of(*particles)
    kernels.weigh_by_field(tag, antenna, rotation.astype(np.float32), table, 8.0, blocks)
    place = (to_local(poses_of(*particles), tag) - antenna) @ rotation.T / 8.0 + np.array([6.0, 5.0])
    cell = np.clip(np.floor(place).astype(int), 0, [11, 9])
    is_clear = (np.abs(place - np.round(place)) > 1e-3).all(axis=1)
    found = field_of(blocks, 5, 5000)
    assert np.array_equal(found[is_clear], table[cell[:, 0], cell[:, 1]][is_clear])
    assert np.unique(found).size > 50


@PROPERTY
@given(seed=seeds, spread=st.floats(0.01, 300), level=st.floats(-1e4, 1e4))
def test_normalized_weights_are_relative_to_the_best(seed, spread, level):
    log_weights = (level + spread * np.random.Generator(np.random.PCG64(seed)).standard_normal(100)).astype(np.float32)
    zeros = np.zeros(100, np.float32)
    blocks = blocks_of(zeros, zeros, zeros.astype(np.int32), log=log_weights)
    kernels.normalize(100, blocks)
    weights = field_of(blocks, 6, 100)
    assert not field_of(blocks, 6, 2 * LANES)[100:].any()
    exact = np.exp(np.maximum(log_weights.astype(float) - log_weights.max(), -80))
    assert np.allclose(weights, exact, rtol=1e-5, atol=0)
    assert weights.max() == 1.0
    assert weights.min() > 0.0


# Eq. 3


@PROPERTY
@given(seed=seeds, centre=st.tuples(st.floats(-1e5, 1e5), st.floats(-1e5, 1e5)))
def test_estimate_is_that_of_numpy(seed, centre):
    rng = np.random.Generator(np.random.PCG64(seed))
    x, y, heading = cloud(200, rng, centre=centre)
    weights = rng.random(200).astype(np.float32)
    out = np.empty(kernels.N_ESTIMATE)
    total = kernels.estimate(blocks_of(x, y, heading, weight=weights), out)
    w, theta = weights.astype(float), heading * RADIANS_PER_BINARY_UNIT
    assert total == pytest.approx(w.sum(), rel=1e-6)
    # Offsets from the first particle are float32.
    assert out[0] == pytest.approx(np.average(x.astype(float), weights=w), abs=1e-3)
    assert out[1] == pytest.approx(np.average(y.astype(float), weights=w), abs=1e-3)
    resultant = np.sum(w * np.exp(1j * theta))
    assert abs(np.angle(np.exp(1j * out[2]) / resultant)) * abs(resultant) < 1e-4
    # The spread is taken about float32 means.
    turn = np.angle(np.exp(1j * (theta - out[2])))
    offsets = np.stack([x - np.float32(out[0]), y - np.float32(out[1]), turn]).astype(float)
    exact = (offsets * w) @ offsets.T / w.sum()
    scale = np.sqrt(np.outer(np.diag(exact), np.diag(exact)))
    found = np.array([[out[3], out[4], out[6]], [out[4], out[5], out[7]], [out[6], out[7], out[8]]])
    assert np.abs((found - exact) / scale).max() < 1e-5
    assert out[9] == pytest.approx(w.sum() ** 2 / (w**2).sum(), rel=1e-6)


def test_headings_on_both_sides_of_half_a_turn_average_to_half_a_turn():
    heading = np.array([binary_angle(math.pi - 0.1), binary_angle(-math.pi + 0.1)], np.int32)
    out, zero = np.empty(kernels.N_ESTIMATE), np.zeros(2, np.float32)
    kernels.estimate(blocks_of(zero, zero, heading, weight=1.0), out)
    assert abs(out[2]) == pytest.approx(math.pi, abs=1e-6)
    assert out[8] == pytest.approx(0.01, rel=1e-5)


# Lines 7 to 10


def resampled(x, y, heading, log_weights, weights, step=0, key=KEY):
    """Particles drawn from these; nothing may be written beyond the room that the kernel is promised."""
    n = x.size
    blocks = blocks_of(x, y, heading, log=log_weights, weight=weights.astype(np.float32))
    room = -(-n // LANES) * LANES + kernels.COPIES
    drawn, headings = np.full((3, room + 16), -7.0, np.float32), np.full(room + 16, -7, np.int32)
    total = float(weights.astype(np.float32).astype(float).sum())
    kernels.resample(key, step, n, total, blocks, drawn, headings)
    beyond = n + kernels.COPIES
    assert (drawn[:, beyond:] == -7).all()
    assert (headings[beyond:] == -7).all()
    return drawn[0, :n], drawn[1, :n], headings[:n], drawn[2, :n]


def ancestors_of(weights, step=0, key=KEY):
    """Numbers of the drawn particles."""
    n = weights.size
    zeros = np.zeros(n, np.float32)
    return resampled(np.arange(n, dtype=np.float32), zeros, zeros.astype(np.int32), zeros, weights, step, key)[0]


weight_lists = st.lists(
    st.one_of(st.just(0.0), st.just(1.0), st.just(1e-7), st.floats(0, 1, width=32)), min_size=2, max_size=200
)


@PROPERTY
@given(weights=weight_lists, step=st.integers(0, 10_000))
def test_each_particle_is_drawn_the_floor_or_the_ceiling_of_its_share(weights, step):
    weights = np.array([*weights, 1.0], np.float32)
    counts = np.bincount(ancestors_of(weights, step).astype(int), minlength=weights.size)
    share = weights.size * weights.astype(float) / weights.astype(float).sum()
    # Shares are rounded to 2^-20 of a draw and better.
    assert counts.sum() == weights.size
    assert (counts >= np.floor(share - 1e-4)).all()
    assert (counts <= np.ceil(share + 1e-4)).all()


@PROPERTY
@given(weights=weight_lists, step=st.integers(0, 10_000))
def test_draws_are_those_of_searchsorted(weights, step):
    weights = np.array([*weights, 1.0], np.float32)
    n = weights.size
    offset = np.empty(1, np.float32)
    fill_uniform(np.uint64(step_key(KEY, STREAM_RESAMPLE, step)), offset)
    cumulative = np.cumsum(weights.astype(float))
    marks = (np.arange(n) + float(offset[0])) * cumulative[-1] / n
    exact = np.searchsorted(cumulative, marks, side="right")
    # A draw that falls within rounding of the border between two particles may take either.
    is_clear = np.abs(cumulative[:, None] - marks).min(axis=0) > 1e-5 * cumulative[-1] / n
    assert np.array_equal(ancestors_of(weights, step)[is_clear], exact[is_clear])


@pytest.mark.parametrize("best", [0, 1, 250, 498, 499])
def test_one_particle_can_take_every_draw(best):
    weights = np.zeros(500)
    weights[best] = 1.0
    assert (ancestors_of(weights) == best).all()


def test_equal_weights_keep_every_particle():
    for n in (2, 3, 7, 500, 100_000):
        assert np.array_equal(ancestors_of(np.full(n, 0.3)), np.arange(n))


def test_resampling_is_unbiased():
    weights = np.array([0.02, 0.5, 0.031, 0.9, 0.3, 0.004, 1.0])
    counts = np.array([np.bincount(ancestors_of(weights, step).astype(int), minlength=7) for step in range(20_000)])
    share = 7 * weights / weights.sum()
    assert np.abs(counts.mean(axis=0) - share).max() < 4.5 * 0.5 / math.sqrt(20_000)


def test_drawn_particles_are_copied_whole():
    x, y, heading = cloud(500)
    log_weights, weights = RNG.random((2, 500)).astype(np.float32)
    weights[::7] *= 20
    ancestors = ancestors_of(weights).astype(int)
    assert np.bincount(ancestors).max() > kernels.COPIES
    for copy, original in zip(
        resampled(x, y, heading, log_weights, weights), (x, y, heading, log_weights), strict=True
    ):
        assert np.array_equal(copy, original[ancestors])


# Lines 11 to 13


def test_a_restarted_particle_has_the_reading_antenna_exactly_over_the_read_tag():
    """Eq. 4, with any heading alike, the reads dealt evenly."""
    n, n_reads = 30_000, 3
    tags = np.array([[1000.0, 2000.0], [-40.0, 7.0], [300.0, 0.0]])
    antennas = np.array([[150.0, 0.0], [0.0, -250.0], [70.0, 30.0]])
    x, y, heading = cloud(n)
    log_weights = np.full(n, -20.0, np.float32)
    assert kernels.reinitialize(KEY, 4, -13.8, tags, antennas, x, y, heading, log_weights) == n
    over = transform_points(poses_of(x, y, heading)[:, None], antennas)
    distance = np.hypot(*np.moveaxis(over - tags, -1, 0))
    assert np.bincount(distance.argmin(axis=1)).tolist() == [n // n_reads] * n_reads
    assert distance.min(axis=1).max() < 1e-3
    for read in range(n_reads):
        turns = heading[distance.argmin(axis=1) == read] / 2.0**32 + 0.5
        assert stats.kstest(turns, "uniform").pvalue > 1e-3


def test_only_particles_whose_weight_is_below_alpha_restart():
    particles = cloud(1000)
    log_weights = RNG.uniform(-20, 0, 1000).astype(np.float32)
    log_weights[:3] = np.float32(-13.8), np.nextafter(np.float32(-13.8), np.float32(-20)), 0.0
    log_alpha = float(np.float32(-13.8))
    x, y, heading = (part.copy() for part in particles)
    n = kernels.reinitialize(KEY, 0, log_alpha, np.zeros((1, 2)), np.zeros((1, 2)), x, y, heading, log_weights)
    is_kept = log_weights >= log_alpha
    assert n == np.count_nonzero(~is_kept) > 0
    assert is_kept[0]
    assert not is_kept[1]
    for part, before in zip((x, y, heading), particles, strict=True):
        assert np.array_equal(part[is_kept], before[is_kept])
        assert (part[~is_kept] != before[~is_kept]).all()


def test_restarts_of_different_steps_differ():
    headings = []
    for step in (0, 1):
        x, y, heading = cloud(100)
        low = np.full(100, -20, np.float32)
        kernels.reinitialize(KEY, step, -13.8, np.zeros((1, 2)), np.zeros((1, 2)), x, y, heading, low)
        headings.append(heading)
    assert not np.isin(headings[0], headings[1]).any()


def test_a_start_anywhere_fills_the_box_evenly_with_every_heading():
    n = 20_000
    x, y, heading = np.empty(n, np.float32), np.empty(n, np.float32), np.empty(n, np.int32)
    kernels.scatter(KEY, -100.0, 50.0, 300.0, 60.0, x, y, heading)
    parts = (x.astype(float) + 100) / 400, (y.astype(float) - 50) / 10, heading / 2.0**32 + 0.5
    for part in parts:
        assert stats.kstest(part, "uniform").pvalue > 1e-3
    assert np.abs(np.corrcoef(parts) - np.eye(3)).max() < 4.5 / math.sqrt(n)


# Reads that are older than the step


@PROPERTY
@given(
    increment=st.tuples(st.floats(-100, 100), st.floats(-100, 100), st.floats(-2, 2)),
    phase=st.floats(0, 1),
    antenna=st.tuples(st.floats(-400, 400), st.floats(-400, 400)),
    start=st.tuples(st.floats(-1e3, 1e3), st.floats(-1e3, 1e3), st.floats(-3, 3)),
)
def test_an_old_read_is_applied_to_where_its_antenna_was(increment, phase, antenna, start):
    """A robot that drives straight and turns evenly over the step, as the simulated one does."""
    start, dt = np.array(start), 0.05
    end = compose(start, np.array(increment))
    at_poll = np.array([*start[:2] + phase * (end[:2] - start[:2]), start[2] + phase * increment[2]])
    expected = to_local(end, transform_points(at_poll, np.array(antenna)))
    out = np.empty((1, 2))
    kernels.age_antennas(
        np.array([1], np.int32), np.array([(1 - phase) * dt]), np.array([[0.0, 0.0], antenna]),
        np.array(increment), dt, out,
    )  # fmt: skip
    assert np.abs(out[0] - expected).max() < 1e-9


def test_a_read_of_now_is_applied_to_where_its_antenna_is():
    positions, out = RNG.uniform(-200, 200, (3, 2)), np.empty((3, 2))
    kernels.age_antennas(
        np.arange(3, dtype=np.int32), np.zeros(3), positions, np.array([9.0, 3.0, 0.2]), 0.05, out
    )  # fmt: skip
    assert np.array_equal(out, positions)
