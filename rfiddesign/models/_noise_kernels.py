"""Counter-based random numbers: each draw is a hash of (study seed, run, stream, step, index).

There is no state to share, so that results cannot depend on threads, on the order of runs or on how far another run
got.  Sources: splitmix64 (Steele, Lea, Flood 2014); the 32-bit mixer `lowbias32` (Wellons 2018); normals by the
inverse of the error function (Giles 2010, single precision), good to +-5.4 sigma.
"""

import math

import numpy as np
from numba import njit

from rfiddesign.models._math_kernels import log_32, sin_cos

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
    """Standard normal float32 from 32 random bits by inversion."""
    x = _F(_F(np.int32(bits >> _U(9))) + _F(0.5)) * _F(2.3841858e-07) - _F(1.0)
    w = _F(-log_32(_F((_F(1.0) - x) * (_F(1.0) + x))))
    a = _F(w - _F(2.5))
    p = _F(2.81022636e-08)
    p = _F(p * a + _F(3.43273939e-07))
    p = _F(p * a + _F(-3.5233877e-06))
    p = _F(p * a + _F(-4.39150654e-06))
    p = _F(p * a + _F(0.00021858087))
    p = _F(p * a + _F(-0.00125372503))
    p = _F(p * a + _F(-0.00417768164))
    p = _F(p * a + _F(0.246640727))
    p = _F(p * a + _F(1.50140941))
    b = _F(_F(math.sqrt(max(w, _F(0.0)))) - _F(3.0))
    q = _F(-0.000200214257)
    q = _F(q * b + _F(0.000100950558))
    q = _F(q * b + _F(0.00134934322))
    q = _F(q * b + _F(-0.00367342844))
    q = _F(q * b + _F(0.00573950773))
    q = _F(q * b + _F(-0.0076224613))
    q = _F(q * b + _F(0.00943887047))
    q = _F(q * b + _F(1.00167406))
    q = _F(q * b + _F(2.83297682))
    return _F((p if w < _F(5.0) else q) * x * _F(1.4142135))


@njit(inline="always", cache=True, nogil=True)
def normal_pair(bits, more_bits):
    """Two independent standard normals (float32, to 5.7 sigma) by Box and Muller: half the work of two inversions."""
    radius = _F(math.sqrt(max(_F(-2.0) * log_32(unit_uniform(bits)), _F(0.0))))
    sine, cosine = sin_cos(np.int32(more_bits))
    return _F(radius * cosine), _F(radius * sine)


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
