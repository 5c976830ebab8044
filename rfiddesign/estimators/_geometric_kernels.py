"""Estimators that compute the pose from tags by geometry alone; see geometric.py.

A belief is the arrays pose (3,), P (3, 3) its covariance, search (see `_acquisition_kernels`; its local map goes on
after the start), history (window, N_HISTORY) of sightings (see `_sighting_kernels`), and memory (N_MEMORY,).
"""

import math

import numpy as np

from rfiddesign.estimators import _acquisition_kernels as acquisition
from rfiddesign.estimators._acquisition_kernels import LOCAL_HEADING, LOCAL_X, LOCAL_Y, advance, find_pose
from rfiddesign.estimators._pose_gaussian_kernels import predict_pose
from rfiddesign.estimators._pose_kernels import in_map, keep_positive, stand, wrapped
from rfiddesign.estimators._sighting_kernels import FROM_X, FROM_Y, SEEN_X, SEEN_Y, fit_line, remember, sight, weigh
from rfiddesign.numerics._compile_kernels import inline_kernel, kernel, leaf_kernel
from rfiddesign.numerics._math_kernels import atan2_64, sin_cos_64

ODOMETRY, RIGID_FIT, TRIGONOMETRIC, MOTION_CONTINUITY, WEIGHTED_CENTRE = range(5)
# Whether the pose is known; steps without odometry since the position and the heading were seen; sightings so far.
IS_KNOWN, STEPS_HELD, TURNS_HELD, SIGHTINGS = range(4)
N_MEMORY = 4
# The tags of a rigid fit lie apart as the antennas do, within this factor, or the fit says nothing of the heading.
_MOST_STRETCH = 4.0
# Across a line the variance is at most this share of that along it, of which the points' order explains at least this.
_STRAIGHT, _LEAST_PROGRESS = 0.25, 0.5


@leaf_kernel
def hold(P, memory, speed, turn_rate):
    """A step without odometry: after n such steps the deviations have grown by n speeds and n turn rates, per step."""
    moved = (2.0 * memory[STEPS_HELD] + 1.0) * speed * speed
    P[0, 0] += moved
    P[1, 1] += moved
    P[2, 2] += (2.0 * memory[TURNS_HELD] + 1.0) * turn_rate * turn_rate
    memory[STEPS_HELD] += 1.0
    memory[TURNS_HELD] += 1.0


@leaf_kernel
def turn_to(pose, P, memory, heading, variance, gain):
    """Move the heading by the share `gain` of what is missing to one that was seen with an independent error."""
    rest = 1.0 - gain
    pose[2] = wrapped(pose[2] + gain * wrapped(heading - pose[2]))
    P[0, 2] *= rest
    P[1, 2] *= rest
    P[2, 2] = rest * rest * P[2, 2] + gain * gain * variance
    memory[TURNS_HELD] = 0.0


@kernel
def two_tags(search, antenna, place, uses_odometry, baseline, radius, pose, P):
    """Pose from two sightings at least a baseline apart; True, with `pose` and `P` written, at the second one.

    Eq. 13 of rssi_kalman_navifloor; the second sighting is then the first one of the next two.  Tags in view at once
    have no way between them, so a way of half the baseline is asked for.  Without odometry the robot is taken to have
    driven ahead, for as far as the tags of one antenna lie apart.

    Parameters
    ----------
    place : (tag_x, tag_y, x, y) of a sighting.
    """
    tag_x, tag_y, x, y = place
    if search[acquisition.STAGE] == 1.0:
        dx, dy = tag_x - search[acquisition.TAG_X], tag_y - search[acquisition.TAG_Y]
        base = math.sqrt(dx * dx + dy * dy)
        if base < baseline or (not uses_odometry and antenna != search[acquisition.ANTENNA]):
            return False
        if not uses_odometry:
            search[LOCAL_X], search[LOCAL_Y] = search[acquisition.PLACE_X] + base - x, search[acquisition.PLACE_Y] - y
        s, c = sin_cos_64(search[LOCAL_HEADING])
        way_x = search[LOCAL_X] + c * x - s * y - search[acquisition.PLACE_X]
        way_y = search[LOCAL_Y] + s * x + c * y - search[acquisition.PLACE_Y]
        if math.sqrt(way_x * way_x + way_y * way_y) < 0.5 * baseline:
            return False
    if not find_pose(search, antenna, x, y, tag_x, tag_y, radius, pose, P):
        return False
    search[acquisition.STAGE] = 0.0
    find_pose(search, antenna, x, y, tag_x, tag_y, radius, pose, P)
    return True


