"""A drive that takes snapshots, compiled; the readable caller is in snapshot_drive.py."""

import numpy as np

from rfiddesign.numerics._compile_kernels import kernel
from rfiddesign.numerics._math_kernels import sin_cos_64
from rfiddesign.numerics._noise_kernels import key_halves, random_bits, step_key, unit_uniform


@kernel
def antenna_poses(poses, mounting, out):
    """Poses `out` (n, 3) of an antenna mounted at (x, y, yaw) on a robot at `poses` (n, 3)."""
    for i in range(poses.shape[0]):
        s, c = sin_cos_64(poses[i, 2])
        out[i, 0] = poses[i, 0] + c * mounting[0] - s * mounting[1]
        out[i, 1] = poses[i, 1] + s * mounting[0] + c * mounting[1]
        out[i, 2] = poses[i, 2] + mounting[2]


@kernel
def dead_reckon(begin, steps, out):
    """Poses `out` (n + 1, 3) that increments `steps` (n, 3) lead to from a pose; headings unwrapped."""
    x, y, heading = begin[0], begin[1], begin[2]
    out[0, 0], out[0, 1], out[0, 2] = x, y, heading
    for t in range(steps.shape[0]):
        s, c = sin_cos_64(heading)
        x += c * steps[t, 0] - s * steps[t, 1]
        y += s * steps[t, 0] + c * steps[t, 1]
        heading += steps[t, 2]
        out[t + 1, 0], out[t + 1, 1], out[t + 1, 2] = x, y, heading


@kernel
def increments(poses, out):
    """Motion `out` (n, 3) from each of `poses` (n, 3), headings unwrapped, to the next, in the frame there; 0 first."""
    out[0] = 0.0
    for t in range(1, poses.shape[0]):
        s, c = sin_cos_64(poses[t - 1, 2])
        dx, dy = poses[t, 0] - poses[t - 1, 0], poses[t, 1] - poses[t - 1, 1]
        out[t, 0], out[t, 1] = c * dx + s * dy, c * dy - s * dx
        out[t, 2] = poses[t, 2] - poses[t - 1, 2]


@kernel
def draw_counts(key, stream, first, n_cycles, chances, start, tag, count):
    """Draw how often each tag is read in the cycles of some inquiries; returns how many entries there are.

    Parameters
    ----------
    key, stream : of the draws; those of an inquiry depend on its number and the tag alone.
    first : number of the first inquiry.
    chances : (n n_cycles, n_tags) float32, of each cycle of each inquiry.
    start : (n + 1,) start[0] is set; the others are written.
    tag, count : entries, with room for n n_tags.
    """
    n_tags, m = chances.shape[1], start[0]
    for i in range(start.shape[0] - 1):
        low, high = key_halves(step_key(key, stream, first + i))
        begin = i * n_cycles
        for j in range(n_tags):
            n_read = 0
            for c in range(n_cycles):
                chance = chances[begin + c, j]
                if chance > 0.0 and unit_uniform(random_bits(low, high, np.uint32(c * n_tags + j))) < chance:
                    n_read += 1
            if n_read > 0:
                tag[m - start[0]], count[m - start[0]] = j, n_read
                m += 1
        start[i + 1] = m
    return m - start[0]
