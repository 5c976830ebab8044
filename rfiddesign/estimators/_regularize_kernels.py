"""Liu-West regularization: particles drawn more than once are set apart, their mean and covariance kept.

Each drawn particle shrinks towards the belief's mean by a = sqrt(1 - h^2) and gets noise of covariance h^2 V, V being
the belief's covariance: a^2 V + h^2 V = V (Liu and West 2001, Combined parameter and state estimation in
simulation-based filtering, section 3.2).  The noise is drawn together with that of the next motion, since a sum of two
Gaussians is a Gaussian.

What is known of the drawn particles lies in `about` (1, N_ABOUT) float64: their moments in the columns of an estimate,
and the squared bandwidth h^2 of the noise that they are due, 0 for none.
"""

import math

import numpy as np

from rfiddesign.estimators._estimate_kernels import N_ESTIMATE
from rfiddesign.estimators._particle_kernels import HEADING, X, Y, turn
from rfiddesign.numerics import _lane_kernels as lanes
from rfiddesign.numerics._compile_kernels import inline_kernel, leaf_kernel
from rfiddesign.numerics._lane_kernels import LANES, fma
from rfiddesign.numerics._math_kernels import binary_angle, sin_cos, sin_cos_64, small_binary_angle
from rfiddesign.numerics._noise_kernels import STREAM_PREDICT, key_halves, random_triple, standard_normal, step_key

_F = np.float32
_U = np.uint32
DUE = N_ESTIMATE
N_ABOUT = N_ESTIMATE + 1
# Columns of the rules of `_mcl_kernels.update`.
BANDWIDTH, MOST_VARIANCE = 6, 7
# Particles that turn more than this (one sigma) lie about no mean heading [rad].
MOST_SPREAD = 0.3
# Normals reach 6.4 sigma and three of them make a turn, which must stay below half a turn [rad].
MOST_TURN_VARIANCE = 0.28**2


@inline_kernel
def is_concentrated(moments, row, most_variance):
    """Whether a belief is one heap: its position within `most_variance` [mm^2] and its heading within 0.3 rad."""
    is_near = moments[row, 3] + moments[row, 5] < most_variance
    return is_near and moments[row, 8] < MOST_SPREAD * MOST_SPREAD


@leaf_kernel
def bandwidth_due(moments, row, n_particles, rules):
    """Squared bandwidth of the noise for particles drawn from a belief with these moments; 0: none.

    By the share of the particles that resampling lost: evidence that says little doubles few, and asks for no kernel.
    `rules` as in `_mcl_kernels.update`.
    """
    if not is_concentrated(moments, row, rules[MOST_VARIANCE]):
        return 0.0
    return rules[BANDWIDTH] * max(1.0 - moments[row, N_ESTIMATE - 1] / n_particles, 0.0)


@leaf_kernel
def remember(moments, row, due, about):
    """Keep the moments of drawn particles, and the squared bandwidth of the noise that they are due."""
    for column in range(N_ESTIMATE):
        about[0, column] = moments[row, column]
    about[0, DUE] = due


@leaf_kernel
def covariance_ahead(about, factor, increment, variances):
    """Covariance (xx, xy, yy, xh, yh, hh) after a step, in the robot's axes before it.

    That of `about` times `factor`, whose turn by e moves the end of the way u by e (-u_y, u_x), and the motion's noise
    of `variances` (x, y, heading).
    """
    s, c = sin_cos_64(about[0, 2])
    dx, dy, _ = increment
    qx, qy, qh = variances
    xx, xy, yy, xh, yh = about[0, 3], about[0, 4], about[0, 5], about[0, 6], about[0, 7]
    ss, sc, cc, hh = s * s, s * c, c * c, factor * about[0, 8]
    uu, uv = factor * (cc * xx + 2.0 * sc * xy + ss * yy), factor * (sc * (yy - xx) + (cc - ss) * xy)
    vv, uh, vh = factor * (ss * xx - 2.0 * sc * xy + cc * yy), factor * (c * xh + s * yh), factor * (c * yh - s * xh)
    return (
        uu - 2.0 * dy * uh + dy * dy * hh + qx,
        uv + dx * uh - dy * vh - dx * dy * hh,
        vv + 2.0 * dx * vh + dx * dx * hh + qy,
        uh - dy * hh,
        vh + dx * hh,
        hh + qh,
    )


