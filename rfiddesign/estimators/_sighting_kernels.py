"""All reads of a step as one sighting, and what the last sightings say together; see geometric.py.

A sighting: the centre of the tags that were read is where the mean of their antennas was.
"""

import numpy as np

from rfiddesign.estimators._acquisition_kernels import LOCAL_HEADING, LOCAL_X, LOCAL_Y
from rfiddesign.estimators._evidence_kernels import antenna_then
from rfiddesign.numerics._compile_kernels import leaf_kernel
from rfiddesign.numerics._math_kernels import atan2_64, sin_cos_64

# Columns of the history, one row per sighting kept: its tags, its antennas in the local map of the search (without
# odometry: on the robot), reads, step.
SEEN_X, SEEN_Y, FROM_X, FROM_Y, READS, STEP = range(6)
N_HISTORY = 6


@leaf_kernel
def sight(first, last, read_antenna, read_tags, read_age, dt, positions, spreads, ages, forward, sideways, turn):
    """The reads in rows first..last-1 as one.

    Returns
    -------
    tag_x, tag_y, x, y : centre of the tags, mean place of the antennas on the robot when they polled.
    antenna : its number; -1: several.
    xx, xy, yy : covariance of the centre as a measurement of the mean place, in the robot's axes.
    dot, cross, scatter : sums of a.t, a x t and a.a over the reads, with places a and tags t about their means.
    """
    is_age_compensated, delay = ages
    n, x0, y0 = last - first, read_tags[first, 0], read_tags[first, 1]
    antenna = np.int64(read_antenna[first])
    sum_x = sum_y = sum_u = sum_v = dot = cross = squares = xx = xy = yy = 0.0
    for row in range(first, last):
        a = np.int64(read_antenna[row])
        x, y = positions[a, 0], positions[a, 1]
        back = read_age[row] / dt + delay
        if is_age_compensated and back > 0.0:
            x, y = antenna_then(x, y, back, forward, sideways, turn)
        u, v = read_tags[row, 0] - x0, read_tags[row, 1] - y0
        sum_x, sum_y, sum_u, sum_v = sum_x + x, sum_y + y, sum_u + u, sum_v + v
        dot += x * u + y * v
        cross += x * v - y * u
        squares += x * x + y * y
        xx, xy, yy = xx + spreads[a, 0, 0], xy + spreads[a, 0, 1], yy + spreads[a, 1, 1]
        if a != read_antenna[first]:
            antenna = np.int64(-1)
    x, y, u, v = sum_x / n, sum_y / n, sum_u / n, sum_v / n
    scatter = squares - n * (x * x + y * y)
    return (
        (x0 + u, y0 + v, x, y),
        antenna,
        (xx / (n * n), xy / (n * n), yy / (n * n)),
        (dot - n * (x * u + y * v), cross - n * (x * v - y * u), scatter),
    )


@leaf_kernel
def remember(history, number, step, n_reads, place, search, uses_odometry):
    """Keep a sighting, by its number, in place of the oldest one."""
    tag_x, tag_y, x, y = place
    row = number % history.shape[0]
    history[row, SEEN_X], history[row, SEEN_Y] = tag_x, tag_y
    history[row, FROM_X], history[row, FROM_Y] = x, y
    if uses_odometry:
        s, c = sin_cos_64(search[LOCAL_HEADING])
        history[row, FROM_X] = search[LOCAL_X] + c * x - s * y
        history[row, FROM_Y] = search[LOCAL_Y] + s * x + c * y
    history[row, READS], history[row, STEP] = n_reads, step


@leaf_kernel
def fit_line(history, last, column):
    """Straight line with the least squared distances from the points kept in two columns, up to sighting last-1.

    Returns
    -------
    mean_x, mean_y, c, s : a point of the line, its direction as the points follow each other.
    along, across : sums of squared distances from the mean along the line and across it.
    progress : share of `along` that the order of the points explains, 1 at constant speed, 0 for a robot that stands.
    n_places : points that differ from the one before.
    """
    window = history.shape[0]
    first = max(last - window, 0)
    n, middle = last - first, 0.5 * (first + last - 1)
    mean_x = mean_y = xx = xy = yy = drift_x = drift_y = 0.0
    n_places = 1
    for j in range(first, last):
        mean_x += history[j % window, column] / n
        mean_y += history[j % window, column + 1] / n
    for j in range(first, last):
        x, y = history[j % window, column] - mean_x, history[j % window, column + 1] - mean_y
        xx, xy, yy = xx + x * x, xy + x * y, yy + y * y
        drift_x, drift_y = drift_x + (j - middle) * x, drift_y + (j - middle) * y
        if j > first:
            is_moved_x = history[j % window, column] != history[(j - 1) % window, column]
            is_moved_y = history[j % window, column + 1] != history[(j - 1) % window, column + 1]
            n_places += 1 if is_moved_x or is_moved_y else 0
    s, c = sin_cos_64(0.5 * atan2_64(2.0 * xy, xx - yy))
    along = c * c * xx + 2.0 * s * c * xy + s * s * yy
    drift = c * drift_x + s * drift_y
    if drift < 0.0:
        s, c = -s, -c
    progress = 12.0 * drift * drift / (n * (n * n - 1.0) * along) if along > 0.0 and n > 1 else 0.0
    return (mean_x, mean_y, c, s), (along, max(xx + yy - along, 0.0), progress), n_places


@leaf_kernel
def weigh(history, last, step, search, uses_odometry):
    """The reads of the last steps, as many as the history has rows, as one sighting of now.

    Returns
    -------
    tag_x, tag_y, x, y : centre of the tags, each with the weight of its reads, and of the antennas then, in the robot's
        frame of now.
    n_places : sightings that differ from the one before.
    age : mean age of the reads, in steps.
    """
    s, c = sin_cos_64(search[LOCAL_HEADING] if uses_odometry else 0.0)
    x0, y0 = (search[LOCAL_X], search[LOCAL_Y]) if uses_odometry else (0.0, 0.0)
    total = tag_x = tag_y = x = y = age = 0.0
    n_places = 0
    for j in range(max(last - history.shape[0], 0), last):
        row = j % history.shape[0]
        if step - history[row, STEP] >= history.shape[0]:
            continue
        weight, from_x, from_y = history[row, READS], history[row, FROM_X] - x0, history[row, FROM_Y] - y0
        total, age = total + weight, age + weight * (step - history[row, STEP])
        tag_x, tag_y = tag_x + weight * history[row, SEEN_X], tag_y + weight * history[row, SEEN_Y]
        x, y = x + weight * (c * from_x + s * from_y), y + weight * (c * from_y - s * from_x)
        before = (j - 1) % history.shape[0]
        is_new = history[row, SEEN_X] != history[before, SEEN_X] or history[row, SEEN_Y] != history[before, SEEN_Y]
        n_places += 1 if n_places == 0 or is_new else 0
    return (tag_x / total, tag_y / total, x / total, y / total), n_places, age / total
