"""A tag's belief in a square window of the floor, as logarithms of masses: its beginning, its moments, its peak.

`logs` (n, n) float32 holds a cell's `row` along y and its `column` along x; minus infinity is no mass.  The middle of
the lowest cell is at (low_x, low_y) [mm].  All mass is in rows box[0] to box[1] - 1 and columns box[2] to
box[3] - 1 of `box` (4,).
"""

import numpy as np

from rfiddesign.estimators._grid_kernels import clear_sums, count_mass, gaussian_exponent, moments_of_sums
from rfiddesign.numerics._compile_kernels import inline_kernel, leaf_kernel
from rfiddesign.numerics._math_kernels import exp_32

# What weighs e^-40 of the best cell counts for nothing in millions of cells, and five odd reads do not bring it back.
_LEAST_LOG = np.float32(-40.0)
_LARGEST_EXPONENT = 1e30


@leaf_kernel
def fill_flat(logs, radius_cells):
    """All cells whose middle lies within a radius of the middle cell's are alike; there is no mass beyond."""
    n, half = logs.shape[0], logs.shape[0] // 2
    for row in range(n):
        for column in range(n):
            x, y = float(column - half), float(row - half)
            is_inside = x * x + y * y <= radius_cells * radius_cells
            logs[row, column] = np.float32(0.0) if is_inside else np.float32(-np.inf)


@leaf_kernel
def fill_gaussian(logs, precision_xx, precision_xy, precision_yy):
    """A Gaussian about the middle cell, 0 there; its precision is per cells^2."""
    n, half = logs.shape[0], logs.shape[0] // 2
    for row in range(n):
        for column in range(n):
            x, y = float(column - half), float(row - half)
            exponent = gaussian_exponent(x, y, precision_xx, precision_xy, precision_yy)
            logs[row, column] = np.float32(-min(exponent, _LARGEST_EXPONENT))


@inline_kernel
def add(cells, value):
    """Add the same to all cells of a row."""
    for i in range(cells.shape[0]):
        cells[i] += value


@leaf_kernel
def largest(logs, box, tops):
    """The largest logarithm, minus infinity if there is no mass; `tops` (n,) float32 is room."""
    low, high, best = box[2], box[3], np.float32(-np.inf)
    # Slices begin at 0, which tells the compiler that no index counts from the end.
    tops = tops[: high - low]
    for i in range(tops.shape[0]):
        tops[i] = best
    for row in range(box[0], box[1]):
        cells = logs[row, low:high]
        for i in range(tops.shape[0]):
            tops[i] = max(tops[i], cells[i])
    for i in range(tops.shape[0]):
        best = max(best, tops[i])
    return best


@leaf_kernel
def lower(logs, box, amount):
    """Subtract the same from all: the belief stays as it is, and its logarithms near 0, where float32 is fine."""
    step = np.float32(-amount)
    for row in range(box[0], box[1]):
        add(logs[row, box[2] : box[3]], step)


@leaf_kernel
def moments(logs, box, best, sums, told):
    """Moments of a belief whose largest logarithm is `best`, finite: `told` (6,), see `moments_of_sums`.

    Masses are those over the largest; `sums` (3, n) is room.
    """
    n, low, high, top = logs.shape[0], box[2], box[3], np.float32(best)
    clear_sums(sums, n)
    plain, first, second = sums[0, low:high], sums[1, low:high], sums[2, low:high]
    for row in range(box[0], box[1]):
        cells, y = logs[row, low:high], float(row - n // 2)
        for i in range(cells.shape[0]):
            log = cells[i] - top
            mass = exp_32(max(log, _LEAST_LOG))
            count_mass(plain, first, second, i, np.float64(mass if log > _LEAST_LOG else np.float32(0.0)), y)
    moments_of_sums(sums, n, told)


@leaf_kernel
def peak(logs, box, best, counts):
    """How many cells have the logarithm `best`, and their mean x, y [cells from the middle].

    `counts` (n,) int32 is room.
    """
    low, high, half, top = box[2], box[3], logs.shape[0] // 2, np.float32(best)
    counts = counts[: high - low]
    total = sum_x = sum_y = 0
    for i in range(counts.shape[0]):
        counts[i] = 0
    for row in range(box[0], box[1]):
        cells, of_row = logs[row, low:high], 0
        for i in range(counts.shape[0]):
            is_best = np.int32(cells[i] == top)
            counts[i] += is_best
            of_row += is_best
        total += of_row
        sum_y += of_row * (row - half)
    for i in range(counts.shape[0]):
        sum_x += counts[i] * (low + i - half)
    return total, sum_x / total, sum_y / total


@leaf_kernel
def trim(logs, box, tops):
    """Give up cells with e^-40 of the best one's mass or less, shrink the box to what is left; returns the largest log.

    `tops` (n,) float32 is room.
    """
    low, high, nothing = box[2], box[3], np.float32(-np.inf)
    best = largest(logs, box, tops)
    least = best + _LEAST_LOG
    tops = tops[: high - low]
    first_row, last_row, first_column, last_column = box[1], box[0], high, low
    for i in range(tops.shape[0]):
        tops[i] = nothing
    for row in range(box[0], box[1]):
        cells, of_row = logs[row, low:high], 0
        for i in range(tops.shape[0]):
            cells[i] = cells[i] if cells[i] > least else nothing
            tops[i] = max(tops[i], cells[i])
            of_row += np.int32(cells[i] > nothing)
        if of_row > 0:
            first_row, last_row = min(first_row, row), row + 1
    for i in range(tops.shape[0]):
        if tops[i] > nothing:
            first_column, last_column = min(first_column, low + i), low + i + 1
    box[0], box[1], box[2], box[3] = first_row, last_row, first_column, last_column
    return best
