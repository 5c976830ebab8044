"""Markov localization on a moving grid with the heading by a Kalman filter, on arrays; markov.py says what is what."""

import math

from rfiddesign.estimators._acquisition_kernels import LOCAL_X, LOCAL_Y, find_pose, restart
from rfiddesign.estimators._evidence_kernels import antenna_then
from rfiddesign.estimators._markov_belief_kernels import (
    CROSS_X,
    CROSS_Y,
    DUE_XX,
    DUE_XY,
    DUE_YY,
    GRID_XX,
    GRID_XY,
    GRID_YY,
    HAS_REFERENCE,
    HAS_SEEN,
    HEADING,
    IS_FOUND,
    MEAN_X,
    MEAN_Y,
    MIDDLE_X,
    MIDDLE_Y,
    MOST_EXPLAINED,
    N_NUMBERS,
    PLACE_X,
    PLACE_XX,
    PLACE_Y,
    SEEN_X,
    SEEN_Y,
    TAG_X,
    TAG_Y,
    UNKNOWN_HEADING,
    VARIANCE,
    WAY_X,
    WAY_Y,
    begin,
    blur_if_due,
    explained,
    make_room,
    predict,
    settle,
    weigh_reads,
    wrapped,
)
from rfiddesign.numerics._compile_kernels import kernel, leaf_kernel
from rfiddesign.numerics._math_kernels import atan2_64, sin_cos_64


@leaf_kernel
def _take_for_reference(tag_x, tag_y, numbers):
    numbers[HAS_REFERENCE] = 1.0
    numbers[PLACE_X], numbers[PLACE_Y] = numbers[MIDDLE_X] + numbers[MEAN_X], numbers[MIDDLE_Y] + numbers[MEAN_Y]
    for k in range(3):
        numbers[PLACE_XX + k] = numbers[GRID_XX + k]
    numbers[TAG_X], numbers[TAG_Y], numbers[WAY_X], numbers[WAY_Y] = tag_x, tag_y, 0.0, 0.0


@leaf_kernel
def _correct_heading(tag_x, tag_y, cell, baseline, numbers):
    """Kalman filter of the heading: the direction between two places against that of the odometry (eq. 11)."""
    if numbers[HAS_REFERENCE] == 0.0:
        _take_for_reference(tag_x, tag_y, numbers)
        return
    way_x, way_y = numbers[WAY_X], numbers[WAY_Y]
    if (tag_x == numbers[TAG_X] and tag_y == numbers[TAG_Y]) or way_x * way_x + way_y * way_y < baseline * baseline:
        return
    dx = numbers[MIDDLE_X] + numbers[MEAN_X] - numbers[PLACE_X]
    dy = numbers[MIDDLE_Y] + numbers[MEAN_Y] - numbers[PLACE_Y]
    length = math.sqrt(dx * dx + dy * dy)
    if length > 0.5 * baseline:
        ux, uy, variance = dx / length, dy / length, cell * cell / 6.0
        for first in (GRID_XX, PLACE_XX):
            variance += uy * uy * numbers[first] - 2.0 * ux * uy * numbers[first + 1] + ux * ux * numbers[first + 2]
        sigma = atan2_64(math.sqrt(variance), length)
        gain = numbers[VARIANCE] / (numbers[VARIANCE] + sigma * sigma)
        error = atan2_64(way_x * dy - way_y * dx, way_x * dx + way_y * dy)
        numbers[HEADING] = wrapped(numbers[HEADING] + gain * error)
        numbers[VARIANCE] *= 1.0 - gain
        # The position's share in what is left of the error stays.
        numbers[CROSS_X] *= math.sqrt(1.0 - gain)
        numbers[CROSS_Y] *= math.sqrt(1.0 - gain)
    _take_for_reference(tag_x, tag_y, numbers)


@leaf_kernel
def _look(tag_x, tag_y, antenna, x, y, sigma2, radius, cell, numbers, grids, search, room):
    """A read while the pose is unknown: two tags tell it, until then the robot is somewhere about the last one."""
    pose, covariance = room[9, :3], room[10:13, :3]
    if find_pose(search, antenna, x, y, tag_x, tag_y, radius, pose, covariance):
        begin(cell, pose, covariance, numbers, grids, room)
        settle(cell, numbers, grids, room)
        _take_for_reference(tag_x, tag_y, numbers)
        return
    numbers[HAS_SEEN], numbers[SEEN_X], numbers[SEEN_Y] = 1.0, search[LOCAL_X], search[LOCAL_Y]
    numbers[MIDDLE_X], numbers[MIDDLE_Y], numbers[MEAN_X], numbers[MEAN_Y] = tag_x, tag_y, 0.0, 0.0
    numbers[GRID_XX] = numbers[GRID_YY] = sigma2 + 0.5 * (x * x + y * y)
    numbers[GRID_XY] = 0.0


