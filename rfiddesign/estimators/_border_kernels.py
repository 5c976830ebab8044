"""What one poll says of a Gaussian over the pose, where the field's border is next to straight beside it.

Across the border the tag's place is Gaussian, and the chance to be inside is a normal distribution function of it: the
moments of their product are known in closed form (the probit update of expectation propagation: Rasmussen, Williams
2006, section 3.9).
"""

import math

import numpy as np

from rfiddesign.estimators._mixture_kernels import HH, XH, XX, XY, YH, YY
from rfiddesign.estimators._projection_kernels import B_U, EVIDENCE, MEAN_U, N_TOLD, VAR_UU, say_nothing
from rfiddesign.numerics._compile_kernels import inline_kernel, leaf_kernel
from rfiddesign.numerics._math_kernels import exp_32

# Beyond so many sigmas a border tells nothing.
FARTHEST = 4.0
_PER_ROOT_2_PI = 1.0 / math.sqrt(2.0 * math.pi)
_LEAST_LEFT, _LEAST_BLUR = 0.02, 1e-4
# By how much the bend of a border may change the logarithm of a poll's probability; the widest Gaussian beside a field,
# in half its size; and how far off a corner must be, in sigmas.
_MOST_BEND, _WIDEST, _CORNER = 0.25, 0.4, 3.0


@inline_kernel
def normal(z):
    """Density and distribution function of a standard normal, error below 1e-7 (Abramowitz, Stegun 26.2.17)."""
    z = min(max(z, -8.0), 8.0)
    density = _PER_ROOT_2_PI * np.float64(exp_32(np.float32(-0.5 * z * z)))
    t = 1.0 / (1.0 + 0.2316419 * abs(z))
    tail = density * t * (
        0.319381530 + t * (-0.356563782 + t * (1.781477937 + t * (-1.821255978 + t * 1.330274429)))
    )  # fmt: skip
    return density, tail if z < 0.0 else 1.0 - tail


@leaf_kernel
def look_across(mix, k, seen, shape, softness, base, gain, found):
    """A poll whose chance is `base` + `gain` times that of a tag to be in the field.

    Parameters
    ----------
    seen : what `seen_from` says of the tag.
    shape : (half_length, half_width, corner, inner) of the field [mm].
    softness : blur of its border [mm].

    Returns False, and finds nothing, if the border bends too much beside the component.
    """
    u, v, h0, h1, hu, hv = seen
    half_length, half_width, corner, inner = shape
    xx, xy, yy, xh, yh, hh = mix[k, XX], mix[k, XY], mix[k, YY], mix[k, XH], mix[k, YH], mix[k, HH]
    # The trace of S, and the blur.
    whole = xx + yy + (hu * hu + hv * hv) * hh - 2.0 * (xh * (hu * h0 - hv * h1) + yh * (hu * h1 + hv * h0))
    soft = softness * softness + _LEAST_BLUR
    beyond_u, beyond_v = abs(u) - half_length, abs(v) - half_width
    out_u, out_v = max(beyond_u, 0.0), max(beyond_v, 0.0)
    way = math.sqrt(out_u * out_u + out_v * out_v)
    depth = corner - way - min(max(beyond_u, beyond_v), 0.0)
    far = FARTHEST * FARTHEST * (whole + soft)
    if depth * depth > far:
        if depth < 0.0:
            say_nothing(found, base)
            return True
        if inner <= 0.0 or (corner - depth - inner > 0.0 and (corner - depth - inner) ** 2 > far):
            say_nothing(found, base + gain)
            return True
    # Outwards, in the antenna's axes.
    if half_length > 0.0:
        is_along = beyond_u > beyond_v
        nu, nv = (math.copysign(1.0, u), 0.0) if is_along else (0.0, math.copysign(1.0, v))
        room = -min(beyond_u, beyond_v)
        size = min(half_length, half_width) + corner
        if room <= 0.0 or room * room < _CORNER * _CORNER * whole:
            return False
    else:
        per_way = 1.0 / max(way, 1e-9)
        nu, nv = u * per_way, v * per_way
        size = corner
    g0, g1, g2 = nv * h1 - nu * h0, -nu * h1 - nv * h0, nu * hu + nv * hv
    p0, p1, p2 = xx * g0 + xy * g1 + xh * g2, xy * g0 + yy * g1 + yh * g2, xh * g0 + yh * g1 + hh * g2
    across = max(g0 * p0 + g1 * p1 + g2 * p2, 1e-9)
    if across > _WIDEST * _WIDEST * size * size:
        return False
    # How much farther than its mean place a tag is on average; a straight border has no bend.
    bend = math.sqrt(way * way + max(whole - across, 0.0)) - way if half_length == 0.0 else 0.0
    variance = across + soft
    per_sigma = 1.0 / math.sqrt(variance)
    z = (depth - bend) * per_sigma
    density, inside = normal(z)
    slope, curve = density, z * density
    if inner > 0.0:
        z = (depth - bend + inner - corner) * per_sigma
        density, within = normal(z)
        slope, curve, inside = slope - density, curve - z * density, inside - within
    e = max(base + gain * inside, 1e-12)
    if abs(gain * slope) * bend * per_sigma > _MOST_BEND * e:
        return False
    # With xi across the border, outwards: its mean and variance in terms of P g' itself, which spares roots.
    per_e = gain / e
    move = -per_e * slope * per_sigma
    shrink = per_e * curve * per_sigma * per_sigma + move * move
    if shrink * across > 1.0 - _LEAST_LEFT:
        shrink = (1.0 - _LEAST_LEFT) / across
    found[EVIDENCE], found[N_TOLD] = e, 1.0
    found[MEAN_U], found[VAR_UU] = move, 1.0 - shrink
    found[B_U], found[B_U + 1], found[B_U + 2] = p0, p1, p2
    return True
