"""Weights from log weights and the estimate over them (eq. 3), compiled, against numpy in double precision."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rfiddesign.estimators import _estimate_kernels as kernels
from rfiddesign.estimators._particle_kernels import WEIGHT
from rfiddesign.numerics._math_kernels import RADIANS_PER_BINARY_UNIT, binary_angle
from tests.estimators.clouds import cloud_of, particles_of

PROPERTY = settings(max_examples=100, deadline=None, derandomize=True)
seeds = st.integers(0, 2**32 - 1)
# Some that fill their lanes and some that do not.
numbers_of_particles = st.sampled_from([2, 3, 15, 16, 17, 200, 501])


def estimated(x, y, heading, log_weights):
    """The estimate, the weights of all lanes, and what the kernel returns."""
    cloud, out = cloud_of(x, y, heading, log_weights), np.full((3, kernels.N_ESTIMATE), -7.0)
    total, lowest = kernels.estimate(x.size, cloud, out, 1)
    assert (out[[0, 2]] == -7).all()
    return out[1], cloud[WEIGHT], total, lowest


# Weights


def weights_of(log_weights):
    zeros = np.zeros(log_weights.size, np.float32)
    return estimated(zeros, zeros, zeros.astype(np.int32), log_weights)[1:]


def log_weights_about(seed, level, spread):
    log_weights = level + spread * np.random.Generator(np.random.PCG64(seed)).standard_normal(100)
    return np.minimum(log_weights, 80).astype(np.float32)


@PROPERTY
@given(seed=seeds, spread=st.floats(0.01, 30), level=st.floats(-15, 0))
def test_weights_are_those_of_the_log_weights(seed, spread, level):
    """Down to e^-80."""
    log_weights = np.minimum(log_weights_about(seed, level, spread), 0)
    exact = np.maximum(log_weights.astype(float), -80)
    weights, _, _ = weights_of(log_weights)
    assert np.allclose(weights[:100], np.exp(exact), rtol=1e-5, atol=0)


@PROPERTY
@given(seed=seeds, spread=st.floats(0.01, 300), level=st.one_of(st.floats(-1e4, -1e3), st.floats(30, 80)))
def test_weights_that_single_precision_cannot_hold_are_relative_to_the_best(seed, spread, level):
    """All far off, or with a sum beyond all bounds; down to e^-80 of the best."""
    log_weights = log_weights_about(seed, level, spread)
    weights, total, _ = weights_of(log_weights)
    exact = np.maximum(log_weights.astype(float) - log_weights.max(), -80)
    assert np.allclose(weights[:100], np.exp(exact), rtol=1e-5, atol=0)
    assert weights.max() == 1.0
    assert weights[:100].min() > 0.0
    assert 1 <= total < 101


@PROPERTY
@given(seed=seeds, spread=st.floats(0.01, 30), level=st.floats(-100, 60))
def test_the_sum_of_the_weights_can_be_divided_by_and_its_ratios_are_those_of_the_log_weights(seed, spread, level):
    """Across the borders between weights as they are and weights relative to the best."""
    log_weights = log_weights_about(seed, level, spread)
    weights, total, _ = weights_of(log_weights)
    below = log_weights.astype(float) - log_weights.max()
    is_counted = below > -50
    relative = weights[:100] / weights.max()
    assert 1e-10 <= total <= 1e10
    assert np.allclose(relative[is_counted], np.exp(below[is_counted]), rtol=1e-5, atol=0)
    assert (relative[~is_counted] < 1e-21).all()


@pytest.mark.parametrize("level", [0.0, -1e4])
@pytest.mark.parametrize("n", [2, 15, 16, 17, 500])
def test_lanes_beyond_the_last_particle_weigh_nothing(n, level):
    """Whatever log weight they hold."""
    weights, total, _ = weights_of(np.full(n, level, np.float32))
    assert (weights[:n] == 1).all()
    assert not weights[n:].any()
    assert total == n


@PROPERTY
@given(seed=seeds, level=st.floats(-1e4, 60), n=numbers_of_particles)
def test_no_log_weight_is_below_the_lowest(seed, level, n):
    log_weights = log_weights_about(seed, level, 10.0)
    _, _, lowest = weights_of(np.resize(log_weights, n))
    assert lowest == min(np.resize(log_weights, n).min(), 0)


# The estimate


def assert_is_numpys(x, y, heading, log_weights, covariance_to=1e-5):
    """The estimate is that of these particles with the kernel's own weights."""
    out, weights, total, _ = estimated(x, y, heading, log_weights.astype(np.float32))
    w, theta = weights[: x.size].astype(float), heading * RADIANS_PER_BINARY_UNIT
    assert total == pytest.approx(w.sum(), rel=1e-6)
    # Offsets from the first particle are float32.
    assert out[0] == pytest.approx(np.average(x.astype(float), weights=w), abs=1e-3)
    assert out[1] == pytest.approx(np.average(y.astype(float), weights=w), abs=1e-3)
    resultant = np.sum(w * np.exp(1j * theta)) / w.sum()
    assert abs(np.angle(np.exp(1j * out[2]) / resultant)) * abs(resultant) < 5e-7
    # Turns count from the mean direction.
    turn = np.angle(np.exp(1j * (theta - np.angle(resultant))))
    offsets = np.stack([x, y, turn]).astype(float)
    offsets -= np.average(offsets, axis=1, weights=w)[:, None]
    exact = (offsets * w) @ offsets.T / w.sum()
    scale = np.sqrt(np.outer(np.diag(exact), np.diag(exact)))
    found = np.array([[out[3], out[4], out[6]], [out[4], out[5], out[7]], [out[6], out[7], out[8]]])
    assert np.abs((found - exact) / scale).max() < covariance_to
    assert out[9] == pytest.approx(w.sum() ** 2 / (w**2).sum(), rel=1e-6)


