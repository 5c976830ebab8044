"""The elementary functions of the compiled code against those of numpy in double precision."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit

from rfiddesign.numerics import _lane_kernels as lanes
from rfiddesign.numerics import _math_kernels as kernels
from rfiddesign.numerics._lane_kernels import LANES
from rfiddesign.numerics._math_kernels import BINARY_UNITS_PER_RADIAN, RADIANS_PER_BINARY_UNIT, atan2_64

RNG = np.random.Generator(np.random.PCG64(1))


@njit
def sin_cos_of(angles, sines, cosines):
    for i in range(angles.size):
        sines[i], cosines[i] = kernels.sin_cos(angles[i])


@njit
def sin_cos_64_of(thetas, sines, cosines):
    for i in range(thetas.size):
        sines[i], cosines[i] = kernels.sin_cos_64(thetas[i])


@njit
def exp_of(x, out):
    for i in range(x.size):
        out[i] = kernels.exp_32(x[i])


@njit
def log_of(x, one_by_one, by_lanes):
    for i in range(x.size):
        one_by_one[i] = kernels.log_32(x[i])
    for i in range(0, x.size, LANES):
        lanes.store(by_lanes, i, kernels.log_32(lanes.load(x, i)))


@njit
def small_binary_angle_of(theta, out):
    for i in range(theta.size):
        out[i] = kernels.small_binary_angle(theta[i])


def difference_of_angles(a, b):
    """Binary angles a - b, wrapped into half a turn either way."""
    return (int(a) - int(b) + 2**31) % 2**32 - 2**31


def test_sin_cos_of_every_kind_of_binary_angle_is_within_its_stated_error():
    near_octants = (np.arange(-8, 8)[:, None] * 2**28 + np.arange(-50, 50)).ravel()
    near_octants = near_octants[(near_octants >= -(2**31)) & (near_octants < 2**31)]
    angles = np.concatenate(
        [np.arange(-(2**31), 2**31, 4099), near_octants, [-(2**31), 2**31 - 1], RNG.integers(-(2**31), 2**31, 200_000)]
    ).astype(np.int32)
    sines, cosines = np.empty(angles.size, np.float32), np.empty(angles.size, np.float32)
    sin_cos_of(angles, sines, cosines)
    theta = angles * RADIANS_PER_BINARY_UNIT
    assert np.abs(sines - np.sin(theta)).max() < 3e-7
    assert np.abs(cosines - np.cos(theta)).max() < 3e-7


def test_sin_cos_64_is_within_its_stated_error_up_to_1e5_radians():
    octants = np.arange(-40, 41) * math.pi / 4
    thetas = np.concatenate(
        [octants, octants + 1e-9, octants - 1e-9, RNG.uniform(-10, 10, 100_000), RNG.uniform(-1e5, 1e5, 100_000)]
    )
    sines, cosines = np.empty(thetas.size), np.empty(thetas.size)
    sin_cos_64_of(thetas, sines, cosines)
    assert np.abs(sines - np.sin(thetas)).max() < 1e-13
    assert np.abs(cosines - np.cos(thetas)).max() < 1e-13


def test_exp_is_within_its_stated_relative_error():
    x = np.concatenate([np.linspace(-80, 80, 200_001), RNG.uniform(-1, 1, 100_000), [0.0, -80.0, 80.0]])
    x = x.astype(np.float32)
    out = np.empty_like(x)
    exp_of(x, out)
    assert (np.abs(out / np.exp(x.astype(float)) - 1) < 2e-7 + 7.5e-8 * np.abs(x)).all()
    assert out[x == 0.0].tolist() == [1.0] * np.count_nonzero(x == 0.0)


def test_log_is_within_its_stated_error_one_by_one_and_by_lanes():
    x = np.concatenate([np.geomspace(1.2e-38, 3e38, 100_000), RNG.uniform(0.5, 2.0, 100_000)]).astype(np.float32)
    out, by_lanes = np.empty_like(x), np.empty_like(x)
    log_of(x, out, by_lanes)
    exact = np.log(x.astype(float))
    assert (np.abs(out - exact) < 4e-7 + 1.5e-7 * np.abs(exact)).all()
    assert np.array_equal(out, by_lanes)
    assert kernels.log_32(np.float32(1.0)) == 0.0


@settings(max_examples=300, deadline=None, derandomize=True)
@given(theta=st.floats(-math.pi, math.pi), turns=st.integers(-1000, 1000))
def test_binary_angles_wrap(theta, turns):
    unit_of_input = np.spacing(abs(theta + 2 * math.pi * turns)) / RADIANS_PER_BINARY_UNIT
    wrapped = kernels.binary_angle(theta + 2 * math.pi * turns)
    assert -(2**31) <= wrapped < 2**31
    assert abs(difference_of_angles(wrapped, kernels.binary_angle(theta))) <= 2 + 2 * unit_of_input
    turn = wrapped * RADIANS_PER_BINARY_UNIT - theta
    assert abs(math.remainder(turn, 2 * math.pi)) < 3e-9 + 4e-16 * abs(2 * math.pi * turns)


@pytest.mark.parametrize("theta", [math.pi, -math.pi, math.nextafter(math.pi, 0), math.nextafter(-math.pi, -4)])
def test_half_a_turn_either_way_is_the_same_binary_angle(theta):
    assert abs(difference_of_angles(kernels.binary_angle(theta), -(2**31))) <= 2


def test_small_binary_angle_agrees_with_binary_angle_to_float32():
    theta = RNG.uniform(-3.14, 3.14, 100_000).astype(np.float32)
    out = np.empty(theta.size, np.int32)
    small_binary_angle_of(theta, out)
    assert np.abs(out * RADIANS_PER_BINARY_UNIT - theta.astype(float)).max() < 4e-7


def test_small_binary_angle_truncates_toward_zero():
    """So that noise has no side: opposite angles become opposite binary angles."""
    theta = np.concatenate([RNG.uniform(-1e-6, 1e-6, 100_000), RNG.uniform(-3.14, 3.14, 100_000)]).astype(np.float32)
    out, opposite = np.empty(theta.size, np.int32), np.empty(theta.size, np.int32)
    small_binary_angle_of(theta, out)
    small_binary_angle_of(-theta, opposite)
    assert np.array_equal(out, np.trunc(theta * np.float32(BINARY_UNITS_PER_RADIAN)).astype(np.int32))
    assert np.array_equal(opposite, -out)


def test_atan2_is_within_1e_14_of_the_library_in_every_direction():
    angles = np.concatenate([np.linspace(-math.pi, math.pi, 10_001)[1:-1], np.arange(-3, 4) * math.pi / 4])
    for angle in angles:
        y, x = 37.0 * math.sin(angle), 37.0 * math.cos(angle)
        assert atan2_64(y, x) == pytest.approx(math.atan2(y, x), abs=1e-14)
    assert atan2_64(0.0, 0.0) == 0.0
    assert atan2_64(0.0, -1.0) == math.pi
    assert atan2_64(1e-300, 1e300) == pytest.approx(0.0, abs=1e-300)
