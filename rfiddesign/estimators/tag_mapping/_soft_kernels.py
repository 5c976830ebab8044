"""Visits of a survey weigh a tag's window, each as far off as the reference may be, compiled; see soft_grid.py."""

import math

import numpy as np

from rfiddesign.estimators.tag_mapping._observation_kernels import weigh_by_table
from rfiddesign.estimators.tag_mapping._window_kernels import largest
from rfiddesign.numerics._compile_kernels import kernel

# Below this a blurred likelihood counts as this: its logarithm must be finite.
_LEAST = np.float32(1e-37)


@kernel
def add_blurred(field, box, taps, along, weight, logs):
    """Blur exp(`field`) (n + 2 p, n + 2 p) by `taps` (2 p + 1,) along both axes; add `weight` times its log to `logs`.

    `logs` (n, n) is the middle of the field, whose rim the blur uses up; `box` (4,) is all of the field and
    `along` (n + 2 p, n) room.  Returns what is to be added to all of `logs`.
    """
    n, wide = logs.shape[0], field.shape[0]
    most = largest(field, box, np.empty(wide, np.float32))
    for row in range(wide):
        cells, to = field[row], along[row]
        for j in range(wide):
            cells[j] = math.exp(cells[j] - most)
        to[:] = 0.0
        for k in range(taps.shape[0]):
            for j in range(n):
                to[j] += taps[k] * cells[j + k]
    blurred, factor = np.empty(n, np.float32), np.float32(weight)
    for row in range(n):
        blurred[:] = 0.0
        for k in range(taps.shape[0]):
            cells = along[row + k]
            for j in range(n):
                blurred[j] += taps[k] * cells[j]
        for j in range(n):
            logs[row, j] += factor * math.log(max(blurred[j], _LEAST))
    return weight * most


@kernel
def add_visits(poses, outcome, visit_start, weights, tables, frame, taps, cell, logs):
    """Add what visits say of the tag to the window `logs` (n, n); returns what is to be added to all of it.

    In each visit the reference was off by some shift, which is unknown and the same for all of the visit's polls: their
    joint likelihood is blurred by how far that may be.

    Parameters
    ----------
    poses, outcome : (m, 3) antennas about the window's middle, and the table that each poll asks, by visit.
    visit_start : (n_visits + 1,) first poll of each visit.
    weights : (n_visits,) power to which the likelihood of each is taken.
    tables : (n_outcomes, n_u * n_v) as `weigh_by_table` takes one; frame : (n_v, low_u, low_v, cell) of all.
    taps : (2 p + 1,) float32, the blur in steps of `cell` mm, which is the side of the window's cells.
    """
    n_v, low_u, low_v, table_cell = frame
    n = logs.shape[0]
    wide = n + taps.shape[0] - 1
    low, everywhere = -(wide // 2) * cell, 0.0
    field, along = np.empty((wide, wide), np.float32), np.empty((wide, n), np.float32)
    at, parts, box = np.empty(wide, np.int32), np.empty((2, wide), np.float32), np.array([0, wide, 0, wide])
    for v in range(visit_start.shape[0] - 1):
        field[:] = 0.0
        for k in range(visit_start[v], visit_start[v + 1]):
            weigh_by_table(
                field, box, low, low, cell, poses[k, 0], poses[k, 1], poses[k, 2], tables[outcome[k]], n_v, low_u,
                low_v, table_cell, at, parts,
            )  # fmt: skip
        everywhere += add_blurred(field, box, taps, along, weights[v], logs)
    return everywhere
