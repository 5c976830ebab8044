"""A pose (3,) [mm, mm, rad] and its covariance P (3, 3), and what is done to them without probabilities."""

import math

from rfiddesign.numerics._compile_kernels import inline_kernel, leaf_kernel
from rfiddesign.numerics._math_kernels import sin_cos_64

# Variances stop to shrink and to grow here (10 km, any heading), and correlations to grow: rounding could make them 1.
_LEAST_VARIANCE, _LEAST_TURN_VARIANCE = 1e-6, 1e-12
_MOST_VARIANCE, _MOST_TURN_VARIANCE = 1e14, math.pi**2 / 3
_MOST_CORRELATION = 1.0 - 1e-6


@inline_kernel
def wrapped(angle):
    """Angle [rad] from -pi to pi."""
    return angle - 2.0 * math.pi * math.floor(angle / (2.0 * math.pi) + 0.5)


@leaf_kernel
def keep_positive(P):
    """Bound the variances of P, keep it symmetric and positive definite."""
    P[2, 2] = min(max(P[2, 2], _LEAST_TURN_VARIANCE), _MOST_TURN_VARIANCE)
    for i in range(2):
        P[i, i] = max(P[i, i], _LEAST_VARIANCE)
        if P[i, i] > _MOST_VARIANCE:
            factor = math.sqrt(_MOST_VARIANCE / P[i, i])
            for j in range(3):
                P[min(i, j), max(i, j)] *= factor
            P[i, i] = _MOST_VARIANCE
    xx, yy, hh = P[0, 0], P[1, 1], P[2, 2]
    most = _MOST_CORRELATION * math.sqrt(xx * yy)
    xy = min(max(P[0, 1], -most), most)
    xh, yh = P[0, 2], P[1, 2]
    # What the position tells of the heading's variance must be less than all of it.
    told = (yy * xh * xh - 2.0 * xy * xh * yh + xx * yh * yh) / (xx * yy - xy * xy)
    factor = math.sqrt(_MOST_CORRELATION * hh / told) if told > _MOST_CORRELATION * hh else 1.0
    P[0, 1] = P[1, 0] = xy
    P[0, 2] = P[2, 0] = factor * xh
    P[1, 2] = P[2, 1] = factor * yh


@leaf_kernel
def stand(pose, P, tag_x, tag_y, x, y, xx, xy, yy):
    """Move the robot such that the place (x, y) on it lies at (tag_x, tag_y), with the heading it has.

    The covariance of the position is (xx, xy, yy) in the map's axes, and what the heading's error does to the lever.
    """
    s, c = sin_cos_64(pose[2])
    ahead_x, ahead_y = c * x - s * y, s * x + c * y
    pose[0], pose[1] = tag_x - ahead_x, tag_y - ahead_y
    hh = P[2, 2]
    P[0, 0], P[0, 1], P[1, 1] = xx + ahead_y**2 * hh, xy - ahead_x * ahead_y * hh, yy + ahead_x**2 * hh
    P[0, 2], P[1, 2] = ahead_y * hh, -ahead_x * hh


@leaf_kernel
def in_map(heading, xx, xy, yy):
    """A covariance of the robot's axes in the map's: R C R'."""
    s, c = sin_cos_64(heading)
    return (
        c * c * xx - 2.0 * s * c * xy + s * s * yy,
        s * c * (xx - yy) + (c * c - s * s) * xy,
        s * s * xx + 2.0 * s * c * xy + c * c * yy,
    )
