"""Cells of a histogram over poses, halved and doubled to fit the belief."""

import math

from rfiddesign.estimators._histogram_window_kernels import (
    CELL,
    LEAST,
    LOST,
    MEAN_TURN,
    MEAN_X,
    MEAN_Y,
    SLOPE_X,
    SLOPE_Y,
    SPREAD,
    TURN,
)
from rfiddesign.numerics._compile_kernels import inline_kernel, leaf_kernel

# More mass than this near the border asks for larger cells; less than this in the outer part allows smaller ones.
_BORDER_SHARE = 1e-5
_BORDER, _INNER = 0.9, 0.42
# Cells are halved when there are fewer per standard deviation, doubled when there are more (and border is not lost).
_FEWEST_CELLS, _MOST_CELLS = 2.5, 6.0


@leaf_kernel
def _share_beyond(marginals, axis, n, share):
    """Mass further from the middle than a share of half the window."""
    half, mass = (n - 1) // 2, 0.0
    for k in range(n):
        if abs(k - half) > share * half:
            mass += marginals[axis, k]
    return mass


@inline_kernel
def _wanted(border, outer, deviation, cell, feature, least, most):
    """-1: halve the cells; 1: double them; 0: neither.  `feature` is a length that wants half a cell at least."""
    if border > _BORDER_SHARE:
        return 1 if 2.0 * cell <= most else 0
    if outer < _BORDER_SHARE and (deviation < _FEWEST_CELLS * cell or cell > 2.0 * feature):
        return -1 if 0.5 * cell >= least else 0
    return 1 if deviation > _MOST_CELLS * cell and cell <= feature and 2.0 * cell <= most else 0


@leaf_kernel
def fit_cells(mass, spare, origins, box, frame, marginals, shape, total, limits):
    """Double or halve cells and layers where the belief outgrew the window or shrank in it.

    `limits`: (least, most side of a cell, least, most turn between layers, length that edges of evidence want to be
    resolved to [mm], and the turn that moves an antenna so far).
    """
    n_layers, n = mass.shape[0], mass.shape[1]
    least, most, least_turn, most_turn, feature, feature_turn = limits
    border = max(_share_beyond(marginals, 1, n, _BORDER), _share_beyond(marginals, 2, n, _BORDER)) / total
    outer = max(_share_beyond(marginals, 1, n, _INNER), _share_beyond(marginals, 2, n, _INNER)) / total
    wanted = _wanted(border, outer, shape[LEAST], frame[CELL], feature, least, most)
    if wanted != 0:
        rescale_cells(mass, spare, box, frame, wanted > 0)
    if n_layers == 1:
        return
    border = _share_beyond(marginals, 0, n_layers, _BORDER) / total
    outer = _share_beyond(marginals, 0, n_layers, _INNER) / total
    wanted = _wanted(border, outer, shape[SPREAD], frame[TURN], feature_turn, least_turn, most_turn)
    if wanted != 0:
        rescale_headings(mass, spare, origins, box, frame, shape, wanted > 0)


@leaf_kernel
def _resample(source, target, is_coarser):
    """Double or halve the cells along the first axis of (n, m) arrays about the middle row.

    By cubic interpolation and its adjoint (Deslauriers, Dubuc 1989), which keep moments up to the third.
    """
    n, m = source.shape
    half = (n - 1) // 2
    for i in range(n):
        for j in range(m):
            target[i, j] = 0.0
        off = i - half
        for tap in range(-3, 4):
            if is_coarser:
                at = half + 2 * off + tap
                weight = 1.0 if tap == 0 else (0.0, 0.5625, 0.0, -0.0625)[abs(tap)]
            else:
                # An even row lies on an old one, an odd row between two.
                if (off - tap) % 2 != 0:
                    continue
                at = half + (off - tap) // 2
                weight = 0.5 if tap == 0 else (0.0, 0.28125, 0.0, -0.03125)[abs(tap)]
            if weight != 0.0 and 0 <= at < n:
                for j in range(m):
                    target[i, j] += weight * source[at, j]


@leaf_kernel
def _clean(mass, box):
    """Clear what interpolation left below zero; the box becomes the whole window.  Returns the sum of all mass."""
    total = 0.0
    for k in range(mass.shape[0]):
        for i in range(mass.shape[1]):
            for j in range(mass.shape[2]):
                mass[k, i, j] = max(mass[k, i, j], 0.0)
                total += mass[k, i, j]
    for axis in range(3):
        box[2 * axis], box[2 * axis + 1] = 0, mass.shape[axis]
    return total


@leaf_kernel
def rescale_cells(mass, spare, box, frame, is_coarser):
    """Double or halve the cells of every layer about its middle."""
    for k in range(box[0], box[1]):
        _resample(mass[k], spare[0], is_coarser)
        _resample(spare[0].T, mass[k].T, is_coarser)
    frame[CELL] *= 2.0 if is_coarser else 0.5
    _normalize(mass, _clean(mass, box), frame)


@leaf_kernel
def rescale_headings(mass, spare, origins, box, frame, shape, is_coarser):
    """Double or halve the turn between layers, which are put on their line before."""
    n_layers, n = mass.shape[0], mass.shape[1]
    middle = (n_layers - 1) // 2
    for k in range(n_layers):
        along = (k - middle) * frame[TURN] - shape[MEAN_TURN]
        x, y = shape[MEAN_X] + along * shape[SLOPE_X], shape[MEAN_Y] + along * shape[SLOPE_Y]
        if box[0] <= k < box[1]:
            _interpolate(mass[k], spare[0], (x - origins[k, 0]) / frame[CELL])
            _interpolate(spare[0].T, mass[k].T, (y - origins[k, 1]) / frame[CELL])
    _resample(mass.reshape(n_layers, n * n), spare.reshape(n_layers, n * n), is_coarser)
    frame[TURN] *= 2.0 if is_coarser else 0.5
    for k in range(n_layers):
        along = (k - middle) * frame[TURN] - shape[MEAN_TURN]
        origins[k, 0] = shape[MEAN_X] + along * shape[SLOPE_X]
        origins[k, 1] = shape[MEAN_Y] + along * shape[SLOPE_Y]
        for i in range(n):
            for j in range(n):
                mass[k, i, j] = spare[k, i, j]
    _normalize(mass, _clean(mass, box), frame)


@leaf_kernel
def _interpolate(source, target, shift):
    """target[i] = source[i + shift] along the first axis, by Lagrange's cubic, which keeps moments up to the third."""
    n, m = source.shape
    shift = min(max(shift, -2.0 * n), 2.0 * n)
    whole = math.floor(shift)
    f = shift - whole
    weights = (
        -f * (f - 1.0) * (f - 2.0) / 6.0, (f + 1.0) * (f - 1.0) * (f - 2.0) / 2.0, -(f + 1.0) * f * (f - 2.0) / 2.0,
        (f + 1.0) * f * (f - 1.0) / 6.0,
    )  # fmt: skip
    for i in range(n):
        for j in range(m):
            target[i, j] = 0.0
        for tap in range(4):
            at = i + whole + tap - 1
            if 0 <= at < n:
                for j in range(m):
                    target[i, j] += weights[tap] * source[at, j]


@leaf_kernel
def _normalize(mass, total, frame):
    """Bring the mass to 1 and count what was lost of it."""
    frame[LOST] += max(1.0 - total, 0.0)
    if total > 0.0:
        for k in range(mass.shape[0]):
            for i in range(mass.shape[1]):
                for j in range(mass.shape[2]):
                    mass[k, i, j] /= total
