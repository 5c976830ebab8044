"""The estimate of a cloud of particles (hf_multireader_mcl, eq. 3); see `_particle_kernels` for its layout."""

import numpy as np

from rfiddesign.estimators._particle_kernels import COSINE, HEADING, LOG, SINE, WEIGHT, X, Y
from rfiddesign.numerics import _lane_kernels as lanes
from rfiddesign.numerics._compile_kernels import leaf_kernel
from rfiddesign.numerics._lane_kernels import LANES, fma
from rfiddesign.numerics._math_kernels import RADIANS_PER_BINARY_UNIT, atan2_64, binary_angle, exp_32

_F = np.float32
_I = np.int32
_LOWEST_LOG = _F(-80.0)
# Weights are taken relative to the best particle's if their sum is beyond these.
_LEAST_TOTAL, _MOST_TOTAL = 1e-10, 1e10
# Particles whose sums are taken in single precision.
_SUMMED_AT_A_TIME = 64 * LANES
# Columns of an estimate: pose, covariance (upper triangle by columns), effective sample size.
N_ESTIMATE = 10


@leaf_kernel
def estimate(n_particles, cloud, out, row):
    """Weights from log weights, and their estimate (eq. 3).

    The estimate is the weighted mean of the particles (heading: of the direction), their covariance and the effective
    sample size.  Lanes beyond the last particle weigh nothing.  Returns the sum of the weights and a log weight
    that none is below.

    One pass weighs and takes the moments about the first particle.  A second one follows where that lies far out, where
    the headings spread so much that the turn at which they wrap matters, or where all weights are next to nothing:
    then they are taken relative to the best particle's.
    """
    x0, y0, heading0 = cloud[X, 0], cloud[Y, 0], lanes.bits_of(cloud[HEADING, 0])
    total, lowest, mean_turn = _moments(n_particles, _F(0.0), x0, y0, heading0, cloud, out, row)
    best = _F(0.0)
    if total < _LEAST_TOTAL or total > _MOST_TOTAL:
        best = cloud[LOG, 0]
        for m in range(n_particles):
            best = max(best, cloud[LOG, m])
        total, lowest, mean_turn = _moments(n_particles, best, x0, y0, heading0, cloud, out, row)
    off_x, off_y = out[row, 0] - x0, out[row, 1] - y0
    is_far = off_x * off_x > 100.0 * out[row, 3] + 1e-6 or off_y * off_y > 100.0 * out[row, 5] + 1e-6
    is_turned = mean_turn * mean_turn > 100.0 * out[row, 8] + 1e-9 or abs(mean_turn) > 1.0
    if is_far or is_turned or out[row, 8] > 0.003:
        x1, y1, heading1 = _F(out[row, 0]), _F(out[row, 1]), binary_angle(out[row, 2])
        total, lowest, mean_turn = _moments(n_particles, best, x1, y1, heading1, cloud, out, row)
    return total, lowest


