"""A tag's belief in a square window of the floor, as logarithms of masses: weighed by ellipses and by tables.

`logs` (n, n) float32 holds a cell's `row` along y and its `column` along x; minus infinity is no mass.  The middle of
the lowest cell is at (low_x, low_y) [mm].  An observation multiplies only what lies in its shape: the factor of all that
lies outside is taken out, so that cells out there are not visited.
"""

import math

import numpy as np

from rfiddesign.estimators._grid_kernels import clear_sums, count_mass, gaussian_exponent, moments_of_sums
from rfiddesign.numerics._compile_kernels import inline_kernel, leaf_kernel
from rfiddesign.numerics._math_kernels import exp_32, sin_cos_64

# What weighs e^-60 of the best cell counts for nothing in 10^8 cells.
_LEAST_LOG = np.float32(-60.0)
_LARGEST_EXPONENT = 1e30
# Distance within which a point counts as on an ellipse's border, and thus in it: shares of its axes, squared.
_ON_BORDER = 1e-9


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
def _beyond_ellipse(dx, dy, cosine, sine, length, width):
    """Above 0 outside an ellipse that has one end of its long axis at the antenna, which is (dx, dy) away."""
    along = (cosine * dx + sine * dy) * (2.0 / length) - 1.0
    across = (cosine * dy - sine * dx) * (2.0 / width)
    return along * along + across * across - (1.0 + _ON_BORDER)


@leaf_kernel
def ellipse_span(n, dx, dy, cell, cosine, sine, length, width):
    """Columns first..last-1 of a row that lie in an ellipse; (dx, dy) is the row's first cell, from the antenna.

    The ends solve a quadratic equation and are then put right by the ellipse's own inequality, so that the cells are
    those that it names, to the last one.
    """
    if length <= 0.0 or width <= 0.0:
        return 0, 0
    # Along the row, along and across (both in half axes) rise by these from column to column.
    p, q = cosine * cell * (2.0 / length), -sine * cell * (2.0 / width)
    along = (cosine * dx + sine * dy) * (2.0 / length) - 1.0
    across = (cosine * dy - sine * dx) * (2.0 / width)
    a, b, c = p * p + q * q, p * along + q * across, along * along + across * across - (1.0 + _ON_BORDER)
    inner = b * b - a * c
    middle = -b / a
    if inner < 0.0 or not abs(middle) < 1e9:
        return 0, 0
    half = math.sqrt(inner) / a
    first, last = math.ceil(middle - half), math.floor(middle + half) + 1
    first, last = max(first - 1, 0), min(last + 1, n)
    while first < last and _beyond_ellipse(dx + first * cell, dy, cosine, sine, length, width) > 0.0:
        first += 1
    while last > first and _beyond_ellipse(dx + (last - 1) * cell, dy, cosine, sine, length, width) > 0.0:
        last -= 1
    return first, last


@inline_kernel
def _rows_about(n, from_y, reach, cell):
    """Rows first..last-1 within `reach` of the antenna, which is `from_y` above the lowest row."""
    if not abs(from_y) < 1e9 * cell:
        return 0, 0
    return max(math.ceil((from_y - reach) / cell), 0), min(math.floor((from_y + reach) / cell) + 1, n)


@leaf_kernel
def weigh_by_ellipses(logs, low_x, low_y, cell, x, y, heading, inner_length, inner_add, outer_length, outer_add, ratio):
    """Add `inner_add` to the cells of one ellipse and `outer_add` to those of another that the first does not hold.

    Both have one end of their long axis at the antenna (x, y) and lie ahead of it; `ratio` is short axis to long one.  A
    length of 0 is no ellipse.
    """
    n = logs.shape[0]
    sine, cosine = sin_cos_64(heading)
    dx = low_x - x
    first_row, last_row = _rows_about(n, y - low_y, max(inner_length, outer_length), cell)
    inner_value, outer_value = np.float32(inner_add), np.float32(outer_add)
    for row in range(first_row, last_row):
        dy = low_y + row * cell - y
        first, last = ellipse_span(n, dx, dy, cell, cosine, sine, inner_length, ratio * inner_length)
        from_, to = ellipse_span(n, dx, dy, cell, cosine, sine, outer_length, ratio * outer_length)
        cells = logs[row]
        for i in range(first, last):
            cells[i] += inner_value
        if first >= last:
            for i in range(from_, to):
                cells[i] += outer_value
        else:
            for i in range(from_, min(to, first)):
                cells[i] += outer_value
            for i in range(max(from_, last), to):
                cells[i] += outer_value


@inline_kernel
def _part_within(start, step, last, first_column, last_column):
    """The columns in which start + step * column lies in [0, last]."""
    if abs(step) < 1e-9:
        return (first_column, last_column) if 0.0 <= start <= last else (0, 0)
    at_0, at_last = -start / step, (last - start) / step
    low, high = min(at_0, at_last), max(at_0, at_last)
    return max(first_column, math.ceil(max(low, -1.0))), min(last_column, math.floor(min(high, 1e9)) + 1)


