"""Monte-Carlo localization (hf_multireader_mcl, Algorithm 1) on arrays; see `_particle_kernels` for their layout."""

import numpy as np

from rfiddesign.estimators._estimate_kernels import estimate
from rfiddesign.estimators._evidence_kernels import N_READ, gather, gather_nothing_seen, room_for_evidence
from rfiddesign.estimators._particle_kernels import (
    COSINE,
    HEADING,
    LOG,
    SINE,
    X,
    Y,
    load,
    resample,
    store,
    turn,
)
from rfiddesign.models._motion_kernels import step_deviations
from rfiddesign.numerics import _lane_kernels as lanes
from rfiddesign.numerics._compile_kernels import inline_kernel, kernel, leaf_kernel
from rfiddesign.numerics._lane_kernels import LANES, fma
from rfiddesign.numerics._math_kernels import (
    binary_angle,
    log_32,
    sin_cos,
    small_binary_angle,
)
from rfiddesign.numerics._noise_kernels import (
    STREAM_INITIALIZE,
    STREAM_PREDICT,
    key_halves,
    random_bits,
    random_triple,
    standard_normal,
    step_key,
    unit_uniform,
)

_F = np.float32
_I = np.int32
_U = np.uint32
# Places drawn until one lies in the detection region; a ring of RSSI may fill a twentieth of its box.
_MOST_TRIES = 128
_LOG_2 = _F(0.6931472)
# Chance left to what cannot be, and how many factors as small as that a float32 holds.
_LEAST_PROBABILITY = _F(1e-3)
_ROWS_PER_LOG = 8


@kernel
def scatter(key, low_x, low_y, high_x, high_y, x, y, heading):
    """Particles uniform over a box, headings uniform over the turn."""
    low, high = key_halves(step_key(key, STREAM_INITIALIZE, 0))
    for m in range(x.shape[0]):
        x[m] = _F(low_x + (high_x - low_x) * unit_uniform(random_bits(low, high, _U(3 * m))))
        y[m] = _F(low_y + (high_y - low_y) * unit_uniform(random_bits(low, high, _U(3 * m + 1))))
        heading[m] = _I(random_bits(low, high, _U(3 * m + 2)))


@kernel
def scatter_about(key, pose, root, x, y, heading):
    """Particles from a Gaussian about a pose (3,); `root` (3, 3) is the lower triangular root of its covariance."""
    low, high = key_halves(step_key(key, STREAM_INITIALIZE, 0))
    for m in range(x.shape[0]):
        for_x, for_y, for_heading = random_triple(low, high, _U(m))
        a, b, c = standard_normal(for_x), standard_normal(for_y), standard_normal(for_heading)
        x[m] = _F(pose[0] + root[0, 0] * a)
        y[m] = _F(pose[1] + root[1, 0] * a + root[1, 1] * b)
        heading[m] = binary_angle(pose[2] + root[2, 0] * a + root[2, 1] * b + root[2, 2] * c)


@leaf_kernel
def predict(key, step, odometry, row, noise, drawn, headings, cloud):
    """Line 3: move each drawn particle by an odometry increment plus noise (eq. 1) into the cloud.

    The increment is a row of `odometry` (n, 3), in the robot's frame; `noise` (3, 3) as in `Motion.noise`.
    """
    deviations = step_deviations(noise, odometry[row, 0], odometry[row, 1], odometry[row, 2])
    width, room = cloud.shape[1], drawn.shape[1]
    low, high = key_halves(step_key(key, STREAM_PREDICT, step))
    dx, dy, turned = _F(odometry[row, 0]), _F(odometry[row, 1]), binary_angle(odometry[row, 2])
    sx, sy, sh = _F(deviations[0]), _F(deviations[1]), _F(deviations[2])
    # Two loops, so that the constants of each stay in registers.
    for i in range(0, width, LANES):
        for_x, for_y, for_heading = random_triple(low, high, lanes.count_up(_U(i)))
        lanes.store(cloud, X * width + i, fma(standard_normal(for_x), sx, dx))
        lanes.store(cloud, Y * width + i, fma(standard_normal(for_y), sy, dy))
        lanes.store(cloud, HEADING * width + i, standard_normal(for_heading) * sh)
    for i in range(0, width, LANES):
        forward, sideways = lanes.load(cloud, X * width + i), lanes.load(cloud, Y * width + i)
        noise = small_binary_angle(lanes.load(cloud, HEADING * width + i))
        heading = lanes.load(headings, i)
        s, c = sin_cos(heading)
        lanes.store(cloud, X * width + i, lanes.load(drawn, i) + fma(c, forward, -(s * sideways)))
        lanes.store(cloud, Y * width + i, lanes.load(drawn, room + i) + fma(s, forward, c * sideways))
        turn(lanes.add(lanes.add(heading, turned), noise), cloud, i)


