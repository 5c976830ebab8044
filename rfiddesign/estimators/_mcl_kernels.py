"""Monte-Carlo localization (hf_multireader_mcl, Algorithm 1) on arrays; see `_particle_kernels` for their layout."""

import numpy as np

from rfiddesign.estimators._estimate_kernels import estimate
from rfiddesign.estimators._particle_kernels import (
    COSINE,
    HEADING,
    LOG,
    SINE,
    X,
    Y,
    resample,
    store,
    turn,
)
from rfiddesign.numerics import _lane_kernels as lanes
from rfiddesign.numerics._compile_kernels import inline_kernel, kernel, leaf_kernel
from rfiddesign.numerics._lane_kernels import LANES, fma
from rfiddesign.numerics._math_kernels import (
    binary_angle,
    sin_cos,
    sin_cos_64,
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
# Columns of a read: the tag on the map, its antenna on the robot at the read, whitening by rows.
N_READ = 8


@kernel
def scatter(key, low_x, low_y, high_x, high_y, x, y, heading):
    """Particles uniform over a box, headings uniform over the turn."""
    low, high = key_halves(step_key(key, STREAM_INITIALIZE, 0))
    for m in range(x.shape[0]):
        x[m] = _F(low_x + (high_x - low_x) * unit_uniform(random_bits(low, high, _U(3 * m))))
        y[m] = _F(low_y + (high_y - low_y) * unit_uniform(random_bits(low, high, _U(3 * m + 1))))
        heading[m] = _I(random_bits(low, high, _U(3 * m + 2)))


@leaf_kernel
def predict(key, step, odometry, row, deviations, drawn, headings, cloud):
    """Line 3: move each drawn particle by an odometry increment plus noise (eq. 1) into the cloud.

    The increment is a row of `odometry` (n, 3), in the robot's frame.
    """
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

    `table` (n, m) float32 is centred on the antenna; its border cells hold the value for every place beyond.
    """
    w00, w01, w10, w11 = reads[k, 4], reads[k, 5], reads[k, 6], reads[k, 7]
    n_i, n_j = table.shape
    per_cell, half_i, half_j = _F(1.0 / cell), _F(0.5 * n_i), _F(0.5 * n_j)
    last_i, last_j = _F(n_i - 1), _F(n_j - 1)
    width = cloud.shape[1]
    for i in range(0, width, LANES):
        u, v = _in_antenna_frame(reads, k, cloud, i)
        p = fma(fma(u, w00, v * w01), per_cell, half_i)
        q = fma(fma(u, w10, v * w11), per_cell, half_j)
        row = lanes.to_integer(lanes.lesser(lanes.greater(p, _F(0.0)), last_i))
        column = lanes.to_integer(lanes.lesser(lanes.greater(q, _F(0.0)), last_j))
        log = lanes.look_up(table, lanes.add(lanes.multiply(row, _I(n_j)), column))
        lanes.store(cloud, LOG * width + i, lanes.load(cloud, LOG * width + i) + log)


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
def update(key, step, n_particles, reads, n_reads, rules, table, cloud, drawn, headings, out, row):
    """Lines 4-13 for the reads of one step, from the cloud to `drawn`; writes the estimate to a row of `out`.

    Parameters
    ----------
    reads : (n_reads or more, N_READ) float32, see there; with a table, whitening is the rotation to the antenna's axes.
    rules : (inner_radius, log_tail, log_alpha, cell_mm of the table); log_alpha = -inf: no reinitialization.
    table : (n, m) float32 log probability of a read; without cells the likelihood is that of the distance.
    cloud : (N_FIELDS, width) float32.
    drawn, headings : see `resample`.
    out : (n, N_ESTIMATE).
    """
    for k in range(n_reads):
        if table.shape[0] > 0:
            weigh_by_field(reads, k, table, rules[3], cloud)
        else:
            weigh_by_distance(reads, k, rules[0], rules[1], cloud)
    total, lowest = estimate(n_particles, cloud, out, row)
    if n_reads == 0:
        store(cloud, drawn, headings)
        return
    log_alpha = _F(rules[2])
    is_doubted = lowest < log_alpha
    resample(key, step, n_particles, total, is_doubted, cloud, drawn, headings)
    if is_doubted:
        reinitialize(key, step, log_alpha, reads, n_reads, n_particles, drawn, headings)


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


@kernel
def track(key, first, last, n_particles, log, model, cloud, drawn, headings, estimates):
    """Run the filter over steps first..last-1 of a recording; estimates[t + 1] is the belief after step t.

    Parameters
    ----------
    log : (odometry (n, 3), read_start (n + 1,), read_antenna, read_tag_xy (r, 2), read_age (r,), dt).
    model : (positions (n, 2), whitening (n, 2, 2) float32, deviations (3,), rules, table, is_age_compensated).
    """
    odometry, read_start, read_antenna, read_tags, read_age, dt = log
    positions, whitening, deviations, rules, table, is_age_compensated = model
    n_most = 0
    for t in range(first, last):
        n_most = max(n_most, read_start[t + 1] - read_start[t])
    reads = np.empty((n_most, N_READ), np.float32)
    for t in range(first, last):
        predict(key, t, odometry, t, deviations, drawn, headings, cloud)
        _gather(
            t,
            odometry,
            read_start,
            read_antenna,
            read_tags,
            read_age,
            dt,
            positions,
            whitening,
            is_age_compensated,
            reads,
        )
        n_reads = read_start[t + 1] - read_start[t]
        update(key, t, n_particles, reads, n_reads, rules, table, cloud, drawn, headings, estimates, t + 1)


@leaf_kernel
def _gather(
    t, odometry, read_start, read_antenna, read_tags, read_age, dt, positions, whitening, is_age_compensated, reads
):
    """The reads of step t as `update` takes them."""
    for row in range(read_start[t], read_start[t + 1]):
        antenna, k = read_antenna[row], row - read_start[t]
        x, y = positions[antenna, 0], positions[antenna, 1]
        if is_age_compensated and read_age[row] > 0.0:
            x, y = antenna_then(x, y, read_age[row] / dt, odometry[t, 0], odometry[t, 1], odometry[t, 2])
        reads[k, 0], reads[k, 1], reads[k, 2], reads[k, 3] = read_tags[row, 0], read_tags[row, 1], x, y
        reads[k, 4], reads[k, 5] = whitening[antenna, 0, 0], whitening[antenna, 0, 1]
        reads[k, 6], reads[k, 7] = whitening[antenna, 1, 0], whitening[antenna, 1, 1]
