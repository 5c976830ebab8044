"""How particles lie in memory, and lines 7 to 10 of Algorithm 1, compiled, against plain numpy in double precision."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rfiddesign.estimators import _estimate_kernels
from rfiddesign.estimators import _particle_kernels as kernels
from rfiddesign.estimators._particle_kernels import COSINE, HEADING, LOG, SINE, WEIGHT, X, Y
from rfiddesign.estimators.mcl import MAX_PARTICLES
from rfiddesign.numerics._lane_kernels import LANES
from rfiddesign.numerics._math_kernels import RADIANS_PER_BINARY_UNIT
from rfiddesign.numerics._noise_kernels import STREAM_RESAMPLE, fill_uniform, step_key
from tests.estimators.clouds import KEY, cloud_of, drawn_of, particles_of, width_of

RNG = np.random.Generator(np.random.PCG64(9))
PROPERTY = settings(max_examples=100, deadline=None, derandomize=True)
GUARD = 50_000


def lane_by_lane(n):
    """Numbers of a cloud's particles in the order in which their weights are laid end to end."""
    return np.arange(width_of(n)).reshape(-1, LANES).T.ravel()


# Memory


@pytest.mark.parametrize("n", [2, 16, 17, 500])
def test_store_is_the_inverse_of_load(n):
    x, y, heading = particles_of(n, RNG)
    # Headings whose bits are those of infinity, of no number and of one too small for a float.
    heading[-2:] = 0x7F800000, 0x7F800001
    heading[0] = -1
    drawn, headings = drawn_of(x, y, heading)
    cloud = np.empty((kernels.N_FIELDS, width_of(n)), np.float32)
    kernels.load(drawn, headings, cloud)
    back, headings_back = np.zeros_like(drawn), np.zeros_like(headings)
    kernels.store(cloud, back, headings_back)
    for part, before in zip((back[0, :n], back[1, :n], headings_back[:n]), (x, y, heading), strict=True):
        assert np.array_equal(part, before)


def test_loaded_particles_have_the_sine_and_cosine_of_their_heading_and_weight_1():
    x, y, heading = particles_of(500, RNG)
    cloud = np.full((kernels.N_FIELDS, width_of(500)), np.nan, np.float32)
    kernels.load(*drawn_of(x, y, heading), cloud)
    theta = heading * RADIANS_PER_BINARY_UNIT
    assert np.array_equal(cloud[X, :500], x)
    assert np.array_equal(cloud[Y, :500], y)
    assert np.array_equal(cloud[HEADING, :500].view(np.int32), heading)
    assert np.abs(cloud[SINE, :500] - np.sin(theta)).max() < 3e-7
    assert np.abs(cloud[COSINE, :500] - np.cos(theta)).max() < 3e-7
    assert (cloud[LOG] == 0).all()


# Lines 7 to 10


def resampled(x, y, heading, log_weights, weights, step=0, key=KEY, has_logs=True):
    """Arrays `drawn` and `headings` after resampling; nothing may be written beyond the room that is promised."""
    weights = weights.astype(np.float32)
    cloud = cloud_of(x, y, heading, log_weights, weights)
    drawn, headings = drawn_of(x, y, heading, GUARD)
    drawn[:, : x.size], headings[: x.size] = -7, -7
    kernels.resample(key, step, x.size, float(weights.astype(float).sum()), has_logs, cloud, drawn, headings)
    assert (drawn[:, -GUARD:] == -7).all()
    assert (headings[-GUARD:] == -7).all()
    return drawn, headings


def ancestors_of(weights, step=0, key=KEY):
    """Numbers of the drawn particles, as they come."""
    n = weights.size
    zeros = np.zeros(n, np.float32)
    drawn, _ = resampled(np.arange(n, dtype=np.float32), zeros, zeros.astype(np.int32), zeros, weights, step, key)
    return drawn[0, :n].astype(int)


def counts_of(weights, step=0, key=KEY):
    """How often each particle is drawn."""
    return np.bincount(ancestors_of(weights, step, key), minlength=weights.size)


weight_lists = st.lists(
    st.one_of(st.just(0.0), st.just(1.0), st.just(1e-7), st.floats(0, 1, width=32)), min_size=2, max_size=200
)


@PROPERTY
@given(weights=weight_lists, step=st.integers(0, 10_000))
def test_each_particle_is_drawn_the_floor_or_the_ceiling_of_its_share(weights, step):
    weights = np.array([*weights, 1.0], np.float32)
    counts = counts_of(weights, step)
    share = weights.size * weights.astype(float) / weights.astype(float).sum()
    # Shares are rounded to 2^-20 of a draw and better.
    assert counts.sum() == weights.size == counts.size
    assert (counts >= np.floor(share - 1e-4)).all()
    assert (counts <= np.ceil(share + 1e-4)).all()


@PROPERTY
@given(weights=weight_lists, step=st.integers(0, 10_000))
def test_draws_are_those_of_searchsorted_along_the_weights_lane_by_lane(weights, step):
    weights = np.array([*weights, 1.0], np.float32)
    n, order = weights.size, lane_by_lane(weights.size)
    offset = np.empty(1, np.float32)
    fill_uniform(np.uint64(step_key(KEY, STREAM_RESAMPLE, step)), offset)
    cumulative = np.cumsum(np.append(weights, np.zeros(order.size - n)).astype(float)[order])
    marks = (np.arange(n) + float(offset[0])) * cumulative[-1] / n
    exact = np.searchsorted(cumulative, marks, side="right")
    found = np.sort(np.argsort(order)[ancestors_of(weights, step)])
    # A draw that falls within rounding of the border between two particles may take either.
    is_clear = np.abs(cumulative[:, None] - marks).min(axis=0) > 1e-5 * cumulative[-1] / n
    assert np.array_equal(found[is_clear], exact[is_clear])