@leaf_kernel
def weigh_by_distance(reads, k, inner_radius, log_tail, cloud):
    """Line 4 for the k-th read: add the logarithm of eq. 6 to each particle's log weight."""
    w00, w01, w10, w11 = reads[k, 4], reads[k, 5], reads[k, 6], reads[k, 7]
    is_isotropic = w00 == w11 and w01 == _F(0.0) and w10 == _F(0.0)
    precision = _F(w00 * w00) if is_isotropic else _F(1.0)
    inner, tail, half = _F(_F(inner_radius * inner_radius) / precision), _F(log_tail), _F(_F(-0.5) * precision)
    width = cloud.shape[1]
    for i in range(0, width, LANES):
        u, v = _in_antenna_frame(reads, k, cloud, i)
        if not is_isotropic:
            u, v = fma(u, w00, v * w01), fma(u, w10, v * w11)
        d2 = fma(u, u, v * v)
        log = lanes.choose(d2 < inner, _F(0.0), fma(d2, half, tail))
        lanes.store(cloud, LOG * width + i, lanes.load(cloud, LOG * width + i) + log)


@leaf_kernel
def weigh_by_field(reads, k, table, cell, cloud):
    """Line 4 for the k-th read: add the tabulated log probability at the tag's place in the antenna's frame.

    `table` (n_tables, n, m) float32 are centred on the antenna; their border cells hold the value for every place
    beyond.
    """
    w00, w01, w10, w11 = reads[k, 4], reads[k, 5], reads[k, 6], reads[k, 7]
    _, n_i, n_j = table.shape
    base = _I(_I(reads[k, 8]) * _I(n_i * n_j))
    per_cell, half_i, half_j = _F(1.0 / cell), _F(0.5 * n_i), _F(0.5 * n_j)
    last_i, last_j = _F(n_i - 1), _F(n_j - 1)
    width = cloud.shape[1]
    for i in range(0, width, LANES):
        u, v = _in_antenna_frame(reads, k, cloud, i)
        p = fma(fma(u, w00, v * w01), per_cell, half_i)
        q = fma(fma(u, w10, v * w11), per_cell, half_j)
        row = lanes.to_integer(lanes.lesser(lanes.greater(p, _F(0.0)), last_i))
        column = lanes.to_integer(lanes.lesser(lanes.greater(q, _F(0.0)), last_j))
        log = lanes.look_up(table, lanes.add(lanes.add(lanes.multiply(row, _I(n_j)), column), base))
        lanes.store(cloud, LOG * width + i, lanes.load(cloud, LOG * width + i) + log)


@leaf_kernel
def weigh_by_discs(reads, n_rows, discs, per_width, cloud):
    """Line 4 for all rows: what `soft_discs` says of each row's tag; `discs` and `per_width` are of there."""
    width = cloud.shape[1]
    for i in range(0, width, LANES):
        x, y = lanes.load(cloud, X * width + i), lanes.load(cloud, Y * width + i)
        s, c = lanes.load(cloud, SINE * width + i), lanes.load(cloud, COSINE * width + i)
        log, product = lanes.load(cloud, LOG * width + i), lanes.copies(_F(1.0))
        for k in range(n_rows):
            which = int(reads[k, 8])
            dx, dy = reads[k, 0] - x, reads[k, 1] - y
            u, v = fma(c, dx, fma(s, dy, -reads[k, 2])), fma(c, dy, fma(-s, dx, -reads[k, 3]))
            distance = lanes.square_root(fma(u, u, v * v))
            inside = _soft_step(discs[which, 0, 0], distance, per_width)
            if discs[which, 1, 0] > _F(0.0):
                inside = inside - _soft_step(discs[which, 1, 0], distance, per_width)
            product = product * lanes.greater(fma(inside, discs[which, 3, 0], discs[which, 2, 0]), _LEAST_PROBABILITY)
            if k % _ROWS_PER_LOG == _ROWS_PER_LOG - 1:
                log, product = log + log_32(product), lanes.copies(_F(1.0))
        lanes.store(cloud, LOG * width + i, log + log_32(product))


@inline_kernel
def _soft_step(radius, distance, per_width):
    """Chance to be within a radius whose border is blurred: 1 inside, 0 outside, a cubic between."""
    t = fma(radius - distance, per_width, _F(0.5))
    t = lanes.lesser(lanes.greater(t, _F(0.0)), _F(1.0))
    return t * t * fma(t, _F(-2.0), _F(3.0))


@inline_kernel
def _in_antenna_frame(reads, k, cloud, i):
    """Where the k-th read's tag lies from its antenna on the particles from i on, in the robot's axes."""
    width = cloud.shape[1]
    dx, dy = reads[k, 0] - lanes.load(cloud, X * width + i), reads[k, 1] - lanes.load(cloud, Y * width + i)
    s, c = lanes.load(cloud, SINE * width + i), lanes.load(cloud, COSINE * width + i)
    return fma(c, dx, fma(s, dy, -reads[k, 2])), fma(c, dy, fma(-s, dx, -reads[k, 3]))


