"""The projected-moment Gaussian filter: every poll of a step, read or not, on every component of a mixture.

State of a belief: `mix` (rows, N_COLUMNS), see `_mixture_kernels`; `numbers` (N_NUMBERS,), see `_hearing_kernels`;
`heard` (n_antennas, N_HEARD), what each antenna told last; the estimate as long as nothing was read.
"""

import math

import numpy as np

from rfiddesign.estimators._hearing_kernels import CAP, MOST_NEAR, N_NUMBERS, N, hear, hear_nothing
from rfiddesign.estimators._mixture_kernels import WEIGHT, carry, merge, normalize, sin_cos_near, write_estimate
from rfiddesign.estimators._plane_kernels import N_GRID
from rfiddesign.estimators._projection_kernels import N_FOUND
from rfiddesign.numerics._compile_kernels import inline_kernel, kernel, leaf_kernel

__all__ = ["CAP", "LAST_N", "N_HEARD", "N_NUMBERS", "N", "predict", "track", "update"]

# Result of an antenna's last poll that was used, sums of x and y of the tags read and their number (-1: none was used),
# the way since then; and the same of this step's poll, with whether there was one.
LAST_X, LAST_Y, LAST_N, TRAVEL, NOW_X, NOW_Y, NOW_N = range(7)
N_HEARD = 7


@kernel
def predict(key, step, odometry, row, model, arrays):
    """See `verbs.Kernels`."""
    mix, numbers, heard, _ = arrays
    _move(odometry, row, model[0], model[1], mix, numbers, heard)


@inline_kernel
def _move(odometry, row, antennas, noise, mix, numbers, heard):
    dx, dy, turn = odometry[row, 0], odometry[row, 1], odometry[row, 2]
    way, turned = math.sqrt(dx * dx + dy * dy), abs(turn)
    for a in range(antennas.shape[0]):
        heard[a, TRAVEL] += way + turned * antennas[a, 4]
    carry(mix, numbers[N], odometry, row, noise)


@kernel
def update(key, step, log, t, model, tags, arrays, out, row):
    """See `verbs.Kernels`."""
    _steps(step, step + 1, t - step, False, log, model, tags, arrays, _scratch(arrays[0]), out, row - t - 1)


@kernel
def track(key, first, last, log, model, tags, arrays, estimates):
    """See `verbs.Kernels`."""
    _steps(first, last, 0, True, log, model, tags, arrays, _scratch(arrays[0]), estimates, 0)


@leaf_kernel
def _steps(first, last, row_of_step, predicts, log, model, tags, arrays, scratch, estimates, row_of_row):
    """Steps first..last-1.

    Step s has row s + `row_of_step` in the log, and row t there has row t + 1 + `row_of_row` in `estimates`.
    """
    mix, numbers, heard, held = arrays
    for step in range(first, last):
        t = step + row_of_step
        if predicts:
            _move(log[0], t, model[0], model[1], mix, numbers, heard)
        _listen(step, t, log, model, tags, mix, numbers, heard, scratch)
        row = t + 1 + row_of_row
        if numbers[N] > 0:
            write_estimate(mix, numbers[N], estimates, row)
        else:
            for column in range(estimates.shape[1]):
                estimates[row, column] = held[column]


@kernel
def _scratch(mix):
    return (
        (np.empty((2, N_GRID)), np.empty((2, N_GRID)), np.empty((N_GRID, N_GRID))),
        np.empty((N_GRID, N_GRID)),
        np.empty((mix.shape[0], N_FOUND)),
        np.empty((MOST_NEAR, 2)),
    )


