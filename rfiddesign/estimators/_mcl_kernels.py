"""Monte-Carlo localization (hf_multireader_mcl, Algorithm 1) on arrays.

Between steps the particles lie in plain arrays (`drawn`): float32 x, y [mm] and the log weight they were drawn with,
int32 binary heading.  Within a step they lie in blocks of LANES (`cloud`), all fields of a block side by side: with
every distance known to the compiler the loops over a block run in SIMD registers, and sums kept one per lane have one
order on every machine.
"""

import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.extending import intrinsic

from rfiddesign.models._math_kernels import (
    RADIANS_PER_BINARY_UNIT,
    atan2_64,
    binary_angle,
    exp_32,
    fma_32,
    sin_cos,
    sin_cos_64,
    small_binary_angle,
)
from rfiddesign.models._noise_kernels import (
    STREAM_INITIALIZE,
    STREAM_PREDICT,
    STREAM_RESAMPLE,
    key_halves,
    random_bits,
    standard_normal,
    step_key,
    unit_uniform,
)

_F = np.float32
_I = np.int32
_U = np.uint32
_W = np.uint64
_LOWEST_LOG = _F(-80.0)
_PADDING_LOG = _F(-1e30)
_RAD_PER_UNIT = _F(RADIANS_PER_BINARY_UNIT)
LANES = 64
# Fields of a block, in units of LANES.
_X, _Y, _HEADING, _SINE, _COSINE, _LOG, _WEIGHT = (k * LANES for k in range(7))
BLOCK_SIZE = 7 * LANES
# Copies of one particle that resampling writes without asking how many there are.
COPIES = 4
# Columns of an estimate: pose, covariance (upper triangle by columns), effective sample size.
N_ESTIMATE = 10
# The sum of all weights in resampling, as a power of two.
_TOTAL_BITS = 30


@njit(cache=True, nogil=True)
def scatter(key, low_x, low_y, high_x, high_y, x, y, heading):
    """Particles uniform over a box, headings uniform over the turn."""
    low, high = key_halves(step_key(key, STREAM_INITIALIZE, 0))
    for m in range(x.shape[0]):
        x[m] = _F(low_x + (high_x - low_x) * unit_uniform(random_bits(low, high, _U(3 * m))))
        y[m] = _F(low_y + (high_y - low_y) * unit_uniform(random_bits(low, high, _U(3 * m + 1))))
        heading[m] = _I(random_bits(low, high, _U(3 * m + 2)))


@njit(cache=True, nogil=True)
def load(drawn, headings, cloud):
    """Spread the drawn particles over the cloud's blocks."""
    for b in range(cloud.shape[0]):
        block, x, y = cloud[b], drawn[0, b * LANES : (b + 1) * LANES], drawn[1, b * LANES : (b + 1) * LANES]
        heading = headings[b * LANES : (b + 1) * LANES]
        for i in range(LANES):
            block[_X + i] = x[i]
            block[_Y + i] = y[i]
            block[_HEADING + i] = _I(heading[i]).view(np.float32)


@njit(cache=True, nogil=True)
def store(cloud, drawn, headings):
    """The inverse of `load`."""
    for b in range(cloud.shape[0]):
        block, x, y = cloud[b], drawn[0, b * LANES : (b + 1) * LANES], drawn[1, b * LANES : (b + 1) * LANES]
        heading = headings[b * LANES : (b + 1) * LANES]
        for i in range(LANES):
            x[i] = block[_X + i]
            y[i] = block[_Y + i]
            heading[i] = _F(block[_HEADING + i]).view(np.int32)


