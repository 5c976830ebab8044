"""Where particles begin, and begin again: over a box, about a pose, under a read tag, in its detection region."""

import numpy as np

from rfiddesign.numerics._compile_kernels import kernel, leaf_kernel
from rfiddesign.numerics._lane_kernels import fma
from rfiddesign.numerics._math_kernels import binary_angle, sin_cos
from rfiddesign.numerics._noise_kernels import (
    STREAM_INITIALIZE,
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
