"""One poll of an antenna: which of the tags in its field answer."""

import numpy as np

from rfiddesign.numerics._compile_kernels import inline_kernel, leaf_kernel
from rfiddesign.numerics._noise_kernels import fine_uniform, random_bits, standard_normal, unit_uniform

_U = np.uint32
# No draw of `standard_normal` lies further out.
FARTHEST_SIGMA = 6.4


@inline_kernel
def read_chance(u, v, box, table):
    """Chance that a poll sees a tag at (u, v) in the antenna's frame; `box` and `table` as in `poll`."""
    half_length, half_width, corner, _, cell = box
    if table.shape[0] == 0:
        du = max(abs(u) - half_length, 0.0)
        dv = max(abs(v) - half_width, 0.0)
        d2 = du * du + dv * dv
        corner2 = corner * corner
        return 1.0 if d2 < corner2 or (corner2 == 0.0 and d2 == 0.0) else 0.0
    i = int(np.floor(u / cell + 0.5 * table.shape[0]))
    j = int(np.floor(v / cell + 0.5 * table.shape[1]))
    if i < 0 or j < 0 or i >= table.shape[0] or j >= table.shape[1]:
        return 0.0
    return table[i, j]


@inline_kernel
def is_dead(tag, dead):
    """Whether the tag of an id never answers; `dead` as in `poll`."""
    share, dead_low, dead_high = dead
    return share > 0.0 and fine_uniform(random_bits(dead_low, dead_high, _U(tag))) < share


@leaf_kernel
def poll(x, y, s, c, low, high, draw, box, table, tag_x, tag_y, tag_id, cell_start, grid, installation, dead):
    """One poll of an antenna at (x, y) with sine and cosine (s, c) of its direction.

    Returns the row of the tag that answers (-1: none) and the next free draw.  Where several tags are in view, each
    is as likely as any other to answer (one tag per reader and poll).

    Parameters
    ----------
    low, high, draw : stream of the step and the next free draw in it.
    box, table : (half_length, half_width, corner, reach, cell) and table of a `ReadField`.
    tag_x, tag_y, tag_id, cell_start : arrays of a TagMap (installed positions).  They and `table` come one by one: an
        array taken out of a tuple is counted as in use, which costs more than the poll.
    grid : (1 / cell_mm, origin_x, origin_y, n_x, n_y) of the TagMap.
    installation : (sigma [mm] per axis of where a tag lies about its place in `grid`, the two halves of the key that
        fixes each tag's error).
    dead : (share of the tags that never answer, the two halves of the key that fixes which).
    """
    n_x, field_reach = grid[3], box[3]
    sigma, install_low, install_high = installation
    reach = field_reach + FARTHEST_SIGMA * sigma
    first_i, last_i, first_j, last_j = cells_about(x, y, reach, grid)
    chosen = -1
    n_seen = 0
    if first_i > last_i:
        return chosen, draw
    for j in range(first_j, last_j + 1):
        for row in range(cell_start[j * n_x + first_i], cell_start[j * n_x + last_i + 1]):
            dx, dy = tag_x[row] - x, tag_y[row] - y
            if dx * dx + dy * dy > reach * reach:
                continue
            if sigma > 0.0:
                number = _U(2 * tag_id[row])
                dx += sigma * standard_normal(random_bits(install_low, install_high, number))
                if abs(dx) > field_reach:
                    continue
                dy += sigma * standard_normal(random_bits(install_low, install_high, _U(number + _U(1))))
            chance = read_chance(c * dx + s * dy, c * dy - s * dx, box, table)
            if chance <= 0.0 or is_dead(tag_id[row], dead):
                continue
            if chance < 1.0:
                is_read = unit_uniform(random_bits(low, high, _U(draw))) < chance
                draw += 1
                if not is_read:
                    continue
            n_seen += 1
            if n_seen > 1:
                is_replaced = unit_uniform(random_bits(low, high, _U(draw))) * n_seen < 1.0
                draw += 1
                if not is_replaced:
                    continue
            chosen = row
    return chosen, draw


@leaf_kernel
def poll_all(
    x, y, s, c, low, high, draw, box, table, tag_x, tag_y, tag_id, cell_start, grid, installation, dead, chance_to_read,
    rows,
):  # fmt: skip
    """As `poll`, but all tags in view answer, each read with `chance_to_read`: their rows go to `rows`.

    Returns how many were read, at most the length of `rows`, and the next free draw.
    """
    n_x, field_reach = grid[3], box[3]
    sigma = installation[0]
    reach = field_reach + FARTHEST_SIGMA * sigma
    first_i, last_i, first_j, last_j = cells_about(x, y, reach, grid)
    n_read = 0
    if first_i > last_i:
        return n_read, draw
    for j in range(first_j, last_j + 1):
        for row in range(cell_start[j * n_x + first_i], cell_start[j * n_x + last_i + 1]):
            u, v = offset_of(row, x, y, s, c, tag_x, tag_y, tag_id, installation)
            if abs(u) > field_reach or abs(v) > field_reach:
                continue
            chance = read_chance(u, v, box, table) * chance_to_read
            if chance <= 0.0 or is_dead(tag_id[row], dead):
                continue
            if chance < 1.0:
                is_read = unit_uniform(random_bits(low, high, _U(draw))) < chance
                draw += 1
                if not is_read:
                    continue
            if n_read < rows.shape[0]:
                rows[n_read] = row
                n_read += 1
    return n_read, draw


@leaf_kernel
def those_in_view(antenna, rows, n, box, table, tag_x, tag_y, tag_id, installation):
    """Keep of the first n rows those of tags in view of an antenna, as `antenna_at` has it; returns how many."""
    x, y, s, c = antenna
    n_kept = 0
    for i in range(n):
        u, v = offset_of(rows[i], x, y, s, c, tag_x, tag_y, tag_id, installation)
        if read_chance(u, v, box, table) > 0.0:
            rows[n_kept] = rows[i]
            n_kept += 1
    return n_kept


@inline_kernel
def cells_about(x, y, reach, grid):
    """First and last column and row of the map's cells within `reach` of a point; first > last: there are none."""
    per_cell, x0, y0, n_x, n_y = grid
    # A hair more than the reach, so that the rounding of the reciprocal cannot lose a cell.
    column, line, span = (x - x0) * per_cell, (y - y0) * per_cell, reach * per_cell + 1e-6
    first_i = max(int(np.floor(column - span)), 0)
    last_i = min(int(np.floor(column + span)), n_x - 1)
    first_j = max(int(np.floor(line - span)), 0)
    last_j = min(int(np.floor(line + span)), n_y - 1)
    return first_i, last_i, first_j, last_j


@inline_kernel
def offset_of(row, x, y, s, c, tag_x, tag_y, tag_id, installation):
    """Where the tag of a row lies in the frame of an antenna at (x, y), as in `poll`."""
    sigma, install_low, install_high = installation
    dx, dy = tag_x[row] - x, tag_y[row] - y
    if sigma > 0.0:
        number = _U(2 * tag_id[row])
        dx += sigma * standard_normal(random_bits(install_low, install_high, number))
        dy += sigma * standard_normal(random_bits(install_low, install_high, _U(number + _U(1))))
    return c * dx + s * dy, c * dy - s * dx


@inline_kernel
def rssi_of(u, v, radii):
    """Step of RSSI of a tag at (u, v) in the antenna's frame; -1: the reader tells none."""
    distance, step = np.sqrt(u * u + v * v), -1
    for k in range(radii.shape[0]):
        if distance < radii[k] or k == 0:
            step = k
    return step