@leaf_kernel
def reinitialize(key, step, log_alpha, reads, n_reads, n_particles, drawn, headings):
    """Lines 11-13 with eq. 4: a particle of weight below alpha restarts under a read tag with any heading.

    The reads (n_reads or more, N_READ) are dealt to the particles in turn.  Returns how many particles restarted.
    """
    low, high = key_halves(step_key(key, STREAM_INITIALIZE, step + 1))
    n_restarted = 0
    for m in range(n_particles):
        if drawn[2, m] < log_alpha:
            angle = _I(random_bits(low, high, _U(m)))
            s, c = sin_cos(angle)
            k = m % n_reads
            tx, ty, ax, ay = reads[k, 0], reads[k, 1], reads[k, 2], reads[k, 3]
            drawn[0, m] = tx - fma(c, ax, -_F(s * ay))
            drawn[1, m] = ty - fma(s, ax, _F(c * ay))
            headings[m] = angle
            n_restarted += 1
    return n_restarted


@leaf_kernel
def restart_in_region(key, step, reads, n_reads, table, cell, n_particles, drawn, headings):
    """Restart every particle in the detection region of a read tag (rssi_kalman_navifloor, section IV-C).

    The tag lies uniformly in what the antenna reads with more than half the chance of its best place; half of the
    particles keep their heading, the others take any.  The reads are dealt to the particles in turn.
    """
    low, high = key_halves(step_key(key, STREAM_INITIALIZE, step + 1))
    _, n_i, n_j = table.shape
    for k in range(n_reads):
        which, best = int(reads[k, 8]), _F(0.0)
        if n_j > 1:
            best = table[which, 0, 0]
            for i in range(n_i):
                for j in range(n_j):
                    best = max(best, table[which, i, j])
        w00, w01, w10, w11 = reads[k, 4], reads[k, 5], reads[k, 6], reads[k, 7]
        for m in range(k, n_particles, n_reads):
            u = v = _F(0.0)
            draw = m * (2 * _MOST_TRIES + 1)
            for i in range(_MOST_TRIES):
                p = unit_uniform(random_bits(low, high, _U(draw + 2 * i))) - _F(0.5)
                q = unit_uniform(random_bits(low, high, _U(draw + 2 * i + 1))) - _F(0.5)
                if n_j > 1:
                    u, v = p * _F(n_i * cell), q * _F(n_j * cell)
                    log = table[which, int((p + _F(0.5)) * _F(n_i)), int((q + _F(0.5)) * _F(n_j))]
                else:
                    u, v = p * _F(2.0) * table[which, 0, 0], q * _F(2.0) * table[which, 0, 0]
                    distance = np.sqrt(u * u + v * v)
                    log = _F(0.0) if table[which, 1, 0] <= distance <= table[which, 0, 0] else -_F(10.0)
                if log > best - _LOG_2:
                    break
                u = v = _F(0.0)
            if m % 2 == 1:
                headings[m] = _I(random_bits(low, high, _U(draw + 2 * _MOST_TRIES)))
            # From the robot's centre to the tag, in the robot's axes.
            ax, ay = reads[k, 2] + fma(w00, u, w10 * v), reads[k, 3] + fma(w01, u, w11 * v)
            s, c = sin_cos(headings[m])
            drawn[0, m] = reads[k, 0] - fma(c, ax, -_F(s * ay))
            drawn[1, m] = reads[k, 1] - fma(s, ax, _F(c * ay))


