"""Compiled ray casting among a polygon's edges; the readable callers are in routes.py."""

import math

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def ray_distance(edges: np.ndarray, x: float, y: float, dx: float, dy: float) -> float:
    """Distance from (x, y) along the unit vector (dx, dy) to the first edge it crosses; infinite if there is none.

    `edges` has rows x0, y0, x1, y1. An edge is crossed where its ends lie on different sides of the ray's line; an end
    on the line counts to its right side, so that a ray through a vertex crosses exactly one of two passing edges.
    """
    nearest = math.inf
    for i in range(edges.shape[0]):
        start_x, start_y = edges[i, 0] - x, edges[i, 1] - y
        end_x, end_y = edges[i, 2] - x, edges[i, 3] - y
        start_side = dx * start_y - dy * start_x
        end_side = dx * end_y - dy * end_x
        if (start_side > 0.0) != (end_side > 0.0):
            start_along = dx * start_x + dy * start_y
            end_along = dx * end_x + dy * end_y
            along = (start_side * end_along - end_side * start_along) / (start_side - end_side)
            if 0.0 <= along < nearest:
                nearest = along
    return nearest