@leaf_kernel
def weigh_by_table(logs, low_x, low_y, cell, x, y, heading, table, n_v, low_u, low_v, table_cell, at, parts):
    """Add what a table says at each cell's place in the antenna's frame, between its entries by bilinear interpolation.

    Beyond its outermost entries it says nothing, which these should do as well: cells out there are not visited.

    Parameters
    ----------
    table : (n_u * n_v,) float32 logarithms over u, ahead of the antenna, and v, to its left, those of a u together;
        at least two of each.
    low_u, low_v : place of the first entry [mm].
    at, parts : (n,) int32 and (2, n) float32, room.
    """
    n, n_u = logs.shape[0], table.shape[0] // n_v
    sine, cosine = sin_cos_64(heading)
    per_cell = 1.0 / table_cell
    dx, step_u, step_v = low_x - x, cosine * cell * per_cell, -sine * cell * per_cell
    last_u, last_v = float(n_u - 1), float(n_v - 1)
    # The table along y: between its lowest and its highest corner.
    corner_y = sine * low_u + cosine * low_v
    along_y, across_y = sine * last_u * table_cell, cosine * last_v * table_cell
    least_y = corner_y + min(along_y, 0.0) + min(across_y, 0.0)
    most_y = corner_y + max(along_y, 0.0) + max(across_y, 0.0)
    first_row, last_row = _rows_about(n, y + 0.5 * (least_y + most_y) - low_y, 0.5 * (most_y - least_y), cell)
    rise_u, rise_v, nothing = np.float32(step_u), np.float32(step_v), np.float32(0.0)
    # In float32 a place may come out beyond the last entry by a rounding, but looks up none beyond.
    most_j, most_k = np.int32(n_u - 2), np.int32(n_v - 2)
    stride, parts_u, parts_v = np.int32(n_v), parts[0], parts[1]
    right, ahead, oblique = np.uint64(1), np.uint64(n_v), np.uint64(n_v + 1)
    for row in range(first_row, last_row):
        dy = low_y + row * cell - y
        u, v = (cosine * dx + sine * dy - low_u) * per_cell, (cosine * dy - sine * dx - low_v) * per_cell
        first, last = _part_within(u, step_u, last_u, 0, n)
        first, last = _part_within(v, step_v, last_v, first, last)
        start_u, start_v = np.float32(u + first * step_u), np.float32(v + first * step_v)
        cells = logs[row]
        # Two loops: the first is arithmetic, many cells at once; only the second looks up.
        for i in range(last - first):
            at_u = max(start_u + np.float32(i) * rise_u, nothing)
            at_v = max(start_v + np.float32(i) * rise_v, nothing)
            j, k = min(np.int32(at_u), most_j), min(np.int32(at_v), most_k)
            parts_u[i], parts_v[i] = at_u - np.float32(j), at_v - np.float32(k)
            at[i] = j * stride + k
        for i in range(last - first):
            # Without a sign there is no counting from the end to look after.
            entry, part_v = np.uint64(np.uint32(at[i])), parts_v[i]
            near, far = table[entry], table[entry + ahead]
            near += part_v * (table[entry + right] - near)
            far += part_v * (table[entry + oblique] - far)
            cells[first + i] += near + parts_u[i] * (far - near)


@leaf_kernel
def largest(logs, tops):
    """The largest logarithm, minus infinity if there is no mass; `tops` (n,) float32 is room."""
    n, best = logs.shape[0], np.float32(-np.inf)
    for i in range(n):
        tops[i] = best
    for row in range(n):
        cells = logs[row]
        for i in range(n):
            tops[i] = max(tops[i], cells[i])
    for i in range(n):
        best = max(best, tops[i])
    return best


@leaf_kernel
def lower(logs, amount):
    """Subtract the same from all: the belief stays as it is, and its logarithms near 0, where float32 is fine."""
    step = np.float32(amount)
    for row in range(logs.shape[0]):
        cells = logs[row]
        for i in range(cells.shape[0]):
            cells[i] -= step


@leaf_kernel
def moments(logs, best, sums, told):
    """Moments of a belief whose largest logarithm is `best`, finite: `told` (6,), see `moments_of_sums`.

    Masses are those over the largest; `sums` (3, n) is room.
    """
    n = logs.shape[0]
    plain, first, second, top = sums[0], sums[1], sums[2], np.float32(best)
    clear_sums(sums, n)
    for row in range(n):
        cells, y = logs[row], float(row - n // 2)
        for i in range(n):
            log = cells[i] - top
            mass = exp_32(max(log, _LEAST_LOG))
            count_mass(plain, first, second, i, np.float64(mass if log > _LEAST_LOG else np.float32(0.0)), y)
    moments_of_sums(sums, n, told)


@leaf_kernel
def peak(logs, best, counts, told):
    """The cells whose logarithm is `best`: `told` (3,) receives how many, and their mean x, y [cells from the middle].

    `counts` (n,) int32 is room.
    """
    n, top = logs.shape[0], np.float32(best)
    total = sum_x = sum_y = 0
    for i in range(n):
        counts[i] = 0
    for row in range(n):
        cells, of_row = logs[row], 0
        for i in range(n):
            is_best = np.int32(cells[i] == top)
            counts[i] += is_best
            of_row += is_best
        total += of_row
        sum_y += of_row * (row - n // 2)
    for i in range(n):
        sum_x += counts[i] * (i - n // 2)
    told[0], told[1], told[2] = total, sum_x / total, sum_y / total


@leaf_kernel
def weigh_by_polls(
    logs, low_x, low_y, cell, poses, is_read, read_table, silent_table, n_v, low_u, low_v, table_cell, at, parts
):
    """Weigh by polls of an antenna at `poses` (m, 3), each of which read the tag or did not, see `weigh_by_table`."""
    for k in range(poses.shape[0]):
        weigh_by_table(
            logs, low_x, low_y, cell, poses[k, 0], poses[k, 1], poses[k, 2],
            read_table if is_read[k] else silent_table, n_v, low_u, low_v, table_cell, at, parts,
        )  # fmt: skip
