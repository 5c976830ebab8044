"""A belief on a square grid of positions: blurred with exact second moments, weighed, moved by whole cells.

A belief (n, n) holds the mass of the cell `row` along y and `column` along x; each mass counts at its cell's centre.
`grids` (2, n, n) holds it and room for what it becomes.
"""

import math

import numpy as np

from rfiddesign.estimators._grid_kernels import clear_sums, count_mass, gaussian_exponent, moments_of_sums
from rfiddesign.numerics._compile_kernels import leaf_kernel
from rfiddesign.numerics._math_kernels import exp_32

# Most cells to either side that one blur along a direction reaches: 21 in all, as in the paper.
MOST_TAPS = 10
# Largest variance [cells^2] of such a blur: that of steps of 0 or one cell to either side, as likely as that allows.
MOST_VARIANCE = 0.5 * MOST_TAPS
# Ratio of the variances along the axes of a blur.  Where the thinner axis has less it gets this share: blurs along a
# line that no row of cells follows would throw mass many cells away.
_MOST_RATIO = 64.0
_MOST_REDUCTIONS = 40
# Masses below this share of all are dropped: they count for nothing, and denormal numbers are slow.
_NOTHING = 1e-30
_LARGEST_EXPONENT = 80.0


@leaf_kernel
def positive_part(xx, xy, yy, ratio):
    """A symmetric matrix (xx, xy, yy) with its negative eigenvalues, and those below 1/ratio of the largest, raised."""
    middle, half = 0.5 * (xx + yy), 0.5 * (xx - yy)
    radius = math.sqrt(half * half + xy * xy)
    large, small = middle + radius, middle - radius
    if large <= 0.0:
        return 0.0, 0.0, 0.0
    least = large / ratio
    if small >= least:
        return xx, xy, yy
    if radius == 0.0:
        return large, 0.0, large
    # As middle + radius times a reflection, whose eigenvalues are 1 and -1.
    new_middle, share = 0.5 * (large + least), 0.5 * (large - least) / radius
    return new_middle + share * half, share * xy, new_middle - share * half


@leaf_kernel
def whole_directions(xx, xy, yy, directions):
    """Write (xx, xy, yy), positive definite, as a sum of weights times e e' with whole e (Selling's reduction).

    `directions` (3, 3) receives x and y of e, and its weight, which is not negative.
    """
    ax, ay, bx, by, cx, cy = 1.0, 0.0, 0.0, 1.0, -1.0, -1.0
    for _ in range(_MOST_REDUCTIONS):
        ab = ax * (xx * bx + xy * by) + ay * (xy * bx + yy * by)
        ac = ax * (xx * cx + xy * cy) + ay * (xy * cx + yy * cy)
        bc = bx * (xx * cx + xy * cy) + by * (xy * cx + yy * cy)
        if ab > 0.0:
            ax, ay, cx, cy = -ax, -ay, ax - bx, ay - by
        elif ac > 0.0:
            ax, ay, bx, by = -ax, -ay, ax - cx, ay - cy
        elif bc > 0.0:
            bx, by, ax, ay = -bx, -by, bx - cx, by - cy
        else:
            break
    directions[0, 0], directions[0, 1], directions[0, 2] = -ay, ax, max(-bc, 0.0)
    directions[1, 0], directions[1, 1], directions[1, 2] = -by, bx, max(-ac, 0.0)
    directions[2, 0], directions[2, 1], directions[2, 2] = -cy, cx, max(-ab, 0.0)


@leaf_kernel
def fill_taps(variance, taps):
    """Half of a symmetric kernel of this variance [cells^2] by its middle; returns how many cells it reaches.

    The kernel is that of equal steps of 0 or one cell to either side, two for each cell^2: its variance is exact, and
    many steps tend to a Gaussian.  `taps` (2 MOST_TAPS + 1,) is room; the kernel's middle is taps[0].
    """
    reach = min(max(math.ceil(2.0 * variance - 1e-12), 1), MOST_TAPS)
    p = 0.5 * variance / reach
    for k in range(taps.shape[0]):
        taps[k] = 0.0
    taps[0] = 1.0
    for done in range(reach):
        before, here = taps[1], taps[0]
        for k in range(done + 2):
            after = taps[k + 1]
            taps[k] = (1.0 - 2.0 * p) * here + p * (before + after)
            before, here = here, after
    return reach