@leaf_kernel
def _moments(n_particles, best, x0, y0, heading0, cloud, out, row):
    """Weights relative to `best` and their moments about (x0, y0, heading0).

    Returns the sum of the weights, a log weight that none is below, and the mean turn from heading0.
    """
    width = cloud.shape[1]
    total = squares = sum_x = sum_y = sum_t = sum_s = sum_c = 0.0
    sum_xx = sum_xy = sum_yy = sum_xt = sum_yt = sum_tt = 0.0
    lowest = _F(0.0)
    # Single precision loses digits over long sums.
    for begin in range(0, width, _SUMMED_AT_A_TIME):
        end = min(begin + _SUMMED_AT_A_TIME, width)
        sums, least = _sums(n_particles, best, x0, y0, heading0, cloud, begin, end)
        w, ww, x, y, t, s, c, xx, xy, yy, xt, yt, tt = sums
        total, squares, sum_x, sum_y, sum_t = total + w, squares + ww, sum_x + x, sum_y + y, sum_t + t
        sum_s, sum_c, sum_xx, sum_xy, sum_yy = sum_s + s, sum_c + c, sum_xx + xx, sum_xy + xy, sum_yy + yy
        sum_xt, sum_yt, sum_tt = sum_xt + xt, sum_yt + yt, sum_tt + tt
        lowest = min(lowest, least)
    # Turns were summed in binary units.
    per_weight, turn_per_weight = 1.0 / total, RADIANS_PER_BINARY_UNIT / total
    mean_x, mean_y, mean_t = sum_x * per_weight, sum_y * per_weight, sum_t * turn_per_weight
    out[row, 0], out[row, 1], out[row, 2] = x0 + mean_x, y0 + mean_y, atan2_64(sum_s, sum_c)
    out[row, 3] = max(sum_xx * per_weight - mean_x * mean_x, 0.0)
    out[row, 4] = sum_xy * per_weight - mean_x * mean_y
    out[row, 5] = max(sum_yy * per_weight - mean_y * mean_y, 0.0)
    out[row, 6] = sum_xt * turn_per_weight - mean_x * mean_t
    out[row, 7] = sum_yt * turn_per_weight - mean_y * mean_t
    out[row, 8] = max(sum_tt * (turn_per_weight * RADIANS_PER_BINARY_UNIT) - mean_t * mean_t, 0.0)
    out[row, 9] = total * total / squares
    return total, lowest, mean_t


@leaf_kernel
def _sums(n_particles, best, x0, y0, heading0, cloud, begin, end):
    """Weights of the particles from `begin` to `end`, and sums of these and of what they weigh, in float64."""
    width = cloud.shape[1]
    zero = lanes.copies(_F(0.0))
    lowest = zero
    sum_w = sum_ww = sum_x = sum_y = sum_t = sum_s = sum_c = zero
    sum_xx = sum_xy = sum_yy = sum_xt = sum_yt = sum_tt = zero
    for i in range(begin, end, LANES):
        is_particle = lanes.is_at_least(_I(n_particles - 1), lanes.count_up(_I(i)))
        log = lanes.load(cloud, LOG * width + i)
        lowest = lanes.lesser(log, lowest)
        w = lanes.choose(is_particle, exp_32(lanes.greater(log - best, _LOWEST_LOG)), _F(0.0))
        lanes.store(cloud, WEIGHT * width + i, w)
        dx, dy = lanes.load(cloud, X * width + i) - x0, lanes.load(cloud, Y * width + i) - y0
        heading = lanes.bits_of(lanes.load(cloud, HEADING * width + i))
        dt = lanes.to_float(lanes.subtract(heading, heading0))
        wx, wy, wt = w * dx, w * dy, w * dt
        sum_w, sum_ww = sum_w + w, fma(w, w, sum_ww)
        sum_x, sum_y, sum_t = sum_x + wx, sum_y + wy, sum_t + wt
        sum_s = fma(w, lanes.load(cloud, SINE * width + i), sum_s)
        sum_c = fma(w, lanes.load(cloud, COSINE * width + i), sum_c)
        sum_xx, sum_xy, sum_yy = fma(wx, dx, sum_xx), fma(wx, dy, sum_xy), fma(wy, dy, sum_yy)
        sum_xt, sum_yt, sum_tt = fma(wx, dt, sum_xt), fma(wy, dt, sum_yt), fma(wt, dt, sum_tt)
    sums = (
        lanes.total(sum_w), lanes.total(sum_ww), lanes.total(sum_x), lanes.total(sum_y), lanes.total(sum_t),
        lanes.total(sum_s), lanes.total(sum_c), lanes.total(sum_xx), lanes.total(sum_xy), lanes.total(sum_yy),
        lanes.total(sum_xt), lanes.total(sum_yt), lanes.total(sum_tt),
    )  # fmt: skip
    return sums, lanes.least(lowest)