def narrow(n, rng, spread=5.0, direction=0.0, heading_spread=0.05, centre=(0.0, 0.0)):
    """Particles about a pose, with log weights of 0.01 to 1."""
    x, y = (np.array(centre)[:, None] + rng.normal(0, spread, (2, n))).astype(np.float32)
    heading = np.array([binary_angle(theta) for theta in rng.normal(direction, heading_spread, n)], np.int32)
    return x, y, heading, np.log(rng.uniform(0.01, 1.0, n))


@PROPERTY
@given(seed=seeds, n=numbers_of_particles, centre=st.tuples(st.floats(-1e5, 1e5), st.floats(-1e5, 1e5)))
def test_estimate_of_headings_all_around_is_numpys(seed, n, centre):
    rng = np.random.Generator(np.random.PCG64(seed))
    assert_is_numpys(*particles_of(n, rng, centre=centre), np.log(rng.uniform(0.01, 1.0, n)))


@PROPERTY
@given(seed=seeds, n=numbers_of_particles, direction=st.floats(-7, 7), heading_spread=st.floats(0.001, 1.0))
def test_estimate_of_headings_about_any_direction_is_numpys(seed, n, direction, heading_spread):
    rng = np.random.Generator(np.random.PCG64(seed))
    assert_is_numpys(*narrow(n, rng, direction=direction, heading_spread=heading_spread))


@PROPERTY
@given(seed=seeds, n=numbers_of_particles, heading_spread=st.floats(0.001, 0.5))
def test_estimate_of_headings_on_both_sides_of_half_a_turn_is_numpys(seed, n, heading_spread):
    rng = np.random.Generator(np.random.PCG64(seed))
    assert_is_numpys(*narrow(n, rng, direction=math.pi, heading_spread=heading_spread))


@PROPERTY
@given(seed=seeds, n=numbers_of_particles, level=st.sampled_from([-1e4, -30.0, 40.0]))
def test_estimate_of_weights_that_are_all_small_or_all_large_is_numpys(seed, n, level):
    x, y, heading, log_weights = narrow(n, np.random.Generator(np.random.PCG64(seed)))
    assert_is_numpys(x, y, heading, level + log_weights)


@PROPERTY
@given(seed=seeds, n=st.sampled_from([17, 200, 501]), deviations=st.floats(20, 1e4), log_weight=st.floats(-60, -5))
def test_estimate_where_the_first_particle_lies_far_out_is_numpys(seed, n, deviations, log_weight):
    x, y, heading, log_weights = narrow(n, np.random.Generator(np.random.PCG64(seed)), centre=(3e4, -2e4))
    x[0] += 5 * deviations
    log_weights[0] = log_weight
    assert_is_numpys(x, y, heading, log_weights)


@PROPERTY
@given(seed=seeds, n=st.sampled_from([17, 200, 501]), deviations=st.floats(0, 20))
def test_estimate_where_the_first_particle_lies_somewhat_out_is_numpys_to_5e_5(seed, n, deviations):
    """Spread is told from distance to the first particle up to ten deviations, which costs two digits of seven."""
    x, y, heading, log_weights = narrow(n, np.random.Generator(np.random.PCG64(seed)))
    y[0] += 5 * deviations
    log_weights[0] = -10.0
    assert_is_numpys(x, y, heading, log_weights, covariance_to=5e-5)


@PROPERTY
@given(seed=seeds, n=st.sampled_from([17, 200, 501]), turn=st.floats(-math.pi, math.pi))
def test_estimate_where_the_first_particle_looks_another_way_is_numpys_to_5e_5(seed, n, turn):
    """As one that has just restarted with any heading, in a belief that is sure of its heading to 2 mrad."""
    x, y, heading, log_weights = narrow(n, np.random.Generator(np.random.PCG64(seed)), heading_spread=0.002)
    heading[0] = binary_angle(turn)
    log_weights[0] = -20.0
    assert_is_numpys(x, y, heading, log_weights, covariance_to=5e-5)


def test_headings_on_both_sides_of_half_a_turn_average_to_half_a_turn():
    heading, zero = np.array([binary_angle(math.pi - 0.1), binary_angle(-math.pi + 0.1)], np.int32), np.zeros(2)
    out = estimated(zero, zero, heading, zero)[0]
    assert abs(out[2]) == pytest.approx(math.pi, abs=1e-6)
    assert out[8] == pytest.approx(0.01, rel=1e-5)


@pytest.mark.parametrize("n", [2, 17, 500])
def test_particles_that_coincide_have_no_spread(n):
    """As at the start from a known pose."""
    x, y, heading = np.full(n, 123_456.7), np.full(n, -98.7), np.full(n, 2**30 + 12_345, np.int32)
    out = estimated(x, y, heading, np.linspace(-3.0, 0.0, n))[0]
    assert out[:3] == pytest.approx(
        (np.float32(x[0]), np.float32(y[0]), heading[0] * RADIANS_PER_BINARY_UNIT), abs=3e-7
    )
    assert (out[3:9] == 0).all()