@njit(cache=True, nogil=True)
def predict(key, step, n_particles, increment, deviations, drawn, headings, cloud):
    """Line 3: move each drawn particle by an odometry increment (body frame) plus noise (eq. 1) into the cloud."""
    low, high = key_halves(step_key(key, STREAM_PREDICT, step))
    n = _U(n_particles)
    dx, dy = _F(increment[0]), _F(increment[1])
    turn = binary_angle(increment[2])
    sx, sy, sh = _F(deviations[0]), _F(deviations[1]), _F(deviations[2])
    for b in range(cloud.shape[0]):
        block, x, y = cloud[b], drawn[0, b * LANES : (b + 1) * LANES], drawn[1, b * LANES : (b + 1) * LANES]
        heading = headings[b * LANES : (b + 1) * LANES]
        first = _U(b * LANES)
        for i in range(LANES):
            m = _U(first + _U(i))
            forward = fma_32(sx, standard_normal(random_bits(low, high, m)), dx)
            sideways = fma_32(sy, standard_normal(random_bits(low, high, _U(m + n))), dy)
            noise = _F(sh * standard_normal(random_bits(low, high, _U(_U(m + n) + n))))
            s, c = sin_cos(heading[i])
            block[_X + i] = _F(x[i] + fma_32(c, forward, -_F(s * sideways)))
            block[_Y + i] = _F(y[i] + fma_32(s, forward, _F(c * sideways)))
            block[_HEADING + i] = _I(_I(heading[i] + turn) + small_binary_angle(noise)).view(np.float32)


@njit(cache=True, nogil=True)
def begin_weights(cloud):
    """Sine and cosine of each heading, and weight 1."""
    for b in range(cloud.shape[0]):
        block = cloud[b]
        for i in range(LANES):
            s, c = sin_cos(_F(block[_HEADING + i]).view(np.int32))
            block[_SINE + i] = s
            block[_COSINE + i] = c
            block[_LOG + i] = _F(0.0)


@njit(cache=True, nogil=True)
def weigh_by_distance(tag, antenna, whitening, inner_radius, log_tail, cloud):
    """Line 4 for one read: add the logarithm of eq. 6 to each particle's log weight."""
    tx, ty, ax, ay = _F(tag[0]), _F(tag[1]), _F(antenna[0]), _F(antenna[1])
    w00, w01, w10, w11 = whitening[0, 0], whitening[0, 1], whitening[1, 0], whitening[1, 1]
    inner, tail = _F(inner_radius * inner_radius), _F(log_tail)
    for b in range(cloud.shape[0]):
        block = cloud[b]
        for i in range(LANES):
            dx, dy = _F(tx - block[_X + i]), _F(ty - block[_Y + i])
            s, c = block[_SINE + i], block[_COSINE + i]
            u = fma_32(c, dx, fma_32(s, dy, -ax))
            v = fma_32(c, dy, fma_32(-s, dx, -ay))
            p = fma_32(w00, u, _F(w01 * v))
            q = fma_32(w10, u, _F(w11 * v))
            d2 = fma_32(p, p, _F(q * q))
            block[_LOG + i] += _F(0.0) if d2 < inner else fma_32(_F(-0.5), d2, tail)


@njit(cache=True, nogil=True)
def weigh_by_field(tag, antenna, rotation, table, cell, cloud):
    """Line 4 for one read: add the tabulated log probability of the read at the tag's place in the antenna's frame.

    `table` (n, m) float32 is centred on the antenna; its border cells hold the value for every place beyond.
    """
    tx, ty, ax, ay = _F(tag[0]), _F(tag[1]), _F(antenna[0]), _F(antenna[1])
    w00, w01, w10, w11 = rotation[0, 0], rotation[0, 1], rotation[1, 0], rotation[1, 1]
    n_i, n_j = table.shape
    per_cell = _F(1.0 / cell)
    half_i, half_j = _F(0.5 * n_i), _F(0.5 * n_j)
    for b in range(cloud.shape[0]):
        block = cloud[b]
        for i in range(LANES):
            dx, dy = _F(tx - block[_X + i]), _F(ty - block[_Y + i])
            s, c = block[_SINE + i], block[_COSINE + i]
            u = fma_32(c, dx, fma_32(s, dy, -ax))
            v = fma_32(c, dy, fma_32(-s, dx, -ay))
            p = fma_32(fma_32(w00, u, _F(w01 * v)), per_cell, half_i)
            q = fma_32(fma_32(w10, u, _F(w11 * v)), per_cell, half_j)
            row = int(min(max(p, _F(0.0)), _F(n_i - 1)))
            column = int(min(max(q, _F(0.0)), _F(n_j - 1)))
            block[_LOG + i] += table[row, column]


