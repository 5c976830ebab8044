"""What one poll says of a Gaussian over the pose, on a grid over the tag's place; see `_projection_kernels`."""

import math

import numpy as np

from rfiddesign.estimators._projection_kernels import (
    EVIDENCE,
    MEAN_U,
    MEAN_V,
    N_TOLD,
    VAR_UU,
    VAR_UV,
    VAR_VV,
    say_nothing,
    spread,
)
from rfiddesign.models.soft_field import LEAST_PROBABILITY
from rfiddesign.numerics._compile_kernels import inline_kernel, leaf_kernel

# Cells of the grid per axis, and half its extent in sigmas.
N_GRID = 8
HALF_GRID = 3.2
# Half the width of a border, in sigmas of its blur: t^2 (3 - 2 t) over twice this has the variance of a Gaussian's.
HALF_BORDER = math.sqrt(5.0)
NO_INNER = -1e9
_LEAST = LEAST_PROBABILITY
_LEAST_BLUR = 1e-4
# A mean and a covariance of xi that a grid of few points can still tell.
_LEAST_LEFT = 0.02


def _nodes() -> tuple[np.ndarray, np.ndarray]:
    step = 2.0 * HALF_GRID / N_GRID
    nodes = (np.arange(N_GRID) - (N_GRID - 1) / 2) * step
    weights = np.exp(-0.5 * nodes**2)
    weights /= weights.sum()
    # Cut at the grid's ends, the variance is a little below that of a Gaussian.
    nodes = nodes / math.sqrt(float((weights * nodes**2).sum()))
    # The last bits of an exponential differ between machines.
    return np.round(nodes, 12), np.round(weights, 12)


_NODES, _WEIGHTS = _nodes()
_DENSITY = 1.0 / math.sqrt(2.0 * math.pi)


@inline_kernel
def exp_minus(x):
    """e^-x for 0 <= x <= 6, relative error below 1e-6."""
    y = x * -0.125
    p = 1.0 + y * (
        1.0 + y * (1 / 2 + y * (1 / 6 + y * (1 / 24 + y * (1 / 120 + y * (1 / 720 + y * (1 / 5040 + y / 40320))))))
    )
    p *= p
    p *= p
    return p * p


@inline_kernel
def depth_at(u, v, shape):
    """How deep (u, v) lies inside the outer border of (half_length, half_width, corner, inner) [mm]."""
    half_length, half_width, corner, _ = shape
    beyond_u, beyond_v = abs(u) - half_length, abs(v) - half_width
    out_u, out_v = max(beyond_u, 0.0), max(beyond_v, 0.0)
    return corner - math.sqrt(out_u * out_u + out_v * out_v) - min(max(beyond_u, beyond_v), 0.0)


@inline_kernel
def soft_step(depth, per_width):
    """Chance to be within a border that is blurred over 1 / `per_width`."""
    t = min(max(depth * per_width + 0.5, 0.0), 1.0)
    return t * t * (3.0 - 2.0 * t)


@inline_kernel
def _in_table(u, v, table, per_cell):
    """Table at (u, v) from its middle (bilinear); what its border holds lies all around."""
    p = min(max(u * per_cell + 0.5 * (table.shape[0] - 1), 0.0), table.shape[0] - 1.000001)
    q = min(max(v * per_cell + 0.5 * (table.shape[1] - 1), 0.0), table.shape[1] - 1.000001)
    i, j = int(p), int(q)
    f, g = p - i, q - j
    low = table[i, j] + g * (table[i, j + 1] - table[i, j])
    high = table[i + 1, j] + g * (table[i + 1, j + 1] - table[i + 1, j])
    return low + f * (high - low)


@leaf_kernel
def _fill_chances(chances, u0, v0, root, nodes, shape, per_width, table, per_cell):
    """Chance to be in the field at every point of the grid: row j, column i is xi = (nodes[0, i], nodes[1, j])."""
    l00, l10, l11 = root
    _, _, corner, inner = shape
    if table.shape[0] > 0:
        for j in range(N_GRID):
            for i in range(N_GRID):
                u = u0 + l00 * nodes[0, i]
                v = v0 + l10 * nodes[0, i] + l11 * nodes[1, j]
                chances[j, i] = _in_table(u, v, table, per_cell)
        return
    for j in range(N_GRID):
        for i in range(N_GRID):
            u = u0 + l00 * nodes[0, i]
            v = v0 + l10 * nodes[0, i] + l11 * nodes[1, j]
            depth = depth_at(u, v, shape)
            chances[j, i] = soft_step(depth, per_width) - soft_step(depth + (inner - corner), per_width)


@leaf_kernel
def _sum_up(chances, nodes, weights, base, found):
    """Moments of xi under weights times chances plus `base` times its prior."""
    e = base
    mu = mv = cuv = 0.0
    cuu = cvv = base
    for j in range(N_GRID):
        row = row_u = row_uu = 0.0
        for i in range(N_GRID):
            share = weights[0, i] * chances[j, i]
            row += share
            row_u += share * nodes[0, i]
            row_uu += share * nodes[0, i] * nodes[0, i]
        w, v = weights[1, j], nodes[1, j]
        e += w * row
        mu += w * row_u
        mv += w * v * row
        cuu += w * row_uu
        cuv += w * v * row_u
        cvv += w * v * v * row
    per = 1.0 / max(e, 1e-12)
    mu, mv = mu * per, mv * per
    cuu, cuv, cvv = cuu * per - mu * mu, cuv * per - mu * mv, cvv * per - mv * mv
    if cuu * cvv - cuv * cuv < _LEAST_LEFT * _LEAST_LEFT or cuu < _LEAST_LEFT or cvv < _LEAST_LEFT:
        cuu, cvv = max(cuu, 0.0) + _LEAST_LEFT, max(cvv, 0.0) + _LEAST_LEFT
    found[EVIDENCE], found[N_TOLD], found[MEAN_U], found[MEAN_V] = e, 2.0, mu, mv
    found[VAR_UU], found[VAR_UV], found[VAR_VV] = cuu, cuv, cvv


