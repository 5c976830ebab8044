"""Extended Kalman filters over the pose that take a read as a quantized place or as a constraint; see ekf.py.

A belief is the arrays pose (3,), covariance (3, 3), search (see `_acquisition_kernels`), memory (n_antennas, 4):
whether a tag was last read, the tag, its RSSI; and doubt (1,): successive reads that contradicted the belief.
"""

import math

from rfiddesign.estimators._acquisition_kernels import STAGE, advance, find_pose, restart
from rfiddesign.estimators._evidence_kernels import antenna_then
from rfiddesign.models._motion_kernels import step_variances
from rfiddesign.models._shape_kernels import signed_distance
from rfiddesign.numerics._compile_kernels import inline_kernel, kernel, leaf_kernel
from rfiddesign.numerics._math_kernels import sin_cos_64

QUANTIZED, CONSTRAINED = 0, 1
# Closer to the centre of a disc than this its border has no direction.
_LEAST_GRADIENT = 0.5
# Least variances that rounding may leave.
_LEAST = (1e-6, 1e-6, 1e-12)
# Variances of a robot that is lost: 1 m, any heading.
_LOST = (1e6, 1e6, math.pi**2 / 3)


@leaf_kernel
def predict_pose(pose, P, odometry, row, noise):
    """Move the pose by an increment in the robot's frame; P becomes F P F' + G Q G'."""
    dx, dy, turn = odometry[row, 0], odometry[row, 1], odometry[row, 2]
    qx, qy, qh = step_variances(noise, dx, dy, turn)
    s, c = sin_cos_64(pose[2])
    ahead_x, ahead_y = c * dx - s * dy, s * dx + c * dy
    pose[0] += ahead_x
    pose[1] += ahead_y
    pose[2] = _wrapped(pose[2] + turn)
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
def _wrapped(angle):
    if abs(angle) <= math.pi:
        return angle
    return angle - 2.0 * math.pi * math.floor(angle * (0.5 / math.pi) + 0.5)


@inline_kernel
def _mirror(P):
    P[1, 0], P[2, 0], P[2, 1] = P[0, 1], P[0, 2], P[1, 2]
    for i in range(3):
        P[i, i] = max(P[i, i], _LEAST[i])


@leaf_kernel
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
    pose[2] = _wrapped(pose[2] + k2 * innovation)
    P[0, 0] -= k0 * p0
    P[0, 1] -= k0 * p1
    P[1, 1] -= k1 * p1
    P[0, 2] -= k0 * p2
    P[1, 2] -= k1 * p2
    P[2, 2] -= k2 * p2
    _mirror(P)
    return S


