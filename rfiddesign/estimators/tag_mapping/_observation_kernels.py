"""A tag's window weighed by what antennas at known poses read: by ellipses ahead of them, and by tables about them.

See `_window_kernels` for windows and boxes.  An observation multiplies only what lies in its shape: the factor of all
that lies outside is taken out, so that cells out there are not visited.
"""

import math

import numpy as np

from rfiddesign.estimators.tag_mapping._window_kernels import add, largest, lower, peak, trim
from rfiddesign.numerics._compile_kernels import inline_kernel, leaf_kernel
from rfiddesign.numerics._math_kernels import sin_cos_64

# Looking for cells that may be given up costs about what a poll does.
_POLLS_PER_TRIM = 16
# Largest logarithm beyond which all are lowered: where sums of float32 are good to 4e-6.
_FAR_FROM_0 = 30.0
# Distance within which a point counts as on an ellipse's border, and thus in it: shares of its axes, squared.
_ON_BORDER = 1e-9


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
    first = max(math.ceil(middle - half) - 1, 0)
    # No less than `first`: a slice to -1 would be nearly all.
    last = max(min(math.floor(middle + half) + 2, n), first)
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

    Both have one end of their long axis at the antenna (x, y) and lie ahead of it; `ratio` is short axis to long one.
    A length of 0 is no ellipse.
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
        if first < last:
            add(logs[row, first:last], inner_value)
            add(logs[row, from_ : max(min(to, first), from_)], outer_value)
            add(logs[row, min(max(from_, last), to) : to], outer_value)
        else:
            add(logs[row, from_:to], outer_value)


@inline_kernel
def _part_within(start, step, last, first_column, last_column):
    """The columns in which start + step * column lies in [0, last]."""
    if abs(step) < 1e-9:
        return (first_column, last_column) if 0.0 <= start <= last else (0, 0)
    at_0, at_last = -start / step, (last - start) / step
    low, high = min(at_0, at_last), max(at_0, at_last)
    return max(first_column, math.ceil(max(low, -1.0))), min(last_column, math.floor(min(high, 1e9)) + 1)


@leaf_kernel
def weigh_by_table(logs, box, low_x, low_y, cell, x, y, heading, table, n_v, low_u, low_v, table_cell, at, parts):
    """Add what a table says at each cell's place in the antenna's frame, between its entries by bilinear interpolation.

    Beyond its outermost entries it says nothing, which these should do as well: cells out there are not visited.

    Parameters
    ----------
    table : (n_u * n_v,) float32 logarithms over u, ahead of the antenna, and v, to its left, those of a u together;
        at least two of each.
    low_u, low_v : place of the first entry [mm].
    at, parts : (n,) int32 and (2, n) float32, room.
    """
    n_u = table.shape[0] // n_v
    sine, cosine = sin_cos_64(heading)
    per_cell = 1.0 / table_cell
    dx, step_u, step_v = low_x - x, cosine * cell * per_cell, -sine * cell * per_cell
    last_u, last_v = float(n_u - 1), float(n_v - 1)
    # The table along y: between its lowest and its highest corner.
    corner_y = sine * low_u + cosine * low_v
    along_y, across_y = sine * last_u * table_cell, cosine * last_v * table_cell
    least_y = corner_y + min(along_y, 0.0) + min(across_y, 0.0)
    most_y = corner_y + max(along_y, 0.0) + max(across_y, 0.0)
    first_row, last_row = _rows_about(
        logs.shape[0], y + 0.5 * (least_y + most_y) - low_y, 0.5 * (most_y - least_y), cell
    )
    rise_u, rise_v, nothing = np.float32(step_u), np.float32(step_v), np.float32(0.0)
    # In float32 a place may come out beyond the last entry by a rounding, but looks up none beyond.
    most_j, most_k = np.int32(n_u - 2), np.int32(n_v - 2)
    stride, parts_u, parts_v = np.int32(n_v), parts[0], parts[1]
    right, ahead, oblique = np.uint64(1), np.uint64(n_v), np.uint64(n_v + 1)
    for row in range(max(first_row, box[0]), min(last_row, box[1])):
        dy = low_y + row * cell - y
        u, v = (cosine * dx + sine * dy - low_u) * per_cell, (cosine * dy - sine * dx - low_v) * per_cell
        first, last = _part_within(u, step_u, last_u, box[2], box[3])
        first, last = _part_within(v, step_v, last_v, first, last)
        start_u, start_v = np.float32(u + first * step_u), np.float32(v + first * step_v)
        if first >= last:
            continue
        cells = logs[row, first:last]
        # Two loops: the first is arithmetic, many cells at once; only the second looks up.
        for i in range(cells.shape[0]):
            at_u = max(start_u + np.float32(i) * rise_u, nothing)
            at_v = max(start_v + np.float32(i) * rise_v, nothing)
            j, k = min(np.int32(at_u), most_j), min(np.int32(at_v), most_k)
            parts_u[i], parts_v[i] = at_u - np.float32(j), at_v - np.float32(k)
            at[i] = j * stride + k
        for i in range(cells.shape[0]):
            # Without a sign there is no counting from the end to look after.
            entry, part_v = np.uint64(np.uint32(at[i])), parts_v[i]
            near, far = table[entry], table[entry + ahead]
            near += part_v * (table[entry + right] - near)
            far += part_v * (table[entry + oblique] - far)
            cells[i] += near + parts_u[i] * (far - near)


