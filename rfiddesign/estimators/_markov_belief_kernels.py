"""A belief in a pose, its position on a moving grid: moved, blurred and weighed; markov.py says what is what."""

import math

import numpy as np

from rfiddesign.estimators._acquisition_kernels import LOCAL_HEADING, advance
from rfiddesign.estimators._markov_grid_kernels import (
    MOST_TAPS,
    MOST_VARIANCE,
    blur,
    draw_gaussian,
    fill_gaussian,
    move,
    positive_part,
    weigh,
)
from rfiddesign.models._motion_kernels import step_variances
from rfiddesign.numerics._compile_kernels import kernel, leaf_kernel
from rfiddesign.numerics._math_kernels import sin_cos_64

# The numbers of a belief.  Whether the pose is known; where the grid's middle cell is; the grid's mean from there, its
# covariance, and the sum of its masses; covariance of motion that the grid has not been blurred by (both together are
# that of the position); covariance of position and heading; mean and variance of the heading.
IS_FOUND, MIDDLE_X, MIDDLE_Y, MEAN_X, MEAN_Y, GRID_XX, GRID_XY, GRID_YY, TOTAL = range(9)
DUE_XX, DUE_XY, DUE_YY, CROSS_X, CROSS_Y, HEADING, VARIANCE = range(9, 16)
# Which of the two grids is the belief.  The reference: whether there is one, its place and covariance, its tag, and the
# way since by odometry.  While the pose is unknown: whether a tag was read, and where it was in the local map.
WHICH, HAS_REFERENCE, PLACE_X, PLACE_Y, PLACE_XX, PLACE_XY, PLACE_YY, TAG_X, TAG_Y, WAY_X, WAY_Y = range(16, 27)
HAS_SEEN, SEEN_X, SEEN_Y = range(27, 30)
N_NUMBERS = 30
# Variance of a heading that may be any.
UNKNOWN_HEADING = math.pi**2 / 3
# A belief that leaves a read less than this, 1 at its best place, is wrong: 7.4 sigma.
_LOST = 1e-12
# The grid is blurred once either variance of what is due reaches this [cells^2]: late, since what is due may shrink
# again as the robot turns back, and a blur cannot be undone.
_DUE = 0.8 * MOST_VARIANCE
_MOST_BLURS = 8
# At most so much is blurred for a read [cells^2].
_MOST_DUE = 0.5 * _MOST_BLURS * MOST_VARIANCE
# Variance of a grid, in its width squared, that is half that of a flat one.
_FLAT = 1 / 24
# Share of the heading's variance that the position may explain.
MOST_EXPLAINED = 0.98
_LARGEST = 1e12


@leaf_kernel
def wrapped(angle):
    """Angle in [-pi, pi)."""
    return angle - 2.0 * math.pi * math.floor(angle / (2.0 * math.pi) + 0.5)


@leaf_kernel
def predict(odometry, row, noise, numbers, search):
    """Move the window by an odometry increment in the robot's frame; the grid itself is not touched (eqs. 6 to 8).

    The heading's error stays from step to step, so that it is the whole way that it turns, not each step anew.
    """
    forward, sideways, turn = odometry[row, 0], odometry[row, 1], odometry[row, 2]
    variance_x, variance_y, variance_heading = step_variances(noise, forward, sideways, turn)
    if numbers[IS_FOUND] == 0.0:
        advance(search, odometry, row)
        search[LOCAL_HEADING] = wrapped(search[LOCAL_HEADING])
        numbers[HEADING] = wrapped(numbers[HEADING] + turn)
        return
    s, c = sin_cos_64(numbers[HEADING])
    dx, dy = c * forward - s * sideways, s * forward + c * sideways
    numbers[MIDDLE_X] += dx
    numbers[MIDDLE_Y] += dy
    numbers[WAY_X] += dx
    numbers[WAY_Y] += dy
    # How the position moves with the heading.
    across_x, across_y, variance = -dy, dx, numbers[VARIANCE]
    cross_x, cross_y = numbers[CROSS_X], numbers[CROSS_Y]
    numbers[DUE_XX] += (2.0 * cross_x + variance * across_x) * across_x + c * c * variance_x + s * s * variance_y
    numbers[DUE_YY] += (2.0 * cross_y + variance * across_y) * across_y + s * s * variance_x + c * c * variance_y
    numbers[DUE_XY] += (
        cross_x * across_y + cross_y * across_x + variance * across_x * across_y + c * s * (variance_x - variance_y)
    )
    numbers[CROSS_X] = cross_x + variance * across_x
    numbers[CROSS_Y] = cross_y + variance * across_y
    numbers[VARIANCE] = min(variance + variance_heading, UNKNOWN_HEADING)
    numbers[HEADING] = wrapped(numbers[HEADING] + turn)
    for k in range(DUE_XX, CROSS_Y + 1):
        numbers[k] = min(max(numbers[k], -_LARGEST), _LARGEST)


