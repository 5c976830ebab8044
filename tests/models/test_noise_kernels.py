"""Random numbers: distributed as they say, independent between all that a study tells apart, and always the same.

All draws are fixed by their keys, so that a bound of 4.5 standard errors either always holds or never.
"""

import numpy as np
import pytest
from numba import njit
from scipy import stats

from rfiddesign.models import _noise_kernels as kernels

KEY = np.uint64(kernels.run_key(np.uint64(20_240), np.uint64(7)))
N_STEPS, N_DRAWS = 4000, 500


@njit
def bits_of_steps(key, stream, n_steps, n_draws):
    out = np.empty((n_steps, n_draws), np.uint32)
    for t in range(n_steps):
        low, high = kernels.key_halves(kernels.step_key(key, stream, t))
        for i in range(n_draws):
            out[t, i] = kernels.random_bits(low, high, np.uint32(i))
    return out


@njit
def uniforms_of(bits):
    out = np.empty(bits.size, np.float32)
    for i, b in enumerate(bits.flat):
        out[i] = kernels.unit_uniform(b)
    return out


@njit
def normals_of(bits):
    out = np.empty(bits.size, np.float32)
    for i, b in enumerate(bits.flat):
        out[i] = kernels.standard_normal(b)
    return out


@njit
def pairs_of(bits, more_bits):
    out = np.empty((2, bits.size), np.float32)
    for i, (b, more) in enumerate(zip(bits.flat, more_bits.flat)):  # noqa: B905 (numba has no strict)
        out[0, i], out[1, i] = kernels.normal_pair(b, more)
    return out


@pytest.fixture(scope="module")
def bits():
    """(4000, 500) bits: as many steps of as many particles."""
    return bits_of_steps(KEY, 3, N_STEPS, N_DRAWS)


@pytest.fixture(scope="module")
def paired(bits):
    """(2, 1e6) normals by pairs whose bits lie 250 draws apart, as the filter takes them."""
    return pairs_of(bits[:, :250].copy(), bits[:, 250:].copy())


def assert_standard_normal(x):
    x = x.astype(float)
    n = x.size
    assert abs(x.mean()) < 4.5 / np.sqrt(n)
    assert abs(x.var() - 1) < 4.5 * np.sqrt(2 / n)
    assert abs((x**3).mean()) < 4.5 * np.sqrt(15 / n)
    assert abs((x**4).mean() - 3) < 4.5 * np.sqrt(96 / n)
    assert stats.kstest(x, "norm").pvalue > 1e-3
    for sigmas in (2, 3, 4):
        for tail in (x > sigmas, x < -sigmas):
            expected = n * stats.norm.sf(sigmas)
            assert abs(np.count_nonzero(tail) - expected) < 4.5 * np.sqrt(expected)


def assert_independent(u, v):
    """No correlation of values or of their distance from the middle, and a flat 16 x 16 table of pairs."""
    u, v = u.ravel().astype(float) - 0.5, v.ravel().astype(float) - 0.5
    limit = 4.5 / np.sqrt(u.size)
    assert abs(np.corrcoef(u, v)[0, 1]) < limit
    assert abs(np.corrcoef(u**2, v**2)[0, 1]) < limit
    assert abs(np.corrcoef(u, v**2)[0, 1]) < limit
    table = np.histogram2d(u, v, bins=16, range=[[-0.5, 0.5]] * 2)[0]
    assert stats.chisquare(table.ravel()).pvalue > 1e-4


def test_every_bit_is_fair(bits):
    n = bits.size
    for bit in range(32):
        assert abs(np.count_nonzero(bits >> np.uint32(bit) & np.uint32(1)) - n / 2) < 4.5 * np.sqrt(n) / 2


def test_uniforms_are_uniform(bits):
    u = uniforms_of(bits)
    assert stats.kstest(u, "uniform").pvalue > 1e-3
    assert abs(u.mean(dtype=float) - 0.5) < 4.5 / np.sqrt(12 * u.size)


def test_uniforms_lie_strictly_inside_the_unit_interval():
    extremes = np.array([0, 1, 0x7FFFFFFF, 0x80000000, 0xFFFFFEFF, 0xFFFFFFFE, 0xFFFFFFFF], np.uint32)
    u = uniforms_of(extremes)
    assert u.min() > 0
    assert u.max() < 1
    # Symmetric: no end is nearer than the other.
    assert u[0] == np.float32(1) - u[-1]


def test_normals_by_inversion_are_standard_normal(bits):
    assert_standard_normal(normals_of(bits))


def test_inversion_is_the_inverse_of_the_normal_distribution():
    bits = np.concatenate([np.arange(0, 2**32, 40_009), [0, 2**32 - 1]]).astype(np.uint32)
    exact = stats.norm.ppf(((bits >> np.uint32(9)) + 0.5) / 2**23)
    assert np.abs(normals_of(bits) - exact).max() < 4e-6
    assert np.abs(exact).max() < 5.4


