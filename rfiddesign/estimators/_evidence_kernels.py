"""What one step tells a particle filter, in rows: tags that were read, and tags that were in reach and were not."""

import numpy as np

from rfiddesign.numerics._compile_kernels import kernel, leaf_kernel
from rfiddesign.numerics._math_kernels import sin_cos_64

_F = np.float32
# Columns: the tag on the map, its antenna on the robot when it polled, whitening by rows, number of the table.
N_READ = 9
# Tags near one poll that are looked at; where there are more, the belief is too vague to learn from them.
MOST_UNREAD = 32
# An antenna's place is known to so many sigmas, and not at all beyond so many reaches of it.
SIGMAS = 4.0
MOST_REACHES = 50.0
# Particles that turn more than this (one sigma) are too few per place of an antenna: what was not read would leave of
# them those that happen to lie well, not those that face right [rad].
_MOST_TURN = 0.4


@kernel
def room_for_evidence(log, first, last, model):
    """Rows that any step from `first` to `last` - 1 needs."""
    read_start, n_most = log[1], 0
    for t in range(first, last):
        n_most = max(n_most, read_start[t + 1] - read_start[t])
    if model[7][1]:
        n_most += model[1].shape[0] * MOST_UNREAD
    return n_most


@leaf_kernel
def antenna_then(x, y, back, forward, sideways, turn):
    """Where an antenna at (x, y) on the robot was the share `back` of a step ago, in the robot's frame of now.

    The robot's motion over the step is (forward, sideways, turn) in its frame at the begin, driven and turned at
    constant rates.
    """
    s_end, c_end = sin_cos_64(turn)
    s, c = sin_cos_64(back * turn)
    behind_x, behind_y = back * forward, back * sideways
    return (
        c * x + s * y - (c_end * behind_x + s_end * behind_y),
        c * y - s * x - (c_end * behind_y - s_end * behind_x),
    )


@leaf_kernel
def gather(
    t, odometry, read_start, read_antenna, read_tags, read_age, read_rssi, dt, positions, whitening, is_age_compensated,
    delay, n_rssi, reads,
):  # fmt: skip
    """The reads of step t as rows; `n_rssi` is how many steps of RSSI have a table, a stronger signal has the last."""
    for row in range(read_start[t], read_start[t + 1]):
        antenna, k = read_antenna[row], row - read_start[t]
        x, y = positions[antenna, 0], positions[antenna, 1]
        back = read_age[row] / dt + delay
        if is_age_compensated and back > 0.0:
            x, y = antenna_then(x, y, back, odometry[t, 0], odometry[t, 1], odometry[t, 2])
        reads[k, 0], reads[k, 1], reads[k, 2], reads[k, 3] = read_tags[row, 0], read_tags[row, 1], x, y
        reads[k, 4], reads[k, 5] = whitening[antenna, 0, 0], whitening[antenna, 0, 1]
        reads[k, 6], reads[k, 7] = whitening[antenna, 1, 0], whitening[antenna, 1, 1]
        reads[k, 8] = _F(min(max(read_rssi[row] + 1, 0), n_rssi))


@leaf_kernel
def _whereabouts(about, x, y):
    """Mean place of an antenna that is at (x, y) on the robot, and the radius about it that all but few places lie in.

    With H = [I, J R (x, y)] its covariance is H P H'.
    """
    s, c = sin_cos_64(about[0, 2])
    ahead_x, ahead_y = c * x - s * y, s * x + c * y
    xh, yh, hh = about[0, 6], about[0, 7], about[0, 8]
    xx = about[0, 3] + ahead_y * (ahead_y * hh - 2.0 * xh)
    xy = about[0, 4] + ahead_x * xh - ahead_y * yh - ahead_x * ahead_y * hh
    yy = about[0, 5] + ahead_x * (ahead_x * hh + 2.0 * yh)
    half = 0.5 * (xx - yy)
    widest = max(0.5 * (xx + yy) + np.sqrt(half * half + xy * xy), 0.0)
    return about[0, 0] + ahead_x, about[0, 1] + ahead_y, SIGMAS * np.sqrt(widest)


