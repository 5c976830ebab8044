"""Diffusion of a histogram over poses by stencils whose second moments are exactly the noise of a step.

A histogram is `mass` (n_headings, n, n): layers of equal heading, each a square of cells over x and y.  Mass lies in
the box (first, end) of layers, rows and columns; outside it is exactly zero.  Layer k has the middle of its middle cell
at `origins[k]`, any real numbers, so that layers move without interpolation.
"""

import math

from rfiddesign.numerics._compile_kernels import inline_kernel, leaf_kernel

# A stencil of three with a third of the mass outside has the kurtosis of a Gaussian, too [steps of the stencil^2].
_MOST_PER_PASS = 1.0 / 3.0
# Thinner covariances than this, least over most variance, would need steps across many cells.
THINNEST = 0.02


@inline_kernel
def _product(a, b, c, v, w):
    return v[0] * (a * w[0] + b * w[1]) + v[1] * (b * w[0] + c * w[1])


@leaf_kernel
def lattice_directions(a, b, c):
    """A covariance [[a, b], [b, c]] in cells^2 as a sum of variances >= 0 along three steps from cell to cell.

    Selling's reduction: while two vectors of a superbase (v0 + v1 + v2 = 0) make an acute angle in the metric of the
    covariance, one of them is turned.

    Returns (variance, rows, columns) three times.
    """
    v, w, u = (1, 0), (0, 1), (-1, -1)
    tolerance = 1e-9 * (a + c)
    for _ in range(32):
        if _product(a, b, c, v, w) > tolerance:
            new = ((-v[0], -v[1]), w, (v[0] - w[0], v[1] - w[1]))
        elif _product(a, b, c, w, u) > tolerance:
            new = ((-w[0], -w[1]), u, (w[0] - u[0], w[1] - u[1]))
        elif _product(a, b, c, u, v) > tolerance:
            new = ((-u[0], -u[1]), v, (u[0] - v[0], u[1] - v[1]))
        else:
            break
        v, w, u = new
    return (
        (max(-_product(a, b, c, w, u), 0.0), -v[1], v[0]),
        (max(-_product(a, b, c, u, v), 0.0), -w[1], w[0]),
        (max(-_product(a, b, c, v, w), 0.0), -u[1], u[0]),
    )


@inline_kernel
def _add_shifted(source, i_source, shift, share, target, i, first, end):
    """target[i, j] += share * source[i_source, j + shift] for first <= j < end, where there is a source."""
    n = source.shape[0]
    if 0 <= i_source < n:
        for j in range(max(first, -shift), min(end, n - shift)):
            target[i, j] += share * source[i_source, j + shift]


@leaf_kernel
def _diffuse_once(source, target, variance, rows, columns, first_i, end_i, first_j, end_j):
    half = 0.5 * variance
    for i in range(first_i, end_i):
        for j in range(first_j, end_j):
            target[i, j] = (1.0 - variance) * source[i, j]
        _add_shifted(source, i - rows, -columns, half, target, i, first_j, end_j)
        _add_shifted(source, i + rows, columns, half, target, i, first_j, end_j)


@leaf_kernel
def diffuse_layer(layer, spare, a, b, c, first_i, end_i, first_j, end_j):
    """Spread a layer's mass by the covariance [[a, b], [b, c]] [cells^2]; returns the box that it then fills.

    `spare` (n, n) is scratch.
    """
    n, is_swapped = layer.shape[0], False
    for i in range(n):
        for j in range(n):
            spare[i, j] = 0.0
    for variance, rows, columns in lattice_directions(a, b, c):
        left = variance
        while left > 1e-12:
            # Two cells at a time where there is much to spread, which has the kurtosis of a Gaussian at 2^2 / 3.
            stride = 2 if left >= 4.0 * _MOST_PER_PASS else 1
            most = stride * stride * _MOST_PER_PASS
            share = most if left >= most else left
            left -= share
            up, across = stride * rows, stride * columns
            first_i, end_i = max(first_i - abs(up), 0), min(end_i + abs(up), n)
            first_j, end_j = max(first_j - abs(across), 0), min(end_j + abs(across), n)
            weight = share / (stride * stride)
            if is_swapped:
                _diffuse_once(spare, layer, weight, up, across, first_i, end_i, first_j, end_j)
            else:
                _diffuse_once(layer, spare, weight, up, across, first_i, end_i, first_j, end_j)
            is_swapped = not is_swapped
    if is_swapped:
        for i in range(first_i, end_i):
            for j in range(first_j, end_j):
                layer[i, j] = spare[i, j]
    return first_i, end_i, first_j, end_j


