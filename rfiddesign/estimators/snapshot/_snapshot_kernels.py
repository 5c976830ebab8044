"""Monte-Carlo localization by RFID snapshots (uhf_snapshots), compiled; see `_particle_kernels` for the particles.

A snapshot counts, for every tag, in how many of N cycles it was read.  Its likelihood (eqs. 8 and 9) is a product over
the tags that it read and over the likeliest of the others, k' in all.  Tags that a row of the table does not list
share one chance, so that the product is that of k' such tags, corrected for those that are listed.
"""

import math

import numpy as np

from rfiddesign.estimators._estimate_kernels import estimate
from rfiddesign.estimators._mcl_kernels import predict
from rfiddesign.estimators._particle_kernels import COSINE, HEADING, LOG, SINE, X, Y, resample
from rfiddesign.models._fingerprint_table_kernels import TAG_BITS, UNTRAINED
from rfiddesign.numerics import _lane_kernels as lanes
from rfiddesign.numerics._compile_kernels import kernel, leaf_kernel
from rfiddesign.numerics._math_kernels import binary_angle, exp_32, sin_cos_64
from rfiddesign.numerics._noise_kernels import (
    STREAM_INITIALIZE,
    fine_uniform,
    key_halves,
    random_bits,
    standard_normal,
    step_key,
)

_U = np.uint32
_TAG = (1 << TAG_BITS) - 1
# Log weight of what cannot be: less than any likelihood, and still a number when a few are added.
IMPOSSIBLE = np.float32(-1e30)


@leaf_kernel
def take_snapshot(row, start, tag, count, is_known, most, counts, by_count):
    """Write the snapshot of a row into `counts` (n_tags,); `by_count` (N + 1,) receives how many tags have each count.

    Tags that training does not know have count -1 for good.
    If more than `most` tags were read, those read most often are kept, of equally many reads the first ones.  Returns
    how many are kept.
    """
    by_count[:] = 0
    n = 0
    for k in range(start[row], start[row + 1]):
        if is_known[tag[k]]:
            by_count[count[k]] += 1
            n += 1
    # Of the counts from `least` on all are kept, of the one below as many as there is room for.
    left, least = most, by_count.shape[0]
    while least > 1 and by_count[least - 1] <= left:
        least -= 1
        left -= by_count[least]
    for f in range(1, least - 1):
        by_count[f] = 0
    if least > 1:
        by_count[least - 1] = left
    for k in range(start[row], start[row + 1]):
        if not is_known[tag[k]]:
            continue
        if count[k] >= least:
            counts[tag[k]] = count[k]
        elif count[k] == least - 1 and left > 0:
            counts[tag[k]] = count[k]
            left -= 1
    return min(n, most)


@leaf_kernel
def forget_snapshot(row, start, tag, counts):
    """Undo `take_snapshot`."""
    for k in range(start[row], start[row + 1]):
        counts[tag[k]] = min(counts[tag[k]], 0)


@leaf_kernel
def row_log(row, table, logs, counts, by_count, n_read, n_others):
    """Log likelihood of a snapshot by one row of the table; IMPOSSIBLE for an untrained row.

    Parameters
    ----------
    table : as in `FingerprintTable.compiled`.
    logs : (N_LEVELS, N + 1) float32: log of the binomial (eq. 4) by level and count.
    n_read, n_others : tags that were read, and those that were not, that count.
    """
    entry_start, entries, base = table[1], table[2], np.int64(table[3][row])
    if base == UNTRAINED:
        return IMPOSSIBLE
    unread = logs[base, 0]
    total = n_others * unread
    for f in range(1, by_count.shape[0]):
        total += by_count[f] * logs[base, f]
    for k in range(entry_start[row], entry_start[row + 1]):
        if n_read == 0 and n_others == 0:
            break
        level, f = entries[k] >> _U(TAG_BITS), counts[entries[k] & _U(_TAG)]
        if f > 0:
            total += logs[level, f] - logs[base, f]
            n_read -= 1
        elif f == 0 and n_others > 0:
            total += logs[level, 0] - unread
            n_others -= 1
    return np.float32(total)


@leaf_kernel
def weigh(n_particles, antenna, table, logs, counts, by_count, n_read, n_others, cloud):
    """Add the log likelihood of one antenna's snapshot to each particle's log weight (eq. 1).

    `antenna` (3,) is its pose on the robot.
    """
    cell_row, x0, y0, per_mm, n_headings = table[0], table[4], table[5], table[6], table[7]
    n_y, n_x = cell_row.shape
    # Half a step on, so that headings round to the nearest.
    ahead = _U(binary_angle(antenna[2] + math.pi / n_headings))
    for i in range(n_particles):
        s, c = cloud[SINE, i], cloud[COSINE, i]
        column = math.floor((cloud[X, i] + c * antenna[0] - s * antenna[1] - x0) * per_mm)
        line = math.floor((cloud[Y, i] + s * antenna[0] + c * antenna[1] - y0) * per_mm)
        cell = -1
        if 0 <= column < n_x and 0 <= line < n_y:
            cell = cell_row[line, column]
        if cell < 0:
            cloud[LOG, i] += IMPOSSIBLE
            continue
        angle = np.uint64(_U(_U(lanes.bits_of(cloud[HEADING, i])) + ahead))
        heading = np.int64((angle * np.uint64(n_headings)) >> np.uint64(32))
        row = cell * n_headings + heading
        cloud[LOG, i] += row_log(row, table, logs, counts, by_count, n_read, n_others)


