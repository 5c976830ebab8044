"""What the wheels and the readers of a driving robot report: odometry with noise, polls and reads."""

import numpy as np

from rfiddesign.models._motion_kernels import step_deviations
from rfiddesign.models.reads import MOST_ANSWERS
from rfiddesign.numerics import _lane_kernels as lanes
from rfiddesign.numerics._compile_kernels import inline_kernel, kernel, leaf_kernel
from rfiddesign.numerics._lane_kernels import LANES, fma
from rfiddesign.numerics._math_kernels import binary_angle, sin_cos, sin_cos_64, small_binary_angle
from rfiddesign.numerics._noise_kernels import (
    STREAM_INSTALLATION,
    STREAM_ODOMETRY,
    STREAM_READS,
    STREAM_SLIP,
    fine_uniform,
    key_halves,
    random_bits,
    random_triple,
    standard_normal,
    step_key,
    unit_uniform,
)

_U = np.uint32
# No draw of `standard_normal` lies further out.
_FARTHEST_SIGMA = 6.4
# More than what single precision moves a tag on a floor of 5 km.
_TAG_ROUNDING_MM = 1.0
_F = np.float32


@kernel
def record_odometry(key, poses, wheels, odometry):
    """Motion between successive poses in the robot's frame, plus noise and faults.

    `wheels` : (noise (3, 3) as in `Motion.noise`, faults as in `OdometryFaults.compiled`).
    """
    noise, faults = wheels
    scale_x, scale_y, drift, slips, slip_mm, slip_rad = faults
    n = odometry.shape[0]
    for t in range(n):
        low, high = key_halves(step_key(key, STREAM_ODOMETRY, t))
        for_x, for_y, for_heading = random_triple(low, high, _U(0))
        s, c = sin_cos_64(poses[t, 2])
        dx = poses[t + 1, 0] - poses[t, 0]
        dy = poses[t + 1, 1] - poses[t, 1]
        forward, sideways, turn = c * dx + s * dy, c * dy - s * dx, poses[t + 1, 2] - poses[t, 2]
        deviation_x, deviation_y, deviation_heading = step_deviations(noise, forward, sideways, turn)
        way = np.sqrt(forward * forward + sideways * sideways)
        slipped_ahead = slipped_turn = 0.0
        if slips > 0.0 and way > 0.0:
            low, high = key_halves(step_key(key, STREAM_SLIP, t))
            if fine_uniform(random_bits(low, high, _U(0))) < slips * way:
                # A wheel that slips turns more than the floor passes under it.
                slipped_ahead = abs(slip_mm * standard_normal(random_bits(low, high, _U(1)))) / way
                slipped_turn = slip_rad * standard_normal(random_bits(low, high, _U(2)))
        noise_x = deviation_x * standard_normal(for_x)
        noise_y = deviation_y * standard_normal(for_y)
        odometry[t, 0] = forward + noise_x + (scale_x + slipped_ahead) * forward
        odometry[t, 1] = sideways + noise_y + (scale_y + slipped_ahead) * sideways
        odometry[t, 2] = turn + deviation_heading * standard_normal(for_heading) + (drift * way + slipped_turn)


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


@leaf_kernel
def poll(x, y, s, c, low, high, draw, box, table, tag_x, tag_y, tag_id, cell_start, grid, installation):
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
    """
    n_x, field_reach = grid[3], box[3]
    sigma, install_low, install_high = installation
    reach = field_reach + _FARTHEST_SIGMA * sigma
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


@leaf_kernel
def poll_all(
    x, y, s, c, low, high, draw, box, table, tag_x, tag_y, tag_id, cell_start, grid, installation, chance_to_read, rows
):
    """As `poll`, but all tags in view answer, each read with `chance_to_read`: their rows go to `rows`.

    Returns how many were read, at most the length of `rows`, and the next free draw.
    """
    n_x, field_reach = grid[3], box[3]
    sigma = installation[0]
    reach = field_reach + _FARTHEST_SIGMA * sigma
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
            if chance <= 0.0:
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
def _those_in_view(antenna, rows, n, box, table, tag_x, tag_y, tag_id, installation):
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
def pose_then(poses, t, phase, lag):
    """True pose at the fraction `phase` of step t, less `lag` steps: x, y, sine and cosine of the heading."""
    if lag > 0.0:
        # Before the first pose the robot stood.
        time = max(t + phase - lag, 0.0)
        t = min(int(np.floor(time)), poses.shape[0] - 2)
        phase = time - t
    s, c = sin_cos_64(poses[t, 2] + phase * (poses[t + 1, 2] - poses[t, 2]))
    return (
        poses[t, 0] + phase * (poses[t + 1, 0] - poses[t, 0]),
        poses[t, 1] + phase * (poses[t + 1, 1] - poses[t, 1]),
        s,
        c,
    )


@inline_kernel
def antenna_at(pose, antennas, yaws, a):
    """Place of antenna a, and sine and cosine of its direction, on a robot at `pose` as `pose_then` has it."""
    x, y, s, c = pose
    return (
        x + c * antennas[a, 0] - s * antennas[a, 1],
        y + s * antennas[a, 0] + c * antennas[a, 1],
        s * yaws[a, 1] + c * yaws[a, 0],
        c * yaws[a, 1] - s * yaws[a, 0],
    )


@inline_kernel
def rssi_of(u, v, radii):
    """Step of RSSI of a tag at (u, v) in the antenna's frame; -1: the reader tells none."""
    distance, step = np.sqrt(u * u + v * v), -1
    for k in range(radii.shape[0]):
        if distance < radii[k] or k == 0:
            step = k
    return step


