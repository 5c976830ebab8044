"""Arithmetic on lanes: each operation has the bits of numpy's, on LANES numbers at once as on single ones."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from numba import njit

from rfiddesign.numerics import _lane_kernels as kernels
from rfiddesign.numerics import _math_kernels, _noise_kernels
from rfiddesign.numerics._lane_kernels import LANES, choose, load, store

F32, I32, U32 = np.float32, np.int32, np.uint32
RNG = np.random.Generator(np.random.PCG64(11))
N = 64 * LANES
# Where integers wrap, and where signs change.
EDGES = np.array([0, 1, 2, 0x7FFFFFFF, 0x80000000, 0x80000001, 0xFFFFFFFE, 0xFFFFFFFF], U32)
words = arrays.arrays(U32, LANES)
ordinary = arrays.arrays(F32, LANES, elements=st.floats(-1e6, 1e6, width=32))
masks = arrays.arrays(np.bool_, LANES)


def random_words():
    """(3, N) words of the whole range, each edge among them beside each other."""
    numbers = RNG.integers(0, 2**32, (3, N), dtype=U32)
    numbers[0, : EDGES.size**2], numbers[1, : EDGES.size**2] = np.repeat(EDGES, EDGES.size), np.tile(EDGES, EDGES.size)
    return numbers


def random_floats():
    """(3, N) numbers of either sign and of many sizes, some of them equal."""
    numbers = (RNG.normal(size=(3, N)) * 10.0 ** RNG.uniform(-6, 8, (3, N))).astype(F32)
    numbers[1, :40] = numbers[0, :40]
    return numbers


def has_bits(found, exact):
    exact = np.asarray(exact, found.dtype)
    return np.array_equal(found.view(U32), exact.view(U32))


def on_lanes_and_on_numbers(operations, n_results, numbers):
    """(n_results, 2, N) words: what operations on three numbers make of LANES of them at a time, and of single ones."""

    @njit
    def run(a, b, c, out):
        for i in range(0, a.size, LANES):
            results = operations(load(a, i), load(b, i), load(c, i))
            for k in range(n_results):
                store(out[k, 0], i, results[k])
        for i in range(a.size):
            results = operations(a[i], b[i], c[i])
            for k in range(n_results):
                out[k, 1, i] = results[k]

    out = np.empty((n_results, 2, N), I32)
    run(*numbers, out)
    return out


@njit
def integer_operations(a, b, c):
    """Words that operations make of integers of either type; shifts are by 0 to 31."""
    by = kernels.both(b, 31)
    return (
        kernels.signed(kernels.add(a, b)),
        kernels.signed(kernels.subtract(a, b)),
        kernels.signed(kernels.multiply(a, b)),
        kernels.signed(kernels.both(a, b)),
        kernels.signed(kernels.either(a, b)),
        kernels.signed(kernels.differ(a, b)),
        kernels.signed(kernels.shift_left(a, by)),
        kernels.signed(kernels.shift_right(a, by)),
        kernels.signed(kernels.add(kernels.multiply(a, -3), 7)),
        kernels.bits_of(kernels.float_of(a)),
        kernels.bits_of(kernels.to_float(kernels.signed(a))),
        choose(kernels.is_at_least(kernels.signed(a), kernels.signed(b)), kernels.signed(c), -5),
        choose(
            kernels.both(kernels.is_at_least(kernels.signed(a), 0), kernels.is_at_least(kernels.signed(b), 0)),
            kernels.signed(c),
            -5,
        ),
    )


# What numpy makes of integers, as signed words and as unsigned ones.
INTEGER_TWINS = {
    "add": lambda a, b, c, ua, ub: a + b,
    "subtract": lambda a, b, c, ua, ub: a - b,
    "multiply": lambda a, b, c, ua, ub: a * b,
    "both": lambda a, b, c, ua, ub: a & b,
    "either": lambda a, b, c, ua, ub: a | b,
    "differ": lambda a, b, c, ua, ub: a ^ b,
    "shift_left": lambda a, b, c, ua, ub: a << (b & 31),
    "shift_right": lambda a, b, c, ua, ub: (ua >> (ub & U32(31))).view(I32),
    "numbers beside lanes": lambda a, b, c, ua, ub: a * I32(-3) + I32(7),
    "float_of and bits_of": lambda a, b, c, ua, ub: a,
    "to_float": lambda a, b, c, ua, ub: a.astype(F32).view(I32),
    "choose where is_at_least": lambda a, b, c, ua, ub: np.where(a >= b, c, I32(-5)),
    "choose where both": lambda a, b, c, ua, ub: np.where((a >= 0) & (b >= 0), c, I32(-5)),
}


@njit
def float_operations(a, b, c):
    """Words that operations make of floats."""
    return (
        kernels.bits_of(a + b),
        kernels.bits_of(a - b),
        kernels.bits_of(a * b),
        kernels.bits_of(-a),
        kernels.bits_of(kernels.size(a)),
        kernels.bits_of(a * b + c),
        kernels.bits_of(choose(a < b, c, F32(2.5))),
        kernels.bits_of(kernels.lesser(a, b)),
        kernels.bits_of(kernels.greater(a, b)),
        kernels.to_integer(a),
        kernels.bits_of(kernels.whole_part(a)),
        kernels.bits_of(kernels.square_root(a * a)),
        kernels.bits_of(kernels.fma(a, b, c)),
        kernels.bits_of(F32(0.1) * a - F32(0.7) + b * F32(3.0)),
    )


FLOAT_TWINS = {
    "sum": lambda a, b, c: a + b,
    "difference": lambda a, b, c: a - b,
    "product": lambda a, b, c: a * b,
    "negative": lambda a, b, c: -a,
    "size": lambda a, b, c: np.abs(a),
    "product and sum, each rounded": lambda a, b, c: a * b + c,
    "choose where less": lambda a, b, c: np.where(a < b, c, F32(2.5)),
    "lesser": lambda a, b, c: np.minimum(a, b),
    "greater": lambda a, b, c: np.maximum(a, b),
    "to_integer": lambda a, b, c: np.trunc(a).astype(I32),
    "whole_part": lambda a, b, c: np.floor(a),
    "square_root": lambda a, b, c: np.sqrt(a * a),
    # The product of two float32 is exact in float64, where their sum is rounded far below the last bit of float32.
    "fma": lambda a, b, c: (a.astype(float) * b + c).astype(F32),
    "numbers beside lanes": lambda a, b, c: F32(0.1) * a - F32(0.7) + b * F32(3.0),
}


@pytest.mark.parametrize("dtype", [I32, U32])
def test_operations_on_integers_are_numpys_and_wrap(dtype):
    numbers = random_words()
    found = on_lanes_and_on_numbers(integer_operations, len(INTEGER_TWINS), numbers.view(dtype))
    for (name, twin), results in zip(INTEGER_TWINS.items(), found, strict=True):
        exact = twin(*numbers.view(I32), *numbers[:2])
        assert has_bits(results, np.stack([exact, exact])), name


def test_operations_on_floats_are_numpys_to_the_last_bit():
    numbers = random_floats()
    found = on_lanes_and_on_numbers(float_operations, len(FLOAT_TWINS), numbers)
    for (name, twin), results in zip(FLOAT_TWINS.items(), found, strict=True):
        exact = twin(*numbers).view(I32)
        assert has_bits(results, np.stack([exact, exact])), name


def test_fma_rounds_once():
    """Where c cancels the rounded product, what is left is the product's rounding error, exactly."""
    numbers = RNG.normal(size=(3, N)).astype(F32)
    numbers[2] = -(numbers[0] * numbers[1])
    exact = numbers[0].astype(float) * numbers[1] + numbers[2]
    fused = njit(lambda a, b, c: (kernels.bits_of(kernels.fma(a, b, c)),))
    for found in on_lanes_and_on_numbers(fused, 1, numbers)[0].view(F32):
        assert np.array_equal(found, exact)
        assert np.count_nonzero(found) > 0.8 * N