def test_paired_normals_are_standard_normal(paired):
    assert_standard_normal(paired[0])
    assert_standard_normal(paired[1])


def test_the_two_normals_of_a_pair_are_independent(paired):
    assert_independent(stats.norm.cdf(paired[0]), stats.norm.cdf(paired[1]))
    # The distance of a pair from the origin is Rayleigh, its direction uniform, far out as well.
    radius2, direction = (paired.astype(float) ** 2).sum(axis=0), np.arctan2(paired[1], paired[0])
    assert stats.kstest(radius2, "chi2", (2,)).pvalue > 1e-3
    assert stats.kstest(direction[radius2 > 9] / (2 * np.pi) + 0.5, "uniform").pvalue > 1e-3


def test_no_paired_normal_lies_beyond_what_half_a_turn_of_noise_allows():
    """`mcl.build` allows 0.5 rad of noise per step: below half a turn at the furthest draw."""
    furthest = pairs_of(np.array([0], np.uint32), np.array([0], np.uint32))
    assert 5.5 < furthest[0, 0] < np.pi / 0.5


@pytest.mark.parametrize("lag", [1, 2, 3, 16, 64, 250])
def test_neighbouring_draws_are_independent(bits, lag):
    u = uniforms_of(bits).reshape(bits.shape)
    assert_independent(u[:, :-lag], u[:, lag:])


@pytest.mark.parametrize("lag", [1, 2, 100])
def test_neighbouring_steps_are_independent(bits, lag):
    u = uniforms_of(bits).reshape(bits.shape)
    assert_independent(u[:-lag], u[lag:])


@pytest.mark.parametrize("other", [(20_240, 8), (20_240, 6), (20_241, 7), (7, 20_240)])
def test_neighbouring_runs_and_seeds_are_independent(bits, other):
    other_key = np.uint64(kernels.run_key(np.uint64(other[0]), np.uint64(other[1])))
    assert_independent(uniforms_of(bits), uniforms_of(bits_of_steps(other_key, 3, N_STEPS, N_DRAWS)))


@pytest.mark.parametrize("stream", [1, 2, 4, 5, 6])
def test_streams_are_independent(bits, stream):
    assert_independent(uniforms_of(bits), uniforms_of(bits_of_steps(KEY, stream, N_STEPS, N_DRAWS)))


def test_first_draws_of_runs_are_independent_and_uniform():
    """Draw 0 of step 0 decides a resampling: over runs it must be as random as along one."""
    first = np.array(
        [
            bits_of_steps(np.uint64(kernels.run_key(np.uint64(0), np.uint64(run))), 4, 2, 1).ravel()
            for run in range(20_000)
        ]
    )
    u = uniforms_of(first).reshape(first.shape)
    assert stats.kstest(u[:, 0], "uniform").pvalue > 1e-3
    assert_independent(u[:-1, 0], u[1:, 0])
    assert_independent(u[:, 0], u[:, 1])


def test_the_mean_of_a_step_scatters_as_that_of_independent_draws(bits, paired):
    """Draws that balanced one another within a step would flatter a filter: 500 particles must err like 500."""
    for x in (normals_of(bits).reshape(bits.shape), paired[0].reshape(N_STEPS, -1)):
        n_steps, n = x.shape
        dispersion = x.mean(axis=1, dtype=float).var() * n
        assert abs(dispersion - 1) < 4.5 * np.sqrt(2 / n_steps)


def test_draws_of_a_step_are_all_different():
    draws = bits_of_steps(KEY, 3, 1, 200_000)
    assert np.unique(draws).size == draws.size


def test_runs_have_different_keys():
    keys = {kernels.run_key(np.uint64(seed), np.uint64(run)) for seed in range(30) for run in range(300)}
    assert len(keys) == 9000


def test_the_same_key_gives_the_same_numbers():
    first, second = np.empty(100, np.float32), np.empty(100, np.float32)
    for fill in (kernels.fill_normal, kernels.fill_uniform):
        fill(np.uint64(kernels.step_key(KEY, 1, 5)), first)
        fill(np.uint64(kernels.step_key(KEY, 1, 5)), second)
        assert np.array_equal(first, second)


def test_split_mix_is_the_published_generator():
    """First outputs of splitmix64 from state 1234567 (Vigna's reference implementation, as in Rosetta Code)."""
    gamma, state = 0x9E3779B97F4A7C15, 1234567
    outputs = [kernels.split_mix(np.uint64((state + i * gamma) % 2**64)) for i in range(3)]
    assert outputs == [6457827717110365317, 3203168211198807973, 9817491932198370423]