@kernel
def see_heading(search, antenna, place, uses_odometry, baseline, radius, gain, share, pose, P, memory):
    """Turn to the heading that two sightings tell a baseline apart; `share`: their variance over that of a read."""
    seen, seen_P = np.empty(3), np.empty((3, 3))
    if two_tags(search, antenna, place, uses_odometry, baseline, radius, seen, seen_P):
        turn_to(pose, P, memory, seen[2], share * seen_P[2, 2], gain)


@leaf_kernel
def fit_turn(sums, variance, baseline, gain, pose, P, memory):
    """Turn to the heading of the rigid transform from antennas to tags with the least squares; False if it has none.

    theta = atan2(sum a x t, sum a.t), variance sigma^2 / sum a.a with sigma^2 the `variance` of a read per axis.  There
    is none where the antennas lie closer than two of them a baseline apart, or the tags much closer or wider than they.
    """
    dot, cross, scatter = sums
    stretch = math.sqrt(dot * dot + cross * cross) / scatter
    if not (scatter >= 0.5 * baseline * baseline and 1.0 / _MOST_STRETCH <= stretch <= _MOST_STRETCH):
        return False
    turn_to(pose, P, memory, atan2_64(cross, dot), variance / scatter, gain)
    return True


@inline_kernel
def _is_straight(n, spread, baseline):
    """Whether n points say where a line leads: a baseline long if evenly covered, narrow, in their order."""
    along, across, progress = spread
    return along >= n * baseline * baseline / 12.0 and across <= _STRAIGHT * along and progress >= _LEAST_PROGRESS


@kernel
def follow_line(history, search, uses_odometry, variance, baseline, gain, place, pose, P, memory):
    """Put the newest sighting on the line through the last ones, and turn to it; False if they make no line.

    The line through the same places in the local map tells how the robot faces its way, and how far beside a line it
    stands by now, if the way was bent.  `variance` is that of a sighting per axis: along the line it stays, across it
    is shared by the places, and turns the line by variance / sum of squares along it.
    """
    _, _, x, y = place
    last, window = int(memory[SIGHTINGS]), history.shape[0]
    newest, n = (last - 1) % window, min(last, window)
    if 2 * n < window:
        return False
    (mean_x, mean_y, c, s), spread, n_places = fit_line(history, last, SEEN_X)
    if not _is_straight(n, spread, baseline):
        return False
    heading, beside = atan2_64(s, c), 0.0
    if uses_odometry:
        (way_x, way_y, way_c, way_s), way_spread, _ = fit_line(history, last, FROM_X)
        if not _is_straight(n, way_spread, baseline):
            return False
        heading += search[LOCAL_HEADING] - atan2_64(way_s, way_c)
        beside = way_c * (history[newest, FROM_Y] - way_y) - way_s * (history[newest, FROM_X] - way_x)
    ahead = c * (history[newest, SEEN_X] - mean_x) + s * (history[newest, SEEN_Y] - mean_y)
    turn_to(pose, P, memory, heading, variance * n / (n_places * spread[0]), gain)
    shared = variance / n_places
    xx, xy, yy = c * c * variance + s * s * shared, s * c * (variance - shared), s * s * variance + c * c * shared
    stand(pose, P, mean_x + c * ahead - s * beside, mean_y + s * ahead + c * beside, x, y, xx, xy, yy)
    return True


