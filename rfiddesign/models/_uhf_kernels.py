"""Read probability of UHF tags, compiled; the readable caller is in uhf.py."""

import numpy as np

from rfiddesign.numerics import _lane_kernels as lanes
from rfiddesign.numerics._compile_kernels import inline_kernel, kernel, leaf_kernel
from rfiddesign.numerics._lane_kernels import LANES, fma
from rfiddesign.numerics._math_kernels import exp_32, log_32, sin_cos_64

_F = np.float32
_DB_PER_NEPER = _F(4.342944819032518)  # 10 / ln 10, of power
_NEAREST_MM2 = _F(1e4)
#: In units of the softness: further below the threshold a tag is not read at all, a chance of 6e-6 at most.
DEEPEST = _F(12.0)
#: No fading beyond so many standard deviations is looked for.
FARTHEST_SIGMA = _F(5.0)


@inline_kernel
def _way(tags, place, height, at):
    """Way (dx, dy) [mm] from an antenna to LANES tags, and its square with the rise [mm2]."""
    dx, dy = lanes.load(tags[0], place) - at[0], lanes.load(tags[1], place) - at[1]
    dz = lanes.load(tags[4], place) - height
    return dx, dy, lanes.greater(fma(dx, dx, fma(dy, dy, dz * dz)), _NEAREST_MM2)


@inline_kernel
def _link(tags, place, way, at, law):
    """Margin [dB] of LANES tags without fading and obstacles."""
    dx, dy, d2 = way
    reach, _, beam_db, beam_most, tag_least = law[0], law[1], law[2], law[3], law[4]
    log_d2 = log_32(d2)
    inverse = exp_32(log_d2 * _F(-0.5))
    off_boresight = _F(1.0) - fma(dx, at[2], dy * at[3]) * inverse
    facing = fma(dx, lanes.load(tags[2], place), dy * lanes.load(tags[3], place)) * inverse
    pattern = lanes.lesser(off_boresight * beam_db, beam_most)
    tag_db = log_32(lanes.greater(facing * facing, tag_least)) * _DB_PER_NEPER
    return fma(log_d2, -_DB_PER_NEPER, reach) - pattern + tag_db + lanes.load(tags[5], place)


@leaf_kernel
def _is_crossed(ax, ay, bx, by, edges, first, last):
    """Whether the way from a to b crosses one of some edges (x0, y0, x1, y1)."""
    dx, dy = bx - ax, by - ay
    for e in range(first, last):
        x0, y0, x1, y1 = edges[e, 0] - ax, edges[e, 1] - ay, edges[e, 2] - ax, edges[e, 3] - ay
        if (dx * y0 - dy * x0 > 0.0) == (dx * y1 - dy * x1 > 0.0):
            continue
        # The ends of the edge are on two sides of the line through a and b; so are a and b of the edge's line?
        ex, ey = x1 - x0, y1 - y0
        at_a = ey * x0 - ex * y0
        at_b = at_a + ex * dy - ey * dx
        if (at_a > 0.0) != (at_b > 0.0):
            return True
    return False


@leaf_kernel
def blocking_db(ax, ay, bx, by, edges, edge_start, bounds, loss):
    """What the obstacles between two places take [dB]: the sum of `loss` (k,) of those whose outline is crossed.

    Obstacle k has the edges edge_start[k] to edge_start[k + 1] - 1 and the box `bounds` (k, 4), low x, y, high x, y.
    """
    low_x, high_x, low_y, high_y = min(ax, bx), max(ax, bx), min(ay, by), max(ay, by)
    total = 0.0
    for k in range(loss.shape[0]):
        if bounds[k, 0] > high_x or bounds[k, 2] < low_x or bounds[k, 1] > high_y or bounds[k, 3] < low_y:
            continue
        if _is_crossed(ax, ay, bx, by, edges, edge_start[k], edge_start[k + 1]):
            total += loss[k]
    return total


@kernel
def read_probability(poses, height, tags, fading, law, obstacles, out):
    """Write the chance of each tag to be read from each pose to `out` (n, n_tags), zeros; see `UhfWorld`.

    Parameters
    ----------
    poses : (n, 3) of the antenna.
    height : of the antenna [mm], float32.
    tags : x, y, normal x, normal y, height and offset [dB], each (m,) float32, m a multiple of LANES.
    fading : frequencies (k, 4) over x, y [1/mm] and the boresight's cosine and sine; weights (m / LANES, 2 k, LANES)
        float32 [dB], flat.
    law : float32: margin at 1 mm [dB], range squared [mm2], loss per 1 - cos [dB] and at most [dB], least squared
        cosine at a tag; deviation of the fading [dB], softness [dB], chance at most.
    obstacles : see `blocking_db`.
    """
    frequencies, weights = fading
    deviation, softness, most = law[5], law[6], law[7]
    n_tags, n_features = out.shape[1], 2 * frequencies.shape[0]
    features, margins = np.empty(n_features, np.float32), np.empty(LANES, np.float32)
    edges, edge_start, bounds, loss = obstacles
    deepest = -DEEPEST * softness
    before_fading = deepest - FARTHEST_SIGMA * deviation
    for i in range(poses.shape[0]):
        x, y = poses[i, 0], poses[i, 1]
        sine, cosine = sin_cos_64(poses[i, 2])
        for k in range(frequencies.shape[0]):
            f = frequencies[k]
            s, c = sin_cos_64(f[0] * x + f[1] * y + f[2] * cosine + f[3] * sine)
            features[2 * k], features[2 * k + 1] = c, s
        at = (_F(x), _F(y), _F(cosine), _F(sine))
        for place in range(0, n_tags, LANES):
            n_here = min(LANES, n_tags - place)
            way = _way(tags, place, height, at)
            is_near = way[2] < law[1]
            if lanes.how_many(is_near) == 0:
                continue
            margin = lanes.choose(is_near, _link(tags, place, way, at, law), _F(-1e9))
            if lanes.how_many(lanes.copies(before_fading) < margin) == 0:
                continue
            begin = place * n_features
            for k in range(n_features):
                margin = fma(lanes.load(weights, begin + k * LANES), lanes.copies(features[k]), margin)
            lanes.store(margins, 0, margin)
            for j in range(n_here):
                if margins[j] <= deepest:
                    continue
                m = margins[j] - _F(
                    blocking_db(x, y, np.float64(tags[0][place + j]), np.float64(tags[1][place + j]),
                                edges, edge_start, bounds, loss)
                )  # fmt: skip
                if m > deepest:
                    out[i, place + j] = most / (_F(1.0) + exp_32(-min(m / softness, _F(40.0))))