@leaf_kernel
def gather_nothing_seen(
    step, t, odometry, read_start, read_antenna, read_tags, positions, whitening, slots, phases, period, ages,
    is_inventory, reach, table_number, tag_x, tag_y, cell_start, grid, about, reads,
):  # fmt: skip
    """Append to the rows the tags near an antenna that polled in this step and did not read them; returns all rows.

    An antenna that answers with one tag says nothing of the others once it has read one.  Nothing is said of tags
    that next to no particle reaches, nor by antennas whose place is too vague: leaving evidence out by a rule that does
    not look at it harms no filter.

    Parameters
    ----------
    slots, phases, period : schedule of the antennas, see `Schedule`.
    ages : (is_age_compensated, delay of reads in steps).
    is_inventory : whether all tags in view answer.
    reach : distance beyond which a tag not read says nothing [mm].
    table_number : table for tags not read.
    about : moments of the belief before the step's evidence, see `_regularize_kernels`.
    grid : (1 / cell_mm, origin_x, origin_y, n_x, n_y) of the map.
    """
    is_age_compensated, delay = ages
    per_cell, x0, y0, n_x, n_y = grid
    n_reads = read_start[t + 1] - read_start[t]
    if about[0, 8] > _MOST_TURN * _MOST_TURN:
        return n_reads
    n = n_reads
    for a in range(positions.shape[0]):
        if period > 1 and step % period != slots[a]:
            continue
        has_read = False
        for row in range(read_start[t], read_start[t + 1]):
            has_read = has_read or read_antenna[row] == a
        if has_read and not is_inventory:
            continue
        x, y = positions[a, 0], positions[a, 1]
        back = 1.0 - phases[a] + delay
        if is_age_compensated and back > 0.0:
            x, y = antenna_then(x, y, back, odometry[t, 0], odometry[t, 1], odometry[t, 2])
        at_x, at_y, around = _whereabouts(about, x, y)
        far = reach + around
        if not far <= MOST_REACHES * reach:
            continue
        column, line, span = (at_x - x0) * per_cell, (at_y - y0) * per_cell, far * per_cell + 1e-6
        first_i, last_i = max(int(np.floor(column - span)), 0), min(int(np.floor(column + span)), n_x - 1)
        first_j, last_j = max(int(np.floor(line - span)), 0), min(int(np.floor(line + span)), n_y - 1)
        begin, n_near = n, 0
        for j in range(first_j, last_j + 1):
            if first_i > last_i or n_near > MOST_UNREAD:
                break
            for row in range(cell_start[j * n_x + first_i], cell_start[j * n_x + last_i + 1]):
                dx, dy = tag_x[row] - at_x, tag_y[row] - at_y
                if dx * dx + dy * dy > far * far:
                    continue
                n_near += 1
                if n_near > MOST_UNREAD:
                    break
                is_read = False
                if has_read:
                    for k in range(read_start[t], read_start[t + 1]):
                        # The map is in single precision.
                        is_same = _F(read_tags[k, 0]) == tag_x[row] and _F(read_tags[k, 1]) == tag_y[row]
                        is_read = is_read or (read_antenna[k] == a and is_same)
                if is_read:
                    continue
                reads[n, 0], reads[n, 1], reads[n, 2], reads[n, 3] = tag_x[row], tag_y[row], x, y
                reads[n, 4], reads[n, 5] = whitening[a, 0, 0], whitening[a, 0, 1]
                reads[n, 6], reads[n, 7] = whitening[a, 1, 0], whitening[a, 1, 1]
                reads[n, 8] = _F(table_number)
                n += 1
        if n_near > MOST_UNREAD:
            n = begin
    return n