@njit
def functions_of_words(a, b, c):
    low, high = U32(77), U32(2**32 - 5)
    first, second, third = _noise_kernels.random_triple(low, high, a)
    sine, cosine = _math_kernels.sin_cos(kernels.signed(a))
    return (
        kernels.bits_of(sine),
        kernels.bits_of(cosine),
        kernels.bits_of(_noise_kernels.standard_normal(a)),
        kernels.bits_of(_noise_kernels.unit_uniform(a)),
        kernels.signed(_noise_kernels.random_bits(low, high, a)),
        kernels.signed(first),
        kernels.signed(second),
        kernels.signed(third),
    )


@njit
def functions_of_floats(a, b, c):
    return kernels.bits_of(_math_kernels.exp_32(a)), _math_kernels.small_binary_angle(b)


@pytest.mark.parametrize(
    ("functions", "n_functions", "numbers"),
    [
        (functions_of_words, 8, random_words()),
        (functions_of_floats, 2, RNG.uniform([[-80], [-3.1], [0]], [[80], [3.1], [1]], (3, N)).astype(F32)),
    ],
)
def test_sines_exponentials_and_random_numbers_have_the_same_bits_on_lanes_as_on_single_numbers(
    functions, n_functions, numbers
):
    for on_lanes, on_numbers in on_lanes_and_on_numbers(functions, n_functions, numbers):
        assert np.array_equal(on_lanes, on_numbers)
        assert np.unique(on_lanes).size > N // 2


