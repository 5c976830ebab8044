"""Monte-Carlo localization (hf_multireader_mcl, Algorithm 1) on arrays.

Particles are float32 x and y [mm] and an int32 binary heading.  Each function is one line of the algorithm box; the
same functions serve the single step of `mcl.update` and the whole recording of `mcl.track`.
"""

import math

import numpy as np
from numba import njit

from rfiddesign.models._math_kernels import (
    atan2_64,
    binary_angle,
    exp_32,
    sin_cos,
    sin_cos_64,
    small_binary_angle,
)
from rfiddesign.models._noise_kernels import (
    STREAM_INITIALIZE,
    STREAM_PREDICT,
    STREAM_RESAMPLE,
    key_halves,
    normal_pair,
    random_bits,
    step_key,
    unit_uniform,
)

_F = np.float32
_U = np.uint32
_LOWEST_LOG = _F(-80.0)
_WEIGHT_UNITS = _F(16777216.0)
# Copies of one particle that resampling writes without asking how many there are.
BLOCK = 4


@njit(cache=True, nogil=True)
def scatter(key, low_x, low_y, high_x, high_y, x, y, heading):
    """Particles uniform over a box, headings uniform over the turn."""
    low, high = key_halves(step_key(key, STREAM_INITIALIZE, 0))
    for m in range(x.shape[0]):
        x[m] = _F(low_x + (high_x - low_x) * unit_uniform(random_bits(low, high, _U(3 * m))))
        y[m] = _F(low_y + (high_y - low_y) * unit_uniform(random_bits(low, high, _U(3 * m + 1))))
        heading[m] = np.int32(random_bits(low, high, _U(3 * m + 2)))


@njit(cache=True, nogil=True)
def predict(key, step, increment, deviations, x, y, heading, scratch):
    """Line 3: move each particle by an odometry increment (body frame) plus noise (eq. 1); `scratch`: (M,) float32."""
    low, high = key_halves(step_key(key, STREAM_PREDICT, step))
    n_particles = x.shape[0]
    n = _U(n_particles)
    dx, dy = _F(increment[0]), _F(increment[1])
    turn = binary_angle(increment[2])
    sx, sy, sh = _F(deviations[0]), _F(deviations[1]), _F(deviations[2])
    for m in range(n_particles):
        noise_x, noise_y = normal_pair(random_bits(low, high, _U(m)), random_bits(low, high, _U(_U(m) + n)))
        forward = _F(dx + sx * noise_x)
        sideways = _F(dy + sy * noise_y)
        s, c = sin_cos(heading[m])
        x[m] += c * forward - s * sideways
        y[m] += s * forward + c * sideways
    # One pair of normals turns two particles.
    half = n_particles // 2
    for m in range(n_particles - half):
        i = _U(_U(m) + n + n)
        noise, other_noise = normal_pair(random_bits(low, high, i), random_bits(low, high, _U(i + n)))
        heading[m] = np.int32(heading[m] + turn + small_binary_angle(_F(sh * noise)))
        scratch[m] = _F(sh * other_noise)
    for m in range(half):
        k = n_particles - half + m
        heading[k] = np.int32(heading[k] + turn + small_binary_angle(scratch[m]))


@njit(cache=True, nogil=True)
def add_log_weights(tag_x, tag_y, antenna_x, antenna_y, whitening, inner_radius, log_tail, x, y, sines, cosines, out):
    """Line 4 for one read: add the logarithm of eq. 6 to each particle's log weight."""
    tx, ty, ax, ay = _F(tag_x), _F(tag_y), _F(antenna_x), _F(antenna_y)
    w00, w01, w10, w11 = whitening[0, 0], whitening[0, 1], whitening[1, 0], whitening[1, 1]
    inner, tail = _F(inner_radius * inner_radius), _F(log_tail)
    for m in range(x.shape[0]):
        dx, dy = tx - x[m], ty - y[m]
        u = _F(cosines[m] * dx + sines[m] * dy - ax)
        v = _F(cosines[m] * dy - sines[m] * dx - ay)
        p = _F(w00 * u + w01 * v)
        q = _F(w10 * u + w11 * v)
        d2 = _F(p * p + q * q)
        out[m] += _F(0.0) if d2 < inner else _F(tail - _F(0.5) * d2)


