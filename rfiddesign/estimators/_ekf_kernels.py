"""Extended Kalman filters over the pose that take a read as a quantized place or as a constraint; see ekf.py.

A belief is the arrays pose (3,), covariance (3, 3), search (see `_acquisition_kernels`), memory (n_antennas, 4):
whether a tag was last read, the tag, its RSSI; doubt (1,): successive reads that contradicted the belief; and
direction (3,): a heading with its sine and cosine, that of the pose or one before it.
"""

import math

from rfiddesign.estimators._acquisition_kernels import STAGE, advance, find_pose, restart
from rfiddesign.estimators._evidence_kernels import antenna_then
from rfiddesign.estimators._pose_gaussian_kernels import (
    carry,
    correct,
    correct_place,
    direction_of,
    in_antenna_frame,
    wrapped,
)
from rfiddesign.models._shape_kernels import signed_distance
from rfiddesign.numerics._compile_kernels import inline_kernel, kernel, leaf_kernel
from rfiddesign.numerics._math_kernels import sin_cos_64

QUANTIZED, CONSTRAINED = 0, 1
# Closer to the centre of a disc than this its border has no direction.
_LEAST_GRADIENT = 0.5
# Variances of a robot that is lost: 1 m, any heading.
_LOST = (1e6, 1e6, math.pi**2 / 3)


