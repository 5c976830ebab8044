"""The projected-moment Gaussian filter: every poll of a step, read or not, on every component of a mixture.

State of a belief: `mix` (rows, N_COLUMNS), see `_mixture_kernels`; `numbers` (3,) int64, see N, CAP and DOUBTS;
`heard` (n_antennas, N_HEARD), what each antenna told last.
"""

import math

import numpy as np

from rfiddesign.estimators._border_kernels import look_across
from rfiddesign.estimators._hypotheses_kernels import hypothesize
from rfiddesign.estimators._mixture_kernels import (
    HEADING,
    HH,
    WEIGHT,
    XH,
    XX,
    XY,
    YH,
    YY,
    X,
    Y,
    carry,
    face,
    merge,
    normalize,
    sin_cos_near,
    split,
    write_estimate,
)
from rfiddesign.estimators._plane_kernels import HALF_BORDER, HALF_GRID, N_GRID, depth_at, look_at_none, look_at_read
from rfiddesign.estimators._projection_kernels import (
    EVIDENCE,
    N_FOUND,
    N_TOLD,
    learn,
    seen_from,
    spread,
    spread_of,
)
from rfiddesign.models.soft_field import LEAST_PROBABILITY
from rfiddesign.numerics._compile_kernels import inline_kernel, kernel, leaf_kernel

# Components there are (0: nothing was read yet), how many may be kept, and reads in a row that contradict them all.
N, CAP, DOUBTS = range(3)
N_NUMBERS = 3
# Result of an antenna's last poll that was used, sums of x and y of the tags read and their number (-1: none was used),
# the way since then; and the same of this step's poll, with whether there was one.
LAST_X, LAST_Y, LAST_N, TRAVEL, NOW_X, NOW_Y, NOW_N = range(7)
N_HEARD = 7
MOST_NEAR = 16
# Beyond so many times the extent of the field an uncertain antenna learns nothing of tags it does not read.
_VAGUE = 3.0


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
    """Steps first..last-1; step s has row s + `row_of_step` in the log, row t there t + 1 + `row_of_row` in estimates."""
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
    soft, chance_to_read, n_most, split_sigma, gate, size, reach = rules
    is_inventory, slots, phases, period, uses_rssi, learns_from_nothing, is_age_compensated, delay = looks
    odometry, read_start, read_antenna, read_tags, read_age, read_rssi, dt = log
    dx, dy, turn = odometry[t, 0], odometry[t, 1], odometry[t, 2]
    s, c = sin_cos_near(turn)
    # Seen from the end of the step: rates of motion are constant within it.
    step_back = (-(c * dx + s * dy), s * dx - c * dy, turn)
    first, last = read_start[t], read_start[t + 1]
    _note_polls(first, last, read_antenna, read_tags, heard)
    tuned = (soft, chance_to_read, split_sigma, gate, size, n_most)
    for row in range(first, last):
        a = read_antenna[row]
        if not _is_new(heard, a, soft):
            continue
        which = min(max(read_rssi[row] + 1, 0), shapes.shape[0] - 1) if uses_rssi else 0
        shape = (shapes[which, 0], shapes[which, 1], shapes[which, 2], shapes[which, 3])
        back = read_age[row] / dt + delay
        antenna = _antenna_of(antennas, a, step_back, back if is_age_compensated else 0.0)
        _hear(antenna, read_tags[row, 0], read_tags[row, 1], shape, field, tuned, mix, numbers, scratch)
    if learns_from_nothing and numbers[N] > 0:
        shape = (shapes[0, 0], shapes[0, 1], shapes[0, 2], shapes[0, 3])
        for a in range(antennas.shape[0]):
            if (period > 1 and step % period != slots[a]) or not _is_new(heard, a, soft):
                continue
            if heard[a, NOW_N] > 0.0 and not is_inventory:
                continue
            back = 1.0 - phases[a] + delay
            antenna = _antenna_of(antennas, a, step_back, back if is_age_compensated else 0.0)
            _hear_nothing(a, antenna, first, last, read_antenna, read_tags, shape, field, reach, tuned, tags, mix, numbers, scratch)  # fmt: skip
    for a in range(antennas.shape[0]):
        if (period <= 1 or step % period == slots[a]) and _is_new(heard, a, soft):
            heard[a, LAST_X], heard[a, LAST_Y], heard[a, LAST_N] = heard[a, NOW_X], heard[a, NOW_Y], heard[a, NOW_N]
            heard[a, TRAVEL] = 0.0
        heard[a, NOW_X], heard[a, NOW_Y], heard[a, NOW_N] = 0.0, 0.0, 0.0
    if numbers[N] > 0:
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


