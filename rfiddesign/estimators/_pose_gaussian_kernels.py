"""A Gaussian over the pose, mean (3,) and covariance (3, 3): motion, measurement and updates of a Kalman filter."""

import math

from rfiddesign.models._motion_kernels import step_variances
from rfiddesign.numerics._compile_kernels import inline_kernel, leaf_kernel
from rfiddesign.numerics._math_kernels import sin_cos_64

# Least variances that rounding may leave.
_LEAST = (1e-6, 1e-6, 1e-12)
# Below this a few terms of the series of sine and cosine are exact [rad].
_SMALL_TURN = 0.06


@leaf_kernel
def predict_pose(pose, P, odometry, row, noise):
    """Move the pose by an increment in the robot's frame; P becomes F P F' + G Q G'."""
    s, c = sin_cos_64(pose[2])
    carry(pose, P, s, c, odometry, row, noise)


@leaf_kernel
def direction_of(heading, direction):
    """Sine and cosine of a heading (error below 1e-12), from those of the last one asked for if it is near."""
    turn = heading - direction[0]
    if turn == 0.0:
        return direction[1], direction[2]
    if abs(turn) < _SMALL_TURN:
        # Series up to the eighth power, in sums that do not wait for each other.
        t2 = turn * turn
        t4 = t2 * t2
        s = turn * ((1.0 - t2 * (1 / 6)) + t4 * (1 / 120 - t2 * (1 / 5040)))
        c = (1.0 - 0.5 * t2) + t4 * ((1 / 24 - t2 * (1 / 720)) + t4 * (1 / 40320))
        s, c = direction[1] * c + direction[2] * s, direction[2] * c - direction[1] * s
    else:
        s, c = sin_cos_64(heading)
    direction[0], direction[1], direction[2] = heading, s, c
    return s, c


@inline_kernel
def carry(pose, P, s, c, odometry, row, noise):
    """`predict_pose` for a heading of known sine and cosine."""
    dx, dy, turn = odometry[row, 0], odometry[row, 1], odometry[row, 2]
    qx, qy, qh = step_variances(noise, dx, dy, turn)
    ahead_x, ahead_y = c * dx - s * dy, s * dx + c * dy
    pose[0] += ahead_x
    pose[1] += ahead_y
    pose[2] = wrapped(pose[2] + turn)
    # F adds to x and y what the heading's error does to the way.
    fx, fy = -ahead_y, ahead_x
    xx, xy, yy, xh, yh, hh = P[0, 0], P[0, 1], P[1, 1], P[0, 2], P[1, 2], P[2, 2]
    P[0, 0] = xx + 2.0 * fx * xh + fx * fx * hh + c * c * qx + s * s * qy
    P[0, 1] = xy + fx * yh + fy * xh + fx * fy * hh + s * c * (qx - qy)
    P[1, 1] = yy + 2.0 * fy * yh + fy * fy * hh + s * s * qx + c * c * qy
    P[0, 2] = xh + fx * hh
    P[1, 2] = yh + fy * hh
    P[2, 2] = hh + qh
    _mirror(P)


@inline_kernel
def wrapped(angle):
    """The angle in [-pi, pi]; one that is there already stays as it is."""
    if abs(angle) <= math.pi:
        return angle
    return angle - 2.0 * math.pi * math.floor(angle * (0.5 / math.pi) + 0.5)


@inline_kernel
def _mirror(P):
    P[1, 0], P[2, 0], P[2, 1] = P[0, 1], P[0, 2], P[1, 2]
    for i in range(3):
        P[i, i] = max(P[i, i], _LEAST[i])