@leaf_kernel
def _lose(numbers, search):
    """Nothing of the belief fits: the search begins anew."""
    for k in range(N_NUMBERS):
        if k != HEADING:
            numbers[k] = 0.0
    numbers[VARIANCE] = UNKNOWN_HEADING
    restart(search)


@leaf_kernel
def _write(cell, numbers, search, out, row):
    """The estimate, its variances at least those of a place within a cell."""
    own = cell * cell / 12.0
    xx, xy, yy = numbers[GRID_XX] + numbers[DUE_XX], numbers[GRID_XY] + numbers[DUE_XY], numbers[GRID_YY]
    yy += numbers[DUE_YY]
    if numbers[HAS_SEEN] > 0.0:
        # Somewhere on a circle about where it was.
        dx, dy = search[LOCAL_X] - numbers[SEEN_X], search[LOCAL_Y] - numbers[SEEN_Y]
        xx, yy = xx + 0.5 * (dx * dx + dy * dy), yy + 0.5 * (dx * dx + dy * dy)
    xx, yy = max(xx, own), max(yy, own)
    most = math.sqrt(xx * yy)
    xy = min(max(xy, -MOST_EXPLAINED * most), MOST_EXPLAINED * most)
    factor = explained(xx, xy, yy, numbers[CROSS_X], numbers[CROSS_Y], numbers[VARIANCE])
    out[row, 0], out[row, 1] = numbers[MIDDLE_X] + numbers[MEAN_X], numbers[MIDDLE_Y] + numbers[MEAN_Y]
    out[row, 2] = numbers[HEADING]
    out[row, 3], out[row, 4], out[row, 5] = xx, xy, yy
    out[row, 6], out[row, 7] = factor * numbers[CROSS_X], factor * numbers[CROSS_Y]
    out[row, 8], out[row, 9] = numbers[VARIANCE], 1.0


@kernel
def _update(t, log, model, numbers, grids, search, room, out, row):
    cell, positions, _, sigma2, radius, corrects_heading, baseline, is_age_compensated, delay = model
    odometry, read_start, read_antenna, read_tags, read_age, _, dt = log
    first, last = read_start[t], read_start[t + 1]
    # Twice where the first time tells that all was wrong.
    for _ in range(2):
        precision = sum_x = sum_y = 0.0
        s, c = sin_cos_64(numbers[HEADING])
        for k in range(first, last):
            antenna, tag_x, tag_y = read_antenna[k], read_tags[k, 0], read_tags[k, 1]
            x, y, back = positions[antenna, 0], positions[antenna, 1], read_age[k] / dt + delay
            if is_age_compensated and back > 0.0:
                x, y = antenna_then(x, y, back, odometry[t, 0], odometry[t, 1], odometry[t, 2])
            if numbers[IS_FOUND] == 0.0:
                _look(tag_x, tag_y, antenna, x, y, sigma2, radius, cell, numbers, grids, search, room)
                s, c = sin_cos_64(numbers[HEADING])
                continue
            # An antenna off the centre is where the heading has it, and as uncertain.
            weight = 1.0 / (sigma2 + numbers[VARIANCE] * (x * x + y * y))
            precision += weight
            sum_x += weight * (tag_x - (c * x - s * y))
            sum_y += weight * (tag_y - (s * x + c * y))
        if precision == 0.0:
            break
        if weigh_reads(sum_x / precision, sum_y / precision, precision, cell, numbers, grids, room):
            if corrects_heading:
                _correct_heading(read_tags[last - 1, 0], read_tags[last - 1, 1], cell, baseline, numbers)
            break
        _lose(numbers, search)
    if numbers[IS_FOUND] > 0.0:
        blur_if_due(cell, numbers, grids, room)
    _write(cell, numbers, search, out, row)


@kernel
def predict_step(key, step, odometry, row, model, arrays):
    """`predict` as estimators offer it; see `verbs.Kernels`."""
    numbers, _, search = arrays
    predict(odometry, row, model[2], numbers, search)


@kernel
def update_step(key, step, log, t, model, tags, arrays, out, row):
    """`update` as estimators offer it; see `verbs.Kernels`."""
    numbers, grids, search = arrays
    _update(t, log, model, numbers, grids, search, make_room(grids.shape[1]), out, row)


@kernel
def track(key, first, last, log, model, tags, arrays, estimates):
    """Run the filter over steps first..last-1 of a recording; estimates[t + 1] is the belief after step t.

    Parameters
    ----------
    log : as in `Recording.log`.
    model : (cell [mm], positions (n, 2), noise (3, 3), variance of eq. 10 [mm^2], radius of the antenna's area,
        corrects_heading, baseline, is_age_compensated, delay of reads in steps).
    tags : not used.
    arrays : (numbers (N_NUMBERS,), grids (2, n, n), numbers of the search).
    """
    numbers, grids, search = arrays
    odometry, room = log[0], make_room(grids.shape[1])
    for t in range(first, last):
        predict(odometry, t, model[2], numbers, search)
        _update(t, log, model, numbers, grids, search, room, estimates, t + 1)
