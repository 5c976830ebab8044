"""What is measured on a run's errors, compiled; the readable callers and the words are in metrics.py."""

import math

from rfiddesign.numerics._compile_kernels import kernel

# A robot is localized while it is believed to be within these bounds, and has converged once it has been for this long.
CONVERGED_POSITION_MM = 50.0
CONVERGED_HEADING_RAD = 0.2
CONVERGED_HOLD_S = 1.0
PERCENTILE = 0.95
# Kinds of limits.
MEAN, RMS, P95, MAX, SHARE = range(5)
# Columns of a summary.
N_SUMMARY = 8
# More than the relative rounding error of a sum over a run's steps.
_ROUNDING = 1.0 + 1e-9


@kernel
def is_localized(position, heading):
    """Whether one error lies within the bounds."""
    return position <= CONVERGED_POSITION_MM and heading <= CONVERGED_HEADING_RAD


@kernel
def convergence_time(position, heading, dt):
    """Time after which the errors first stay within the bounds for a second; inf: never."""
    hold = max(1, round(CONVERGED_HOLD_S / dt))
    n_held = 0
    for t in range(position.shape[0]):
        n_held = n_held + 1 if is_localized(position[t], heading[t]) else 0
        if n_held == hold:
            return (t - hold + 2) * dt
    return math.inf


@kernel
def _summarize_one(errors, out):
    total = squares = most = 0.0
    for t in range(errors.shape[0]):
        error = errors[t]
        total += error
        squares += error * error
        most = max(most, error)
    n = errors.shape[0]
    out[0], out[1], out[2] = total / n, math.sqrt(squares / n), most


@kernel
def summarize(position, heading, dt, first_scored, out):
    """Mean, RMS and maximum of both errors, time to converge and lost share: to `out` (N_SUMMARY,)."""
    start = first_scored if position.shape[0] > first_scored else 0
    _summarize_one(position[start:], out[0:3])
    _summarize_one(heading[start:], out[3:6])
    out[6] = convergence_time(position, heading, dt)
    n_lost = 0
    for t in range(start, position.shape[0]):
        n_lost += not is_localized(position[t], heading[t])
    out[7] = n_lost / (position.shape[0] - start)


@kernel
def has_certainly_failed(position, heading, dt, first_scored, n_total, of_heading, kinds, limits, within):
    """Whether a run of `n_total` steps must fail whatever comes after its errors so far.

    A limit on a 95th percentile is lost once more than 5 % of all scored steps exceed it, a limit on a mean once the
    sum so far exceeds it (by more than its rounding), a limit on a maximum at once.

    Parameters
    ----------
    of_heading, kinds, limits : (n,) whether each limit is one on the heading's error, its kind and its value.
    within : time by which the run must converge; inf: no such demand.
    """
    n_done = position.shape[0]
    is_decided = within < math.inf and n_done > math.ceil((within + CONVERGED_HOLD_S) / dt)
    if is_decided and convergence_time(position, heading, dt) > within:
        return True
    n_scored = n_total - first_scored
    for k in range(limits.shape[0]):
        kind, limit = kinds[k], limits[k]
        n_beyond, total, squares = 0, 0.0, 0.0
        for t in range(first_scored, n_done):
            error = heading[t] if of_heading[k] else position[t]
            total += error
            squares += error * error
            n_beyond += not is_localized(position[t], heading[t]) if kind == SHARE else error > limit
        if kind == SHARE:
            is_lost = n_beyond / n_scored > limit
        elif kind == MAX:
            is_lost = n_beyond > 0
        elif kind == P95:
            is_lost = n_beyond > n_scored - math.ceil(PERCENTILE * n_scored)
        elif kind == RMS:
            is_lost = squares > limit * limit * n_scored * _ROUNDING
        else:
            is_lost = total > limit * n_scored * _ROUNDING
        if is_lost:
            return True
    return False
