"""Beliefs in a tag's place in plain numpy, all cells weighed by all observations: twin of the compiled ones."""

import numpy as np
from scipy.interpolate import RegularGridInterpolator


def cells_of(window):
    """Places of all cells (n, n, 2) [mm]."""
    n = len(window.logs)
    steps = (np.arange(n) - n // 2) * window.cell_mm
    x, y = np.meshgrid(window.centre_mm[0] + steps, window.centre_mm[1] + steps)
    return np.stack([x, y], axis=-1)


def seen_from(pose, places):
    """Places (..., 2) in the frame of an antenna at a pose."""
    d = places - np.asarray(pose)[:2]
    c, s = np.cos(pose[2]), np.sin(pose[2])
    return np.stack([c * d[..., 0] + s * d[..., 1], c * d[..., 1] - s * d[..., 0]], axis=-1)


def in_ellipse(pose, places, length, ratio=0.35):
    """Whether places lie in an ellipse with one end of its long axis at the antenna, ahead of it."""
    u, v = np.moveaxis(seen_from(pose, places), -1, 0)
    if length <= 0:
        return np.zeros(u.shape, bool)
    return (2 * u / length - 1) ** 2 + (2 * v / (ratio * length)) ** 2 <= 1 + 1e-9


def looked_up(pose, places, table, field):
    """A table of a field, between its entries by bilinear interpolation and 0 beyond them."""
    u, v = (low + np.arange(n) * field.cell_mm for low, n in zip((field.low_u, field.low_v), table.shape, strict=True))
    return RegularGridInterpolator((u, v), table, bounds_error=False, fill_value=0.0)(seen_from(pose, places))


def moments_of(mass, places):
    """Mean and covariance of masses at places."""
    mass = mass / mass.sum()
    mean = np.einsum("ij,ijk->k", mass, places)
    return mean, np.einsum("ij,ijk,ijl->kl", mass, places - mean, places - mean)