@njit(cache=True, nogil=True)
def normalize(log_weights, weights):
    """Weights relative to the best particle's, in (0, 1]."""
    best = log_weights[0]
    for m in range(1, log_weights.shape[0]):
        best = max(best, log_weights[m])
    for m in range(log_weights.shape[0]):
        weights[m] = exp_32(max(_F(log_weights[m] - best), _LOWEST_LOG))


@njit(cache=True, nogil=True)
def weighted_mean(x, y, sines, cosines, weights, out):
    """Eq. 3: weighted mean of the particles (heading: of the direction)."""
    # Offsets from the first particle keep the sums small against the building's coordinates.
    x0, y0 = x[0], y[0]
    total = sum_x = sum_y = sum_s = sum_c = 0.0
    for m in range(x.shape[0]):
        w = np.float64(weights[m])
        total += w
        sum_x += w * (x[m] - x0)
        sum_y += w * (y[m] - y0)
        sum_s += w * sines[m]
        sum_c += w * cosines[m]
    out[0] = x0 + sum_x / total
    out[1] = y0 + sum_y / total
    out[2] = atan2_64(sum_s, sum_c)


@njit(cache=True, nogil=True)
def draw_ancestors(key, step, weights, ancestors):
    """Lines 7-8: systematic resampling; `ancestors` (M + BLOCK,) int32 receives the particle that each draw takes.

    Weights are summed as integers, so that no sum depends on its order.
    """
    n = weights.shape[0]
    total = np.int64(0)
    for m in range(n):
        total += np.int64(weights[m] * _WEIGHT_UNITS)
    low, high = key_halves(step_key(key, STREAM_RESAMPLE, step))
    offset = np.float64(unit_uniform(random_bits(low, high, _U(0))))
    draws_per_unit = n / np.float64(total)
    cumulative = np.int64(0)
    begin = 0
    for m in range(n):
        cumulative += np.int64(weights[m] * _WEIGHT_UNITS)
        # Draw j takes the particle whose share of the n draws contains j + offset.
        end = min(np.int64(math.ceil(cumulative * draws_per_unit - offset)), n)
        # A block written whatever its length spares a branch per draw; what is too much is overwritten next.
        for k in range(BLOCK):
            ancestors[begin + k] = m
        for k in range(begin + BLOCK, end):
            ancestors[k] = m
        begin = end
    for k in range(begin, n):
        ancestors[k] = n - 1


@njit(cache=True, nogil=True)
def take(ancestors, x, y, heading, log_weights, new_x, new_y, new_heading, new_log_weights):
    """Lines 9-10: copy the drawn particles."""
    for j in range(x.shape[0]):
        m = ancestors[j]
        new_x[j] = x[m]
        new_y[j] = y[m]
        new_heading[j] = heading[m]
        new_log_weights[j] = log_weights[m]


@njit(cache=True, nogil=True)
def reinitialize(key, step, log_alpha, tags, antennas, x, y, heading, log_weights):
    """Lines 11-13 with eq. 4: a particle of weight below alpha restarts under a read tag with any heading.

    `tags` (n, 2) and `antennas` (n, 2) belong to the step's reads; the reads are dealt to the particles in turn.
    Returns how many particles restarted.
    """
    n_restarted = np.int32(0)
    for m in range(x.shape[0]):
        n_restarted += np.int32(log_weights[m] < log_alpha)
    # As a rule no particle restarts, and this loop, unlike the next, is a matter of nanoseconds.
    if n_restarted == 0:
        return n_restarted
    low, high = key_halves(step_key(key, STREAM_INITIALIZE, step + 1))
    n_reads = tags.shape[0]
    for m in range(x.shape[0]):
        if log_weights[m] < log_alpha:
            angle = np.int32(random_bits(low, high, _U(m)))
            s, c = sin_cos(angle)
            k = m % n_reads
            ax, ay = _F(antennas[k, 0]), _F(antennas[k, 1])
            x[m] = _F(tags[k, 0]) - (c * ax - s * ay)
            y[m] = _F(tags[k, 1]) - (s * ax + c * ay)
            heading[m] = angle
    return n_restarted


@njit(cache=True, nogil=True)
def fill_sin_cos(heading, sines, cosines):
    """Sine and cosine of each particle's heading."""
    for m in range(heading.shape[0]):
        sines[m], cosines[m] = sin_cos(heading[m])