@inline_kernel
def take_read(
    kind, pose, P, direction, x, y, ys, yc, tag_x, tag_y, rssi, radii, box, segments, mean, spread, variance, is_watched
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
    u, v, H = in_antenna_frame(pose, direction, x, y, ys, yc, tag_x, tag_y)
    g, gu, gv = signed_distance(u, v, half_length, half_width, corner, segments)
    if g <= 0.0:
        return 0.0
    if kind == QUANTIZED and not is_watched:
        correct_place(pose, P, H, mu - u, mv - v, ruu + variance, ruv, rvv + variance)
        return 0.0
    h00, h01, h02, h10, h11, h12 = H
    g0, g1, g2 = gu * h00 + gv * h10, gu * h01 + gv * h11, gu * h02 + gv * h12
    if kind == CONSTRAINED:
        return g / math.sqrt(correct(pose, P, g0, g1, g2, -g, variance))
    p0 = P[0, 0] * g0 + P[0, 1] * g1 + P[0, 2] * g2
    p1 = P[1, 0] * g0 + P[1, 1] * g1 + P[1, 2] * g2
    p2 = P[2, 0] * g0 + P[2, 1] * g1 + P[2, 2] * g2
    beyond = g / math.sqrt(g0 * p0 + g1 * p1 + g2 * p2 + variance)
    correct_place(pose, P, H, mu - u, mv - v, ruu + variance, ruv, rvv + variance)
    return beyond


@leaf_kernel
def push_out(pose, P, direction, x, y, ys, yc, tag_x, tag_y, rssi, radii, box, segments, variance):
    """Rule 3: a tag that is no longer read though the pose has it in the area moves it to the border.

    Returns whether the tag is out of the area by now.
    """
    half_length, half_width, corner = box
    if rssi >= 0 and radii.shape[0] > 0:
        half_length, half_width, corner = 0.0, 0.0, radii[min(rssi, radii.shape[0] - 1)]
    u, v, H = in_antenna_frame(pose, direction, x, y, ys, yc, tag_x, tag_y)
    g, gu, gv = signed_distance(u, v, half_length, half_width, corner, segments)
    if g >= 0.0:
        return True
    if gu * gu + gv * gv > _LEAST_GRADIENT and (segments.shape[0] > 0 or u * u + v * v > 1.0):
        h00, h01, h02, h10, h11, h12 = H
        correct(pose, P, gu * h00 + gv * h10, gu * h01 + gv * h11, gu * h02 + gv * h12, -g, variance)
    return False


@leaf_kernel
def _push_out_all(
    step, t, antennas, slots, period, read_start, read_antenna, read_tags, read_rssi, memory, pose, P, direction, radii,
    box, segments, variance,
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
            pose, P, direction, antennas[a, 0], antennas[a, 1], antennas[a, 3], antennas[a, 4], memory[a, 1],
            memory[a, 2], int(memory[a, 3]), radii, box, segments, variance,
        )  # fmt: skip
        if is_out:
            memory[a, 0] = 0.0


@leaf_kernel
def take_steps(
    first, last, row_of_step, predicts, kind, pushes_out, rules, box, ages, antennas, slots, period, noise, segments,
    mean, spread, radii, odometry, read_start, read_antenna, read_tags, read_age, read_rssi, dt, pose, P, search,
    memory, doubt, direction, out, row_of_out,
):  # fmt: skip
    """Steps first..last-1, as `track` says; step s has row s + `row_of_step` in the log, s + `row_of_out` in `out`.

    One function with its arrays one by one: numba counts those that it takes out of a tuple, and handing over so many
    costs as much as a step.
    """
    radius, variance, gate, patience = rules
    is_age_compensated, delay = ages
    for step in range(first, last):
        t, row = step + row_of_step, step + row_of_out
        if predicts:
            move(pose, P, search, direction, odometry, t, noise)
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
                pose[2] = wrapped(pose[2])
                continue
            beyond = take_read(
                kind, pose, P, direction, x, y, ys, yc, tag_x, tag_y, rssi, radii, box, segments, mean, spread,
                variance, patience > 0,
            )  # fmt: skip
            doubt[0] = doubt[0] + 1.0 if beyond > gate else 0.0
            if patience > 0 and doubt[0] >= patience:
                doubt[0] = 0.0
                restart(search)
                find_pose(search, a, x, y, tag_x, tag_y, radius, pose, P)
                _lose(P)
        if pushes_out and search[STAGE] == 2.0:
            _push_out_all(
                step, t, antennas, slots, period, read_start, read_antenna, read_tags, read_rssi, memory, pose, P,
                direction, radii, box, segments, variance,
            )  # fmt: skip
        out[row, 0], out[row, 1], out[row, 2] = pose[0], pose[1], pose[2]
        out[row, 3], out[row, 4], out[row, 5] = P[0, 0], P[0, 1], P[1, 1]
        out[row, 6], out[row, 7], out[row, 8], out[row, 9] = P[0, 2], P[1, 2], P[2, 2], 1.0


@leaf_kernel
def _lose(P):
    for i in range(3):
        for j in range(3):
            P[i, j] = _LOST[i] if i == j else 0.0


@kernel
def predict(key, step, odometry, row, model, arrays):
    """See `verbs.Kernels`."""
    pose, P, search, _, _, direction = arrays
    move(pose, P, search, direction, odometry, row, model[4])


@inline_kernel
def move(pose, P, search, direction, odometry, row, noise):
    """Move the pose, and the place in the local map while two tags are awaited."""
    if search[STAGE] < 2.0:
        advance(search, odometry, row)
    s, c = direction_of(pose[2], direction)
    carry(pose, P, s, c, odometry, row, noise)


@kernel
def update(key, step, log, t, model, tags, arrays, out, row):
    """See `verbs.Kernels`; `model` as in `track`."""
    _steps(step, step + 1, t - step, False, log, model, arrays, out, row - step)


@kernel
def track(key, first, last, log, model, tags, arrays, estimates):
    """See `verbs.Kernels`.

    `model` : (kind, whether rule 3 applies, antennas (n, 5): their poses, sine and cosine of their yaws; (slots,
    period) of their schedule, noise (3, 3), `Shape` as a tuple, (radius of the area, sigma^2 of a read, sigmas beyond
    which a read contradicts, how many such reads in a row end the belief; 0: none), (is_age_compensated, delay of reads
    in steps)).
    """
    _steps(first, last, 0, True, log, model, arrays, estimates, 1)


@kernel
def _steps(first, last, row_of_step, predicts, log, model, arrays, out, row_of_out):
    """`take_steps` with its arrays in tuples."""
    kind, pushes_out, antennas, (slots, period), noise, shape, rules, ages = model
    half_length, half_width, corner, segments, mean, spread, radii = shape
    odometry, read_start, read_antenna, read_tags, read_age, read_rssi, dt = log
    pose, P, search, memory, doubt, direction = arrays
    take_steps(
        first, last, row_of_step, predicts, kind, pushes_out, rules, (half_length, half_width, corner), ages, antennas,
        slots, period, noise, segments, mean, spread, radii, odometry, read_start, read_antenna, read_tags, read_age,
        read_rssi, dt, pose, P, search, memory, doubt, direction, out, row_of_out,
    )  # fmt: skip
