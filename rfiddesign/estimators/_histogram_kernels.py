"""Histogram filter over (x, y, heading), step by step; see `_histogram_diffusion_kernels` for how the mass lies.

`model` is (antennas (n, 4) x, y, cosine and sine of the direction; noise (3, 3) of `Motion.noise`; field, see
`_histogram_evidence_kernels`; rules (softness [mm], read probability, RSSI is used, polls without a read are used,
cells adapt, radius for the search [mm]) and limits of the cells; ages (is_age_compensated, delay in steps); looks (all
tags answer, slots, phases, period)).
"""

import math

import numpy as np

from rfiddesign.estimators._acquisition_kernels import STAGE, advance, find_pose, restart
from rfiddesign.estimators._histogram_diffusion_kernels import (
    THINNEST,
    added_by_exchange,
    diffuse_layer,
    exchange_layers,
)
from rfiddesign.estimators._histogram_evidence_kernels import antenna_of, weigh, weigh_nothing_seen
from rfiddesign.estimators._histogram_rescale_kernels import fit_cells, rescale_cells, rescale_headings
from rfiddesign.estimators._histogram_window_kernels import (
    CELL,
    DOUBT,
    HEADING,
    LOST,
    TURN,
    moments,
    recentre,
    trim,
)
from rfiddesign.models._motion_kernels import step_variances
from rfiddesign.numerics._compile_kernels import kernel, leaf_kernel
from rfiddesign.numerics._math_kernels import exp_32, sin_cos_64

_F = np.float32
_TURN = 2.0 * math.pi
# Half the window is so many standard deviations at the start.
_SIGMAS = 3.5
# A read that the belief gives less than this contradicts it; so many of them, less half of those that do not, and the
# robot is lost.  Twice the chance that the field leaves to what cannot be.
_CONTRADICTION, _MOST_DOUBT = 2e-3, 5.0
# Noise of a step beyond this, in cells or layers, wants larger ones; it is cut at this share of the window.
_MOST_VARIANCE, _CUT = 16.0, 1 / 16
_HEALTHY = 1e-100


@leaf_kernel
def begin(pose, covariance, limits, is_adaptive, mass, spare, origins, box, frame):
    """Fill the window with a Gaussian (pose (3,), covariance (3, 3)); cells are made to fit it where they may."""
    n_layers, n = mass.shape[0], mass.shape[1]
    middle, half = (n_layers - 1) // 2, (n - 1) // 2
    tt = covariance[2, 2]
    sx, sy = (covariance[0, 2] / tt, covariance[1, 2] / tt) if tt > 1e-12 else (0.0, 0.0)
    a, b = covariance[0, 0] - sx * covariance[0, 2], covariance[0, 1] - sx * covariance[1, 2]
    c = covariance[1, 1] - sy * covariance[1, 2]
    if is_adaptive:
        most = math.sqrt(max(0.5 * (a + c) + math.sqrt(0.25 * (a - c) * (a - c) + b * b), 0.0))
        frame[CELL] = min(max(_SIGMAS * most / half, limits[0]), limits[1])
        frame[TURN] = min(max(_SIGMAS * math.sqrt(max(tt, 0.0)) / max(middle, 1), limits[2]), limits[3])
    h, turn = frame[CELL], frame[TURN]
    frame[HEADING], frame[DOUBT] = pose[2], 0.0
    # What is thinner than a cell is one cell.
    a, c, tt = a + 0.09 * h * h, c + 0.09 * h * h, tt + 0.09 * turn * turn
    determinant = max(a * c - b * b, 1e-3 * a * c)
    total = 0.0
    for k in range(n_layers):
        t = (k - middle) * turn
        origins[k, 0], origins[k, 1] = pose[0] + sx * t, pose[1] + sy * t
        for i in range(n):
            x = (i - half) * h
            for j in range(n):
                y = (j - half) * h
                square = t * t / tt + (c * x * x - 2.0 * b * x * y + a * y * y) / determinant
                mass[k, i, j] = float(exp_32(_F(-0.5 * square))) if square < 150.0 else 0.0
                total += mass[k, i, j]
    for k in range(n_layers):
        for i in range(n):
            for j in range(n):
                mass[k, i, j] /= total
    box[0], box[1], box[2], box[3], box[4], box[5] = 0, n_layers, 0, n, 0, n