@inline_kernel
def _hear(antenna, tag_x, tag_y, shape, field, tuned, mix, numbers, scratch):
    """An antenna read a tag."""
    soft, chance_to_read, split_sigma, gate, size, n_most = tuned
    grid, _, found, _ = scratch
    is_table = field[0].shape[0] > 0
    if numbers[N] == 0:
        numbers[N] = hypothesize(mix, 0, 1.0, antenna, tag_x, tag_y, shape, field)
        numbers[CAP] = numbers[N]
        return
    total, does_matter = 0.0, False
    n, k = numbers[N], 0
    base, gain = LEAST_PROBABILITY, chance_to_read - LEAST_PROBABILITY
    while k < n:
        seen = seen_from(mix, k, antenna, tag_x, tag_y)
        if is_table or not look_across(mix, k, seen, shape, soft, base, gain, found[k]):
            look_at_read(mix, k, seen, shape, soft, chance_to_read, field, grid, found[k])
            if n <= n_most and found[k, N_TOLD] > 1.0:
                sigma, dx, dy, dh = spread_of(found[k])
                if sigma > split_sigma * size:
                    n = split(mix, n, k, dx, dy, dh)
                    continue
        does_matter = does_matter or found[k, N_TOLD] > 0.0 or found[k, EVIDENCE] < gate
        total += mix[k, WEIGHT] * found[k, EVIDENCE]
        k += 1
    numbers[N] = n
    if not does_matter:
        numbers[DOUBTS] = 0
        return
    if total < gate:
        numbers[DOUBTS] += 1
        for k in range(n):
            _move_to_border(mix, k, antenna, tag_x, tag_y, shape, found[k])
        if numbers[DOUBTS] >= 2:
            n = merge(mix, n, 3)
            for k in range(n):
                mix[k, WEIGHT] *= 0.5
            numbers[N] = hypothesize(mix, n, 0.5, antenna, tag_x, tag_y, shape, field)
            numbers[CAP] = numbers[N]
            numbers[DOUBTS] = 0
        return
    numbers[DOUBTS] = 0
    for k in range(n):
        mix[k, WEIGHT] *= found[k, EVIDENCE] / total
        learn(mix, k, found[k])


@leaf_kernel
def _move_to_border(mix, k, antenna, tag_x, tag_y, shape, found):
    """Move a component so far that the tag lies on the border of the field; the move adds to its covariance."""
    u, v, h0, h1, hu, hv = seen_from(mix, k, antenna, tag_x, tag_y)
    excess = -depth_at(u, v, shape)
    way = math.sqrt(u * u + v * v)
    if excess <= 0.0 or way <= 0.0:
        return
    nu, nv = -u / way, -v / way
    # Row g of the constraint and P g'.
    g0, g1, g2 = -nu * h0 + nv * h1, -nu * h1 - nv * h0, nu * hu + nv * hv
    p0 = mix[k, XX] * g0 + mix[k, XY] * g1 + mix[k, XH] * g2
    p1 = mix[k, XY] * g0 + mix[k, YY] * g1 + mix[k, YH] * g2
    p2 = mix[k, XH] * g0 + mix[k, YH] * g1 + mix[k, HH] * g2
    share = excess / (g0 * p0 + g1 * p1 + g2 * p2 + 1e-9)
    dx, dy, dh = share * p0, share * p1, share * p2
    mix[k, X] += dx
    mix[k, Y] += dy
    face(mix, k, mix[k, HEADING] + dh)