@leaf_kernel
def root_of(covariance):
    """Lower triangular root (xx, yx, yy, hx, hy, hh) of a covariance as above, zero where this has no width."""
    xx, xy, yy, xh, yh, hh = covariance
    a = math.sqrt(max(xx, 0.0))
    b, d = (xy / a, xh / a) if a > 0.0 else (0.0, 0.0)
    c = math.sqrt(max(yy - b * b, 0.0))
    e = (yh - d * b) / c if c * c > 1e-9 * yy else 0.0
    return a, b, c, d, e, math.sqrt(max(hh - d * d - e * e, 0.0))


@leaf_kernel
def predict_apart(key, step, increment, root, about, drawn, headings, cloud):
    """As `_mcl_kernels.predict`, with the shrinking that is due, and with all noise by its root (see `root_of`)."""
    width, room = cloud.shape[1], drawn.shape[1]
    low, high = key_halves(step_key(key, STREAM_PREDICT, step))
    dx, dy, turned = _F(increment[0]), _F(increment[1]), binary_angle(increment[2])
    xx, yx, yy, hx, hy, hh = _F(root[0]), _F(root[1]), _F(root[2]), _F(root[3]), _F(root[4]), _F(root[5])
    shrink = _F(1.0 - math.sqrt(1.0 - about[0, DUE]))
    mean_x, mean_y, mean_heading = _F(about[0, 0]), _F(about[0, 1]), binary_angle(about[0, 2])
    # Two loops, so that the constants of each stay in registers.
    for i in range(0, width, LANES):
        for_x, for_y, for_heading = random_triple(low, high, lanes.count_up(_U(i)))
        p, q, r = standard_normal(for_x), standard_normal(for_y), standard_normal(for_heading)
        lanes.store(cloud, X * width + i, fma(p, xx, dx))
        lanes.store(cloud, Y * width + i, fma(q, yy, fma(p, yx, dy)))
        lanes.store(cloud, HEADING * width + i, fma(r, hh, fma(q, hy, p * hx)))
    for i in range(0, width, LANES):
        forward, sideways = lanes.load(cloud, X * width + i), lanes.load(cloud, Y * width + i)
        turn_noise = small_binary_angle(lanes.load(cloud, HEADING * width + i))
        x, y, heading = lanes.load(drawn, i), lanes.load(drawn, room + i), lanes.load(headings, i)
        x, y = fma(mean_x - x, shrink, x), fma(mean_y - y, shrink, y)
        back = lanes.to_float(lanes.subtract(mean_heading, heading)) * shrink
        heading = lanes.add(heading, lanes.to_integer(back))
        s, c = sin_cos(heading)
        lanes.store(cloud, X * width + i, x + fma(c, forward, -(s * sideways)))
        lanes.store(cloud, Y * width + i, y + fma(s, forward, c * sideways))
        turn(lanes.add(lanes.add(heading, turned), turn_noise), cloud, i)


@leaf_kernel
def move_moments(about, increment, variances):
    """The moments after a step: mean moved, covariance F P F' + G Q G'; nothing is due any more."""
    xx, xy, yy, xh, yh, hh = covariance_ahead(about, 1.0, increment, variances)
    s, c = sin_cos_64(about[0, 2])
    dx, dy, turned = increment
    heading = about[0, 2] + turned
    about[0, 0] += c * dx - s * dy
    about[0, 1] += s * dx + c * dy
    about[0, 2] = heading - 2.0 * math.pi * math.floor(heading * (0.5 / math.pi) + 0.5)
    about[0, 3], about[0, 4] = c * c * xx - 2.0 * s * c * xy + s * s * yy, s * c * (xx - yy) + (c * c - s * s) * xy
    about[0, 5] = s * s * xx + 2.0 * s * c * xy + c * c * yy
    about[0, 6], about[0, 7], about[0, 8] = c * xh - s * yh, s * xh + c * yh, min(hh, math.pi**2 / 3.0)
    about[0, DUE] = 0.0