@pytest.mark.parametrize("best", [0, 1, 15, 16, 250, 498, 499])
def test_one_particle_can_take_every_draw(best):
    weights = np.zeros(500)
    weights[best] = 1.0
    assert (ancestors_of(weights) == best).all()


@pytest.mark.parametrize("n", [2, 3, 7, 16, 17, 500, 100_000])
def test_equal_weights_keep_every_particle(n):
    assert np.array_equal(np.sort(ancestors_of(np.full(n, 0.3))), np.arange(n))


def test_resampling_is_unbiased():
    weights = np.array([0.02, 0.5, 0.031, 0.9, 0.3, 0.004, 1.0])
    counts = np.array([counts_of(weights, step) for step in range(20_000)])
    share = 7 * weights / weights.sum()
    assert np.abs(counts.mean(axis=0) - share).max() < 4.5 * 0.5 / math.sqrt(20_000)


@pytest.mark.parametrize("has_logs", [True, False])
def test_drawn_particles_are_copied_whole(has_logs):
    """Up to many times each; the log weights only where they are asked for."""
    x, y, heading = particles_of(500, RNG)
    log_weights, weights = RNG.random((2, 500)).astype(np.float32)
    weights[::7] *= 20
    ancestors = ancestors_of(weights)
    assert np.bincount(ancestors).max() > 4
    drawn, headings = resampled(x, y, heading, log_weights, weights, has_logs=has_logs)
    assert np.array_equal(headings[:500], heading[ancestors])
    assert np.array_equal(drawn[0, :500], x[ancestors])
    assert np.array_equal(drawn[1, :500], y[ancestors])
    if has_logs:
        assert np.array_equal(drawn[2, :500], log_weights[ancestors])


def a_few_of(n, n_heavy):
    """Log weights of n_heavy particles, scattered, and of others so light that their sum loses much of them."""
    log_weights = np.full(n, math.log(0.45 * 2.0**-24 * max(n_heavy / LANES, 1.0)))
    log_weights[np.random.Generator(np.random.PCG64(n)).choice(n, min(n_heavy, n - 1), replace=False)] = 0.0
    return log_weights


# Log weights of n particles; single precision loses the most of the sum of the last three.
SKEWED = {
    "alike": lambda n: np.full(n, -0.7),
    "random": lambda n: np.log(np.random.Generator(np.random.PCG64(n)).random(n) + 1e-9),
    "one takes all": lambda n: np.where(np.arange(n) == n - 1, 0.0, -50.0),
    "slope": lambda n: -20.0 * np.arange(n) / n,
    "a few": lambda n: a_few_of(n, 64),
    "many": lambda n: a_few_of(n, 4000),
    "the first of each lane": lambda n: np.where(np.arange(n) < LANES, 0.0, math.log(0.9 * 2.0**-24)),
}


def resampled_by_own_weights(log_weights):
    """Arrays `drawn` and `headings` of particles that tell their number m: x is m, y -m, the heading 3 m.

    Weighed and summed as the filter does.
    """
    n = log_weights.size
    numbers = np.arange(n, dtype=np.float32)
    cloud = cloud_of(numbers, -numbers, np.arange(n, dtype=np.int32) * 3, log_weights)
    total, _ = _estimate_kernels.estimate(n, cloud, np.empty((1, _estimate_kernels.N_ESTIMATE)), 0)
    drawn, headings = drawn_of(numbers, -numbers, np.zeros(n), GUARD)
    drawn[:], headings[:] = -7, -7
    kernels.resample(KEY, 0, n, total, True, cloud, drawn, headings)
    return drawn, headings


N_PARTICLES = [2, 16, 17, 500, 100_000, MAX_PARTICLES]


@pytest.mark.parametrize("n", N_PARTICLES)
@pytest.mark.parametrize("kind", SKEWED)
def test_resampling_writes_nothing_beyond_the_room_that_it_asks_for(kind, n):
    drawn, headings = resampled_by_own_weights(SKEWED[kind](n))
    n_beyond = np.count_nonzero((drawn[:, -GUARD:] != -7).any(axis=0) | (headings[-GUARD:] != -7))
    assert n_beyond == 0


@pytest.mark.parametrize("n", N_PARTICLES)
@pytest.mark.parametrize("kind", SKEWED)
def test_resampling_fills_every_lane_with_copies_of_particles(kind, n):
    """Also the lanes beyond the last particle."""
    log_weights = SKEWED[kind](n)
    drawn, headings = resampled_by_own_weights(log_weights)
    x, y, log = drawn[:, : width_of(n)]
    numbers = x.astype(int)
    assert np.array_equal(x, numbers)
    assert numbers.min() >= 0
    assert numbers.max() < n
    assert np.array_equal(y, -x)
    assert np.array_equal(headings[: width_of(n)], 3 * numbers)
    assert np.array_equal(log, log_weights.astype(np.float32)[numbers])


def test_resampling_leaves_the_particles_of_the_cloud_as_they_are():
    cloud = cloud_of(*particles_of(500, RNG), weight=RNG.random(500))
    before = cloud.copy()
    kernels.resample(
        KEY, 0, 500, float(cloud[WEIGHT].sum(dtype=float)), True, cloud, *drawn_of(*particles_of(500, RNG))
    )
    assert np.array_equal(cloud[:WEIGHT].view(np.int32), before[:WEIGHT].view(np.int32))
