"""Tempering: evidence that leaves few particles is applied in stages, and the particles move between these.

A stage applies the likelihood to the power of the greatest share of what is left that keeps half of the particles
effective (Del Moral, Doucet, Jasra 2006, Sequential Monte Carlo samplers); the particles drawn by these weights are set
apart by a Liu-West move, and what is left of the likelihood is evaluated anew where they lie then.
"""

import numpy as np

from rfiddesign.estimators._estimate_kernels import N_ESTIMATE, estimate
from rfiddesign.estimators._particle_kernels import LOG, resample
from rfiddesign.estimators._regularize_kernels import (
    DUE,
    MOST_VARIANCE,
    covariance_ahead,
    is_concentrated,
    predict_apart,
    remember,
    root_of,
)
from rfiddesign.estimators._weigh_kernels import weigh
from rfiddesign.numerics import _lane_kernels as lanes
from rfiddesign.numerics._compile_kernels import leaf_kernel
from rfiddesign.numerics._lane_kernels import LANES, fma
from rfiddesign.numerics._math_kernels import exp_32
from rfiddesign.numerics._noise_kernels import run_key

_F = np.float32
_I = np.int32
_LOWEST_LOG = _F(-80.0)
_MOST_STAGES = 5
# Effective share of the particles that a stage leaves.
_KEPT_SHARE = 0.5
# An exponent is found to 1 / 2^6, or further to the first that is not too great; at 1 / 2^20 no likelihood is sharp.
_HALVINGS, _MOST_HALVINGS = 6, 20
_STILL = (0.0, 0.0, 0.0)
# Columns of the rules, see `_mcl_kernels.update`.
LEAST_SHARE, MOVE_BANDWIDTH = 8, 9


@leaf_kernel
def effective_size(n_particles, exponent, best, cloud):
    """Effective sample size if log weights were `exponent` times what they are; `best` is the greatest of these."""
    width = cloud.shape[1]
    total = squares = lanes.copies(_F(0.0))
    for i in range(0, width, LANES):
        is_particle = lanes.is_at_least(_I(n_particles - 1), lanes.count_up(_I(i)))
        log = (lanes.load(cloud, LOG * width + i) - best) * _F(exponent)
        weight = lanes.choose(is_particle, exp_32(lanes.greater(log, _LOWEST_LOG)), _F(0.0))
        total, squares = total + weight, fma(weight, weight, squares)
    weight, square = np.float64(lanes.total(total)), np.float64(lanes.total(squares))
    return weight * weight / square


@leaf_kernel
def best_of(n_particles, cloud):
    """The greatest log weight."""
    best = cloud[LOG, 0]
    for m in range(n_particles):
        best = max(best, cloud[LOG, m])
    return best


@leaf_kernel
def exponent_for(n_particles, size, cloud):
    """About the greatest exponent below 1, and above 0, that leaves an effective sample size of at least `size`."""
    best = best_of(n_particles, cloud)
    low, high = 0.0, 1.0
    for halving in range(_MOST_HALVINGS):
        if halving >= _HALVINGS and low > 0.0:
            break
        middle = 0.5 * (low + high)
        if effective_size(n_particles, middle, best, cloud) >= size:
            low = middle
        else:
            high = middle
    return low if low > 0.0 else high


@leaf_kernel
def temper(
    key, step, n_particles, total, reads, n_evidence, rules, table, cloud, drawn, headings, about, out, row
):  # fmt: skip
    """Apply weights that leave few particles in stages instead; `out` gets the estimate by the last stage's weights.

    Arguments as in `_mcl_kernels.update`; the cloud is weighed, and `total` the sum of its weights.  Returns that of
    the weights it has in the end.
    """
    left = 1.0
    for stage in range(_MOST_STAGES):
        if out[row, N_ESTIMATE - 1] >= rules[LEAST_SHARE] * n_particles:
            break
        exponent = exponent_for(n_particles, _KEPT_SHARE * n_particles, cloud)
        _scale(cloud, exponent)
        stage_total, _ = estimate(n_particles, cloud, out, row)
        if not is_concentrated(out, row, rules[MOST_VARIANCE]):
            # There is no move to such a belief: what is left applies to where the particles are.
            _scale(cloud, 1.0 / exponent)
            total, _ = estimate(n_particles, cloud, out, row)
            break
        remember(out, row, rules[MOVE_BANDWIDTH], about)
        stage_key = run_key(key, stage)
        resample(stage_key, step, n_particles, stage_total, False, cloud, drawn, headings)
        root = root_of(covariance_ahead(about, about[0, DUE], _STILL, _STILL))
        predict_apart(stage_key, step, _STILL, root, about, drawn, headings, cloud)
        weigh(reads, n_evidence, rules, table, cloud)
        left *= 1.0 - exponent
        _scale(cloud, left)
        total, _ = estimate(n_particles, cloud, out, row)
    return total


@leaf_kernel
def _scale(cloud, factor):
    """Multiply the log weights."""
    width = cloud.shape[1]
    for i in range(LOG * width, (LOG + 1) * width, LANES):
        lanes.store(cloud, i, lanes.load(cloud, i) * _F(factor))
