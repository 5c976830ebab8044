"""Signed distance to the border of a detection area and its gradient, compiled; see `shape.Shape`."""

import math

from rfiddesign.numerics._compile_kernels import leaf_kernel

# Nearer than this there is no direction: squares of tiny numbers vanish.
_LEAST_MM = 1e-9


@leaf_kernel
def signed_distance(u, v, half_length, half_width, corner, segments):
    """Distance of (u, v) in the antenna's frame to the area's border, negative inside, and its gradient.

    The gradient is 0 where it is undefined: in the centre of a disc.  Without `segments` (n, 4) the area is a rounded
    rectangle: what lies within `corner` of a box of the given half sides.
    """
    if segments.shape[0] > 0:
        return _to_segments(u, v, segments)
    beyond_u, beyond_v = abs(u) - half_length, abs(v) - half_width
    sign_u, sign_v = math.copysign(1.0, u), math.copysign(1.0, v)
    if beyond_u <= 0.0 and beyond_v <= 0.0:
        if half_length == 0.0 and half_width == 0.0:
            return -corner, 0.0, 0.0
        if beyond_u > beyond_v:
            return beyond_u - corner, sign_u, 0.0
        return beyond_v - corner, 0.0, sign_v
    out_u, out_v = max(beyond_u, 0.0), max(beyond_v, 0.0)
    distance = math.sqrt(out_u * out_u + out_v * out_v)
    if distance < _LEAST_MM:
        return -corner, 0.0, 0.0
    return distance - corner, sign_u * out_u / distance, sign_v * out_v / distance


@leaf_kernel
def _to_segments(u, v, segments):
    """As above for an area bounded by segments (u0, v0, u1, v1); a point is inside if a ray crosses an odd number."""
    least, off_u, off_v, is_inside = math.inf, 0.0, 0.0, False
    for k in range(segments.shape[0]):
        u0, v0, u1, v1 = segments[k, 0], segments[k, 1], segments[k, 2], segments[k, 3]
        du, dv = u1 - u0, v1 - v0
        share = ((u - u0) * du + (v - v0) * dv) / (du * du + dv * dv)
        share = min(max(share, 0.0), 1.0)
        to_u, to_v = u - (u0 + share * du), v - (v0 + share * dv)
        squared = to_u * to_u + to_v * to_v
        if squared < least:
            least, off_u, off_v = squared, to_u, to_v
        if (v0 > v) != (v1 > v) and u < u0 + du * (v - v0) / dv:
            is_inside = not is_inside
    distance = math.sqrt(least)
    if distance < _LEAST_MM:
        return 0.0, 0.0, 0.0
    sign = -1.0 if is_inside else 1.0
    return sign * distance, sign * off_u / distance, sign * off_v / distance