@inline_kernel
def correct(pose, P, g0, g1, g2, innovation, variance):
    """Scalar update with the row G = (g0, g1, g2): K = P G' / S, S = G P G' + variance; returns S."""
    p0 = P[0, 0] * g0 + P[0, 1] * g1 + P[0, 2] * g2
    p1 = P[1, 0] * g0 + P[1, 1] * g1 + P[1, 2] * g2
    p2 = P[2, 0] * g0 + P[2, 1] * g1 + P[2, 2] * g2
    S = g0 * p0 + g1 * p1 + g2 * p2 + variance
    per_S = 1.0 / S
    k0, k1, k2 = p0 * per_S, p1 * per_S, p2 * per_S
    pose[0] += k0 * innovation
    pose[1] += k1 * innovation
    pose[2] = wrapped(pose[2] + k2 * innovation)
    P[0, 0] -= k0 * p0
    P[0, 1] -= k0 * p1
    P[1, 1] -= k1 * p1
    P[0, 2] -= k0 * p2
    P[1, 2] -= k1 * p2
    P[2, 2] -= k2 * p2
    _mirror(P)
    return S


@inline_kernel
def correct_place(pose, P, H, innovation_u, innovation_v, ruu, ruv, rvv):
    """Update with both coordinates of a place: K = P H' S^-1, S = H P H' + R.

    H : (h00, h01, h02, h10, h11, h12) by rows; R by (ruu, ruv, rvv).
    """
    h00, h01, h02, h10, h11, h12 = H
    p0 = P[0, 0] * h00 + P[0, 1] * h01 + P[0, 2] * h02
    p1 = P[1, 0] * h00 + P[1, 1] * h01 + P[1, 2] * h02
    p2 = P[2, 0] * h00 + P[2, 1] * h01 + P[2, 2] * h02
    q0 = P[0, 0] * h10 + P[0, 1] * h11 + P[0, 2] * h12
    q1 = P[1, 0] * h10 + P[1, 1] * h11 + P[1, 2] * h12
    q2 = P[2, 0] * h10 + P[2, 1] * h11 + P[2, 2] * h12
    suu = h00 * p0 + h01 * p1 + h02 * p2 + ruu
    suv = h10 * p0 + h11 * p1 + h12 * p2 + ruv
    svv = h10 * q0 + h11 * q1 + h12 * q2 + rvv
    # K = P H' S^-1, by columns k and l.
    per_det = 1.0 / (suu * svv - suv * suv)
    inv_uu, inv_uv, inv_vv = svv * per_det, -suv * per_det, suu * per_det
    k0, k1, k2 = p0 * inv_uu + q0 * inv_uv, p1 * inv_uu + q1 * inv_uv, p2 * inv_uu + q2 * inv_uv
    l0, l1, l2 = p0 * inv_uv + q0 * inv_vv, p1 * inv_uv + q1 * inv_vv, p2 * inv_uv + q2 * inv_vv
    pose[0] += k0 * innovation_u + l0 * innovation_v
    pose[1] += k1 * innovation_u + l1 * innovation_v
    pose[2] = wrapped(pose[2] + k2 * innovation_u + l2 * innovation_v)
    P[0, 0] -= k0 * p0 + l0 * q0
    P[0, 1] -= k0 * p1 + l0 * q1
    P[1, 1] -= k1 * p1 + l1 * q1
    P[0, 2] -= k0 * p2 + l0 * q2
    P[1, 2] -= k1 * p2 + l1 * q2
    P[2, 2] -= k2 * p2 + l2 * q2
    _mirror(P)


@inline_kernel
def in_antenna_frame(pose, direction, x, y, ys, yc, tag_x, tag_y):
    """Where a tag lies in the frame of an antenna at (x, y) on the robot: z, and its derivative H by rows.

    p = R'(theta) (t - xy), z = R'(yaw) (p - a); H = [-R'(theta + yaw) | R'(yaw) (p_y, -p_x)]; (ys, yc) are sine and
    cosine of yaw.
    """
    s, c = direction_of(pose[2], direction)
    dx, dy = tag_x - pose[0], tag_y - pose[1]
    px, py = c * dx + s * dy, c * dy - s * dx
    u, v = yc * (px - x) + ys * (py - y), yc * (py - y) - ys * (px - x)
    both_s, both_c = s * yc + c * ys, c * yc - s * ys
    return u, v, (-both_c, -both_s, yc * py - ys * px, both_s, -both_c, -yc * px - ys * py)
