"""Random numbers: distributed as they say, independent between all that a study tells apart, and always the same.

All draws are fixed by their keys, so that a bound of 4.5 standard errors either always holds or never.
"""

import numpy as np
import pytest
from numba import njit
from scipy import stats

from rfiddesign.numerics import _noise_kernels as kernels

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
def triples_of_steps(key, n_steps, n_draws, triple):
    """(3, n_steps, n_draws) words of the triples of a stream of predictions."""
    out = np.empty((3, n_steps, n_draws), np.uint32)
    for t in range(n_steps):
        low, high = kernels.key_halves(kernels.step_key(key, 3, t))
        for i in range(n_draws):
            out[0, t, i], out[1, t, i], out[2, t, i] = triple(low, high, np.uint32(i))
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


@pytest.fixture(scope="module")
def bits():
    """(4000, 500) bits: as many steps of as many particles."""
    return bits_of_steps(KEY, 3, N_STEPS, N_DRAWS)


@pytest.fixture(scope="module")
def triples():
    """(3, 10,000, 512) words: five million triples."""
    return triples_of_steps(KEY, 10_000, 512, kernels.random_triple)


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


def test_fine_uniforms_are_odd_multiples_of_2_to_the_minus_33():
    extremes = np.array([0, 1, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF], np.uint32)
    assert [kernels.fine_uniform(each) * 2.0**33 for each in extremes] == [2.0 * int(each) + 1 for each in extremes]


def test_normals_by_inversion_are_standard_normal(bits):
    assert_standard_normal(normals_of(bits))


def test_inversion_is_the_inverse_of_the_normal_distribution():
    """The top bit is the sign, the others the tail probability; within 2e-4 of the quantile or of 0.3."""
    tail_bits = np.concatenate([np.arange(0, 2**31, 20_011), np.arange(2000), [2**31 - 1]]).astype(np.uint32)
    exact = -stats.norm.ppf((tail_bits + 0.5) / 2**32)
    upper, lower = normals_of(tail_bits), normals_of(tail_bits | np.uint32(2**31))
    assert (np.abs(upper - exact) < 2e-4 * np.maximum(exact, 0.3)).all()
    assert np.array_equal(lower, -upper)


def test_no_normal_lies_beyond_what_half_a_turn_of_noise_allows():
    """`mcl.build` allows 0.49 rad of noise per step: below half a turn at the furthest draw."""
    furthest = normals_of(np.array([0], np.uint32))[0]
    assert 6.2 < furthest < min(6.4, np.pi / 0.49)


def test_tails_hold_what_they_should_beyond_five_sigma():
    """2^26 draws: some 19 beyond 5 sigma on each side, 2 beyond 5.4."""
    draws = np.empty(2**22, np.float32)
    counts = dict.fromkeys([(side, sigmas) for side in (-1, 1) for sigmas in (3.0, 4.0, 4.5, 5.0)], 0)
    for step in range(16):
        kernels.fill_normal(np.uint64(kernels.step_key(KEY, 3, step)), draws)
        for side, sigmas in counts:
            counts[side, sigmas] += np.count_nonzero(side * draws > sigmas)
    for (_, sigmas), count in counts.items():
        expected = 2**26 * stats.norm.sf(sigmas)
        assert stats.poisson.cdf(count, expected) > 1e-4
        assert stats.poisson.sf(count - 1, expected) > 1e-4


@pytest.mark.parametrize(
    "wrong",
    [
        lambda rng: rng.normal(0, 1.004, 2_000_000),
        lambda rng: rng.normal(0.005, 1, 2_000_000),
        lambda rng: rng.random((2_000_000, 12)).sum(axis=1) - 6,
        lambda rng: np.clip(rng.normal(size=2_000_000), -3.9, 3.9),
        lambda rng: rng.normal(size=2_000_000).round(1),
    ],
    ids=["wide", "shifted", "twelve uniforms", "cut tails", "coarse"],
)
def test_the_checks_on_normals_reject_what_is_not_normal(wrong):
    with pytest.raises(AssertionError):
        assert_standard_normal(wrong(np.random.Generator(np.random.PCG64(0))))