# Lanes and memory


@njit
def moved(source, place, target, there):
    store(target, there, load(source, place))


@pytest.mark.parametrize("dtype", [F32, I32, U32])
@pytest.mark.parametrize(("place", "there"), [(0, 0), (3, 41), (40, 7)])
def test_store_writes_the_lanes_that_load_read_and_nothing_else(dtype, place, there):
    """At any place, aligned or not."""
    source = RNG.integers(0, 2**32, 64, dtype=U32).view(dtype)
    target = np.full(64, 7, dtype)
    expected = target.copy()
    expected[there : there + LANES] = source[place : place + LANES]
    moved(source, place, target, there)
    assert has_bits(target, expected)


@njit
def chosen_from(numbers, mask, out, place):
    kernels.store_chosen(out, place, load(numbers, 0), kernels.is_at_least(load(mask, 0), 1))


@given(numbers=words, mask=masks, place=st.integers(0, 20), dtype=st.sampled_from([F32, I32]))
def test_store_chosen_writes_exactly_the_chosen_lanes_side_by_side_in_order(numbers, mask, place, dtype):
    out, n = np.full(64, 7, dtype), np.count_nonzero(mask)
    chosen_from(numbers.view(dtype), mask.astype(I32), out, place)
    assert has_bits(out[place : place + n], numbers.view(dtype)[mask])
    # Up to LANES there may be anything.
    assert (np.delete(out, np.s_[place : place + LANES]) == 7).all()


@njit
def count_of(mask):
    return kernels.how_many(kernels.is_at_least(load(mask, 0), 1))


@given(mask=masks)
def test_how_many_counts_the_lanes_for_which_the_condition_holds(mask):
    assert count_of(mask.astype(I32)) == np.count_nonzero(mask)


@njit
def looked_up(table, places, out):
    store(out, 0, kernels.look_up(table, load(places, 0)))


def test_look_up_takes_the_numbers_at_flat_places_of_a_table():
    table, places, out = RNG.random((9, 11), F32), RNG.integers(0, 99, LANES).astype(I32), np.empty(LANES, F32)
    places[:2] = 0, 98
    looked_up(table, places, out)
    assert np.array_equal(out, table.ravel()[places])


@njit
def put(first, number, counted, copied):
    store(counted, 0, kernels.count_up(first))
    store(copied, 0, kernels.copies(number))


@pytest.mark.parametrize("first", [U32(0), U32(2**32 - 3), I32(-5), I32(2**31 - 3)])
def test_count_up_goes_up_by_one_and_wraps(first):
    counted = np.empty(LANES, first.dtype)
    put(first, F32(0.1), counted, np.empty(LANES, F32))
    assert has_bits(counted, np.full(LANES, first) + np.arange(LANES, dtype=first.dtype))


@pytest.mark.parametrize("number", [F32(0.1), I32(-9), U32(2**32 - 1)])
def test_copies_are_all_the_number(number):
    copied = np.empty(LANES, number.dtype)
    put(U32(0), number, np.empty(LANES, U32), copied)
    assert (copied == number).all()


# From lane to lane


@njit
def sums_of(numbers, out):
    store(out, 0, kernels.running_sums(load(numbers, 0)))


@given(numbers=words, dtype=st.sampled_from([I32, U32]))
def test_running_sums_are_numpys_and_wrap(numbers, dtype):
    out = np.empty(LANES, dtype)
    sums_of(numbers.view(dtype), out)
    assert has_bits(out, np.cumsum(numbers.view(dtype), dtype=dtype))


@njit
def total_and_least(numbers):
    lanes = load(numbers, 0)
    return kernels.total(lanes), kernels.least(lanes)


@given(numbers=ordinary)
def test_total_adds_the_second_half_to_the_first_until_one_is_left(numbers):
    halved = numbers
    while halved.size > 1:
        halved = halved[: halved.size // 2] + halved[halved.size // 2 :]
    assert has_bits(np.array([total_and_least(numbers)[0]], F32), halved)


@given(numbers=ordinary)
def test_least_is_the_minimum(numbers):
    assert total_and_least(numbers)[1] == numbers.min()