@leaf_kernel
def _make_room(mass, spare, origins, box, frame, shape, limits, noise_xy, noise_heading):
    """Double cells, and turns between layers, until a step's noise is a few of them."""
    while noise_xy > _MOST_VARIANCE * frame[CELL] ** 2 and 2.0 * frame[CELL] <= limits[1]:
        rescale_cells(mass, spare, box, frame, True)
    while mass.shape[0] > 1 and noise_heading > _MOST_VARIANCE * frame[TURN] ** 2 and 2.0 * frame[TURN] <= limits[3]:
        rescale_headings(mass, spare, origins, box, frame, shape, True)


@leaf_kernel
def _move(row, odometry, model, mass, spare, origins, box, frame, shape):
    """Move every layer along its heading, diffuse it, turn all, and swap mass between layers."""
    n_layers, n = mass.shape[0], mass.shape[1]
    middle = (n_layers - 1) // 2
    dx, dy, turned = odometry[row, 0], odometry[row, 1], odometry[row, 2]
    qx, qy, qh = step_variances(model[1], dx, dy, turned)
    if model[3][4]:
        _make_room(mass, spare, origins, box, frame, shape, model[3][6], max(qx, qy), qh)
    per_cell = 1.0 / frame[CELL]
    most = _CUT * n * n
    qx, qy = min(qx * per_cell * per_cell, most), min(qy * per_cell * per_cell, most)
    qx, qy = max(qx, THINNEST * qy), max(qy, THINNEST * qx)
    qh = min(qh / (frame[TURN] * frame[TURN]), _CUT * n_layers * n_layers)
    for k in range(n_layers):
        s, c = sin_cos_64(frame[HEADING] + (k - middle) * frame[TURN])
        origins[k, 0] += c * dx - s * dy
        origins[k, 1] += s * dx + c * dy
    first_i, end_i, first_j, end_j = box[2], box[3], box[4], box[5]
    for k in range(box[0], box[1]):
        s, c = sin_cos_64(frame[HEADING] + (k - middle) * frame[TURN])
        xx, xy, yy = c * c * qx + s * s * qy, s * c * (qx - qy), s * s * qx + c * c * qy
        # Swapping mass between layers will add to this.
        less_x = 0.5 * qh * added_by_exchange(origins, per_cell, k, 0)
        less_y = 0.5 * qh * added_by_exchange(origins, per_cell, k, 1)
        for _ in range(6):
            a, b = xx - less_x, yy - less_y
            if a > 0.0 and b > 0.0 and a * b - xy * xy > 0.5 * THINNEST * (a + b) ** 2:
                xx, yy = a, b
                break
            less_x, less_y = 0.5 * less_x, 0.5 * less_y
        a, b, d, e = diffuse_layer(mass[k], spare[0], xx, xy, yy, box[2], box[3], box[4], box[5])
        first_i, end_i, first_j, end_j = min(first_i, a), max(end_i, b), min(first_j, d), max(end_j, e)
    box[2], box[3], box[4], box[5] = first_i, end_i, first_j, end_j
    heading = frame[HEADING] + turned
    frame[HEADING] = heading - _TURN * math.floor(heading / _TURN + 0.5)
    exchange_layers(mass, spare, origins, frame[CELL], box, qh)
    total = 0.0
    for k in range(box[0], box[1]):
        for i in range(box[2], box[3]):
            for j in range(box[4], box[5]):
                total += mass[k, i, j]
    frame[LOST] += max(1.0 - total, 0.0)
    return total


@leaf_kernel
def predict(key, step, odometry, row, model, arrays):
    """See `verbs.Kernels`; arrays: mass, spare, origins, box, frame, shape, marginals, held, search."""
    mass, spare, origins, box, frame, shape, _, _, search = arrays
    if search[STAGE] < 2.0:
        advance(search, odometry, row)
        return
    if not _move(row, odometry, model, mass, spare, origins, box, frame, shape) > 0.0:
        restart(search)