@kernel
def _rough_copy(antennas, phases):
    """x, y and phase of the antennas in single precision, filled up to whole groups of LANES."""
    n = antennas.shape[0]
    rough = np.zeros((3, -(-n // LANES) * LANES), np.float32)
    for a in range(n):
        rough[0, a], rough[1, a], rough[2, a] = antennas[a, 0], antennas[a, 1], phases[a]
    return rough


@leaf_kernel
def _near_tags(poses, t, rough, n_antennas, lattice, bounds, near):
    """Which antennas may have a tag in reach when they poll in step t: all whose place in the lattice is near a point.

    Writes their numbers in rising order to `near` and returns how many; in single precision, which `bounds`, in steps
    of the lattice, must allow for.
    """
    origin_x, origin_y, b00, b01, b10, b11 = lattice
    x, y = poses[t, 0] - origin_x, poses[t, 1] - origin_y
    i, j = b00 * x + b01 * y, b10 * x + b11 * y
    # Whole steps are left out before they cost digits.
    i, j = _F(i - np.floor(i + 0.5)), _F(j - np.floor(j + 0.5))
    dx, dy = _F(poses[t + 1, 0] - poses[t, 0]), _F(poses[t + 1, 1] - poses[t, 1])
    turn, heading = _F(poses[t + 1, 2] - poses[t, 2]), binary_angle(poses[t, 2])
    b00, b01, b10, b11 = _F(b00), _F(b01), _F(b10), _F(b11)
    is_spinning = abs(turn) > _F(3.0)
    width, n_near = rough.shape[1], 0
    for a in range(0, width, LANES):
        numbers = lanes.count_up(np.int32(a))
        is_near = lanes.is_at_least(np.int32(n_antennas - 1), numbers)
        if not is_spinning:
            ax, ay, phase = lanes.load(rough, a), lanes.load(rough, width + a), lanes.load(rough, 2 * width + a)
            s, c = sin_cos(lanes.add(small_binary_angle(phase * turn), heading))
            u, v = fma(c, ax, fma(-s, ay, phase * dx)), fma(s, ax, fma(c, ay, phase * dy))
            steps_i, steps_j = fma(u, b00, fma(v, b01, i)), fma(u, b10, fma(v, b11, j))
            off_i = lanes.size(steps_i - lanes.whole_part(steps_i + _F(0.5)))
            off_j = lanes.size(steps_j - lanes.whole_part(steps_j + _F(0.5)))
            is_near = lanes.both(is_near, lanes.both(off_i < bounds[0], off_j < bounds[1]))
        lanes.store_chosen(near, n_near, numbers, is_near)
        n_near += lanes.how_many(is_near)
    return n_near


@kernel
def record_reads(key, poses, first, last, dt, robot, world, field, tags, lattice, out):
    """Poll every antenna once in each of the steps first..last-1 along the true poses; returns the number of reads.

    Parameters
    ----------
    poses : (n_steps + 1, 3) true poses.
    robot : (antennas (n, 3), their poses in the robot's frame; phases (n,), the fraction of the step at which each
        polls; slots (n,) and period, see `Schedule`).
    world : (read_probability, installation_error_mm; read time and delay in steps; how many tags answer at most).
    field : see `ReadField`.
    tags : (installed_x, installed_y, tag_id, cell_start, 1 / cell_mm, origin_x, origin_y, n_x, n_y) of a TagMap.
    lattice : (6,) origin x, y [mm] and, row by row, the matrix that takes an offset from it to steps of the lattice
        that holds every tag [1/mm]; zeros if there is none.
    out : (read_start (n_steps + 1,), read_antenna, read_row, read_age, read_rssi), the last four with room for
        (last - first) * n times as many entries as tags may answer; the reads of step t are rows read_start[t] to
        read_start[t + 1] - 1 of them.
    """
    antennas, phases, slots, period = robot
    read_probability, sigma, read_time, delay, n_answers = world
    read_start, read_antenna, read_row, read_age, read_rssi = out
    tag_x, tag_y, tag_id, cell_start, per_cell, x0, y0, n_x, n_y = tags
    grid = (per_cell, x0, y0, n_x, n_y)
    box = (field.half_length_mm, field.half_width_mm, field.corner_mm, field.reach_mm, field.cell_mm)
    table, radii = field.table, field.rssi_radii
    install_low, install_high = key_halves(step_key(key, STREAM_INSTALLATION, 0))
    installation = (sigma, install_low, install_high)
    # A tag in reach lies within these bounds, in steps of the lattice, of the antenna's place.
    _, _, b00, b01, b10, b11 = lattice
    reach = field.reach_mm + _FARTHEST_SIGMA * sigma + _TAG_ROUNDING_MM
    bound_i, bound_j = reach * np.sqrt(b00 * b00 + b01 * b01), reach * np.sqrt(b10 * b10 + b11 * b11)
    bounds = (_F(bound_i + 1e-6), _F(bound_j + 1e-6))
    n_reads = 0
    n_antennas = antennas.shape[0]
    rough, near = _rough_copy(antennas, phases), np.empty(n_antennas + 2 * LANES, np.int32)
    # Which tags were in view for long enough shows only once all in view are known.
    rows = np.empty(max(n_answers, MOST_ANSWERS) if read_time > 0.0 else n_answers, np.int32)
    yaws = np.empty((n_antennas, 2))
    for a in range(n_antennas):
        yaws[a, 0], yaws[a, 1] = sin_cos_64(antennas[a, 2])
    read_start[first] = 0
    for t in range(first, last):
        low, high = key_halves(step_key(key, STREAM_READS, t))
        draw = 0
        phase = -1.0
        pose = (0.0, 0.0, 0.0, 1.0)
        for k in range(_near_tags(poses, t, rough, n_antennas, lattice, bounds, near)):
            a = near[k]
            if period > 1 and t % period != slots[a]:
                continue
            if phases[a] != phase:
                phase = phases[a]
                pose = pose_then(poses, t, phase, delay)
            x, y, s, c = antenna_at(pose, antennas, yaws, a)
            if n_answers > 1 or read_time > 0.0:
                n_answered, draw = poll_all(
                    x, y, s, c, low, high, draw, box, table, tag_x, tag_y, tag_id, cell_start, grid, installation,
                    read_probability if n_answers > 1 else 1.0, rows,
                )  # fmt: skip
            else:
                rows[0], draw = poll(
                    x, y, s, c, low, high, draw, box, table, tag_x, tag_y, tag_id, cell_start, grid, installation
                )
                n_answered = 1 if rows[0] >= 0 else 0
            if read_time > 0.0:
                before = antenna_at(pose_then(poses, t, phase, delay + read_time), antennas, yaws, a)
                n_answered = _those_in_view(before, rows, n_answered, box, table, tag_x, tag_y, tag_id, installation)
            if n_answers == 1 and n_answered > 0:
                if n_answered > 1:
                    rows[0] = rows[int(unit_uniform(random_bits(low, high, _U(draw))) * n_answered)]
                    n_answered, draw = 1, draw + 1
                if read_probability < 1.0:
                    if unit_uniform(random_bits(low, high, _U(draw))) >= read_probability:
                        n_answered = 0
                    draw += 1
            for i in range(n_answered):
                row = rows[i]
                rssi = -1
                if radii.shape[0] > 0:
                    u, v = offset_of(row, x, y, s, c, tag_x, tag_y, tag_id, installation)
                    rssi = rssi_of(u, v, radii)
                read_antenna[n_reads] = a
                read_row[n_reads] = row
                read_age[n_reads] = (1.0 - phases[a]) * dt
                read_rssi[n_reads] = rssi
                n_reads += 1
        read_start[t + 1] = n_reads
    return n_reads


@kernel
def pose_errors(true_poses, poses, first, last, position_error, heading_error):
    """Distance [mm] and absolute heading difference [rad] of steps first..last-1 between estimate and truth."""
    for t in range(first, last):
        dx = poses[t, 0] - true_poses[t, 0]
        dy = poses[t, 1] - true_poses[t, 1]
        position_error[t] = np.sqrt(dx * dx + dy * dy)
        turn = poses[t, 2] - true_poses[t, 2]
        turn -= 2.0 * np.pi * np.floor(turn / (2.0 * np.pi) + 0.5)
        heading_error[t] = abs(turn)