@leaf_kernel
def weigh_by_polls(logs, box, low_x, low_y, cell, poses, said, tables, n_v, low_u, low_v, table_cell, at, parts, tops):
    """Weigh by polls of an antenna at `poses` (m, 3), poll k saying `tables[said[k]]`, see `weigh_by_table`.

    Returns how far all logarithms were lowered, so that they stay where float32 is fine.
    """
    lowered = 0.0
    for k in range(poses.shape[0]):
        weigh_by_table(
            logs, box, low_x, low_y, cell, poses[k, 0], poses[k, 1], poses[k, 2], tables[said[k]], n_v, low_u, low_v,
            table_cell, at, parts,
        )  # fmt: skip
        if k % _POLLS_PER_TRIM == _POLLS_PER_TRIM - 1 or k == poses.shape[0] - 1:
            best = trim(logs, box, tops)
            if abs(best) > _FAR_FROM_0:
                lower(logs, box, best)
                lowered += best
    return lowered


@leaf_kernel
def weigh_by_reads(logs, box, low_x, low_y, cell, poses, ellipses, ratio, most, best, counts, tops, places):
    """Weigh by reads of antennas at `poses` (m, 3), `ellipses` (m, 4) the lengths and logarithms of each.

    Parameters
    ----------
    most : a sum of logarithms up to which sums are exact; before the largest passes it, all are lowered.
    best : the largest logarithm so far.
    counts, tops : (n,) int32 and float32, room.
    places : (m, 2) receives where the peak is after each read [cells from the middle]; none asked for if it is empty.

    Returns
    -------
    The largest logarithm after all reads may be at most this, and how far all were lowered.
    """
    lowered = 0.0
    for k in range(poses.shape[0]):
        inner_add, outer_add = ellipses[k, 1], ellipses[k, 3]
        if best + max(inner_add, outer_add) > most:
            best = largest(logs, box, tops)
            lower(logs, box, best)
            lowered += best
            best = 0.0
        weigh_by_ellipses(
            logs, low_x, low_y, cell, poses[k, 0], poses[k, 1], poses[k, 2], ellipses[k, 0], inner_add, ellipses[k, 2],
            outer_add, ratio,
        )  # fmt: skip
        best += max(inner_add, outer_add)
        if places.shape[0] > 0:
            _, places[k, 0], places[k, 1] = peak(logs, box, largest(logs, box, tops), counts)
    return best, lowered