@inline_kernel
def _hear_nothing(
    a, antenna, first, last, read_antenna, read_tags, shape, field, reach, tuned, tags, mix, numbers, scratch
):
    """An antenna read none of the tags about it but those in rows first..last-1."""
    soft, chance_to_read, split_sigma, _, size, n_most = tuned
    grid, product, found, near = scratch
    is_table = field[0].shape[0] > 0
    tag_x, tag_y, cell_start, per_cell, x0, y0, n_x, n_y = tags
    x, y, _, _ = antenna
    n, k = numbers[N], 0
    total, before = 0.0, 1.0
    while k < n:
        s, c = mix[k, 10], mix[k, 11]
        lever_x, lever_y = c * x - s * y, s * x + c * y
        at_x, at_y = mix[k, X] + lever_x, mix[k, Y] + lever_y
        variance = mix[k, XX] + mix[k, YY] + 2.0 * (lever_x * mix[k, YH] - lever_y * mix[k, XH])
        variance += (x * x + y * y) * mix[k, HH]
        sigma = math.sqrt(max(variance, 0.0))
        n_near = 0
        if sigma < _VAGUE * reach:
            far = reach + HALF_BORDER * soft + HALF_GRID * sigma
            column, line, span = (at_x - x0) * per_cell, (at_y - y0) * per_cell, far * per_cell + 1e-6
            first_i, last_i = max(int(math.floor(column - span)), 0), min(int(math.floor(column + span)), n_x - 1)
            first_j, last_j = max(int(math.floor(line - span)), 0), min(int(math.floor(line + span)), n_y - 1)
            for j in range(first_j, last_j + 1):
                if first_i > last_i:
                    break
                for tag in range(cell_start[j * n_x + first_i], cell_start[j * n_x + last_i + 1]):
                    dx, dy = tag_x[tag] - at_x, tag_y[tag] - at_y
                    if dx * dx + dy * dy > far * far:
                        continue
                    is_read = False
                    for row in range(first, last):
                        is_same = read_tags[row, 0] == tag_x[tag] and read_tags[row, 1] == tag_y[tag]
                        is_read = is_read or (read_antenna[row] == a and is_same)
                    if is_read:
                        continue
                    if n_near < MOST_NEAR:
                        near[n_near, 0], near[n_near, 1] = tag_x[tag], tag_y[tag]
                    n_near += 1
        if n_near == 0 or n_near > MOST_NEAR:
            total += mix[k, WEIGHT]
            k += 1
            continue
        if variance > split_sigma * split_sigma * size * size and n <= n_most:
            seen = seen_from(mix, k, antenna, near[0, 0], near[0, 1])
            spread(mix, k, seen, found[k])
            sigma, dx, dy, dh = spread_of(found[k])
            if sigma > split_sigma * size:
                n = split(mix, n, k, dx, dy, dh)
                continue
        evidence, n_bent = 1.0, 0
        for i in range(n_near):
            seen = seen_from(mix, k, antenna, near[i, 0], near[i, 1])
            if not is_table and look_across(mix, k, seen, shape, soft, 1.0, -chance_to_read, found[k]):
                evidence *= found[k, EVIDENCE]
                learn(mix, k, found[k])
            else:
                near[n_bent, 0], near[n_bent, 1] = near[i, 0], near[i, 1]
                n_bent += 1
        if n_bent > 0:
            seen = seen_from(mix, k, antenna, near[0, 0], near[0, 1])
            look_at_none(mix, k, seen, near, n_bent, shape, soft, chance_to_read, field, grid, product, found[k])
            evidence *= found[k, EVIDENCE]
            learn(mix, k, found[k])
        mix[k, WEIGHT] *= evidence
        total += mix[k, WEIGHT]
        k += 1
    numbers[N] = n
    if total < 1e-3 * before:
        for k in range(n):
            mix[k, WEIGHT] /= max(total, 1e-300)
