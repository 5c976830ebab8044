"""What one step tells a particle filter, in rows: tags that were read, and tags that were in reach and were not."""

import numpy as np

from rfiddesign.estimators._particle_kernels import HEADING, X, Y
from rfiddesign.numerics import _lane_kernels as lanes
from rfiddesign.numerics._compile_kernels import kernel, leaf_kernel
from rfiddesign.numerics._lane_kernels import LANES
from rfiddesign.numerics._math_kernels import RADIANS_PER_BINARY_UNIT, sin_cos_64

_F = np.float32
# Columns: the tag on the map, its antenna on the robot when it polled, whitening by rows, number of the table.
N_READ = 9
# Tags not read by one poll that are looked at; where there may be more, the belief is too vague to learn from them.
MOST_UNREAD = 8


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
def _extent(cloud):
    """Middle (x, y) and radius of a cloud, half the spread of its headings [rad], and its middle heading."""
    width = cloud.shape[1]
    first = lanes.bits_of(cloud[HEADING, 0])
    low_x = high_x = lanes.copies(cloud[X, 0])
    low_y = high_y = lanes.copies(cloud[Y, 0])
    low_turn = high_turn = lanes.copies(_F(0.0))
    # Lanes beyond the last particle are copies of particles.
    for i in range(0, width, LANES):
        x, y = lanes.load(cloud, X * width + i), lanes.load(cloud, Y * width + i)
        turn = lanes.to_float(lanes.subtract(lanes.bits_of(lanes.load(cloud, HEADING * width + i)), first))
        low_x, high_x = lanes.lesser(low_x, x), lanes.greater(high_x, x)
        low_y, high_y = lanes.lesser(low_y, y), lanes.greater(high_y, y)
        low_turn, high_turn = lanes.lesser(low_turn, turn), lanes.greater(high_turn, turn)
    zero = lanes.copies(_F(0.0))
    left, right = lanes.least(low_x), -lanes.least(zero - high_x)
    bottom, top = lanes.least(low_y), -lanes.least(zero - high_y)
    begin, end = np.float64(lanes.least(low_turn)), -np.float64(lanes.least(zero - high_turn))
    mid_x, mid_y = _F(0.5) * (left + right), _F(0.5) * (bottom + top)
    farthest = lanes.copies(_F(0.0))
    for i in range(0, width, LANES):
        dx, dy = lanes.load(cloud, X * width + i) - mid_x, lanes.load(cloud, Y * width + i) - mid_y
        farthest = lanes.greater(farthest, lanes.fma(dx, dx, dy * dy))
    radius = np.sqrt(np.float64(-lanes.least(zero - farthest)))
    heading = (np.float64(first) + 0.5 * (begin + end)) * RADIANS_PER_BINARY_UNIT
    spread = 0.5 * (end - begin) * RADIANS_PER_BINARY_UNIT
    return np.float64(mid_x), np.float64(mid_y), radius, spread, heading


@leaf_kernel
def gather_nothing_seen(
    step, t, odometry, read_start, read_antenna, read_tags, positions, whitening, slots, phases, period, ages,
    is_inventory, reach, table_number, tag_x, tag_y, cell_start, grid, cloud, reads,
):  # fmt: skip
    """Append to the rows the tags near an antenna that polled in this step and did not read them; returns all rows.

    An antenna that answers with one tag says nothing of the others once it has read one.  Nothing is said of tags in
    reach of no particle, nor by antennas whose place is too vague: leaving evidence out by a rule that does not look at
    it harms no filter.

    Parameters
    ----------
    slots, phases, period : schedule of the antennas, see `Schedule`.
    ages : (is_age_compensated, delay of reads in steps).
    is_inventory : whether all tags in view answer.
    reach : distance beyond which a tag not read says nothing [mm].
    table_number : table for tags not read.
    grid : (1 / cell_mm, origin_x, origin_y, n_x, n_y) of the map.
    """
    is_age_compensated, delay = ages
    per_cell, x0, y0, n_x, n_y = grid
    n_reads = read_start[t + 1] - read_start[t]
    mid_x, mid_y, radius, spread, heading = _extent(cloud)
    if radius > 2.0 * reach or spread > 0.5:
        return n_reads
    s, c = sin_cos_64(heading)
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
        at_x, at_y = mid_x + c * x - s * y, mid_y + s * x + c * y
        far = reach + radius + spread * np.sqrt(x * x + y * y)
        column, line, span = (at_x - x0) * per_cell, (at_y - y0) * per_cell, far * per_cell + 1e-6
        first_i, last_i = max(int(np.floor(column - span)), 0), min(int(np.floor(column + span)), n_x - 1)
        first_j, last_j = max(int(np.floor(line - span)), 0), min(int(np.floor(line + span)), n_y - 1)
        begin = n
        for j in range(first_j, last_j + 1):
            if first_i > last_i:
                break
            for row in range(cell_start[j * n_x + first_i], cell_start[j * n_x + last_i + 1]):
                dx, dy = tag_x[row] - at_x, tag_y[row] - at_y
                if dx * dx + dy * dy > far * far:
                    continue
                is_read = False
                if has_read:
                    for k in range(read_start[t], read_start[t + 1]):
                        # The map is in single precision.
                        is_same = _F(read_tags[k, 0]) == tag_x[row] and _F(read_tags[k, 1]) == tag_y[row]
                        is_read = is_read or (read_antenna[k] == a and is_same)
                if is_read:
                    continue
                if n - begin < MOST_UNREAD:
                    reads[n, 0], reads[n, 1], reads[n, 2], reads[n, 3] = tag_x[row], tag_y[row], x, y
                    reads[n, 4], reads[n, 5] = whitening[a, 0, 0], whitening[a, 0, 1]
                    reads[n, 6], reads[n, 7] = whitening[a, 1, 0], whitening[a, 1, 1]
                    reads[n, 8] = _F(table_number)
                n += 1
        if n - begin > MOST_UNREAD:
            n = begin
    return n