@inline_kernel
def _listen(step, t, log, model, tags, mix, numbers, heard, scratch):
    """Take what the antennas read in step t into account, then what they did not."""
    antennas, _, shapes, field, rules, looks = model
    soft, chance_to_read, n_most, split_sigma, gate, size, reach, patience = rules
    is_inventory, slots, phases, period, uses_rssi, learns_from_nothing, is_age_compensated, delay = looks
    odometry, read_start, read_antenna, read_tags, read_age, read_rssi, dt = log
    dx, dy, turn = odometry[t, 0], odometry[t, 1], odometry[t, 2]
    s, c = sin_cos_near(turn)
    # Seen from the end of the step: rates of motion are constant within it.
    step_back = (-(c * dx + s * dy), s * dx - c * dy, turn)
    first, last = read_start[t], read_start[t + 1]
    _note_polls(first, last, read_antenna, read_tags, heard)
    tuned = (soft, chance_to_read, split_sigma, gate, size, n_most, patience)
    for row in range(first, last):
        a = read_antenna[row]
        if not _is_new(heard, a, soft):
            continue
        which = min(max(read_rssi[row] + 1, 0), shapes.shape[0] - 1) if uses_rssi else 0
        shape = (shapes[which, 0], shapes[which, 1], shapes[which, 2], shapes[which, 3])
        back = read_age[row] / dt + delay
        antenna = _antenna_of(antennas, a, step_back, back if is_age_compensated else 0.0)
        hear(antenna, read_tags[row, 0], read_tags[row, 1], shape, field, tuned, mix, numbers, scratch)
    shape = (shapes[0, 0], shapes[0, 1], shapes[0, 2], shapes[0, 3])
    for a in range(antennas.shape[0]):
        if (period <= 1 or step % period == slots[a]) and _is_new(heard, a, soft):
            is_silent = heard[a, NOW_N] == 0.0 or is_inventory
            if learns_from_nothing and is_silent and numbers[N] > 0:
                back = 1.0 - phases[a] + delay
                antenna = _antenna_of(antennas, a, step_back, back if is_age_compensated else 0.0)
                hear_nothing(
                    a, antenna, first, last, read_antenna, read_tags, shape, field, reach, tuned, tags, mix, numbers,
                    scratch,
                )  # fmt: skip
            heard[a, LAST_X], heard[a, LAST_Y], heard[a, LAST_N] = heard[a, NOW_X], heard[a, NOW_Y], heard[a, NOW_N]
            heard[a, TRAVEL] = 0.0
        heard[a, NOW_X], heard[a, NOW_Y], heard[a, NOW_N] = 0.0, 0.0, 0.0
    if numbers[N] == 1:
        mix[0, WEIGHT] = 1.0
        numbers[CAP] = n_most
    elif numbers[N] > 1:
        n = normalize(mix, numbers[N])
        numbers[CAP] = max(n_most, min(numbers[CAP], n))
        numbers[N] = merge(mix, n, numbers[CAP])


@inline_kernel
def _note_polls(first, last, read_antenna, read_tags, heard):
    for row in range(first, last):
        a = read_antenna[row]
        heard[a, NOW_X] += read_tags[row, 0]
        heard[a, NOW_Y] += read_tags[row, 1]
        heard[a, NOW_N] += 1.0


@inline_kernel
def _is_new(heard, a, soft):
    """Whether an antenna's poll tells something else than the last one used, or from a place of its own."""
    is_same = heard[a, NOW_N] == heard[a, LAST_N] and heard[a, NOW_X] == heard[a, LAST_X]
    return heard[a, TRAVEL] >= soft or not (is_same and heard[a, NOW_Y] == heard[a, LAST_Y])


@inline_kernel
def _antenna_of(antennas, a, step_back, back):
    """x, y, sine and cosine of antenna a on the robot as it is at the end of a step, `back` steps before.

    `step_back` : where the robot's centre was a step before, and the turn since.
    """
    x, y, yaw_s, yaw_c = antennas[a, 0], antennas[a, 1], antennas[a, 2], antennas[a, 3]
    to_x, to_y, turn = step_back
    s, c = sin_cos_near(back * turn)
    return c * x + s * y + back * to_x, c * y - s * x + back * to_y, yaw_s * c - yaw_c * s, yaw_c * c + yaw_s * s