@leaf_kernel
def update(key, step, n_particles, reads, n_reads, n_evidence, rules, table, cloud, drawn, headings, out, row):
    """Lines 4-13 for the reads of one step, from the cloud to `drawn`; writes the estimate to a row of `out`.

    Parameters
    ----------
    reads : (n_evidence or more, N_READ) float32, see there: n_reads reads, then tags that were not read; with a table,
        whitening is the rotation to the antenna's axes.
    rules : (inner_radius, log_tail, log_alpha, cell_mm of the table, whether all particles restart in the region,
        1 / (2 w) of `soft_discs`);
        log_alpha = -inf: no reinitialization.
    table : (n_tables, n, m) float32 log probabilities about the antenna; (n, 4, 1): discs, see `soft_discs`; without
        cells the likelihood is that of eq. 6.
    cloud : (N_FIELDS, width) float32.
    drawn, headings : see `resample`.
    out : (n, N_ESTIMATE).
    """
    if table.shape[2] == 1:
        weigh_by_discs(reads, n_evidence, table, _F(rules[5]), cloud)
    elif table.shape[1] > 0:
        for k in range(n_evidence):
            weigh_by_field(reads, k, table, rules[3], cloud)
    else:
        for k in range(n_evidence):
            weigh_by_distance(reads, k, rules[0], rules[1], cloud)
    total, lowest = estimate(n_particles, cloud, out, row)
    if n_evidence == 0:
        store(cloud, drawn, headings)
        return
    log_alpha = _F(rules[2])
    is_doubted = lowest < log_alpha
    resample(key, step, n_particles, total, is_doubted, cloud, drawn, headings)
    if not is_doubted or n_reads == 0:
        return
    if rules[4] > 0.0:
        best = cloud[LOG, 0]
        for m in range(n_particles):
            best = max(best, cloud[LOG, m])
        # What contradicts nothing may still be on the border of the field, at half the chance, for every row.
        if best < log_alpha - _F(n_evidence) * _LOG_2:
            restart_in_region(key, step, reads, n_reads, table, rules[3], n_particles, drawn, headings)
            # Lanes beyond the last particle stay near the others.
            for m in range(n_particles, cloud.shape[1]):
                drawn[0, m], drawn[1, m] = drawn[0, n_particles - 1], drawn[1, n_particles - 1]
                headings[m] = headings[n_particles - 1]
    else:
        reinitialize(key, step, log_alpha, reads, n_reads, n_particles, drawn, headings)


@kernel
def predict_step(key, step, odometry, row, model, arrays):
    """`predict` for particles that lie in `drawn` before and after; see `verbs.Kernels`."""
    drawn, headings, cloud = arrays
    predict(key, step, odometry, row, model[3], drawn, headings, cloud)
    store(cloud, drawn, headings)


@kernel
def update_step(key, step, log, t, model, tags, arrays, out, row):
    """`update` for particles that lie in `drawn`; see `verbs.Kernels`."""
    drawn, headings, cloud = arrays
    load(drawn, headings, cloud)
    _steps(key, step, step + 1, t - step, False, log, model, tags, arrays, out, row - t - 1)


@kernel
def track(key, first, last, log, model, tags, arrays, estimates):
    """Run the filter over steps first..last-1 of a recording; estimates[t + 1] is the belief after step t.

    Parameters
    ----------
    log : as in `Recording.log`.
    model : (n_particles, positions (n, 2), whitening (n, 2, 2) float32, noise (3, 3), rules, table, ages, looks);
        ages: (is_age_compensated, delay of reads in steps); looks: (uses_rssi, learns from nothing seen, reader answers
        with all tags, slots (n,), phases (n,), period of its schedule, reach of the tables [mm], number of the table
        for tags not read).
    tags : as in `verbs.known`.
    arrays : (drawn, headings, cloud).
    """
    _steps(key, first, last, 0, True, log, model, tags, arrays, estimates, 0)


@kernel
def _steps(key, first, last, row_of_step, predicts, log, model, tags, arrays, estimates, row_of_row):
    """Steps first..last-1; step s has row s + `row_of_step` in the log, row t there t + 1 + `row_of_row` in estimates.

    Arrays are taken out of their tuples here, once: each time costs as much as a read.
    """
    drawn, headings, cloud = arrays
    n_particles, positions, whitening, noise, rules, table, (is_age_compensated, delay), looks = model
    uses_rssi, learns_from_nothing, is_inventory, slots, phases, period, reach, unread_table = looks
    odometry, read_start, read_antenna, read_tags, read_age, read_rssi, dt = log
    tag_x, tag_y, cell_start, per_cell, x0, y0, n_x, n_y = tags
    grid, ages = (per_cell, x0, y0, n_x, n_y), (is_age_compensated, delay)
    # Beside the tables of the steps of RSSI there are that of any read and that of none.
    n_rssi = table.shape[0] - 2 if uses_rssi else 0
    reads = np.empty((room_for_evidence(log, first + row_of_step, last + row_of_step, model), N_READ), np.float32)
    for step in range(first, last):
        t = step + row_of_step
        if predicts:
            predict(key, step, odometry, t, noise, drawn, headings, cloud)
        gather(
            t, odometry, read_start, read_antenna, read_tags, read_age, read_rssi, dt, positions, whitening,
            is_age_compensated, delay, n_rssi, reads,
        )  # fmt: skip
        n_reads = n_evidence = read_start[t + 1] - read_start[t]
        if learns_from_nothing:
            n_evidence = gather_nothing_seen(
                step, t, odometry, read_start, read_antenna, read_tags, positions, whitening, slots, phases, period, ages,
                is_inventory, reach, unread_table, tag_x, tag_y, cell_start, grid, cloud, reads,
            )  # fmt: skip
        update(
            key, step, n_particles, reads, n_reads, n_evidence, rules, table, cloud, drawn, headings, estimates,
            t + 1 + row_of_row,
        )  # fmt: skip
