"""Square grids of positions: what a robot's belief (Markov localization) and a tag's (tag mapping) have in common.

Cell `row` of a grid (n, n) lies along y and `column` along x; offsets are counted from the middle cell, n // 2.  A
robot's belief holds masses, since it is blurred and weighed by factors; a tag's holds their logarithms, since it does
not move and is weighed thousands of times.
"""

from rfiddesign.numerics._compile_kernels import inline_kernel, leaf_kernel


@leaf_kernel
def clear_sums(sums, n):
    """Begin to count masses.

    `sums` (3, n or more) holds, by column, the sums of mass, of mass times y and of mass times y^2.
    """
    for k in range(3):
        for i in range(n):
            sums[k, i] = 0.0


@inline_kernel
def count_mass(plain, first, second, column, mass, y):
    """Count the mass of a cell in the rows of `sums`.

    By columns, which the compiler can take many at once; a sum along a row has an order.
    """
    plain[column] += mass
    first[column] += mass * y
    second[column] += mass * (y * y)


@leaf_kernel
def moments_of_sums(sums, n, moments):
    """Moments (6,) of counted masses: their sum; mean x, y; variances xx, xy, yy, about the middle cell [cells]."""
    plain, first, second = sums[0], sums[1], sums[2]
    total = sx = sy = sxx = sxy = syy = 0.0
    for i in range(n):
        x = float(i - n // 2)
        total += plain[i]
        sx, sxx = sx + x * plain[i], sxx + x * x * plain[i]
        sy, sxy, syy = sy + first[i], sxy + x * first[i], syy + second[i]
    moments[0] = total
    if total > 0.0:
        x, y = sx / total, sy / total
        moments[1], moments[2] = x, y
        moments[3], moments[4], moments[5] = max(sxx / total - x * x, 0.0), sxy / total - x * y, max(
            syy / total - y * y, 0.0
        )  # fmt: skip


@inline_kernel
def gaussian_exponent(x, y, precision_xx, precision_xy, precision_yy):
    """Minus the logarithm of a Gaussian about the middle cell, 0 there; its precision is per cells^2."""
    return 0.5 * (precision_xx * x * x + precision_yy * y * y) + precision_xy * x * y