@inline_kernel
def _add_neighbour(mass, spare, origins, per_cell, k, neighbour, share, first_i, end_i, first_j, end_j):
    """Add a share of a neighbouring layer, where its cells lie over those of layer k (bilinear)."""
    at_i = (origins[k, 0] - origins[neighbour, 0]) * per_cell
    at_j = (origins[k, 1] - origins[neighbour, 1]) * per_cell
    whole_i, whole_j = math.floor(at_i), math.floor(at_j)
    part_i, part_j = at_i - whole_i, at_j - whole_j
    source, target = mass[neighbour], spare[k]
    for i in range(first_i, end_i):
        row = i + whole_i
        here, next_ = share * (1.0 - part_i), share * part_i
        _add_shifted(source, row, whole_j, here * (1.0 - part_j), target, i, first_j, end_j)
        _add_shifted(source, row, whole_j + 1, here * part_j, target, i, first_j, end_j)
        _add_shifted(source, row + 1, whole_j, next_ * (1.0 - part_j), target, i, first_j, end_j)
        _add_shifted(source, row + 1, whole_j + 1, next_ * part_j, target, i, first_j, end_j)


@inline_kernel
def added_by_exchange(origins, per_cell, k, axis):
    """Variance [cells^2] that the mass of layer k gains along an axis, per unit of it sent to each neighbour."""
    added = 0.0
    for neighbour in (k - 1, k + 1):
        if 0 <= neighbour < origins.shape[0]:
            at = (origins[k, axis] - origins[neighbour, axis]) * per_cell
            part = at - math.floor(at)
            added += part * (1.0 - part)
    return added


@leaf_kernel
def _exchange_once(mass, spare, origins, cell, box, half):
    n_layers, n = mass.shape[0], mass.shape[1]
    per_cell = 1.0 / cell
    first_k, end_k = max(box[0] - 1, 0), min(box[1] + 1, n_layers)
    first_i, end_i, first_j, end_j = box[2], box[3], box[4], box[5]
    for k in range(first_k, end_k - 1):
        at_i = math.floor((origins[k, 0] - origins[k + 1, 0]) * per_cell)
        at_j = math.floor((origins[k, 1] - origins[k + 1, 1]) * per_cell)
        first_i, end_i = min(first_i, box[2] - abs(at_i) - 1), max(end_i, box[3] + abs(at_i) + 1)
        first_j, end_j = min(first_j, box[4] - abs(at_j) - 1), max(end_j, box[5] + abs(at_j) + 1)
    first_i, end_i, first_j, end_j = max(first_i, 0), min(end_i, n), max(first_j, 0), min(end_j, n)
    for k in range(first_k, end_k):
        for i in range(first_i, end_i):
            for j in range(first_j, end_j):
                spare[k, i, j] = (1.0 - 2.0 * half) * mass[k, i, j]
        if k > box[0] and k <= box[1]:
            _add_neighbour(mass, spare, origins, per_cell, k, k - 1, half, first_i, end_i, first_j, end_j)
        if k + 1 >= box[0] and k + 1 < box[1]:
            _add_neighbour(mass, spare, origins, per_cell, k, k + 1, half, first_i, end_i, first_j, end_j)
    box[0], box[1], box[2], box[3], box[4], box[5] = first_k, end_k, first_i, end_i, first_j, end_j
    for k in range(first_k, end_k):
        for i in range(first_i, end_i):
            for j in range(first_j, end_j):
                mass[k, i, j] = spare[k, i, j]


@leaf_kernel
def exchange_layers(mass, spare, origins, cell, box, variance):
    """Spread the heading by a variance [layers^2]: neighbouring layers swap mass where cells lie above each other.

    Only what is swapped is interpolated; the variance in x and y that this adds is `added_by_exchange` times half the
    variance.
    """
    if variance <= 1e-12 or mass.shape[0] == 1:
        return
    n_passes = max(1, math.ceil(variance / _MOST_PER_PASS))
    for _ in range(n_passes):
        _exchange_once(mass, spare, origins, cell, box, 0.5 * variance / n_passes)