@leaf_kernel
def correct_twice(pose, P, H, innovation_u, innovation_v, ruu, ruv, rvv):
    """Update with both coordinates of a place: the first as it is, the second less what the first tells of it.

    H : (h00, h01, h02, h10, h11, h12) by rows; R by (ruu, ruv, rvv).  Equal to the update with S (2, 2).
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
    per_u = 1.0 / suu
    share = suv * per_u
    per_v = 1.0 / (svv - share * suv)
    q0, q1, q2 = q0 - share * p0, q1 - share * p1, q2 - share * p2
    a, b = innovation_u * per_u, (innovation_v - share * innovation_u) * per_v
    pose[0] += p0 * a + q0 * b
    pose[1] += p1 * a + q1 * b
    pose[2] = _wrapped(pose[2] + p2 * a + q2 * b)
    k0, k1, k2 = p0 * per_u, p1 * per_u, p2 * per_u
    l0, l1, l2 = q0 * per_v, q1 * per_v, q2 * per_v
    P[0, 0] -= k0 * p0 + l0 * q0
    P[0, 1] -= k0 * p1 + l0 * q1
    P[1, 1] -= k1 * p1 + l1 * q1
    P[0, 2] -= k0 * p2 + l0 * q2
    P[1, 2] -= k1 * p2 + l1 * q2
    P[2, 2] -= k2 * p2 + l2 * q2
    _mirror(P)


@leaf_kernel
def in_antenna_frame(pose, x, y, ys, yc, tag_x, tag_y):
    """Where a tag lies in the frame of an antenna at (x, y) on the robot: z, and its derivative H by rows.

    p = R'(theta) (t - xy), z = R'(yaw) (p - a); H = [-R'(theta + yaw) | R'(yaw) (p_y, -p_x)]; (ys, yc) are sine and
    cosine of yaw.
    """
    s, c = sin_cos_64(pose[2])
    dx, dy = tag_x - pose[0], tag_y - pose[1]
    px, py = c * dx + s * dy, c * dy - s * dx
    u, v = yc * (px - x) + ys * (py - y), yc * (py - y) - ys * (px - x)
    both_s, both_c = s * yc + c * ys, c * yc - s * ys
    return u, v, (-both_c, -both_s, yc * py - ys * px, both_s, -both_c, -yc * px - ys * py)


@leaf_kernel
def take_read(
    kind, pose, P, x, y, ys, yc, tag_x, tag_y, rssi, radii, box, segments, mean, spread, variance, is_watched
):
    """One read: nothing if the tag is where it may be, else an update.

    Returns the distance beyond, in sigmas, if that `is_watched`.

    Parameters
    ----------
    kind : QUANTIZED (eqs. 5-7) or CONSTRAINED (eq. 12).
    box : (half_length, half_width, corner) of the area; with RSSI the disc of its step takes its place.
    mean, spread : (2,) and (2, 2) moments of the area.
    variance : of the read, sigma^2.
    """
    half_length, half_width, corner = box
    mu, mv, ruu, ruv, rvv = mean[0], mean[1], spread[0, 0], spread[0, 1], spread[1, 1]
    if rssi >= 0 and radii.shape[0] > 0:
        half_length, half_width, corner = 0.0, 0.0, radii[min(rssi, radii.shape[0] - 1)]
        mu, mv, ruu, ruv, rvv = 0.0, 0.0, 0.25 * corner * corner, 0.0, 0.25 * corner * corner
    u, v, H = in_antenna_frame(pose, x, y, ys, yc, tag_x, tag_y)
    g, gu, gv = signed_distance(u, v, half_length, half_width, corner, segments)
    if g <= 0.0:
        return 0.0
    if kind == QUANTIZED and not is_watched:
        correct_twice(pose, P, H, mu - u, mv - v, ruu + variance, ruv, rvv + variance)
        return 0.0
    h00, h01, h02, h10, h11, h12 = H
    g0, g1, g2 = gu * h00 + gv * h10, gu * h01 + gv * h11, gu * h02 + gv * h12
    if kind == CONSTRAINED:
        return g / math.sqrt(correct(pose, P, g0, g1, g2, -g, variance))
    p0 = P[0, 0] * g0 + P[0, 1] * g1 + P[0, 2] * g2
    p1 = P[1, 0] * g0 + P[1, 1] * g1 + P[1, 2] * g2
    p2 = P[2, 0] * g0 + P[2, 1] * g1 + P[2, 2] * g2
    beyond = g / math.sqrt(g0 * p0 + g1 * p1 + g2 * p2 + variance)
    correct_twice(pose, P, H, mu - u, mv - v, ruu + variance, ruv, rvv + variance)
    return beyond


@leaf_kernel
def push_out(pose, P, x, y, ys, yc, tag_x, tag_y, rssi, radii, box, segments, variance):
    """Rule 3: a tag that is no longer read though the pose has it in the area moves it to the border.

    Returns whether the tag is out of the area by now.
    """
    half_length, half_width, corner = box
    if rssi >= 0 and radii.shape[0] > 0:
        half_length, half_width, corner = 0.0, 0.0, radii[min(rssi, radii.shape[0] - 1)]
    u, v, H = in_antenna_frame(pose, x, y, ys, yc, tag_x, tag_y)
    g, gu, gv = signed_distance(u, v, half_length, half_width, corner, segments)
    if g >= 0.0:
        return True
    if gu * gu + gv * gv > _LEAST_GRADIENT and (segments.shape[0] > 0 or u * u + v * v > 1.0):
        h00, h01, h02, h10, h11, h12 = H
        correct(pose, P, gu * h00 + gv * h10, gu * h01 + gv * h11, gu * h02 + gv * h12, -g, variance)
    return False


@leaf_kernel
def take_reads(
    step, t, kind, pushes_out, rules, box, ages, antennas, slots, period, segments, mean, spread, radii, odometry,
    read_start, read_antenna, read_tags, read_age, read_rssi, dt, pose, P, search, memory, doubt, out, row,
):  # fmt: skip
    """The reads of step t, and what `track` says of rule 3 and of robots that are lost; the belief goes to `out`.

    Arrays come one by one: those taken out of a tuple are counted, which costs more than an update.
    """
    radius, variance, gate, patience = rules
    is_age_compensated, delay = ages
    for k in range(read_start[t], read_start[t + 1]):
        a, rssi, tag_x, tag_y = read_antenna[k], read_rssi[k], read_tags[k, 0], read_tags[k, 1]
        x, y, ys, yc = antennas[a, 0], antennas[a, 1], antennas[a, 3], antennas[a, 4]
        back = read_age[k] / dt + delay
        if is_age_compensated and back > 0.0:
            turn = odometry[t, 2]
            x, y = antenna_then(x, y, back, odometry[t, 0], odometry[t, 1], turn)
            ys, yc = sin_cos_64(antennas[a, 2] - back * turn)
        if search[STAGE] < 2.0:
            disc = radii[min(rssi, radii.shape[0] - 1)] if rssi >= 0 and radii.shape[0] > 0 else radius
            find_pose(search, a, x, y, tag_x, tag_y, disc, pose, P)
            pose[2] = _wrapped(pose[2])
            continue
        beyond = take_read(
            kind, pose, P, x, y, ys, yc, tag_x, tag_y, rssi, radii, box, segments, mean, spread, variance, patience > 0
        )  # fmt: skip
        doubt[0] = doubt[0] + 1.0 if beyond > gate else 0.0
        if patience > 0 and doubt[0] >= patience:
            doubt[0] = 0.0
            restart(search)
            find_pose(search, a, x, y, tag_x, tag_y, radius, pose, P)
            for i in range(3):
                for j in range(3):
                    P[i, j] = _LOST[i] if i == j else 0.0
    if pushes_out and search[STAGE] == 2.0:
        _push_out_all(
            step, t, antennas, slots, period, read_start, read_antenna, read_tags, read_rssi, memory, pose, P, radii,
            box, segments, variance,
        )  # fmt: skip
    out[row, 0], out[row, 1], out[row, 2] = pose[0], pose[1], pose[2]
    out[row, 3], out[row, 4], out[row, 5] = P[0, 0], P[0, 1], P[1, 1]
    out[row, 6], out[row, 7], out[row, 8], out[row, 9] = P[0, 2], P[1, 2], P[2, 2], 1.0


@leaf_kernel
def _push_out_all(
    step, t, antennas, slots, period, read_start, read_antenna, read_tags, read_rssi, memory, pose, P, radii, box,
    segments, variance,
):  # fmt: skip
    """Rule 3 for every antenna that polled in this step and did not read what it had read before."""
    for a in range(antennas.shape[0]):
        if period > 1 and step % period != slots[a]:
            continue
        is_read = False
        for k in range(read_start[t], read_start[t + 1]):
            if read_antenna[k] == a:
                is_read = True
                memory[a, 0], memory[a, 1], memory[a, 2] = 1.0, read_tags[k, 0], read_tags[k, 1]
                memory[a, 3] = read_rssi[k]
        if is_read or memory[a, 0] == 0.0:
            continue
        is_out = push_out(
            pose, P, antennas[a, 0], antennas[a, 1], antennas[a, 3], antennas[a, 4], memory[a, 1], memory[a, 2],
            int(memory[a, 3]), radii, box, segments, variance,
        )  # fmt: skip
        if is_out:
            memory[a, 0] = 0.0


@kernel
def predict(key, step, odometry, row, model, arrays):
    """See `verbs.Kernels`."""
    pose, P, search, _, _ = arrays
    move(pose, P, search, odometry, row, model[4])


@leaf_kernel
def move(pose, P, search, odometry, row, noise):
    """Move the pose, and the place in the local map while two tags are awaited."""
    if search[STAGE] < 2.0:
        advance(search, odometry, row)
    predict_pose(pose, P, odometry, row, noise)


@kernel
def update(key, step, log, t, model, tags, arrays, out, row):
    """See `verbs.Kernels`; `model` as in `track`."""
    kind, pushes_out, antennas, (slots, period), _, shape, rules, ages = model
    half_length, half_width, corner, segments, mean, spread, radii = shape
    odometry, read_start, read_antenna, read_tags, read_age, read_rssi, dt = log
    pose, P, search, memory, doubt = arrays
    take_reads(
        step, t, kind, pushes_out, rules, (half_length, half_width, corner), ages, antennas, slots, period, segments,
        mean, spread, radii, odometry, read_start, read_antenna, read_tags, read_age, read_rssi, dt, pose, P, search,
        memory, doubt, out, row,
    )  # fmt: skip


@kernel
def track(key, first, last, log, model, tags, arrays, estimates):
    """See `verbs.Kernels`.

    `model` : (kind, whether rule 3 applies, antennas (n, 5): their poses, sine and cosine of their yaws; (slots,
    period) of their schedule, noise (3, 3), `Shape` as a tuple, (radius of the area, sigma^2 of a read, sigmas beyond
    which a read contradicts, how many such reads in a row end the belief; 0: none), (is_age_compensated, delay of reads
    in steps)).
    """
    kind, pushes_out, antennas, (slots, period), noise, shape, rules, ages = model
    half_length, half_width, corner, segments, mean, spread, radii = shape
    odometry, read_start, read_antenna, read_tags, read_age, read_rssi, dt = log
    pose, P, search, memory, doubt = arrays
    box = (half_length, half_width, corner)
    for t in range(first, last):
        move(pose, P, search, odometry, t, noise)
        take_reads(
            t, t, kind, pushes_out, rules, box, ages, antennas, slots, period, segments, mean, spread, radii, odometry,
            read_start, read_antenna, read_tags, read_age, read_rssi, dt, pose, P, search, memory, doubt, estimates,
            t + 1,
        )  # fmt: skip
