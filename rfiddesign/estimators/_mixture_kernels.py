"""A mixture of Gaussians over the pose: a row per component, their motion, splitting, merging and estimate."""

import math

import numpy as np

from rfiddesign.estimators._pose_gaussian_kernels import wrapped
from rfiddesign.models._motion_kernels import step_variances
from rfiddesign.numerics._compile_kernels import inline_kernel, leaf_kernel
from rfiddesign.numerics._math_kernels import log_32, sin_cos_64

# Columns of a component: weight, mean, covariance, and sine and cosine of its heading.
WEIGHT, X, Y, HEADING, XX, XY, YY, XH, YH, HH, SINE, COSINE = range(12)
N_COLUMNS = 12
# A third of a Gaussian moves to either side: with these the three have its mean and covariance.
SPLIT_WEIGHT, SPLIT_OFF = 0.2252246249, 1.0575154615
SPLIT_VARIANCE = 1.0 - 2.0 * SPLIT_WEIGHT * SPLIT_OFF * SPLIT_OFF
# Least variances that rounding may leave.
_LEAST_PLACE, _LEAST_HEADING = 1e-6, 1e-12
_SMALL_TURN = 0.05
# Two components merge if that loses less than this of the mixture (Runnalls 2007, eq. 16); less weight is dropped.
_MERGE_COST, _LEAST_WEIGHT = 1e-3, 1e-5


@leaf_kernel
def face(mix, k, heading):
    """Set a component's heading, with its sine and cosine."""
    mix[k, HEADING] = wrapped(heading)
    mix[k, SINE], mix[k, COSINE] = sin_cos_64(mix[k, HEADING])


@inline_kernel
def sin_cos_near(angle):
    """Sine and cosine; near 0 by a series that is exact to 1e-12."""
    if abs(angle) > _SMALL_TURN:
        return sin_cos_64(angle)
    t2 = angle * angle
    return angle * (1.0 - t2 * (1 / 6 - t2 * (1 / 120))), 1.0 - t2 * (0.5 - t2 * (1 / 24 - t2 * (1 / 720)))


@inline_kernel
def turn_by(mix, k, turn):
    """Turn a component."""
    s, c = sin_cos_near(turn)
    mix[k, HEADING] = wrapped(mix[k, HEADING] + turn)
    mix[k, SINE], mix[k, COSINE] = mix[k, SINE] * c + mix[k, COSINE] * s, mix[k, COSINE] * c - mix[k, SINE] * s


@inline_kernel
def keep_positive(mix, k):
    """Give a component the least variances, and correlations below one, that rounding may have taken."""
    xx, yy, hh = max(mix[k, XX], _LEAST_PLACE), max(mix[k, YY], _LEAST_PLACE), max(mix[k, HH], _LEAST_HEADING)
    mix[k, XX], mix[k, YY], mix[k, HH] = xx, yy, hh
    det = determinant(xx, mix[k, XY], yy, mix[k, XH], mix[k, YH], hh)
    if mix[k, XY] * mix[k, XY] >= xx * yy or det <= 1e-12 * xx * yy * hh:
        # Three correlations of at most a half are always possible together.
        for column, most in ((XY, math.sqrt(xx * yy)), (XH, math.sqrt(xx * hh)), (YH, math.sqrt(yy * hh))):
            mix[k, column] = min(max(mix[k, column], -0.49 * most), 0.49 * most)


@inline_kernel
def determinant(xx, xy, yy, xh, yh, hh):
    """Of a symmetric 3 x 3 matrix."""
    return xx * (yy * hh - yh * yh) - xy * (xy * hh - yh * xh) + xh * (xy * yh - yy * xh)


@leaf_kernel
def carry(mix, n, odometry, row, noise):
    """Move every component by an increment in the robot's frame: P becomes F P F' + G Q G'."""
    dx, dy, turn = odometry[row, 0], odometry[row, 1], odometry[row, 2]
    qx, qy, qh = step_variances(noise, dx, dy, turn)
    for k in range(n):
        s, c = mix[k, SINE], mix[k, COSINE]
        ahead_x, ahead_y = c * dx - s * dy, s * dx + c * dy
        mix[k, X] += ahead_x
        mix[k, Y] += ahead_y
        face(mix, k, mix[k, HEADING] + turn)
        fx, fy = -ahead_y, ahead_x
        xh, yh, hh = mix[k, XH], mix[k, YH], mix[k, HH]
        mix[k, XX] += 2.0 * fx * xh + fx * fx * hh + c * c * qx + s * s * qy
        mix[k, XY] += fx * yh + fy * xh + fx * fy * hh + s * c * (qx - qy)
        mix[k, YY] += 2.0 * fy * yh + fy * fy * hh + s * s * qx + c * c * qy
        mix[k, XH] = xh + fx * hh
        mix[k, YH] = yh + fy * hh
        mix[k, HH] = hh + qh


@leaf_kernel
def split(mix, n, k, dx, dy, dh):
    """Split component k in three along a direction (dx, dy, dh) of one sigma; returns how many there are then."""
    for column, change in ((XX, dx * dx), (XY, dx * dy), (YY, dy * dy), (XH, dx * dh), (YH, dy * dh), (HH, dh * dh)):
        mix[k, column] -= (1.0 - SPLIT_VARIANCE) * change
    keep_positive(mix, k)
    for side in range(2):
        off = SPLIT_OFF if side == 0 else -SPLIT_OFF
        for column in range(N_COLUMNS):
            mix[n + side, column] = mix[k, column]
        mix[n + side, WEIGHT] = SPLIT_WEIGHT * mix[k, WEIGHT]
        mix[n + side, X] += off * dx
        mix[n + side, Y] += off * dy
        face(mix, n + side, mix[k, HEADING] + off * dh)
    mix[k, WEIGHT] *= 1.0 - 2.0 * SPLIT_WEIGHT
    return n + 2


