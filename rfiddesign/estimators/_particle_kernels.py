"""How particles lie in memory, and systematic resampling of them.

Between steps the particles lie in `drawn`: float32 x, y [mm] and log weight, and int32 binary headings beside it.
Within a step they lie in the fields of a `cloud`.  All arrays hold whole groups of LANES; lanes beyond the last
particle hold numbers that count for nothing.
"""

import math

import numpy as np

from rfiddesign.numerics import _lane_kernels as lanes
from rfiddesign.numerics._compile_kernels import inline_kernel, leaf_kernel
from rfiddesign.numerics._lane_kernels import LANES
from rfiddesign.numerics._math_kernels import sin_cos
from rfiddesign.numerics._noise_kernels import STREAM_RESAMPLE, key_halves, random_bits, step_key, unit_uniform

_F = np.float32
_I = np.int32
_U = np.uint32
# Rows of a cloud.
X, Y, HEADING, SINE, COSINE, LOG, WEIGHT = range(7)
N_FIELDS = 7
# The sum of all weights in resampling, as a power of two.
_TOTAL_BITS = 30
_CACHE_LINE = 64


def room_for(n_particles: int) -> int:
    """Length of the arrays that `resample` writes `n_particles` to: it writes whole groups until there are enough."""
    return -(-n_particles // LANES) * LANES + 2 * LANES


def aligned_zeros(shape: tuple[int, ...], dtype: type) -> np.ndarray:
    """Zeros that begin on a line of the cache, so that no load or store of LANES numbers takes two."""
    n_bytes = math.prod(shape) * np.dtype(dtype).itemsize
    room = np.zeros(n_bytes + _CACHE_LINE, np.uint8)
    begin = -room.ctypes.data % _CACHE_LINE
    return room[begin : begin + n_bytes].view(dtype).reshape(shape)


@leaf_kernel
def load(drawn, headings, cloud):
    """Bring the drawn particles into the cloud, each with weight 1."""
    width = cloud.shape[1]
    for i in range(0, width, LANES):
        angle = lanes.load(headings, i)
        lanes.store(cloud, X * width + i, lanes.load(drawn[0], i))
        lanes.store(cloud, Y * width + i, lanes.load(drawn[1], i))
        turn(angle, cloud, i)


@inline_kernel
def turn(angle, cloud, i):
    """Set the heading of the particles from i on, and their weight to 1."""
    width = cloud.shape[1]
    s, c = sin_cos(angle)
    lanes.store(cloud, HEADING * width + i, lanes.float_of(angle))
    lanes.store(cloud, SINE * width + i, s)
    lanes.store(cloud, COSINE * width + i, c)
    lanes.store(cloud, LOG * width + i, lanes.copies(_F(0.0)))


@leaf_kernel
def store(cloud, drawn, headings):
    """The inverse of `load`."""
    width = cloud.shape[1]
    for i in range(0, width, LANES):
        lanes.store(drawn[0], i, lanes.load(cloud, X * width + i))
        lanes.store(drawn[1], i, lanes.load(cloud, Y * width + i))
        lanes.store(headings, i, lanes.bits_of(lanes.load(cloud, HEADING * width + i)))


@leaf_kernel
def _stretch(cloud, factor):
    """Multiply the shares, which are in the weights' place, and sum them by lanes."""
    width = cloud.shape[1]
    sums = lanes.copies(_I(0))
    for i in range(WEIGHT * width, (WEIGHT + 1) * width, LANES):
        share = lanes.to_float(lanes.bits_of(lanes.load(cloud, i)))
        share = lanes.to_integer(lanes.fma(share, factor, _F(0.5)))
        lanes.store(cloud, i, lanes.float_of(share))
        sums = lanes.add(sums, share)
    return sums


@leaf_kernel
def resample(key, step, n_particles, total, has_logs, cloud, drawn, headings):
    """Systematic resampling (hf_multireader_mcl, Algorithm 1, lines 7-10) from the cloud to `drawn`.

    Weights are laid end to end as integers, lane by lane of all groups, in units such that draw j takes the particle
    whose share contains j 2^shift + offset: no sum depends on its order, no search is needed, and all lanes are
    counted at once.  In the cloud the shares take the weights' place.

    Parameters
    ----------
    total : sum of the weights.
    has_logs : whether the particles' log weights are written to `drawn[2]`.
    drawn, headings : (3, `room_for(n_particles)`) float32 x, y, log weight, and int32.
    """
    width, room = cloud.shape[1], drawn.shape[1]
    shift = _TOTAL_BITS
    while n_particles << shift > 1 << _TOTAL_BITS:
        shift -= 1
    scale = _F(np.float64(n_particles) * np.float64(1 << shift) / total)
    sums = lanes.copies(_I(0))
    for i in range(WEIGHT * width, (WEIGHT + 1) * width, LANES):
        share = lanes.to_integer(lanes.fma(lanes.load(cloud, i), scale, _F(0.5)))
        lanes.store(cloud, i, lanes.float_of(share))
        sums = lanes.add(sums, share)
    # A sum of many numbers in single precision is not the whole that the shares add up to.
    whole, summed = np.int64(n_particles) << shift, lanes.total(sums)
    if abs(summed - whole) > 1 << shift:
        sums = _stretch(cloud, _F(np.float64(whole) / np.float64(summed)))
    low, high = key_halves(step_key(key, STREAM_RESAMPLE, step))
    offset = np.int64(np.float64(unit_uniform(random_bits(low, high, _U(0)))) * np.float64(1 << shift))
    # Where each lane begins; counts draws rounded up.
    ends = lanes.add(lanes.subtract(lanes.running_sums(sums), sums), _I((1 << shift) - 1 - offset))
    drawn_before = lanes.shift_right(ends, shift)
    place = 0
    for i in range(0, width, LANES):
        x, y = lanes.load(cloud, X * width + i), lanes.load(cloud, Y * width + i)
        heading = lanes.bits_of(lanes.load(cloud, HEADING * width + i))
        ends = lanes.add(ends, lanes.bits_of(lanes.load(cloud, WEIGHT * width + i)))
        drawn_now = lanes.shift_right(ends, shift)
        count = lanes.subtract(drawn_now, drawn_before)
        drawn_before = drawn_now
        # As a rule there are up to two copies, which saves asking.
        copy, is_more = 1, place < n_particles
        while is_more:
            is_taken = lanes.is_at_least(count, copy)
            lanes.store_chosen(drawn, place, x, is_taken)
            lanes.store_chosen(drawn, room + place, y, is_taken)
            lanes.store_chosen(headings, place, heading, is_taken)
            if has_logs:
                lanes.store_chosen(drawn, 2 * room + place, lanes.load(cloud, LOG * width + i), is_taken)
            place += lanes.how_many(is_taken)
            copy += 1
            is_more = place < n_particles and (copy < 3 or lanes.how_many(lanes.is_at_least(count, copy)) > 0)
    # Rounding may leave the last draw without a particle, and lanes beyond it must hold numbers: they take the one
    # before.
    for k in range(min(place, n_particles), width):
        for field in range(3):
            drawn[field, k] = drawn[field, k - 1]
        headings[k] = headings[k - 1]