@kernel
def locate(step, log, t, model, arrays):
    """Use the reads of step t."""
    method, uses_odometry, positions, spreads, _, rules, held, ages = model
    pose, P, search, history, memory = arrays
    odometry, read_start, read_antenna, read_tags, read_age, _, dt = log
    baseline, radius, gain = rules
    first, last = read_start[t], read_start[t + 1]
    if first == last:
        return
    forward = sideways = turn = 0.0
    if uses_odometry:
        forward, sideways, turn = odometry[t, 0], odometry[t, 1], odometry[t, 2]
    place, antenna, spread, sums = sight(
        first, last, read_antenna, read_tags, read_age, dt, positions, spreads, ages, forward, sideways, turn
    )
    remember(history, int(memory[SIGHTINGS]), step, last - first, place, search, uses_odometry)
    memory[SIGHTINGS] += 1.0
    # Of one read per axis.
    variance = 0.5 * (last - first) * (spread[0] + spread[2])
    first_gain = gain if memory[IS_KNOWN] else 1.0
    has_fit = method == RIGID_FIT and fit_turn(sums, variance, baseline, first_gain, pose, P, memory)
    if not memory[IS_KNOWN]:
        if not has_fit and not two_tags(search, antenna, place, uses_odometry, baseline, radius, pose, P):
            return
        memory[IS_KNOWN] = 1.0
        memory[TURNS_HELD] = 0.0
        # What follows may look at other places than single sightings.
        search[acquisition.STAGE] = 0.0
    if method != ODOMETRY:
        memory[STEPS_HELD] = 0.0
        correct(step, method, uses_odometry, rules, held, place, antenna, spread, arrays)


@kernel
def correct(step, method, uses_odometry, rules, held, place, antenna, spread, arrays):
    """Position, and where the way tells it heading, by the newest sighting and those before it."""
    pose, P, search, history, memory = arrays
    baseline, radius, gain = rules
    if method == MOTION_CONTINUITY:
        variance = 0.5 * (spread[0] + spread[2])
        if follow_line(history, search, uses_odometry, variance, baseline, gain, place, pose, P, memory):
            return
    share, lag = 1.0, 0.0
    if method == WEIGHTED_CENTRE:
        place, n_places, age = weigh(history, int(memory[SIGHTINGS]), step, search, uses_odometry)
        antenna, share = -1, 1.0 / n_places
        lag = 0.0 if uses_odometry else (held[0] * age) ** 2
    if method in (TRIGONOMETRIC, WEIGHTED_CENTRE):
        of_read = 2.0 * share * (spread[0] + spread[2]) / radius**2
        see_heading(search, antenna, place, uses_odometry, baseline, radius, gain, of_read, pose, P, memory)
    xx, xy, yy = in_map(pose[2], spread[0], spread[1], spread[2])
    stand(pose, P, place[0], place[1], place[2], place[3], share * xx + lag, share * xy, share * yy + lag)


@kernel
def predict(key, step, odometry, row, model, arrays):
    """See `verbs.Kernels`: move by the odometry, or stay and grow uncertain."""
    _, uses_odometry, _, _, noise, _, held, _ = model
    pose, P, search, _, memory = arrays
    if uses_odometry:
        advance(search, odometry, row)
        search[LOCAL_HEADING] = wrapped(search[LOCAL_HEADING])
    if memory[IS_KNOWN]:
        if uses_odometry:
            predict_pose(pose, P, odometry, row, noise)
        else:
            hold(P, memory, held[0], held[1])
        keep_positive(P)


@kernel
def update(key, step, log, t, model, tags, arrays, out, row):
    """See `verbs.Kernels`."""
    pose, P, _, _, memory = arrays
    locate(step, log, t, model, arrays)
    if memory[IS_KNOWN]:
        keep_positive(P)
    for i in range(3):
        out[row, i] = pose[i]
    out[row, 3], out[row, 4], out[row, 5] = P[0, 0], P[0, 1], P[1, 1]
    out[row, 6], out[row, 7], out[row, 8] = P[0, 2], P[1, 2], P[2, 2]
    out[row, 9] = 1.0


@kernel
def track(key, first, last, log, model, tags, arrays, estimates):
    """See `verbs.Kernels`.

    Parameters
    ----------
    model : (method, uses_odometry, positions (n, 2) of the antennas, spreads (n, 2, 2) covariance of a read tag about
        its antenna in the robot's axes, noise (3, 3), rules, held, ages); rules: (baseline [mm], radius [mm], gain);
        held: (speed [mm], turn rate [rad], per step) believed without odometry; ages: (is_age_compensated, delay of
        reads in steps).
    arrays : (pose, P, search, history, memory).
    """
    for t in range(first, last):
        predict(key, t, log[0], t, model, arrays)
        update(key, t, log, t, model, tags, arrays, estimates, t + 1)