@leaf_kernel
def keep_to_floor(n_particles, floor, cloud):
    """Give particles off the drivable floor the log weight of what cannot be."""
    is_drivable, x0, y0, per_mm = floor
    n_y, n_x = is_drivable.shape
    for i in range(n_particles):
        column, line = math.floor((cloud[X, i] - x0) * per_mm), math.floor((cloud[Y, i] - y0) * per_mm)
        if not (0 <= column < n_x and 0 <= line < n_y and is_drivable[line, column]):
            cloud[LOG, i] += IMPOSSIBLE


@leaf_kernel
def weigh_by_snapshots(n_particles, step, log, model, room, cloud):
    """Weigh the particles in the cloud by all antennas' snapshots of a step, and by the floor."""
    _, start, tag, count = log
    antennas, table, logs, is_known, most, n_known, floor, _ = model
    counts, by_count = room
    n_antennas = antennas.shape[0]
    keep_to_floor(n_particles, floor, cloud)
    for a in range(n_antennas):
        row = step * n_antennas + a
        n_read = take_snapshot(row, start, tag, count, is_known, most, counts, by_count)
        n_others = min(most, n_known) - n_read
        weigh(n_particles, antennas[a], table, logs, counts, by_count, n_read, n_others, cloud)
        forget_snapshot(row, start, tag, counts)


@kernel
def track(key, first, last, n_particles, log, model, arrays, room, estimates):
    """Run the filter over steps first..last-1 of a log; row t of `estimates` (n, N_ESTIMATE) is after step t.

    Parameters
    ----------
    log : (odometry (n, 3), start, tag, count): snapshots as sparse rows, row t n_antennas + a for antenna a at step t.
    model : (antennas (n_antennas, 3), table, logs, is_known (n_tags,), most tags that count (k'), number of known tags,
        floor, noise (3, 3) of the odometry as in `Motion.noise`); floor: (is_drivable (n, m), x0, y0, cells per mm).
    arrays : (drawn, headings, cloud), see `_particle_kernels`.
    room : (counts (n_tags,) int16, 0, or -1 for tags that training does not know; by_count (N + 1,) int64).
    """
    drawn, headings, cloud = arrays
    for step in range(first, last):
        predict(key, step, log[0], step, model[7], drawn, headings, cloud)
        weigh_by_snapshots(n_particles, step, log, model, room, cloud)
        total, _ = estimate(n_particles, cloud, estimates, step)
        resample(key, step, n_particles, total, False, cloud, drawn, headings)


@kernel
def weigh_poses(step, log, model, poses, room, out):
    """Log likelihood (n,) of the snapshots of a step at robot poses (n, 3); `IMPOSSIBLE` (or a multiple) if none."""
    _, start, tag, count = log
    antennas, table, logs, is_known, most, n_known, _, _ = model
    counts, by_count = room
    out[:] = 0.0
    cell_row, x0, y0, per_mm, n_headings = table[0], table[4], table[5], table[6], table[7]
    n_y, n_x = cell_row.shape
    n_antennas = antennas.shape[0]
    for a in range(n_antennas):
        row = step * n_antennas + a
        n_read = take_snapshot(row, start, tag, count, is_known, most, counts, by_count)
        n_others = min(most, n_known) - n_read
        for i in range(poses.shape[0]):
            s, c = sin_cos_64(poses[i, 2])
            column = math.floor((poses[i, 0] + c * antennas[a, 0] - s * antennas[a, 1] - x0) * per_mm)
            line = math.floor((poses[i, 1] + s * antennas[a, 0] + c * antennas[a, 1] - y0) * per_mm)
            turns = (poses[i, 2] + antennas[a, 2]) / (2.0 * math.pi) + 0.5 / n_headings
            heading = int((turns - math.floor(turns)) * n_headings) % n_headings
            cell = cell_row[line, column] if 0 <= column < n_x and 0 <= line < n_y else -1
            out[i] += (
                row_log(cell * n_headings + heading, table, logs, counts, by_count, n_read, n_others)
                if cell >= 0
                else IMPOSSIBLE
            )
        forget_snapshot(row, start, tag, counts)


@kernel
def draw_poses(key, logs, poses, noise, drawn, headings, n_particles):
    """Draw particles from poses (n, 3) in proportion to their likelihoods, systematically, and scatter each.

    `noise` are the standard deviations by axis [mm] and of the heading [rad].  False, and nothing is drawn, if no pose
    is possible.
    """
    best = logs.max()
    if best <= IMPOSSIBLE:
        return False
    total = 0.0
    for i in range(logs.shape[0]):
        total += np.float64(exp_32(np.float32(max(logs[i] - best, np.float32(-80.0)))))
    low, high = key_halves(step_key(key, STREAM_INITIALIZE, 0))
    at, i = fine_uniform(random_bits(low, high, _U(0))) * total / n_particles, 0
    end = np.float64(exp_32(np.float32(max(logs[0] - best, np.float32(-80.0)))))
    for k in range(n_particles):
        while end < at and i < logs.shape[0] - 1:
            i += 1
            end += np.float64(exp_32(np.float32(max(logs[i] - best, np.float32(-80.0)))))
        drawn[0, k] = poses[i, 0] + noise[0] * standard_normal(random_bits(low, high, _U(3 * k + 1)))
        drawn[1, k] = poses[i, 1] + noise[0] * standard_normal(random_bits(low, high, _U(3 * k + 2)))
        headings[k] = binary_angle(poses[i, 2] + noise[1] * standard_normal(random_bits(low, high, _U(3 * k + 3))))
        at += total / n_particles
    return True
