"""The window of a histogram over poses: its moments, and how it follows the belief.

See `_histogram_diffusion_kernels` for how the mass lies.  A window is sheared: its layers lie along the line on which
the position depends on the heading, so that a belief needs room only for its spread at given heading.
"""

import math

from rfiddesign.numerics._compile_kernels import inline_kernel, leaf_kernel
from rfiddesign.numerics._math_kernels import atan2_64, sin_cos_64

# What a frame holds: heading of the middle layer, side of a cell, heading from layer to layer, share of the mass lost
# so far, and how doubtful the belief is.
HEADING, CELL, TURN, LOST, DOUBT = range(5)
N_FRAME = 5
# What `moments` tells of the belief's shape: mean position, mean turn from the middle layer, how the position depends
# on the heading, least deviation of the position at given heading, deviation of the heading, mean layer.
MEAN_X, MEAN_Y, MEAN_TURN, SLOPE_X, SLOPE_Y, LEAST, SPREAD, MEAN_LAYER = range(8)
N_SHAPE = 8
# Rows and columns at the rim of the box that hold less than this are given up in each step.
_TRIMMED = 1e-9


@leaf_kernel
def moments(mass, origins, box, frame, marginals, shape, out, row):
    """Estimate of the belief to a row of `out`, its `shape`, and its marginals over layers, rows and columns.

    `marginals` (3, max(n_headings, n)).  Returns the sum of all mass, for which the moments are normalized.
    """
    n = mass.shape[1]
    middle, half = (mass.shape[0] - 1) // 2, (n - 1) // 2
    h, turn = frame[CELL], frame[TURN]
    x0, y0 = origins[middle, 0], origins[middle, 1]
    for axis in range(3):
        for k in range(marginals.shape[1]):
            marginals[axis, k] = 0.0
    total = sum_x = sum_y = sum_t = sum_s = sum_c = 0.0
    sum_xx = sum_xy = sum_yy = sum_xt = sum_yt = sum_tt = 0.0
    for k in range(box[0], box[1]):
        w = wi = wj = wii = wij = wjj = 0.0
        for i in range(box[2], box[3]):
            rw = rj = rjj = 0.0
            for j in range(box[4], box[5]):
                m, at = mass[k, i, j], float(j - half)
                rw += m
                rj += m * at
                rjj += m * at * at
                marginals[2, j] += m
            at = float(i - half)
            marginals[1, i] += rw
            w, wi, wj, wii, wij, wjj = w + rw, wi + at * rw, wj + rj, wii + at * at * rw, wij + at * rj, wjj + rjj
        marginals[0, k] = w
        # From cells about the layer's middle to mm about that of the middle layer.
        bx, by, t = origins[k, 0] - x0, origins[k, 1] - y0, (k - middle) * turn
        lx, ly = bx * w + h * wi, by * w + h * wj
        s, c = sin_cos_64(frame[HEADING] + t)
        total, sum_x, sum_y, sum_t = total + w, sum_x + lx, sum_y + ly, sum_t + t * w
        sum_s, sum_c = sum_s + s * w, sum_c + c * w
        sum_xx += bx * bx * w + 2.0 * bx * h * wi + h * h * wii
        sum_yy += by * by * w + 2.0 * by * h * wj + h * h * wjj
        sum_xy += bx * by * w + h * (bx * wj + by * wi) + h * h * wij
        sum_xt, sum_yt, sum_tt = sum_xt + t * lx, sum_yt + t * ly, sum_tt + t * t * w
    if not (total > 0.0 and total < math.inf):
        return 0.0
    p = 1.0 / total
    mx, my, mt = sum_x * p, sum_y * p, sum_t * p
    xx, xy, yy = max(sum_xx * p - mx * mx, 0.0), sum_xy * p - mx * my, max(sum_yy * p - my * my, 0.0)
    xt, yt, tt = sum_xt * p - mx * mt, sum_yt * p - my * mt, max(sum_tt * p - mt * mt, 0.0)
    out[row, 0], out[row, 1], out[row, 2] = x0 + mx, y0 + my, atan2_64(sum_s, sum_c)
    out[row, 3], out[row, 4], out[row, 5] = xx, xy, yy
    out[row, 6], out[row, 7], out[row, 8], out[row, 9] = xt, yt, tt, 1.0
    _describe(x0 + mx, y0 + my, mt, xx, xy, yy, xt, yt, tt, turn, h * n, shape)
    shape[MEAN_LAYER] = middle + mt / turn
    return total


@inline_kernel
def _describe(x, y, t, xx, xy, yy, xt, yt, tt, turn, width, shape):
    # Too little of the heading is in more than one layer to tell how the position depends on it.
    is_thin = tt < 0.05 * turn * turn
    sx, sy = (0.0, 0.0) if is_thin else (xt / tt, yt / tt)
    # Neighbouring layers must not lie too far apart to swap mass.
    steep = 4.0 * max(abs(sx), abs(sy)) * turn / width
    if steep > 1.0:
        sx, sy = sx / steep, sy / steep
    a, b, c = xx - sx * xt, xy - 0.5 * (sx * yt + sy * xt), yy - sy * yt
    least = 0.5 * (a + c) - math.sqrt(0.25 * (a - c) * (a - c) + b * b)
    shape[MEAN_X], shape[MEAN_Y], shape[MEAN_TURN], shape[SLOPE_X], shape[SLOPE_Y] = x, y, t, sx, sy
    shape[LEAST], shape[SPREAD] = math.sqrt(max(least, 0.0)), math.sqrt(tt)