@leaf_kernel
def _search(t, log, model, mass, spare, origins, box, frame, held, search, pose, covariance):
    """Look for a pose in the reads of a step; True once there is one, with which the histogram begins."""
    odometry, read_start, read_antenna, read_tags, read_age, _, dt = log
    antennas, rules, ages = model[0], model[3], model[4]
    for row in range(read_start[t], read_start[t + 1]):
        a = read_antenna[row]
        x, y, _, _ = antenna_of(t, odometry, antennas, a, read_age[row] / dt + ages[1], ages[0])
        if find_pose(search, a, x, y, read_tags[row, 0], read_tags[row, 1], rules[5], pose, covariance):
            begin(pose, covariance, rules[6], rules[4], mass, spare, origins, box, frame)
            return True
    return False


@leaf_kernel
def _weigh_reads(t, log, model, mass, origins, box, frame):
    """The evidence of the step's reads; False if the robot is lost."""
    odometry, read_start, read_antenna, read_tags, read_age, read_rssi, dt = log
    antennas, _, field, rules, ages, _ = model
    before = 0.0
    for k in range(box[0], box[1]):
        for i in range(box[2], box[3]):
            for j in range(box[4], box[5]):
                before += mass[k, i, j]
    for row in range(read_start[t], read_start[t + 1]):
        antenna = antenna_of(t, odometry, antennas, read_antenna[row], read_age[row] / dt + ages[1], ages[0])
        rssi = read_rssi[row] if rules[2] else -1
        total = weigh(
            mass, origins, box, frame, antenna, read_tags[row, 0], read_tags[row, 1], rssi, rules[0], rules[1], field
        )
        if not total > 0.0:
            return False
        is_contradiction = total < _CONTRADICTION * before
        frame[DOUBT] = max(frame[DOUBT] + (1.0 if is_contradiction else -0.5), 0.0)
        if frame[DOUBT] >= _MOST_DOUBT:
            return False
        if total < _HEALTHY:
            _scale(mass, box, 1.0 / total)
            total = 1.0
        before = total
    return True


@leaf_kernel
def _scale(mass, box, factor):
    for k in range(box[0], box[1]):
        for i in range(box[2], box[3]):
            for j in range(box[4], box[5]):
                mass[k, i, j] *= factor


@kernel
def update(key, step, log, t, model, tags, arrays, out, row):
    """See `verbs.Kernels`."""
    mass, spare, origins, box, frame, shape, marginals, held, search = arrays
    rules = model[3]
    pose, covariance = np.empty(3), np.empty((3, 3))
    has_begun = False
    if search[STAGE] >= 2.0:
        is_found = _weigh_reads(t, log, model, mass, origins, box, frame)
        if is_found and rules[3]:
            weigh_nothing_seen(step, t, log, model, tags, mass, origins, box, frame)
        total = moments(mass, origins, box, frame, marginals, shape, out, row) if is_found else 0.0
        has_begun = total > 0.0
        if not has_begun:
            restart(search)
    if not has_begun and _search(t, log, model, mass, spare, origins, box, frame, held, search, pose, covariance):
        has_begun = moments(mass, origins, box, frame, marginals, shape, out, row) > 0.0
        total = 1.0
    if not has_begun:
        for column in range(out.shape[1]):
            out[row, column] = held[column]
        return
    for column in range(out.shape[1]):
        held[column] = out[row, column]
    trim(mass, box, marginals, total)
    _scale(mass, box, 1.0 / total)
    recentre(mass, spare, origins, box, frame, shape)
    if rules[4]:
        fit_cells(mass, spare, origins, box, frame, marginals, shape, total, rules[6])


@kernel
def track(key, first, last, log, model, tags, arrays, estimates):
    """See `verbs.Kernels`."""
    for t in range(first, last):
        predict(key, t, log[0], t, model, arrays)
        update(key, t, log, t, model, tags, arrays, estimates, t + 1)
