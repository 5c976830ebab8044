"""Particles in the arrays of the compiled filter, for the tests of its kernels."""

import numpy as np

from rfiddesign.estimators import _particle_kernels as kernels
from rfiddesign.numerics._lane_kernels import LANES
from rfiddesign.numerics._math_kernels import RADIANS_PER_BINARY_UNIT
from rfiddesign.numerics._noise_kernels import run_key

KEY = np.uint64(run_key(np.uint64(5), np.uint64(3)))


def particles_of(n, rng, extent=200.0, centre=(0.0, 0.0)):
    """x, y (float32) and binary headings of n particles, headings all around."""
    x, y = (rng.uniform(-extent, extent, (2, n)) + np.array(centre)[:, None]).astype(np.float32)
    return x, y, rng.integers(-(2**31), 2**31, n).astype(np.int32)


def poses_of(x, y, heading):
    """(n, 3) poses in double precision."""
    return np.stack([x, y, heading * RADIANS_PER_BINARY_UNIT], axis=-1).astype(float)


def width_of(n):
    """Numbers in a row of a cloud of n particles."""
    return -(-n // LANES) * LANES


def drawn_of(x, y, heading, guard=0):
    """The arrays `drawn` and `headings` with these particles, and room for resampling as many of them.

    Beyond the last particle, and in `guard` more places than the kernels are promised, all are -7.
    """
    room = kernels.room_for(x.size) + guard
    drawn, headings = np.full((3, room), -7.0, np.float32), np.full(room, -7, np.int32)
    drawn[0, : x.size], drawn[1, : x.size], headings[: x.size] = x, y, heading
    return drawn, headings


def cloud_of(x, y, heading, log=0.0, weight=0.0):
    """A cloud of these particles; lanes beyond the last one hold wild numbers, but weigh nothing."""
    n = x.size
    drawn, headings = drawn_of(x, y, heading)
    drawn[:2, n:], headings[n:] = 3e6, 2**30 + 5
    cloud = np.full((kernels.N_FIELDS, width_of(n)), 7.0, np.float32)
    kernels.load(drawn, headings, cloud)
    cloud[kernels.LOG, :n], cloud[kernels.LOG, n:] = log, 20.0
    cloud[kernels.WEIGHT, :n], cloud[kernels.WEIGHT, n:] = weight, 0.0
    return cloud


def reads_of(tags, antennas, whitenings, table=0):
    """(n, N_READ) float32 rows of evidence, see `_evidence_kernels`; one whitening may be of all, and one table."""
    tags, antennas = np.reshape(tags, (-1, 2)), np.reshape(antennas, (-1, 2))
    rows = np.broadcast_to(np.reshape(whitenings, (-1, 4)), (len(tags), 4))
    numbers = np.broadcast_to(np.reshape(table, (-1, 1)), (len(tags), 1))
    return np.hstack([tags, antennas, rows, numbers]).astype(np.float32)
