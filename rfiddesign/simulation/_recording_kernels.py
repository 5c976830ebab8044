"""What the wheels and the readers of a driving robot report: odometry with noise, polls and reads."""

import numpy as np

from rfiddesign.models._motion_kernels import step_deviations
from rfiddesign.models.reads import MOST_ANSWERS
from rfiddesign.numerics import _lane_kernels as lanes
from rfiddesign.numerics._compile_kernels import inline_kernel, kernel, leaf_kernel
from rfiddesign.numerics._lane_kernels import LANES, fma
from rfiddesign.numerics._math_kernels import binary_angle, sin_cos, sin_cos_64, small_binary_angle
from rfiddesign.numerics._noise_kernels import (
    STREAM_DEAD,
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
from rfiddesign.simulation._poll_kernels import FARTHEST_SIGMA, offset_of, poll, poll_all, rssi_of, those_in_view

_U = np.uint32
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
    world : (read_probability, installation_error_mm, dead_share; read time and delay in steps; how many tags answer at
        most).
    field : see `ReadField`.
    tags : (installed_x, installed_y, tag_id, cell_start, 1 / cell_mm, origin_x, origin_y, n_x, n_y) of a TagMap.
    lattice : (6,) origin x, y [mm] and, row by row, the matrix that takes an offset from it to steps of the lattice
        that holds every tag [1/mm]; zeros if there is none.
    out : (read_start (n_steps + 1,), read_antenna, read_row, read_age, read_rssi), the last four with room for
        (last - first) * n times as many entries as tags may answer; the reads of step t are rows read_start[t] to
        read_start[t + 1] - 1 of them.
    """
    antennas, phases, slots, period = robot
    read_probability, sigma, dead_share, read_time, delay, n_answers = world
    read_start, read_antenna, read_row, read_age, read_rssi = out
    tag_x, tag_y, tag_id, cell_start, per_cell, x0, y0, n_x, n_y = tags
    grid = (per_cell, x0, y0, n_x, n_y)
    box = (field.half_length_mm, field.half_width_mm, field.corner_mm, field.reach_mm, field.cell_mm)
    table, radii = field.table, field.rssi_radii
    install_low, install_high = key_halves(step_key(key, STREAM_INSTALLATION, 0))
    installation = (sigma, install_low, install_high)
    dead_low, dead_high = key_halves(step_key(key, STREAM_DEAD, 0))
    dead = (dead_share, dead_low, dead_high)
    # A tag in reach lies within these bounds, in steps of the lattice, of the antenna's place.
    _, _, b00, b01, b10, b11 = lattice
    reach = field.reach_mm + FARTHEST_SIGMA * sigma + _TAG_ROUNDING_MM
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
                    x, y, s, c, low, high, draw, box, table, tag_x, tag_y, tag_id, cell_start, grid, installation, dead,
                    read_probability if n_answers > 1 else 1.0, rows,
                )  # fmt: skip
            else:
                rows[0], draw = poll(
                    x, y, s, c, low, high, draw, box, table, tag_x, tag_y, tag_id, cell_start, grid, installation, dead
                )
                n_answered = 1 if rows[0] >= 0 else 0
            if read_time > 0.0:
                before = antenna_at(pose_then(poses, t, phase, delay + read_time), antennas, yaws, a)
                n_answered = those_in_view(before, rows, n_answered, box, table, tag_x, tag_y, tag_id, installation)
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
