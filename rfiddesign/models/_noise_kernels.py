"""Counter-based random numbers: each draw is a hash of (study seed, run, stream, step, index).

There is no state to share, so that results cannot depend on threads, on the order of runs or on how far another run
got.  Sources: splitmix64 (Steele, Lea, Flood 2014); the 32-bit mixer `lowbias32` (Wellons 2018); normals by
a polynomial of our own for the inverse of the normal distribution.
"""

import math

import numpy as np
from numba import njit

from rfiddesign.models._math_kernels import fma_32

# One stream per use, so that a change in how often one is drawn leaves the others alone.
STREAM_ODOMETRY = 1
STREAM_READS = 2
STREAM_PREDICT = 3
STREAM_RESAMPLE = 4
STREAM_INITIALIZE = 5
STREAM_INSTALLATION = 6

_F = np.float32
_U = np.uint32
_W = np.uint64
# The bump of log2 between powers of two, divided by m (1 - m); and the normal quantile over sqrt(-log2 u).
_B0 = 0.44183588
_B1 = -0.26653627
_B2 = 0.14701878
_B3 = -0.04424374
_Z0 = -2.3014235
_Z1 = 3.2199233
_Z2 = -1.3971417
_Z3 = 0.63065535
_Z4 = -0.1803738
_Z5 = 0.03126139
_Z6 = -0.0029823203
_Z7 = 0.000119800716


@njit(cache=True, nogil=True)
def split_mix(x):
    """One step of splitmix64: a bijective mix of 64 bits."""
    z = _W(x) + _W(0x9E3779B97F4A7C15)
    z = (z ^ (z >> _W(30))) * _W(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> _W(27))) * _W(0x94D049BB133111EB)
    return z ^ (z >> _W(31))


@njit(cache=True, nogil=True)
def run_key(seed, run):
    """Key of one run of a study (uint64)."""
    return split_mix(split_mix(_W(seed)) ^ _W(run))


@njit(cache=True, nogil=True)
def step_key(key, stream, step):
    """Key of one stream at one step of a run (uint64)."""
    return split_mix(_W(key) ^ (_W(stream) << _W(48)) ^ _W(step))


@njit(inline="always", cache=True, nogil=True)
def random_bits(key_low, key_high, index):
    """32 random bits for draw `index` of a step's stream, whose key is given as its two halves."""
    h = _U(_U(index) + key_low)
    h = _U(h ^ (h >> _U(16)))
    h = _U(h * _U(0x7FEB352D))
    h = _U(h ^ (h >> _U(15)) ^ key_high)
    h = _U(h * _U(0x846CA68B))
    return _U(h ^ (h >> _U(16)))


@njit(inline="always", cache=True, nogil=True)
def key_halves(key):
    """The two 32-bit halves of a 64-bit key."""
    return _U(key & _W(0xFFFFFFFF)), _U(key >> _W(32))


@njit(inline="always", cache=True, nogil=True)
def unit_uniform(bits):
    """Uniform float32 strictly inside (0, 1): odd multiples of 2^-24, which float32 holds exactly up to the last."""
    return _F(_F(np.int32(bits >> _U(9))) + _F(0.5)) * _F(1.1920929e-07)


@njit(inline="always", cache=True, nogil=True)
def standard_normal(bits):
    """Standard normal float32 from 32 random bits by inversion, to 6.4 sigma.

    The top bit is the sign, the others a tail probability u = (bits + 1/2) / 2^32 below 1/2.  The quantile is a
    polynomial in sqrt(-log2 u); the error is below 2e-4 of the quantile (of 0.3 where that is more).
    """
    tail = _F(_F(np.int32(bits & _U(0x7FFFFFFF))) + _F(0.5))
    word = tail.view(np.int32)
    mantissa = np.int32((word & np.int32(0x007FFFFF)) | np.int32(0x3F800000)).view(np.float32)
    m = _F(mantissa - _F(1.0))
    # The bits of a float, read as an integer, are its logarithm but for a bump within each octave.
    bump = fma_32(fma_32(fma_32(_F(_B3), m, _F(_B2)), m, _F(_B1)), m, _F(_B0))
    log_u = fma_32(_F(word), _F(-1.1920929e-07), _F(159.0))
    s = _F(math.sqrt(fma_32(_F(m - _F(1.0)) * m, bump, log_u)))
    z = fma_32(_F(_Z7), s, _F(_Z6))
    z = fma_32(z, s, _F(_Z5))
    z = fma_32(z, s, _F(_Z4))
    z = fma_32(z, s, _F(_Z3))
    z = fma_32(z, s, _F(_Z2))
    z = fma_32(z, s, _F(_Z1))
    z = fma_32(z, s, _F(_Z0))
    sign = np.int32(bits & _U(0x80000000))
    return np.int32(_F(z).view(np.int32) ^ sign).view(np.float32)


@njit(cache=True, nogil=True)
def fill_normal(key, out):
    """Fill a float32 array with standard normals of one step's stream."""
    low, high = key_halves(key)
    for i in range(out.shape[0]):
        out[i] = standard_normal(random_bits(low, high, _U(i)))


@njit(cache=True, nogil=True)
def fill_uniform(key, out):
    """Fill a float32 array with uniforms of one step's stream."""
    low, high = key_halves(key)
    for i in range(out.shape[0]):
        out[i] = unit_uniform(random_bits(low, high, _U(i)))