@njit(cache=True, nogil=True)
def update(key, step, tags, antennas, whitenings, rules, particles, headings, scratch, ancestors, out):
    """Lines 4-13 for the reads of one step; writes the estimate (x, y, heading) to `out`.

    Parameters
    ----------
    tags, antennas : (n_reads, 2) position of the read tag on the map, and of its antenna on the robot at the read.
    whitenings : (n_reads, 2, 2) float32.
    rules : (inner_radius, log_tail, log_alpha); log_alpha = -inf turns reinitialization off.
    particles, headings : (2, 2, M) float32 and (2, M) int32; slot 0 holds the belief before and after, slot 1 is spare.
    scratch : (5, M) float32: sines, cosines, log weights, weights, resampled log weights.
    ancestors : (M + BLOCK,) int32 scratch.
    """
    x, y = particles[0, 0], particles[0, 1]
    sines, cosines, log_weights, weights = scratch[0], scratch[1], scratch[2], scratch[3]
    fill_sin_cos(headings[0], sines, cosines)
    n_reads = tags.shape[0]
    if n_reads == 0:
        weights[:] = _F(1.0)
        weighted_mean(x, y, sines, cosines, weights, out)
        return
    log_weights[:] = _F(0.0)
    for k in range(n_reads):
        add_log_weights(
            tags[k, 0], tags[k, 1], antennas[k, 0], antennas[k, 1], whitenings[k], rules[0], rules[1],
            x, y, sines, cosines, log_weights,
        )  # fmt: skip
    normalize(log_weights, weights)
    weighted_mean(x, y, sines, cosines, weights, out)
    draw_ancestors(key, step, weights, ancestors)
    take(ancestors, x, y, headings[0], log_weights, particles[1, 0], particles[1, 1], headings[1], scratch[4])
    particles[0] = particles[1]
    headings[0] = headings[1]
    if rules[2] > -1e30:
        reinitialize(key, step, _F(rules[2]), tags, antennas, x, y, headings[0], scratch[4])


@njit(cache=True, nogil=True)
def age_antennas(read_antenna, read_age, positions, increment, dt, out):
    """Where each read's antenna was, in the robot's frame at the end of the step.

    `increment` is the step's motion in the robot's frame at its begin, driven and turned at constant rates.
    """
    s_end, c_end = sin_cos_64(increment[2])
    for k in range(read_antenna.shape[0]):
        x, y = positions[read_antenna[k], 0], positions[read_antenna[k], 1]
        back = read_age[k] / dt
        s, c = sin_cos_64(back * increment[2])
        behind_x, behind_y = back * increment[0], back * increment[1]
        out[k, 0] = c * x + s * y - (c_end * behind_x + s_end * behind_y)
        out[k, 1] = c * y - s * x - (c_end * behind_y - s_end * behind_x)


@njit(cache=True, nogil=True)
def track(key, first, last, log, model, particles, headings, scratch, ancestors, estimates):
    """Run the filter over steps first..last-1 of a recording; estimates[t + 1] is the belief after step t.

    Parameters
    ----------
    log : (odometry (n, 3), read_start (n + 1,), read_antenna, read_tag_xy (r, 2), read_age (r,), dt).
    model : (positions (n, 2), whitening (n, 2, 2) float32, deviations (3,), rules, is_age_compensated).
    """
    odometry, read_start, read_antenna, read_tags, read_age, dt = log
    positions, whitening, deviations, rules, is_age_compensated = model
    n_most = 0
    for t in range(first, last):
        n_most = max(n_most, read_start[t + 1] - read_start[t])
    antennas = np.empty((n_most, 2))
    whitenings = np.empty((n_most, 2, 2), np.float32)
    ages = np.zeros(n_most)
    for t in range(first, last):
        predict(key, t, odometry[t], deviations, particles[0, 0], particles[0, 1], headings[0], scratch[0])
        a, b = read_start[t], read_start[t + 1]
        n = b - a
        if is_age_compensated:
            ages[:n] = read_age[a:b]
        age_antennas(read_antenna[a:b], ages[:n], positions, odometry[t], dt, antennas[:n])
        for k in range(n):
            whitenings[k] = whitening[read_antenna[a + k]]
        update(
            key,
            t,
            read_tags[a:b],
            antennas[:n],
            whitenings[:n],
            rules,
            particles,
            headings,
            scratch,
            ancestors,
            estimates[t + 1],
        )