@leaf_kernel
def _blur_along(source, target, step_x, step_y, taps, reach):
    """Blur along a direction of whole cells; what leaves the grid is lost."""
    n = source.shape[0]
    for row in range(n):
        here, new = source[row], target[row]
        for i in range(n):
            new[i] = taps[0] * here[i]
        for k in range(1, reach + 1):
            for side in range(2):
                shift_x, shift_y = (k * step_x, k * step_y) if side == 0 else (-k * step_x, -k * step_y)
                from_row = row - shift_y
                if from_row < 0 or from_row >= n or abs(shift_x) >= n:
                    continue
                low, high = max(shift_x, 0), min(n + shift_x, n)
                there, part = source[from_row, low - shift_x : high - shift_x], target[row, low:high]
                for i in range(high - low):
                    part[i] += taps[k] * there[i]


@leaf_kernel
def blur(grids, which, xx, xy, yy, directions, taps):
    """Blur a belief by up to a covariance [cells^2]; returns where the belief now is, and the covariance that it got.

    That is the covariance's positive part, its thinner axis at least 1/8 as wide as the other, along each direction at
    most MOST_VARIANCE.
    """
    xx, xy, yy = positive_part(xx, xy, yy, _MOST_RATIO)
    got_xx = got_xy = got_yy = 0.0
    if xx + yy <= 0.0:
        return which, got_xx, got_xy, got_yy
    whole_directions(xx, xy, yy, directions)
    for k in range(3):
        x, y, variance = directions[k, 0], directions[k, 1], min(directions[k, 2], MOST_VARIANCE)
        if variance < 1e-12:
            continue
        reach = fill_taps(variance, taps)
        _blur_along(grids[which], grids[1 - which], int(x), int(y), taps, reach)
        which = 1 - which
        got_xx, got_xy, got_yy = got_xx + variance * x * x, got_xy + variance * x * y, got_yy + variance * y * y
    return which, got_xx, got_xy, got_yy


@leaf_kernel
def fill_gaussian(factors, first, cell, mean, precision, scale):
    """scale exp(-(x - mean)^2 precision / 2) at x = first, first + cell, ..."""
    for k in range(factors.shape[0]):
        d = first + k * cell - mean
        exponent = 0.5 * precision * d * d
        factors[k] = scale * np.float64(exp_32(np.float32(-exponent))) if exponent < _LARGEST_EXPONENT else 0.0


@leaf_kernel
def draw_gaussian(grid, precision_xx, precision_xy, precision_yy):
    """A Gaussian about the grid's middle, its precision per cells^2."""
    n = grid.shape[0]
    for row in range(n):
        y = float(row - n // 2)
        for column in range(n):
            x = float(column - n // 2)
            exponent = gaussian_exponent(x, y, precision_xx, precision_xy, precision_yy)
            grid[row, column] = np.float64(exp_32(np.float32(-exponent))) if exponent < _LARGEST_EXPONENT else 0.0


@leaf_kernel
def weigh(grid, factors, sums, moments):
    """Multiply a belief by a function of x times one of y; `moments` (6,) receives those of what is left.

    Parameters
    ----------
    factors : (2, n) the functions of x and y.
    sums : (3, n) room.
    """
    n = grid.shape[0]
    by_x, plain, first, second = factors[0], sums[0], sums[1], sums[2]
    clear_sums(sums, n)
    for row in range(n):
        masses, by_y, y = grid[row], factors[1, row], float(row - n // 2)
        for i in range(n):
            mass = masses[i] * by_x[i] * by_y
            mass = mass if mass > _NOTHING else 0.0
            masses[i] = mass
            count_mass(plain, first, second, i, mass, y)
    moments_of_sums(sums, n, moments)


@leaf_kernel
def move(source, target, columns, rows):
    """Write a belief as seen from a window that has moved by whole cells; what it does not see is lost."""
    n = source.shape[0]
    low, high = max(-columns, 0), min(n - columns, n)
    for row in range(n):
        for i in range(n):
            target[row, i] = 0.0
        from_row = row + rows
        if 0 <= from_row < n:
            for i in range(low, high):
                target[row, i] = source[from_row, i + columns]
