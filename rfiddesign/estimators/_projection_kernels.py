"""What one poll says of a Gaussian over the pose, and how the pose learns from it.

The tag's place z in the antenna's frame is, to first order, Gaussian with mean z(m) and covariance S = H P H' = L L'.
With z = z(m) + L xi the prior of xi is standard; its mean and covariance after the poll move the pose by B mean and the
covariance by B (covariance - I) B' with B = P H' L'^-1.  Where the field's border is straight beside the Gaussian, one
coordinate across it tells all (`_border_kernels`); else both are taken on a grid (`_plane_kernels`).
"""

import math

from rfiddesign.estimators._mixture_kernels import (
    COSINE,
    HH,
    SINE,
    XH,
    XX,
    XY,
    YH,
    YY,
    X,
    Y,
    keep_positive,
    turn_by,
)
from rfiddesign.numerics._compile_kernels import inline_kernel, leaf_kernel

# What is found of a poll: its probability; along how many coordinates it tells something; mean and covariance of xi
# after it; B by columns; L.
EVIDENCE, N_TOLD, MEAN_U, MEAN_V, VAR_UU, VAR_UV, VAR_VV, B_U, B_V, ROOT = 0, 1, 2, 3, 4, 5, 6, 7, 10, 13
N_FOUND = 16
_LEAST_VARIANCE = 1e-6


@inline_kernel
def say_nothing(found, evidence):
    """A poll that is as likely everywhere changes nothing."""
    found[EVIDENCE], found[N_TOLD] = evidence, 0.0


@inline_kernel
def seen_from(mix, k, antenna, tag_x, tag_y):
    """Where a tag lies in the frame of an antenna (x, y, sine, cosine) on component k, and H.

    Returns u, v, h0, h1, hu, hv: H = [[-h0, -h1, hu], [h1, -h0, hv]].
    """
    x, y, yaw_s, yaw_c = antenna
    s, c = mix[k, SINE], mix[k, COSINE]
    dx, dy = tag_x - mix[k, X], tag_y - mix[k, Y]
    px, py = c * dx + s * dy, c * dy - s * dx
    return (
        yaw_c * (px - x) + yaw_s * (py - y),
        yaw_c * (py - y) - yaw_s * (px - x),
        c * yaw_c - s * yaw_s,
        s * yaw_c + c * yaw_s,
        yaw_c * py - yaw_s * px,
        -yaw_c * px - yaw_s * py,
    )


@inline_kernel
def spread(mix, k, seen, found):
    """Root L of S = H P H' as (l00, l10, l11); B goes to `found`."""
    _, _, h0, h1, hu, hv = seen
    xx, xy, yy, xh, yh, hh = mix[k, XX], mix[k, XY], mix[k, YY], mix[k, XH], mix[k, YH], mix[k, HH]
    p0, p1, p2 = hu * xh - h0 * xx - h1 * xy, hu * yh - h0 * xy - h1 * yy, hu * hh - h0 * xh - h1 * yh
    q0, q1, q2 = hv * xh + h1 * xx - h0 * xy, hv * yh + h1 * xy - h0 * yy, hv * hh + h1 * xh - h0 * yh
    suu = hu * p2 - h0 * p0 - h1 * p1
    suv = hu * q2 - h0 * q0 - h1 * q1
    svv = hv * q2 + h1 * q0 - h0 * q1
    l00 = math.sqrt(max(suu, _LEAST_VARIANCE))
    l10 = suv / l00
    l11 = math.sqrt(max(svv - l10 * l10, _LEAST_VARIANCE))
    found[B_U], found[B_U + 1], found[B_U + 2] = p0 / l00, p1 / l00, p2 / l00
    found[B_V] = (q0 - l10 * found[B_U]) / l11
    found[B_V + 1] = (q1 - l10 * found[B_U + 1]) / l11
    found[B_V + 2] = (q2 - l10 * found[B_U + 2]) / l11
    found[ROOT], found[ROOT + 1], found[ROOT + 2] = l00, l10, l11
    return l00, l10, l11


@leaf_kernel
def spread_of(found):
    """Largest sigma of the tag's place, and the direction in the pose that goes with it: (sigma, x, y, heading)."""
    l00, l10, l11 = found[ROOT], found[ROOT + 1], found[ROOT + 2]
    suu, suv, svv = l00 * l00, l00 * l10, l10 * l10 + l11 * l11
    half = 0.5 * (suu - svv)
    most = 0.5 * (suu + svv) + math.sqrt(half * half + suv * suv)
    # An eigenvector of S, from the row with the larger numbers.
    eu, ev = (suv, most - suu) if suu < svv else (most - svv, suv)
    size = math.sqrt(eu * eu + ev * ev)
    if size < 1e-9 * most:
        eu, ev, size = 1.0, 0.0, 1.0
    sigma = math.sqrt(most)
    eu, ev = eu / (size * sigma), ev / (size * sigma)
    # L' e / sigma is the same direction in xi, of length 1.
    a, b = l00 * eu + l10 * ev, l11 * ev
    return (
        sigma,
        a * found[B_U] + b * found[B_V],
        a * found[B_U + 1] + b * found[B_V + 1],
        a * found[B_U + 2] + b * found[B_V + 2],
    )


@leaf_kernel
def learn(mix, k, found):
    """Move component k by what a poll said of it."""
    if found[N_TOLD] == 0.0:
        return
    b0, b1, b2 = found[B_U], found[B_U + 1], found[B_U + 2]
    mean, more = found[MEAN_U], found[VAR_UU] - 1.0
    dx, dy, turn = b0 * mean, b1 * mean, b2 * mean
    u0, u1, u2 = more * b0, more * b1, more * b2
    xx, xy, yy, xh, yh, hh = u0 * b0, u0 * b1, u1 * b1, u0 * b2, u1 * b2, u2 * b2
    if found[N_TOLD] > 1.0:
        c0, c1, c2 = found[B_V], found[B_V + 1], found[B_V + 2]
        mean, more, both = found[MEAN_V], found[VAR_VV] - 1.0, found[VAR_UV]
        dx, dy, turn = dx + c0 * mean, dy + c1 * mean, turn + c2 * mean
        v0, v1, v2 = more * c0, more * c1, more * c2
        xx, xy, yy = (
            xx + v0 * c0 + 2.0 * both * b0 * c0,
            xy + v0 * c1 + both * (b0 * c1 + b1 * c0),
            yy + v1 * c1 + 2.0 * both * b1 * c1,
        )
        xh, yh = xh + v0 * c2 + both * (b0 * c2 + b2 * c0), yh + v1 * c2 + both * (b1 * c2 + b2 * c1)
        hh += v2 * c2 + 2.0 * both * b2 * c2
    mix[k, X] += dx
    mix[k, Y] += dy
    turn_by(mix, k, turn)
    mix[k, XX] += xx
    mix[k, XY] += xy
    mix[k, YY] += yy
    mix[k, XH] += xh
    mix[k, YH] += yh
    mix[k, HH] += hh
    keep_positive(mix, k)