@leaf_kernel
def _blur_what_is_due(cell, numbers, grids, room):
    """Blur the grid once by what is due; that, and the grid's covariance, follow."""
    per_cell2 = 1.0 / (cell * cell)
    which, xx, xy, yy = blur(
        grids, int(numbers[WHICH]), numbers[DUE_XX] * per_cell2, numbers[DUE_XY] * per_cell2,
        numbers[DUE_YY] * per_cell2, room[:3, :3], room[3, : 2 * MOST_TAPS + 3],
    )  # fmt: skip
    numbers[WHICH] = which
    for k, got in enumerate((xx, xy, yy)):
        numbers[DUE_XX + k] -= got / per_cell2
        numbers[GRID_XX + k] += got / per_cell2
    return xx + yy > 0.0


@leaf_kernel
def _multiply(cell, numbers, grids, room):
    """Multiply the grid by the factors in `room` (its rows 4, 5), take its moments and keep its mean in the middle.

    False, and only TOTAL is taken, if next to nothing is left.
    """
    n, k = grids.shape[1], int(numbers[WHICH])
    moments = room[3, :6]
    weigh(grids[k], room[4:6], room[6:9], moments)
    numbers[TOTAL] = moments[0]
    if moments[0] < _LOST:
        return False
    numbers[MEAN_X], numbers[MEAN_Y] = moments[1] * cell, moments[2] * cell
    for i in range(3):
        numbers[GRID_XX + i] = moments[3 + i] * cell * cell
    columns = min(max(round(moments[1]), -n), n)
    rows = min(max(round(moments[2]), -n), n)
    if columns != 0 or rows != 0:
        move(grids[k], grids[1 - k], columns, rows)
        numbers[WHICH] = 1 - k
        numbers[MIDDLE_X] += columns * cell
        numbers[MIDDLE_Y] += rows * cell
        numbers[MEAN_X] -= columns * cell
        numbers[MEAN_Y] -= rows * cell
    return True


@leaf_kernel
def _normalize(cell, numbers, grids, room):
    """Make the masses sum to 1 and take their moments."""
    for i in range(grids.shape[1]):
        room[4, i], room[5, i] = 1.0, 1.0 / numbers[TOTAL]
    _multiply(cell, numbers, grids, room)


@leaf_kernel
def _draw(xx, xy, yy, cell, numbers, grids, room):
    """Make the grid a Gaussian about its middle cell with this covariance [cells^2]."""
    least = 0.5 * (xx + yy) - math.sqrt(0.25 * (xx - yy) * (xx - yy) + xy * xy)
    # A Gaussian narrower than half a cell falls between the cells.
    more = max(0.25 - least, 0.0)
    xx, yy = xx + more, yy + more
    determinant = xx * yy - xy * xy
    draw_gaussian(grids[int(numbers[WHICH])], yy / determinant, -xy / determinant, xx / determinant)
    numbers[TOTAL] = 1.0
    _normalize(cell, numbers, grids, room)
    _normalize(cell, numbers, grids, room)


