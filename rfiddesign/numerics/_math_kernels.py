"""Elementary functions from IEEE additions and multiplications alone.

The C library's sin, exp and log differ between machines in their last bits and cannot be vectorized by LLVM; these
give the same bits everywhere and run in SIMD registers.  Angles are binary: int32 with 2^32 units to the turn, so that
wrapping costs nothing.
"""

import math

import numpy as np

from rfiddesign.numerics import _lane_kernels as lanes
from rfiddesign.numerics._compile_kernels import inline_kernel, kernel
from rfiddesign.numerics._lane_kernels import fma

BINARY_UNITS_PER_RADIAN = 2.0**31 / math.pi
RADIANS_PER_BINARY_UNIT = math.pi / 2.0**31

_F = np.float32
_BINARY_PER_RAD_32 = _F(BINARY_UNITS_PER_RADIAN)
_RAD_PER_BINARY_32 = _F(RADIANS_PER_BINARY_UNIT)
_LOG2_E = _F(1.4426950408889634)
_LN_2 = _F(0.6931471805599453)
_ATAN = tuple((-1.0) ** k / (2 * k + 1) for k in range(20))


@inline_kernel
def binary_angle(theta):
    """Angle [rad], any finite value below 1e5, as a binary angle."""
    turns = theta * (0.5 / math.pi)
    turns -= math.floor(turns + 0.5)
    return np.int32(np.int64(turns * 4294967296.0))


@inline_kernel
def small_binary_angle(theta):
    """float32 angle (one or lanes) strictly within (-pi, pi) [rad] as a binary angle."""
    return lanes.to_integer(theta * _BINARY_PER_RAD_32)


@inline_kernel
def sin_cos(angle):
    """Sine and cosine (float32, error below 3e-7) of a binary angle (one or lanes)."""
    # In the left half of the turn both are those of the angle half a turn on, with the other sign.
    sign = lanes.both(lanes.add(angle, 0x40000000), 0x80000000)
    r = lanes.to_float(lanes.differ(angle, sign)) * _RAD_PER_BINARY_32
    r2 = r * r
    s = fma(fma(fma(r2, _F(2.600054717e-6), _F(-1.980661518e-4)), r2, _F(8.333017291e-3)), r2, _F(-1.66666571e-1))
    c = fma(fma(fma(r2, _F(2.31943868e-5), _F(-1.38559272e-3)), r2, _F(4.166398946e-2)), r2, _F(-4.999993229e-1))
    sine, cosine = fma(s, r * r2, r), fma(c, r2, _F(1.0))
    return lanes.float_of(lanes.differ(lanes.bits_of(sine), sign)), lanes.float_of(
        lanes.differ(lanes.bits_of(cosine), sign)
    )


@kernel
def sin_cos_64(theta):
    """Sine and cosine (float64, error below 1e-13) of theta [rad], |theta| below 1e5."""
    quarter = math.floor(theta * (2.0 / math.pi) + 0.5)
    r = (theta - quarter * 1.5707963267341256) - quarter * 6.077100506506192e-11
    r2 = r * r
    s = r * (
        1.0
        + r2 * (-1 / 6 + r2 * (1 / 120 + r2 * (-1 / 5040 + r2 * (1 / 362880 + r2 * (-1 / 39916800 + r2 / 6227020800)))))
    )
    c = 1.0 + r2 * (
        -1 / 2
        + r2
        * (1 / 24 + r2 * (-1 / 720 + r2 * (1 / 40320 + r2 * (-1 / 3628800 + r2 * (1 / 479001600 - r2 / 87178291200)))))
    )
    quadrant = np.int64(quarter) & 3
    if quadrant == 0:
        return s, c
    if quadrant == 1:
        return c, -s
    if quadrant == 2:
        return -s, -c
    return -c, s


@inline_kernel
def exp_32(x):
    """e^x for float32 x (one or lanes) in [-80, 80], relative error below 2e-7 + 7.5e-8 |x|; exactly 1 for 0."""
    t = x * _LOG2_E
    whole = lanes.whole_part(t)
    r = t - whole
    p = fma(fma(r, _F(1.867130495e-3), _F(9.017029268e-3)), r, _F(5.579991403e-2))
    p = fma(fma(fma(p, r, _F(2.401644498e-1)), r, _F(6.931513118e-1)), r, _F(1.0))
    # The exponent of a float starts at its bit 23.
    return lanes.float_of(lanes.add(lanes.bits_of(p), lanes.shift_left(lanes.to_integer(whole), 23)))


@inline_kernel
def log_32(x):
    """Natural logarithm of float32 x > 0 (one or lanes, no denormals), error below 4e-7 + 1.5e-7 |log x|; 0 for 1."""
    bits = lanes.bits_of(x)
    exponent = lanes.to_float(lanes.subtract(lanes.shift_right(bits, 23), 127))
    t = lanes.float_of(lanes.either(lanes.both(bits, 0x007FFFFF), 0x3F800000)) - _F(1.0)
    p = fma(
        fma(fma(t, _F(1.5529675409197807e-2), _F(-7.95568972826004e-2)), t, _F(0.19429320096969604)),
        t,
        _F(-0.32590124011039734),
    )
    p = fma(fma(fma(p, t, _F(0.4735531508922577)), t, _F(-0.7205854058265686)), t, _F(1.442667841911316))
    return fma(p, t, exponent) * _LN_2


@kernel
def atan2_64(y, x):
    """Angle of the point (x, y) (float64, error below 1e-14 rad), 0 for the origin."""
    across, along = abs(y), abs(x)
    if across == 0.0 and along == 0.0:
        return 0.0
    is_steep = across > along
    t = along / across if is_steep else across / along
    # Below tan(pi/8) the series of the arctangent needs few terms; four sums of every fourth term do not wait for each
    # other.
    is_large = t > 0.41421356237309503
    t = (t - 1.0) / (t + 1.0) if is_large else t
    t2 = t * t
    t4 = t2 * t2
    t8 = t4 * t4
    first = second = third = fourth = 0.0
    for k in range(16, -1, -4):
        first = _ATAN[k] + t8 * first
        second = _ATAN[k + 1] + t8 * second
        third = _ATAN[k + 2] + t8 * third
        fourth = _ATAN[k + 3] + t8 * fourth
    series = (first + t2 * second) + t4 * (third + t2 * fourth)
    angle = t * series
    if is_large:
        angle += 0.7853981633974483
    if is_steep:
        angle = 1.5707963267948966 - angle
    if x < 0.0:
        angle = 3.141592653589793 - angle
    return -angle if y < 0.0 else angle
