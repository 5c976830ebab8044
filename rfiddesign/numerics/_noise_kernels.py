"""Counter-based random numbers: each draw is a hash of (study seed, run, stream, step, index).

There is no state to share, so that results cannot depend on threads, on the order of runs or on how far another run
got.  Sources: splitmix64 (Steele, Lea, Flood 2014); the 32-bit mixer `lowbias32` (Wellons 2018); normals by
a polynomial of our own for the inverse of the normal distribution.
"""

import numpy as np

from rfiddesign.numerics import _lane_kernels as lanes
from rfiddesign.numerics._compile_kernels import inline_kernel, kernel
from rfiddesign.numerics._lane_kernels import fma

# One stream per use, so that a change in how often one is drawn leaves the others alone.
STREAM_ODOMETRY = 1
STREAM_READS = 2
STREAM_PREDICT = 3
STREAM_RESAMPLE = 4
STREAM_INITIALIZE = 5
STREAM_INSTALLATION = 6
STREAM_ROUTE = 7
STREAM_MANNER = 8
STREAM_SLIP = 9
STREAM_PLACE = 10
STREAM_DEAD = 11

_F = np.float32
_U = np.uint32
_W = np.uint64
# 159 - x - log2(f) + (f - 1) for 1 <= f < 2, to 1.3e-5, and the normal quantile of u over sqrt(-log2 u), to 1.3e-4 of
# it (of 0.3 where that is more).
_L0 = _F(160.80036)
_L1 = _F(-4.09170624)
_L2 = _F(3.55078639)
_L3 = _F(-1.63114418)
_L4 = _F(0.4165621)
_L5 = _F(-0.0448733941)
_Z0 = _F(-2.30143678)
_Z1 = _F(3.21998032)
_Z2 = _F(-1.39723694)
_Z3 = _F(0.630735145)
_Z4 = _F(-0.180410367)
_Z5 = _F(0.031270619)
_Z6 = _F(-0.00298352037)
_Z7 = _F(0.00011986324)


@kernel
def split_mix(x):
    """One step of splitmix64: a bijective mix of 64 bits."""
    z = _W(x) + _W(0x9E3779B97F4A7C15)
    z = (z ^ (z >> _W(30))) * _W(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> _W(27))) * _W(0x94D049BB133111EB)
    return z ^ (z >> _W(31))


@kernel
def run_key(seed, run):
    """Key of one run of a study (uint64)."""
    return split_mix(split_mix(_W(seed)) ^ _W(run))


@kernel
def step_key(key, stream, step):
    """Key of one stream at one step of a run (uint64)."""
    return split_mix(_W(key) ^ (_W(stream) << _W(48)) ^ _W(step))


@inline_kernel
def _first_round(key_low, index):
    h = lanes.add(index, key_low)
    return lanes.multiply(lanes.differ(h, lanes.shift_right(h, 16)), _U(0x7FEB352D))


@inline_kernel
def _second_round(h, shift, key_high, factor):
    h = lanes.multiply(lanes.differ(lanes.differ(h, lanes.shift_right(h, shift)), key_high), factor)
    return lanes.differ(h, lanes.shift_right(h, 16))


@inline_kernel
def random_bits(key_low, key_high, index):
    """32 random bits for draw `index` (uint32, one or lanes) of a step's stream, whose key is given as two halves."""
    return _second_round(_first_round(key_low, index), 15, key_high, _U(0x846CA68B))


@inline_kernel
def random_triple(key_low, key_high, index):
    """Three words of 32 random bits each for draw `index`; the first is that of `random_bits`.

    The three share the hash's first round and have second rounds of their own.
    """
    h = _first_round(key_low, index)
    return (
        _second_round(h, 15, key_high, _U(0x846CA68B)),
        _second_round(h, 13, key_high, _U(0xC2B2AE35)),
        _second_round(h, 17, key_high, _U(0x9E3779B1)),
    )


@inline_kernel
def key_halves(key):
    """The two 32-bit halves of a 64-bit key."""
    return _U(key & _W(0xFFFFFFFF)), _U(key >> _W(32))


@inline_kernel
def unit_uniform(bits):
    """Uniform float32 strictly inside (0, 1) from bits (one or lanes): odd multiples of 2^-24."""
    return (lanes.to_float(lanes.signed(lanes.shift_right(bits, 9))) + _F(0.5)) * _F(1.1920929e-07)


@inline_kernel
def fine_uniform(bits):
    """Uniform float64 strictly inside (0, 1) from 32 random bits (one): odd multiples of 2^-33."""
    return (np.float64(bits) + 0.5) * 2.0**-32


@inline_kernel
def standard_normal(bits):
    """Standard normal float32 from 32 random bits (one or lanes) by inversion, to 6.4 sigma.

    The top bit is the sign, the others a tail probability u = (bits + 1/2) / 2^32 below 1/2.  The quantile is a
    polynomial in sqrt(-log2 u); the error is below 2e-4 of the quantile (of 0.3 where that is more).
    """
    tail = lanes.to_float(lanes.signed(lanes.both(bits, 0x7FFFFFFF))) + _F(0.5)
    pattern = lanes.bits_of(tail)
    f = lanes.float_of(lanes.either(lanes.both(pattern, 0x007FFFFF), 0x3F800000))
    # The bits of a float, read as an integer, are its logarithm but for a bump within each octave.
    bump = fma(fma(fma(fma(f, _L5, _L4), f, _L3), f, _L2), f, _L1)
    s = lanes.square_root(fma(bump, f, fma(lanes.to_float(pattern), _F(-1.1920929e-07), _L0)))
    z = fma(fma(fma(fma(s, _Z7, _Z6), s, _Z5), s, _Z4), s, _Z3)
    z = fma(fma(fma(z, s, _Z2), s, _Z1), s, _Z0)
    return lanes.float_of(lanes.differ(lanes.bits_of(z), lanes.signed(lanes.both(bits, 0x80000000))))


@kernel
def fill_normal(key, out):
    """Fill a float32 array with standard normals of one step's stream."""
    low, high = key_halves(key)
    for i in range(out.shape[0]):
        out[i] = standard_normal(random_bits(low, high, _U(i)))


@kernel
def fill_fine_uniform(key, out):
    """Fill a float64 array with uniforms of one step's stream."""
    low, high = key_halves(key)
    for i in range(out.shape[0]):
        out[i] = fine_uniform(random_bits(low, high, _U(i)))


@kernel
def fill_uniform(key, out):
    """Fill a float32 array with uniforms of one step's stream."""
    low, high = key_halves(key)
    for i in range(out.shape[0]):
        out[i] = unit_uniform(random_bits(low, high, _U(i)))