@njit(cache=True, nogil=True)
def normalize(n_particles, cloud):
    """Weights relative to the best particle's, in (0, 1]; lanes beyond the last particle weigh nothing."""
    n_blocks = cloud.shape[0]
    n_last = n_particles - (n_blocks - 1) * LANES
    last = cloud[n_blocks - 1]
    for i in range(n_last, LANES):
        last[_LOG + i] = _PADDING_LOG
    best = np.empty(LANES, np.float32)
    best[:] = _PADDING_LOG
    for b in range(n_blocks):
        block = cloud[b]
        for i in range(LANES):
            value = block[_LOG + i]
            best[i] = value if value > best[i] else best[i]
    for i in range(LANES // 2):
        best[i] = best[i] if best[i] > best[LANES // 2 + i] else best[LANES // 2 + i]
    for i in range(LANES // 4):
        best[i] = best[i] if best[i] > best[LANES // 4 + i] else best[LANES // 4 + i]
    for i in range(LANES // 8):
        best[i] = best[i] if best[i] > best[LANES // 8 + i] else best[LANES // 8 + i]
    top = best[0]
    for i in range(1, LANES // 8):
        top = best[i] if best[i] > top else top
    for b in range(n_blocks):
        block = cloud[b]
        for i in range(LANES):
            below = _F(block[_LOG + i] - top)
            block[_WEIGHT + i] = exp_32(below if below > _LOWEST_LOG else _LOWEST_LOG)
    for i in range(n_last, LANES):
        last[_WEIGHT + i] = _F(0.0)


@njit(inline="always", cache=True, nogil=True)
def _lane_total(lanes, first):
    """Sum of LANES partial sums, by halves; overwrites them."""
    for i in range(LANES // 2):
        lanes[first + i] += lanes[first + LANES // 2 + i]
    for i in range(LANES // 4):
        lanes[first + i] += lanes[first + LANES // 4 + i]
    for i in range(LANES // 8):
        lanes[first + i] += lanes[first + LANES // 8 + i]
    for i in range(LANES // 16):
        lanes[first + i] += lanes[first + LANES // 16 + i]
    total = 0.0
    for i in range(LANES // 16):
        total += np.float64(lanes[first + i])
    return total


@intrinsic
def _put_copies(typingctx, array, index, value):
    """Write COPIES copies of a value to a contiguous array from `index` (uint64) on, in one vector store."""

    def codegen(context, builder, signature, arguments):
        array_type, _, _ = signature.args
        data = context.make_array(array_type)(context, builder, arguments[0]).data
        place = builder.gep(data, [arguments[1]])
        vector_type = ir.VectorType(arguments[2].type, COPIES)
        vector = ir.Constant(vector_type, ir.Undefined)
        for k in range(COPIES):
            vector = builder.insert_element(vector, arguments[2], ir.Constant(ir.IntType(32), k))
        store = builder.store(vector, builder.bitcast(place, vector_type.as_pointer()))
        store.align = 4
        return context.get_dummy_value()

    return types.void(array, index, value), codegen


@njit(cache=True, nogil=True)
def estimate(cloud, out):
    """Eq. 3: weighted mean of the particles (heading: of the direction), their covariance, effective sample size.

    Returns the sum of the weights.
    """
    sums = np.zeros(6 * LANES, np.float32)
    # Offsets from a particle keep the sums small against the building's coordinates.
    x0, y0 = cloud[0, _X], cloud[0, _Y]
    for b in range(cloud.shape[0]):
        block = cloud[b]
        for i in range(LANES):
            w = block[_WEIGHT + i]
            sums[i] += w
            sums[LANES + i] = fma_32(w, w, sums[LANES + i])
            sums[2 * LANES + i] = fma_32(w, _F(block[_X + i] - x0), sums[2 * LANES + i])
            sums[3 * LANES + i] = fma_32(w, _F(block[_Y + i] - y0), sums[3 * LANES + i])
            sums[4 * LANES + i] = fma_32(w, block[_SINE + i], sums[4 * LANES + i])
            sums[5 * LANES + i] = fma_32(w, block[_COSINE + i], sums[5 * LANES + i])
    total = _lane_total(sums, 0)
    out[9] = total * total / _lane_total(sums, LANES)
    out[0] = x0 + _lane_total(sums, 2 * LANES) / total
    out[1] = y0 + _lane_total(sums, 3 * LANES) / total
    out[2] = atan2_64(_lane_total(sums, 4 * LANES), _lane_total(sums, 5 * LANES))
    mean_x, mean_y, mean_heading = _F(out[0]), _F(out[1]), binary_angle(out[2])
    sums[:] = _F(0.0)
    for b in range(cloud.shape[0]):
        block = cloud[b]
        for i in range(LANES):
            w = block[_WEIGHT + i]
            dx, dy = _F(block[_X + i] - mean_x), _F(block[_Y + i] - mean_y)
            turn = _F(_F(_I(_F(block[_HEADING + i]).view(np.int32) - mean_heading)) * _RAD_PER_UNIT)
            wx, wy, wt = _F(w * dx), _F(w * dy), _F(w * turn)
            sums[i] = fma_32(wx, dx, sums[i])
            sums[LANES + i] = fma_32(wx, dy, sums[LANES + i])
            sums[2 * LANES + i] = fma_32(wy, dy, sums[2 * LANES + i])
            sums[3 * LANES + i] = fma_32(wt, dx, sums[3 * LANES + i])
            sums[4 * LANES + i] = fma_32(wt, dy, sums[4 * LANES + i])
            sums[5 * LANES + i] = fma_32(wt, turn, sums[5 * LANES + i])
    for k in range(6):
        out[3 + k] = _lane_total(sums, k * LANES) / total
    return total


@njit(cache=True, nogil=True)
def resample(key, step, n_particles, total, cloud, drawn, headings):
    """Lines 7-10: systematic resampling from the cloud to `drawn`; log weights go along.

    Weights are summed as integers, in units such that draw j takes the particle whose share contains
    j 2^shift + offset: no sum depends on its order and no search is needed.
    """
    shift = _TOTAL_BITS
    while n_particles << shift > 1 << _TOTAL_BITS:
        shift -= 1
    scale = _F(np.float64(n_particles) * np.float64(1 << shift) / total)
    low, high = key_halves(step_key(key, STREAM_RESAMPLE, step))
    offset = np.int64(np.float64(unit_uniform(random_bits(low, high, _U(0)))) * np.float64(1 << shift))
    # Counts draws rounded up.
    cumulative = _W((1 << shift) - 1 - offset)
    x, y, log_weights = drawn[0], drawn[1], drawn[2]
    n, down, begin = _W(n_particles), _W(shift), _W(0)
    one, copies = _W(1), _W(COPIES)
    units = np.empty(LANES, np.int32)
    for b in range(cloud.shape[0]):
        block = cloud[b]
        for i in range(LANES):
            units[i] = _I(_F(block[_WEIGHT + i] * scale) + _F(0.5))
        for i in range(LANES):
            cumulative += _W(units[i])
            end = min(cumulative >> down, n)
            px, py, pw, ph = block[_X + i], block[_Y + i], block[_LOG + i], _F(block[_HEADING + i]).view(np.int32)
            # A few copies written whatever their number spare a branch per particle; the next overwrites the rest.
            _put_copies(x, begin, px)
            _put_copies(y, begin, py)
            _put_copies(log_weights, begin, pw)
            _put_copies(headings, begin, ph)
            k = begin + copies
            while k < end:
                x[k], y[k], log_weights[k], headings[k] = px, py, pw, ph
                k += one
            begin = end
    # Rounding may leave the last draw without a particle: it takes the one before it.
    while begin < n:
        before = begin - one
        x[begin], y[begin], log_weights[begin] = x[before], y[before], log_weights[before]
        headings[begin] = headings[before]
        begin += one


@njit(cache=True, nogil=True)
def reinitialize(key, step, log_alpha, tags, antennas, x, y, heading, log_weights):
    """Lines 11-13 with eq. 4: a particle of weight below alpha restarts under a read tag with any heading.

    `tags` (n, 2) and `antennas` (n, 2) belong to the step's reads; the reads are dealt to the particles in turn.
    Returns how many particles restarted.
    """
    n_restarted = _I(0)
    for m in range(x.shape[0]):
        n_restarted += _I(log_weights[m] < log_alpha)
    # As a rule no particle restarts, and this loop, unlike the next, is a matter of nanoseconds.
    if n_restarted == 0:
        return n_restarted
    low, high = key_halves(step_key(key, STREAM_INITIALIZE, step + 1))
    n_reads = tags.shape[0]
    for m in range(x.shape[0]):
        if log_weights[m] < log_alpha:
            angle = _I(random_bits(low, high, _U(m)))
            s, c = sin_cos(angle)
            k = m % n_reads
            ax, ay = _F(antennas[k, 0]), _F(antennas[k, 1])
            x[m] = _F(_F(tags[k, 0]) - fma_32(c, ax, -_F(s * ay)))
            y[m] = _F(_F(tags[k, 1]) - fma_32(s, ax, _F(c * ay)))
            heading[m] = angle
    return n_restarted


@njit(cache=True, nogil=True)
def update(key, step, n_particles, tags, antennas, whitenings, rules, table, cloud, drawn, headings, out):
    """Lines 4-13 for the reads of one step, from the cloud to `drawn`; writes the estimate to `out`.

    Parameters
    ----------
    tags, antennas : (n_reads, 2) position of the read tag on the map, and of its antenna on the robot at the read.
    whitenings : (n_reads, 2, 2) float32; with a table, the rotation to the antenna's axes.
    rules : (inner_radius, log_tail, log_alpha, cell_mm of the table); log_alpha = -inf: no reinitialization.
    table : (n, m) float32 log probability of a read; without cells the likelihood is that of the distance.
    cloud : (n_blocks, BLOCK_SIZE) float32.
    drawn, headings : (3, n_blocks LANES + COPIES) float32 x, y, log weight, and int32.
    out : (N_ESTIMATE,).
    """
    begin_weights(cloud)
    for k in range(tags.shape[0]):
        if table.shape[0] > 0:
            weigh_by_field(tags[k], antennas[k], whitenings[k], table, rules[3], cloud)
        else:
            weigh_by_distance(tags[k], antennas[k], whitenings[k], rules[0], rules[1], cloud)
    normalize(n_particles, cloud)
    total = estimate(cloud, out)
    if tags.shape[0] == 0:
        store(cloud, drawn, headings)
        return
    resample(key, step, n_particles, total, cloud, drawn, headings)
    if rules[2] > -1e30:
        n = n_particles
        reinitialize(key, step, _F(rules[2]), tags, antennas, drawn[0, :n], drawn[1, :n], headings[:n], drawn[2, :n])


@njit(cache=True, nogil=True)
def age_antennas(read_antenna, read_age, positions, increment, dt, out):
    """Where each read's antenna was, in the robot's frame at the end of the step.

    `increment` is the step's motion in the robot's frame at its begin, driven and turned at constant rates.
    """
    s_end, c_end = sin_cos_64(increment[2])
    for k in range(read_antenna.shape[0]):
        x, y = positions[read_antenna[k], 0], positions[read_antenna[k], 1]
        back = read_age[k] / dt
        if back == 0.0:
            out[k, 0], out[k, 1] = x, y
            continue
        s, c = sin_cos_64(back * increment[2])
        behind_x, behind_y = back * increment[0], back * increment[1]
        out[k, 0] = c * x + s * y - (c_end * behind_x + s_end * behind_y)
        out[k, 1] = c * y - s * x - (c_end * behind_y - s_end * behind_x)


@njit(cache=True, nogil=True)
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
    antennas = np.empty((n_most, 2))
    whitenings = np.empty((n_most, 2, 2), np.float32)
    ages = np.zeros(n_most)
    for t in range(first, last):
        predict(key, t, n_particles, odometry[t], deviations, drawn, headings, cloud)
        a, b = read_start[t], read_start[t + 1]
        n = b - a
        if is_age_compensated:
            ages[:n] = read_age[a:b]
        age_antennas(read_antenna[a:b], ages[:n], positions, odometry[t], dt, antennas[:n])
        for k in range(n):
            whitenings[k] = whitening[read_antenna[a + k]]
        update(
            key, t, n_particles, read_tags[a:b], antennas[:n], whitenings[:n], rules, table, cloud, drawn, headings,
            estimates[t + 1],
        )  # fmt: skip
