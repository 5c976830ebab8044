"""What the wheels and the readers of a driving robot report: odometry with noise, polls and reads."""

import numpy as np
from numba import njit

from rfiddesign.models._math_kernels import sin_cos_64
from rfiddesign.models._noise_kernels import (
    STREAM_INSTALLATION,
    STREAM_ODOMETRY,
    STREAM_READS,
    key_halves,
    random_bits,
    standard_normal,
    step_key,
    unit_uniform,
)

_U = np.uint32
# No draw of `standard_normal` lies further out.
_FARTHEST_SIGMA = 5.5


@njit(cache=True, nogil=True)
def record_odometry(key, poses, deviations, odometry):
    """Motion between successive poses in the robot's frame, plus white noise."""
    n = odometry.shape[0]
    for t in range(n):
        low, high = key_halves(step_key(key, STREAM_ODOMETRY, t))
        s, c = sin_cos_64(poses[t, 2])
        dx = poses[t + 1, 0] - poses[t, 0]
        dy = poses[t + 1, 1] - poses[t, 1]
        motion = (c * dx + s * dy, c * dy - s * dx, poses[t + 1, 2] - poses[t, 2])
        for axis in range(3):
            noise = deviations[axis] * standard_normal(random_bits(low, high, _U(axis)))
            odometry[t, axis] = motion[axis] + noise


@njit(inline="always", cache=True, nogil=True)
def read_chance(u, v, field):
    """Chance that a poll sees a tag at (u, v) in the antenna's frame."""
    table = field.table
    if table.shape[0] == 0:
        du = max(abs(u) - field.half_length_mm, 0.0)
        dv = max(abs(v) - field.half_width_mm, 0.0)
        d2 = du * du + dv * dv
        corner2 = field.corner_mm * field.corner_mm
        return 1.0 if d2 < corner2 or (corner2 == 0.0 and d2 == 0.0) else 0.0
    i = int(np.floor(u / field.cell_mm + 0.5 * table.shape[0]))
    j = int(np.floor(v / field.cell_mm + 0.5 * table.shape[1]))
    if i < 0 or j < 0 or i >= table.shape[0] or j >= table.shape[1]:
        return 0.0
    return table[i, j]


@njit(cache=True, nogil=True)
def poll(x, y, s, c, low, high, draw, field, grid, installation):
    """One poll of an antenna at (x, y) with sine and cosine (s, c) of its direction.

    Returns the row of the tag that answers (-1: none) and the next free draw.  Where several tags are in view, each
    is as likely as any other to answer (one tag per reader and poll).

    Parameters
    ----------
    low, high, draw : stream of the step and the next free draw in it.
    grid : (installed_x, installed_y, tag_id, cell_start, cell_mm, origin_x, origin_y, n_x, n_y) of a TagMap.
    installation : (sigma [mm] per axis of where a tag lies about its place in `grid`, the two halves of the key that
        fixes each tag's error).
    """
    tag_x, tag_y, tag_id, cell_start, cell, x0, y0, n_x, n_y = grid
    sigma, install_low, install_high = installation
    reach = field.reach_mm + _FARTHEST_SIGMA * sigma
    first_i = max(int(np.floor((x - reach - x0) / cell)), 0)
    last_i = min(int(np.floor((x + reach - x0) / cell)), n_x - 1)
    first_j = max(int(np.floor((y - reach - y0) / cell)), 0)
    last_j = min(int(np.floor((y + reach - y0) / cell)), n_y - 1)
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
                dy += sigma * standard_normal(random_bits(install_low, install_high, _U(number + _U(1))))
            chance = read_chance(c * dx + s * dy, c * dy - s * dx, field)
            if chance <= 0.0:
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


@njit(cache=True, nogil=True)
def record_reads(key, poses, dt, robot, world, field, grid, out):
    """Poll every antenna once per step along the true poses; returns the number of reads.

    Parameters
    ----------
    poses : (n_steps + 1, 3) true poses.
    robot : (antennas (n, 3), their poses in the robot's frame; phases (n,), the fraction of the step at which each
        polls).
    world : (read_probability, installation_error_mm).
    field : see `ReadField`.
    grid : see `poll`.
    out : (read_start (n_steps + 1,), read_antenna, read_row, read_age), the last three with room for
        n_steps * n entries.
    """
    antennas, phases = robot
    read_probability, sigma = world
    read_start, read_antenna, read_row, read_age = out
    install_low, install_high = key_halves(step_key(key, STREAM_INSTALLATION, 0))
    installation = (sigma, install_low, install_high)
    n_reads = 0
    n_antennas = antennas.shape[0]
    yaw_s = np.empty(n_antennas)
    yaw_c = np.empty(n_antennas)
    for a in range(n_antennas):
        yaw_s[a], yaw_c[a] = sin_cos_64(antennas[a, 2])
    read_start[0] = 0
    for t in range(poses.shape[0] - 1):
        low, high = key_halves(step_key(key, STREAM_READS, t))
        draw = 0
        phase = -1.0
        x = y = s = c = 0.0
        for a in range(n_antennas):
            if phases[a] != phase:
                phase = phases[a]
                x = poses[t, 0] + phase * (poses[t + 1, 0] - poses[t, 0])
                y = poses[t, 1] + phase * (poses[t + 1, 1] - poses[t, 1])
                s, c = sin_cos_64(poses[t, 2] + phase * (poses[t + 1, 2] - poses[t, 2]))
            antenna_x = x + c * antennas[a, 0] - s * antennas[a, 1]
            antenna_y = y + s * antennas[a, 0] + c * antennas[a, 1]
            sine, cosine = s * yaw_c[a] + c * yaw_s[a], c * yaw_c[a] - s * yaw_s[a]
            row, draw = poll(antenna_x, antenna_y, sine, cosine, low, high, draw, field, grid, installation)
            if row >= 0 and read_probability < 1.0:
                if unit_uniform(random_bits(low, high, _U(draw))) >= read_probability:
                    row = -1
                draw += 1
            if row >= 0:
                read_antenna[n_reads] = a
                read_row[n_reads] = row
                read_age[n_reads] = (1.0 - phases[a]) * dt
                n_reads += 1
        read_start[t + 1] = n_reads
    return n_reads


@njit(cache=True, nogil=True)
def pose_errors(true_poses, poses, first, last, position_error, heading_error):
    """Distance [mm] and absolute heading difference [rad] of steps first..last-1 between estimate and truth."""
    for t in range(first, last):
        dx = poses[t, 0] - true_poses[t, 0]
        dy = poses[t, 1] - true_poses[t, 1]
        position_error[t] = np.sqrt(dx * dx + dy * dy)
        turn = poses[t, 2] - true_poses[t, 2]
        turn -= 2.0 * np.pi * np.floor(turn / (2.0 * np.pi) + 0.5)
        heading_error[t] = abs(turn)