@leaf_kernel
def begin(cell, pose, covariance, numbers, grids, room):
    """A Gaussian belief about a pose (3,) with a covariance (3, 3)."""
    n, per_cell2 = grids.shape[1], 1.0 / (cell * cell)
    for k in range(N_NUMBERS):
        numbers[k] = 0.0
    numbers[IS_FOUND], numbers[TOTAL] = 1.0, 1.0
    numbers[MIDDLE_X], numbers[MIDDLE_Y], numbers[HEADING] = pose[0], pose[1], wrapped(pose[2])
    numbers[CROSS_X], numbers[CROSS_Y] = covariance[0, 2], covariance[1, 2]
    numbers[VARIANCE] = min(covariance[2, 2], UNKNOWN_HEADING)
    xx, xy, yy = covariance[0, 0] * per_cell2, covariance[0, 1] * per_cell2, covariance[1, 1] * per_cell2
    if max(xx, yy) <= MOST_VARIANCE:
        # All mass in the middle cell, and the covariance due: narrow Gaussians cannot be drawn, but blurred to.
        for row in range(n):
            for i in range(n):
                grids[0, row, i] = 0.0
        grids[0, n // 2, n // 2] = 1.0
        numbers[DUE_XX], numbers[DUE_XY], numbers[DUE_YY] = covariance[0, 0], covariance[0, 1], covariance[1, 1]
        return
    _draw(xx, xy, yy, cell, numbers, grids, room)


@leaf_kernel
def explained(xx, xy, yy, cross_x, cross_y, variance):
    """Factor, at most 1, by which the cross covariances fit the variances."""
    determinant = xx * yy - xy * xy
    if determinant <= 0.0:
        return 0.0
    by = (yy * cross_x * cross_x - 2.0 * xy * cross_x * cross_y + xx * cross_y * cross_y) / determinant
    return math.sqrt(MOST_EXPLAINED * variance / by) if by > MOST_EXPLAINED * variance else 1.0


@leaf_kernel
def _fit_cross(cell, numbers):
    """Keep the cross covariance within what the grid allows, which is no Gaussian and may end at its border."""
    own = cell * cell / 12.0
    factor = explained(
        numbers[GRID_XX] + own, numbers[GRID_XY], numbers[GRID_YY] + own, numbers[CROSS_X], numbers[CROSS_Y],
        numbers[VARIANCE],
    )  # fmt: skip
    numbers[CROSS_X] *= factor
    numbers[CROSS_Y] *= factor


@leaf_kernel
def _shrink_cross(before, cell, numbers):
    """What a read leaves of the covariance of position and heading: P' P^-1 of it, as in any Kalman filter."""
    own = cell * cell / 12.0
    xx, xy, yy = before[0] + own, before[1], before[2] + own
    determinant = max(xx * yy - xy * xy, own * own)
    u = (yy * numbers[CROSS_X] - xy * numbers[CROSS_Y]) / determinant
    v = (xx * numbers[CROSS_Y] - xy * numbers[CROSS_X]) / determinant
    cross_x = (numbers[GRID_XX] + own) * u + numbers[GRID_XY] * v
    cross_y = numbers[GRID_XY] * u + (numbers[GRID_YY] + own) * v
    numbers[CROSS_X], numbers[CROSS_Y] = cross_x, cross_y
    _fit_cross(cell, numbers)


@leaf_kernel
def settle(cell, numbers, grids, room):
    """Blur the grid by all that is due, before a read; what is due the other way round is dropped.

    Where much is due, the belief is so wide that its shape is forgotten: a Gaussian takes its place.
    """
    if max(numbers[DUE_XX], numbers[DUE_YY]) > _MOST_DUE * cell * cell:
        per_cell2 = 1.0 / (cell * cell)
        xx, xy, yy = positive_part(
            (numbers[GRID_XX] + numbers[DUE_XX]) * per_cell2, (numbers[GRID_XY] + numbers[DUE_XY]) * per_cell2,
            (numbers[GRID_YY] + numbers[DUE_YY]) * per_cell2, 1e6,
        )  # fmt: skip
        numbers[MIDDLE_X] += numbers[MEAN_X]
        numbers[MIDDLE_Y] += numbers[MEAN_Y]
        numbers[DUE_XX] = numbers[DUE_XY] = numbers[DUE_YY] = 0.0
        _draw(xx, xy, yy, cell, numbers, grids, room)
        _fit_cross(cell, numbers)
        return
    for _ in range(_MOST_BLURS):
        xx, xy, yy = positive_part(numbers[DUE_XX], numbers[DUE_XY], numbers[DUE_YY], np.inf)
        numbers[DUE_XX], numbers[DUE_XY], numbers[DUE_YY] = xx, xy, yy
        if xx + yy < 1e-9 * cell * cell:
            break
        _blur_what_is_due(cell, numbers, grids, room)


@leaf_kernel
def weigh_reads(target_x, target_y, precision, cell, numbers, grids, room):
    """Multiply by the Gaussian of eq. 10 about where the reads put the robot; False if next to nothing is left."""
    n = grids.shape[1]
    settle(cell, numbers, grids, room)
    room[9, 3], room[9, 4], room[9, 5] = numbers[GRID_XX], numbers[GRID_XY], numbers[GRID_YY]
    # A Gaussian narrower than half a cell falls between the cells.
    precision = min(precision, 4.0 / (cell * cell))
    half = (n // 2) * cell
    fill_gaussian(room[4, :n], numbers[MIDDLE_X] - half, cell, target_x, precision, 1.0)
    fill_gaussian(room[5, :n], numbers[MIDDLE_Y] - half, cell, target_y, precision, 1.0 / numbers[TOTAL])
    if not _multiply(cell, numbers, grids, room):
        return False
    _shrink_cross(room[9, 3:6], cell, numbers)
    return True


@leaf_kernel
def blur_if_due(cell, numbers, grids, room):
    """Blur the grid if much is due, unless it is all but flat already."""
    due, width = max(numbers[DUE_XX], numbers[DUE_YY]), grids.shape[1] * cell
    if due > _DUE * cell * cell and max(numbers[GRID_XX], numbers[GRID_YY]) < _FLAT * width * width:
        _blur_what_is_due(cell, numbers, grids, room)
        _normalize(cell, numbers, grids, room)
        _fit_cross(cell, numbers)


@kernel
def make_room(n_cells):
    """Room for what a step computes."""
    return np.empty((13, max(n_cells, 2 * MOST_TAPS + 3)))