# The noise of a particle: a triple


def assert_triples_are_independent(triples):
    """The three normals of a triple, and any four bits of one word beside the same of another."""
    words = triples.reshape(3, -1)
    normals = np.array([normals_of(word) for word in words])
    # A normal's eighth of the distribution, 0 to 7.
    eighths = np.searchsorted(stats.norm.ppf(np.arange(1, 8) / 8).astype(np.float32), normals)
    grid = np.bincount((eighths[0] * 8 + eighths[1]) * 8 + eighths[2], minlength=512)
    assert stats.chisquare(grid).pvalue > 1e-4
    for first, second in ((0, 1), (0, 2), (1, 2)):
        a, b = normals[first], normals[second]
        assert abs(np.corrcoef(a, b)[0, 1]) < 4.5 / np.sqrt(a.size)
        assert abs(np.corrcoef(a**2, b**2)[0, 1]) < 4.5 / np.sqrt(a.size)
        for lowest_bit in (0, 8, 16, 20, 28):
            four_bits = words >> np.uint32(lowest_bit) & np.uint32(15)
            table = np.bincount(four_bits[first] * 16 + four_bits[second], minlength=256)
            assert stats.chisquare(table).pvalue > 1e-4


def test_the_three_normals_of_a_triple_are_independent(triples):
    assert_triples_are_independent(triples)


@njit
def triple_of_one_multiplier(low, high, index):
    """Second and third words by another constant before the second round, not by another round."""
    h = np.uint32(index + low)
    h = np.uint32(np.uint32(h ^ (h >> np.uint32(16))) * np.uint32(0x7FEB352D))
    h = np.uint32(h ^ (h >> np.uint32(15)) ^ high)
    a = np.uint32(h * np.uint32(0x846CA68B))
    b = np.uint32(np.uint32(h ^ np.uint32(0x9E3779B9)) * np.uint32(0x846CA68B))
    c = np.uint32(np.uint32(h ^ np.uint32(0x3C6EF372)) * np.uint32(0x846CA68B))
    return a ^ (a >> np.uint32(16)), b ^ (b >> np.uint32(16)), c ^ (c >> np.uint32(16))


def test_the_checks_on_triples_reject_words_that_share_their_rounds():
    with pytest.raises(AssertionError):
        assert_triples_are_independent(triples_of_steps(KEY, 10_000, 512, triple_of_one_multiplier))


def test_the_first_word_of_a_triple_is_that_of_random_bits(triples):
    assert np.array_equal(triples[0], bits_of_steps(KEY, 3, 10_000, 512))


@pytest.mark.parametrize("word", [1, 2])
def test_the_other_words_of_a_triple_give_standard_normals(triples, word):
    assert_standard_normal(normals_of(triples[word, :4000]))


@pytest.mark.parametrize(("first", "second"), [(1, 1), (2, 2), (0, 1), (1, 0), (0, 2), (2, 0), (1, 2), (2, 1)])
def test_triples_of_neighbouring_particles_and_steps_are_independent(triples, first, second):
    u, v = (uniforms_of(triples[word, :4000]).reshape(4000, 512) for word in (first, second))
    assert_independent(u[:, :-1], v[:, 1:])
    assert_independent(u[:-1], v[1:])


# Draws of one step, of different steps, streams, runs and seeds


@pytest.mark.parametrize("lag", [1, 2, 3, 16, 64, 166, 250, 332])
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


def test_the_mean_of_a_step_scatters_as_that_of_independent_draws(bits):
    """Draws that balanced one another within a step would flatter a filter: 500 particles must err like 500."""
    x = normals_of(bits).reshape(bits.shape)
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
