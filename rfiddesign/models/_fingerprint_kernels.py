"""The kernel mean of fingerprints (uhf_snapshots, eq. 5), compiled; fingerprint.py says what is what."""

import math

import numpy as np

from rfiddesign.numerics._compile_kernels import kernel, leaf_kernel
from rfiddesign.numerics._math_kernels import exp_32


@leaf_kernel
def squared_distance(dx, dy, turn, precision, turn_precision):
    """Squared distance of two poses in bandwidths."""
    turn -= 2.0 * math.pi * math.floor(turn / (2.0 * math.pi) + 0.5)
    return (dx * dx + dy * dy) * precision + turn * turn * turn_precision


@kernel
def kernel_mean(poses, trained, cells, rows, values, metric, prior, out, support):
    """Chance that each tag is read at each pose, and the kernels' sum there before `beta` is added.

    Parameters
    ----------
    poses : (n, 3) antenna poses asked for.
    trained : (r, 3) poses of the snapshots, in the order of the cells.
    cells : (start (n_x n_y + 1,), x0, y0, cells per mm, n_x, n_y): square cells as wide as the kernels reach.
    rows : (start (r + 1,), tag (m,), kind (m,)): tags that a snapshot read and which of the values it gives.
    values : (v,) chance beyond that of a tag that was not read.
    metric : (1 / bandwidth^2 [1/mm^2], 1 / bandwidth^2 of the heading [1/rad^2], most squared distance).
    prior : (chance of a tag that was not read, chance without snapshots, beta_0).
    out : (n, n_tags) float32.
    support : (n,) float64.
    """
    cell_start, x0, y0, per_mm, n_x, n_y = cells
    row_start, row_tag, row_kind = rows
    precision, turn_precision, most = metric
    unread, untrained, beta = prior
    n_tags = out.shape[1]
    sums = np.empty(n_tags, np.float64)
    for i in range(poses.shape[0]):
        x, y, heading = poses[i, 0], poses[i, 1], poses[i, 2]
        total = 0.0
        sums[:] = 0.0
        column, row = math.floor((x - x0) * per_mm), math.floor((y - y0) * per_mm)
        for cell_y in range(max(row - 1, 0), min(row + 2, n_y)):
            for cell_x in range(max(column - 1, 0), min(column + 2, n_x)):
                cell = cell_y * n_x + cell_x
                for j in range(cell_start[cell], cell_start[cell + 1]):
                    d2 = squared_distance(
                        trained[j, 0] - x, trained[j, 1] - y, trained[j, 2] - heading, precision, turn_precision
                    )
                    if d2 > most:
                        continue
                    weight = np.float64(exp_32(np.float32(-0.5 * d2)))
                    total += weight
                    for k in range(row_start[j], row_start[j + 1]):
                        sums[row_tag[k]] += weight * values[row_kind[k]]
        support[i] = total
        share = 1.0 / (total + beta)
        base = share * (total * unread + beta * untrained)
        for tag in range(n_tags):
            out[i, tag] = np.float32(base + share * sums[tag])
