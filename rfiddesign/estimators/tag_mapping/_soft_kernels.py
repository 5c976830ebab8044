"""What a survey's polls say of where one tag lies, on a grid of places, compiled; the readable caller is soft_grid.py."""

import math

import numpy as np

from rfiddesign.numerics._compile_kernels import kernel

# Below this a blurred likelihood counts as this: its logarithm must be finite.
_LEAST = 1e-300


@kernel
def add_polls(x, y, yaw, outcome, first, last, tables, table_cell, reach, cell, field):
    """Add the log likelihood of polls first..last-1 to `field` (n, n); returns what is to be added everywhere.

    Parameters
    ----------
    x, y, yaw : (p,) places of the antennas about the grid's centre [mm], and their directions.
    outcome : (p,) table that each poll asks.
    tables : (n_outcomes, a, b) log likelihoods in cells of `table_cell` mm about the antenna; those on the border hold
        for every place beyond, and for every place farther than `reach` mm from the antenna.
    cell : side of a cell of the grid [mm]; cell (i, j) has its centre at ((i, j) - (n - 1) / 2) times that.
    """
    n, a, b = field.shape[0], tables.shape[1], tables.shape[2]
    middle, everywhere = 0.5 * (n - 1), 0.0
    for k in range(first, last):
        table = tables[outcome[k]]
        beyond = table[0, 0]
        everywhere += beyond
        s, c = math.sin(yaw[k]), math.cos(yaw[k])
        low_i = max(int(math.ceil((x[k] - reach) / cell + middle)), 0)
        high_i = min(int(math.floor((x[k] + reach) / cell + middle)), n - 1)
        for i in range(low_i, high_i + 1):
            dx = (i - middle) * cell - x[k]
            span = math.sqrt(max(reach * reach - dx * dx, 0.0))
            low_j = max(int(math.ceil((y[k] - span) / cell + middle)), 0)
            high_j = min(int(math.floor((y[k] + span) / cell + middle)), n - 1)
            for j in range(low_j, high_j + 1):
                dy = (j - middle) * cell - y[k]
                row = int(math.floor((c * dx + s * dy) / table_cell + 0.5 * a))
                column = int(math.floor((c * dy - s * dx) / table_cell + 0.5 * b))
                if 0 <= row < a and 0 <= column < b:
                    field[i, j] += table[row, column] - beyond
    return everywhere


@kernel
def log_blurred(field, taps, total, weight, everywhere):
    """Blur exp(`field`) (n + 2 p, n + 2 p) by `taps` (2 p + 1,) along both axes; add `weight` times its log to `total`.

    `total` (n, n) is the middle of the field, whose rim the blur uses up; `everywhere` is added to the logarithm.
    """
    n, wide = total.shape[0], field.shape[0]
    most = field.max()
    along = np.zeros((wide, n))
    for i in range(wide):
        for j in range(wide):
            field[i, j] = math.exp(field[i, j] - most)
        for k in range(taps.shape[0]):
            for j in range(n):
                along[i, j] += taps[k] * field[i, j + k]
    for i in range(n):
        row = np.zeros(n)
        for k in range(taps.shape[0]):
            for j in range(n):
                row[j] += taps[k] * along[i + k, j]
        for j in range(n):
            total[i, j] += weight * (math.log(max(row[j], _LEAST)) + most + everywhere)


@kernel
def add_visits(x, y, yaw, outcome, visit_start, weights, model, cell, total):
    """Add what visits say of the tag to the log likelihood `total` (n, n).

    In each visit the reference was off by some shift, which is unknown and the same for all of the visit's polls: their
    joint likelihood is blurred by how far that may be.

    Parameters
    ----------
    x, y, yaw, outcome : as in `add_polls`, by visit.
    visit_start : (n_visits + 1,) first poll of each visit.
    weights : (n_visits,) power to which the likelihood of each is taken.
    model : (tables, table_cell, reach, taps), as in `add_polls` and `log_blurred`.
    """
    tables, table_cell, reach, taps = model
    wide = total.shape[0] + taps.shape[0] - 1
    for v in range(visit_start.shape[0] - 1):
        field = np.zeros((wide, wide))
        everywhere = add_polls(
            x, y, yaw, outcome, visit_start[v], visit_start[v + 1], tables, table_cell, reach, cell, field
        )  # fmt: skip
        log_blurred(field, taps, total, weights[v], everywhere)