@leaf_kernel
def _cut(u0, v0, root, shape, reach, margin, nodes, weights):
    """Lay the grid over what of the prior lies by the box of the field; False if there is nothing."""
    l00, l10, l11 = root
    half_u, half_v = shape[0] + shape[2] + margin, shape[1] + shape[2] + margin
    if reach > 0.0:
        half_u = half_v = reach + margin
    middle_u, side_u = -u0 / l00, half_u / l00
    slope = l10 / l00
    middle_v = (slope * u0 - v0) / l11
    if shape[0] == 0.0 and shape[1] == 0.0:
        side_v = math.sqrt(half_u * half_u * slope * slope + half_v * half_v) / l11
    else:
        side_v = (abs(slope) * half_u + half_v) / l11
    for axis in range(2):
        middle, side = (middle_u, side_u) if axis == 0 else (middle_v, side_v)
        low, high = max(middle - side, -HALF_GRID), min(middle + side, HALF_GRID)
        if low >= high:
            return False
        if low == -HALF_GRID and high == HALF_GRID:
            for i in range(N_GRID):
                nodes[axis, i], weights[axis, i] = _NODES[i], _WEIGHTS[i]
            continue
        step = (high - low) / N_GRID
        for i in range(N_GRID):
            xi = low + (i + 0.5) * step
            nodes[axis, i] = xi
            weights[axis, i] = _DENSITY * step * exp_minus(0.5 * xi * xi)
    return True


@inline_kernel
def _blur(nodes, root, softness):
    """Sigma of a border that is blurred by `softness` and by the cells of the grid."""
    l00, l10, l11 = root
    step_u, step_v = nodes[0, 1] - nodes[0, 0], nodes[1, 1] - nodes[1, 0]
    cell = step_u * step_u * (l00 * l00 + l10 * l10) + step_v * step_v * l11 * l11
    return math.sqrt(softness * softness + cell * (1 / 24) + _LEAST_BLUR)


@leaf_kernel
def look_at_read(mix, k, seen, shape, softness, chance_to_read, field, scratch, found):
    """The antenna read a tag that `seen_from` saw; see the module.

    Parameters
    ----------
    shape : (half_length, half_width, corner, inner) of the field [mm].
    field : (table (n, m), 1 / its cells, reach of the table), or no cells.
    scratch : (nodes (2, N_GRID), weights (2, N_GRID), chances (N_GRID, N_GRID)).
    """
    nodes, weights, chances = scratch
    table, per_cell, reach = field
    u, v = seen[0], seen[1]
    root = spread(mix, k, seen, found)
    l00, l10, l11 = root
    margin = HALF_BORDER * softness
    sigma = math.sqrt(l00 * l00 + l10 * l10 + l11 * l11)
    if not _cut(u, v, root, shape, reach, margin + 0.25 * sigma, nodes, weights):
        say_nothing(found, _LEAST)
        return
    blur = _blur(nodes, root, softness)
    _fill_chances(chances, u, v, root, nodes, shape, 0.5 / (HALF_BORDER * blur), table, per_cell)
    for j in range(N_GRID):
        for i in range(N_GRID):
            chances[j, i] = max(chance_to_read * chances[j, i] - _LEAST, 0.0)
    _sum_up(chances, nodes, weights, _LEAST, found)


@leaf_kernel
def look_at_none(mix, k, seen, tags, n_tags, shape, softness, chance_to_read, field, scratch, product, found):
    """The antenna read none of the first rows of `tags` (n, 2), of which `seen` is the first; see `look_at_read`.

    `product` (N_GRID, N_GRID) is scratch, too.
    """
    nodes, weights, chances = scratch
    table, per_cell, _ = field
    u, v, h0, h1, _, _ = seen
    root = spread(mix, k, seen, found)
    for axis in range(2):
        for i in range(N_GRID):
            nodes[axis, i], weights[axis, i] = _NODES[i], _WEIGHTS[i]
    per_width = 0.5 / (HALF_BORDER * _blur(nodes, root, softness))
    for j in range(N_GRID):
        for i in range(N_GRID):
            product[j, i] = 1.0
    for tag in range(n_tags):
        # The antenna's axes are those of the mean heading.
        dx, dy = tags[tag, 0] - tags[0, 0], tags[tag, 1] - tags[0, 1]
        _fill_chances(
            chances, u + h0 * dx + h1 * dy, v + h0 * dy - h1 * dx, root, nodes, shape, per_width, table, per_cell
        )
        for j in range(N_GRID):
            for i in range(N_GRID):
                product[j, i] *= 1.0 - chance_to_read * chances[j, i]
    _sum_up(product, nodes, weights, 0.0, found)
