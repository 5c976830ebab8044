"""What the rows of a step say of each particle (hf_multireader_mcl, Algorithm 1, line 4); see `_evidence_kernels`."""

import numpy as np

from rfiddesign.estimators._particle_kernels import COSINE, LOG, SINE, X, Y
from rfiddesign.numerics import _lane_kernels as lanes
from rfiddesign.numerics._compile_kernels import inline_kernel, leaf_kernel
from rfiddesign.numerics._lane_kernels import LANES, fma
from rfiddesign.numerics._math_kernels import log_32

_F = np.float32
_I = np.int32
# Chance left to what cannot be, and how many factors as small as that a float32 holds.
_LEAST_PROBABILITY = _F(1e-3)
_ROWS_PER_LOG = 8


@leaf_kernel
def weigh(reads, n_rows, rules, table, cloud):
    """Line 4 for all rows; `rules` and `table` as in `_mcl_kernels.update`."""
    if table.shape[2] == 1:
        weigh_by_discs(reads, n_rows, table, _F(rules[5]), cloud)
    elif table.shape[1] > 0:
        for k in range(n_rows):
            weigh_by_field(reads, k, table, rules[3], cloud)
    else:
        for k in range(n_rows):
            weigh_by_distance(reads, k, rules[0], rules[1], cloud)


@leaf_kernel
def weigh_by_distance(reads, k, inner_radius, log_tail, cloud):
    """Line 4 for the k-th read: add the logarithm of eq. 6 to each particle's log weight."""
    w00, w01, w10, w11 = reads[k, 4], reads[k, 5], reads[k, 6], reads[k, 7]
    is_isotropic = w00 == w11 and w01 == _F(0.0) and w10 == _F(0.0)
    precision = _F(w00 * w00) if is_isotropic else _F(1.0)
    inner, tail, half = _F(_F(inner_radius * inner_radius) / precision), _F(log_tail), _F(_F(-0.5) * precision)
    width = cloud.shape[1]
    for i in range(0, width, LANES):
        u, v = _in_antenna_frame(reads, k, cloud, i)
        if not is_isotropic:
            u, v = fma(u, w00, v * w01), fma(u, w10, v * w11)
        d2 = fma(u, u, v * v)
        log = lanes.choose(d2 < inner, _F(0.0), fma(d2, half, tail))
        lanes.store(cloud, LOG * width + i, lanes.load(cloud, LOG * width + i) + log)


@leaf_kernel
def weigh_by_field(reads, k, table, cell, cloud):
    """Line 4 for the k-th read: add the tabulated log probability at the tag's place in the antenna's frame.

    `table` (n_tables, n, m) float32 are centred on the antenna; their border cells hold the value for every place
    beyond.
    """
    w00, w01, w10, w11 = reads[k, 4], reads[k, 5], reads[k, 6], reads[k, 7]
    _, n_i, n_j = table.shape
    base = _I(_I(reads[k, 8]) * _I(n_i * n_j))
    per_cell, half_i, half_j = _F(1.0 / cell), _F(0.5 * n_i), _F(0.5 * n_j)
    last_i, last_j = _F(n_i - 1), _F(n_j - 1)
    width = cloud.shape[1]
    for i in range(0, width, LANES):
        u, v = _in_antenna_frame(reads, k, cloud, i)
        p = fma(fma(u, w00, v * w01), per_cell, half_i)
        q = fma(fma(u, w10, v * w11), per_cell, half_j)
        row = lanes.to_integer(lanes.lesser(lanes.greater(p, _F(0.0)), last_i))
        column = lanes.to_integer(lanes.lesser(lanes.greater(q, _F(0.0)), last_j))
        log = lanes.look_up(table, lanes.add(lanes.add(lanes.multiply(row, _I(n_j)), column), base))
        lanes.store(cloud, LOG * width + i, lanes.load(cloud, LOG * width + i) + log)


@leaf_kernel
def weigh_by_discs(reads, n_rows, discs, per_width, cloud):
    """Line 4 for all rows: what `soft_discs` says of each row's tag; `discs` and `per_width` are of there."""
    width = cloud.shape[1]
    for i in range(0, width, LANES):
        x, y = lanes.load(cloud, X * width + i), lanes.load(cloud, Y * width + i)
        s, c = lanes.load(cloud, SINE * width + i), lanes.load(cloud, COSINE * width + i)
        log, product = lanes.load(cloud, LOG * width + i), lanes.copies(_F(1.0))
        for k in range(n_rows):
            which = int(reads[k, 8])
            dx, dy = reads[k, 0] - x, reads[k, 1] - y
            u, v = fma(c, dx, fma(s, dy, -reads[k, 2])), fma(c, dy, fma(-s, dx, -reads[k, 3]))
            distance = lanes.square_root(fma(u, u, v * v))
            inside = _soft_step(discs[which, 0, 0], distance, per_width)
            if discs[which, 1, 0] > _F(0.0):
                inside = inside - _soft_step(discs[which, 1, 0], distance, per_width)
            product = product * lanes.greater(fma(inside, discs[which, 3, 0], discs[which, 2, 0]), _LEAST_PROBABILITY)
            if k % _ROWS_PER_LOG == _ROWS_PER_LOG - 1:
                log, product = log + log_32(product), lanes.copies(_F(1.0))
        lanes.store(cloud, LOG * width + i, log + log_32(product))


@inline_kernel
def _soft_step(radius, distance, per_width):
    """Chance to be within a radius whose border is blurred: 1 inside, 0 outside, a cubic between."""
    t = fma(radius - distance, per_width, _F(0.5))
    t = lanes.lesser(lanes.greater(t, _F(0.0)), _F(1.0))
    return t * t * fma(t, _F(-2.0), _F(3.0))


@inline_kernel
def _in_antenna_frame(reads, k, cloud, i):
    """Where the k-th read's tag lies from its antenna on the particles from i on, in the robot's axes."""
    width = cloud.shape[1]
    dx, dy = reads[k, 0] - lanes.load(cloud, X * width + i), reads[k, 1] - lanes.load(cloud, Y * width + i)
    s, c = lanes.load(cloud, SINE * width + i), lanes.load(cloud, COSINE * width + i)
    return fma(c, dx, fma(s, dy, -reads[k, 2])), fma(c, dy, fma(-s, dx, -reads[k, 3]))