@leaf_kernel
def normalize(mix, n):
    """Let the weights sum to 1 and drop components of next to no weight; returns how many are left."""
    total, best = 0.0, 0.0
    for k in range(n):
        total += mix[k, WEIGHT]
        best = max(best, mix[k, WEIGHT])
    if not total > 0.0:
        for k in range(n):
            mix[k, WEIGHT] = 1.0 / n
        return n
    kept, left = 0, 0.0
    for k in range(n):
        if mix[k, WEIGHT] >= _LEAST_WEIGHT * best:
            if kept != k:
                for column in range(N_COLUMNS):
                    mix[kept, column] = mix[k, column]
            left += mix[kept, WEIGHT]
            kept += 1
    for k in range(kept):
        mix[k, WEIGHT] /= left
    return kept


@leaf_kernel
def _merged(mix, i, j):
    """Mean (relative to i) and covariance of components i and j together, in the order of their columns."""
    a, b = mix[i, WEIGHT], mix[j, WEIGHT]
    share, both = b / (a + b), a * b / ((a + b) * (a + b))
    dx, dy, dh = mix[j, X] - mix[i, X], mix[j, Y] - mix[i, Y], wrapped(mix[j, HEADING] - mix[i, HEADING])
    return (
        share * dx, share * dy, share * dh,
        mix[i, XX] + share * (mix[j, XX] - mix[i, XX]) + both * dx * dx,
        mix[i, XY] + share * (mix[j, XY] - mix[i, XY]) + both * dx * dy,
        mix[i, YY] + share * (mix[j, YY] - mix[i, YY]) + both * dy * dy,
        mix[i, XH] + share * (mix[j, XH] - mix[i, XH]) + both * dx * dh,
        mix[i, YH] + share * (mix[j, YH] - mix[i, YH]) + both * dy * dh,
        mix[i, HH] + share * (mix[j, HH] - mix[i, HH]) + both * dh * dh,
    )  # fmt: skip


@inline_kernel
def _log_determinant(xx, xy, yy, xh, yh, hh):
    """Half the logarithm of the determinant, headings counted in thousandths of a radian."""
    # A float32 holds it: least variances give 1e-18.
    return 0.5 * np.float64(log_32(np.float32(min(max(determinant(xx, xy, yy, xh, yh, hh) * 1e6, 1e-30), 1e30))))


@leaf_kernel
def merge(mix, n, most):
    """Merge components until there are at most `most`, and those next to the same; returns how many are left."""
    while n > 1:
        least, at_i, at_j = math.inf, 0, 0
        for i in range(n):
            log_i = _log_determinant(mix[i, XX], mix[i, XY], mix[i, YY], mix[i, XH], mix[i, YH], mix[i, HH])
            for j in range(i):
                log_j = _log_determinant(mix[j, XX], mix[j, XY], mix[j, YY], mix[j, XH], mix[j, YH], mix[j, HH])
                _, _, _, xx, xy, yy, xh, yh, hh = _merged(mix, i, j)
                a, b = mix[i, WEIGHT], mix[j, WEIGHT]
                cost = (a + b) * _log_determinant(xx, xy, yy, xh, yh, hh) - a * log_i - b * log_j
                if cost < least:
                    least, at_i, at_j = cost, i, j
        if n <= most and least > _MERGE_COST:
            break
        dx, dy, dh, xx, xy, yy, xh, yh, hh = _merged(mix, at_i, at_j)
        mix[at_i, X] += dx
        mix[at_i, Y] += dy
        face(mix, at_i, mix[at_i, HEADING] + dh)
        mix[at_i, XX], mix[at_i, XY], mix[at_i, YY] = xx, xy, yy
        mix[at_i, XH], mix[at_i, YH], mix[at_i, HH] = xh, yh, hh
        mix[at_i, WEIGHT] += mix[at_j, WEIGHT]
        n -= 1
        for column in range(N_COLUMNS):
            mix[at_j, column] = mix[n, column]
    return n


@leaf_kernel
def write_estimate(mix, n, out, row):
    """Mean and covariance of a mixture whose weights sum to 1, in the columns of an estimate."""
    out[row, 9] = 1.0
    if n == 1:
        for column in range(9):
            out[row, column] = mix[0, X + column]
        return
    best = 0
    for k in range(1, n):
        if mix[k, WEIGHT] > mix[best, WEIGHT]:
            best = k
    x0, y0, h0 = mix[best, X], mix[best, Y], mix[best, HEADING]
    mx = my = mh = 0.0
    xx = xy = yy = xh = yh = hh = 0.0
    for k in range(n):
        w = mix[k, WEIGHT]
        dx, dy, dh = mix[k, X] - x0, mix[k, Y] - y0, wrapped(mix[k, HEADING] - h0)
        mx, my, mh = mx + w * dx, my + w * dy, mh + w * dh
        xx, xy, yy = (
            xx + w * (mix[k, XX] + dx * dx),
            xy + w * (mix[k, XY] + dx * dy),
            yy + w * (mix[k, YY] + dy * dy),
        )
        xh, yh, hh = (
            xh + w * (mix[k, XH] + dx * dh),
            yh + w * (mix[k, YH] + dy * dh),
            hh + w * (mix[k, HH] + dh * dh),
        )
    out[row, 0], out[row, 1], out[row, 2] = x0 + mx, y0 + my, wrapped(h0 + mh)
    out[row, 3], out[row, 4], out[row, 5] = xx - mx * mx, xy - mx * my, yy - my * my
    out[row, 6], out[row, 7], out[row, 8] = xh - mx * mh, yh - my * mh, hh - mh * mh
