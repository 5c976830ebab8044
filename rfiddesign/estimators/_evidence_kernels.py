"""What one step tells a particle filter, in rows: tags that were read, and tags that were in reach and were not."""

import numpy as np

from rfiddesign.estimators._particle_kernels import HEADING, X, Y
from rfiddesign.numerics import _lane_kernels as lanes
from rfiddesign.numerics._compile_kernels import kernel, leaf_kernel
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
def _extent(cloud, n_particles):
    """Middle (x, y), half diagonal, and half the spread of the headings [rad] of a cloud, and its middle heading."""
    low_x = high_x = cloud[X, 0]
    low_y = high_y = cloud[Y, 0]
    first = lanes.bits_of(cloud[HEADING, 0])
    low_turn = high_turn = np.int64(0)
    for m in range(n_particles):
        low_x, high_x = min(low_x, cloud[X, m]), max(high_x, cloud[X, m])
        low_y, high_y = min(low_y, cloud[Y, m]), max(high_y, cloud[Y, m])
        turn = np.int64(np.int32(lanes.bits_of(cloud[HEADING, m]) - first))
        low_turn, high_turn = min(low_turn, turn), max(high_turn, turn)
    half_x, half_y = 0.5 * (high_x - low_x), 0.5 * (high_y - low_y)
    heading = (np.float64(first) + 0.5 * np.float64(low_turn + high_turn)) * RADIANS_PER_BINARY_UNIT
    spread = 0.5 * np.float64(high_turn - low_turn) * RADIANS_PER_BINARY_UNIT
    return low_x + half_x, low_y + half_y, np.sqrt(half_x * half_x + half_y * half_y), spread, heading


@kernel
def gather_nothing_seen(step, t, n_reads, log, model, tags, cloud, reads):
    """Append to the rows the tags near an antenna that polled in this step and did not read them; returns all rows.

    An antenna that answers with one tag says nothing of the others once it has read one.  Nothing is said of tags in
    reach of no particle, nor by antennas whose place is too vague: leaving evidence out by a rule that does not look at
    it harms no filter.

    Parameters
    ----------
    model : as in `_mcl_kernels.track`; its looks: (uses_rssi, learns from nothing seen, reader answers with all tags,
        slots (n,), phases (n,), period of its schedule, reach of the tables [mm], number of the table for tags not
        read).
    """
    n_particles, positions, whitening = model[0], model[1], model[2]
    is_age_compensated, delay = model[6]
    _, _, is_inventory, slots, phases, period, reach, table_number = model[7]
    odometry, read_start, read_antenna, read_tags = log[0], log[1], log[2], log[3]
    tag_x, tag_y, cell_start, per_cell, x0, y0, n_x, n_y = tags
    mid_x, mid_y, radius, spread, heading = _extent(cloud, n_particles)
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