@leaf_kernel
def trim(mass, box, marginals, total):
    """Clear what is next to empty at the rim of the box, so that later steps need not look at it."""
    allowed = _TRIMMED * total
    bounds = (box[0], box[1], box[2], box[3], box[4], box[5])
    for axis in range(3):
        first, end, below, above = box[2 * axis], box[2 * axis + 1], 0.0, 0.0
        while first < end - 1 and below + marginals[axis, first] <= allowed:
            below += marginals[axis, first]
            first += 1
        while end > first + 1 and above + marginals[axis, end - 1] <= allowed:
            above += marginals[axis, end - 1]
            end -= 1
        box[2 * axis], box[2 * axis + 1] = first, end
    for k in range(bounds[0], bounds[1]):
        for i in range(bounds[2], bounds[3]):
            is_out = k < box[0] or k >= box[1] or i < box[2] or i >= box[3]
            for j in range(bounds[4], bounds[5]):
                if is_out or j < box[4] or j >= box[5]:
                    mass[k, i, j] = 0.0


@leaf_kernel
def recentre(mass, spare, origins, box, frame, shape):
    """Shift the window by whole layers and its layers by whole cells, where the belief left the middle."""
    n_layers, n = mass.shape[0], mass.shape[1]
    middle = (n_layers - 1) // 2
    turns = math.floor(shape[MEAN_LAYER] - middle + 0.5)
    if abs(turns) * 8 > n_layers:
        _shift_layers(mass, origins, box, frame, shape, turns)
    h, room = frame[CELL], 1.5
    first_i, end_i, first_j, end_j = box[2], box[3], box[4], box[5]
    low_i, high_i, low_j, high_j = n, 0, n, 0
    for k in range(n_layers):
        along = (k - middle) * frame[TURN] - shape[MEAN_TURN]
        off_i = (shape[MEAN_X] + along * shape[SLOPE_X] - origins[k, 0]) / h
        off_j = (shape[MEAN_Y] + along * shape[SLOPE_Y] - origins[k, 1]) / h
        move_i = math.floor(off_i + 0.5) if abs(off_i) > room else 0
        move_j = math.floor(off_j + 0.5) if abs(off_j) > room else 0
        origins[k, 0] += move_i * h
        origins[k, 1] += move_j * h
        if k < box[0] or k >= box[1]:
            continue
        if move_i != 0 or move_j != 0:
            _shift_cells(mass[k], spare[0], move_i, move_j)
        low_i, high_i = min(low_i, first_i - move_i), max(high_i, end_i - move_i)
        low_j, high_j = min(low_j, first_j - move_j), max(high_j, end_j - move_j)
    box[2], box[3] = min(max(low_i, 0), n - 1), max(min(high_i, n), 1)
    box[4], box[5] = min(max(low_j, 0), n - 1), max(min(high_j, n), 1)


@leaf_kernel
def _shift_cells(layer, spare, move_i, move_j):
    """layer[i, j] = layer[i + move_i, j + move_j], zero where there is none."""
    n = layer.shape[0]
    for i in range(n):
        for j in range(n):
            is_in = 0 <= i + move_i < n and 0 <= j + move_j < n
            spare[i, j] = layer[i + move_i, j + move_j] if is_in else 0.0
    for i in range(n):
        for j in range(n):
            layer[i, j] = spare[i, j]


@leaf_kernel
def _shift_layers(mass, origins, box, frame, shape, turns):
    """Layer k becomes what layer k + turns was; layers without mass continue the line of the others."""
    n_layers, n = mass.shape[0], mass.shape[1]
    step = 1 if turns > 0 else -1
    k = 0 if turns > 0 else n_layers - 1
    for _ in range(n_layers):
        old = k + turns
        is_in = 0 <= old < n_layers
        if is_in:
            origins[k, 0], origins[k, 1] = origins[old, 0], origins[old, 1]
        else:
            origins[k, 0] = origins[k - step, 0] + step * frame[TURN] * shape[SLOPE_X]
            origins[k, 1] = origins[k - step, 1] + step * frame[TURN] * shape[SLOPE_Y]
        for i in range(n):
            for j in range(n):
                mass[k, i, j] = mass[old, i, j] if is_in else 0.0
        k += step
    frame[HEADING] += turns * frame[TURN]
    shape[MEAN_TURN] -= turns * frame[TURN]
    shape[MEAN_LAYER] -= turns
    box[0], box[1] = min(max(box[0] - turns, 0), n_layers - 1), max(min(box[1] - turns, n_layers), 1)
