"""Random routes among a polygon's edges, compiled; the readable callers are in routes.py.

Edges have rows x0, y0, x1, y1.  An edge is crossed by a ray where its ends lie on different sides of the ray's line; an
end on the line counts to its right side, so that a ray through a vertex crosses exactly one of two passing edges.
"""

import math

import numpy as np

from rfiddesign.numerics._compile_kernels import kernel, leaf_kernel
from rfiddesign.numerics._noise_kernels import fine_uniform, key_halves, random_bits

_U = np.uint32
# Points drawn for a start, and directions that an oblique leg may take.
_MOST_STARTS = 6400
_N_DIRECTIONS = 4
# Of the free way at most: waypoints never touch a wall.
_WALL_SHARE = 0.99


@leaf_kernel
def ray_distance(edges, x, y, dx, dy):
    """Distance from (x, y) along the unit vector (dx, dy) to the first edge it crosses; infinite if there is none."""
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


@leaf_kernel
def is_inside(edges, x, y):
    """Whether (x, y) lies inside the rings: a ray from it crosses them an odd number of times."""
    n_crossed = 0
    for i in range(edges.shape[0]):
        if (edges[i, 1] > y) != (edges[i, 3] > y):
            along = (y - edges[i, 1]) / (edges[i, 3] - edges[i, 1])
            if edges[i, 0] + along * (edges[i, 2] - edges[i, 0]) > x:
                n_crossed += 1
    return n_crossed % 2 == 1


@kernel
def random_route(key, edges, bounds, refuge, length, is_aligned, axis, legs, out):
    """Waypoints of a route as `routes.random_route` describes it; returns how many, 0 if there is not room enough.

    Parameters
    ----------
    key : stream that all is drawn from.
    edges, bounds : (n, 4), and (low x, low y, high x, high y) of the polygon that the route stays in.
    refuge : (x, y) inside it, where the route starts if no other start is found.
    length : of the route, at least.
    axis : (cosine, sine) of the lattice's first axis.
    legs : (least, greatest) length of a leg.
    out : (n, 2) room for the waypoints.
    """
    low, high = key_halves(key)
    low_x, low_y, high_x, high_y = bounds
    draw = _U(0)
    x, y = refuge
    for _ in range(_MOST_STARTS):
        start_x = low_x + (high_x - low_x) * fine_uniform(random_bits(low, high, draw))
        start_y = low_y + (high_y - low_y) * fine_uniform(random_bits(low, high, _U(draw + _U(1))))
        draw = _U(draw + _U(2))
        if is_inside(edges, start_x, start_y):
            x, y = start_x, start_y
            break
    out[0, 0], out[0, 1] = x, y
    n_points, driven = 1, 0.0
    back_x = back_y = 0.0
    directions = np.empty((_N_DIRECTIONS, 2))
    while driven < length:
        draw = _draw_directions(low, high, draw, is_aligned, axis, directions)
        dx, dy, room = _choose_direction(edges, x, y, directions, back_x, back_y, legs[0])
        longest = min(room, legs[1])
        leg = longest
        if longest > legs[0]:
            leg = legs[0] + (longest - legs[0]) * fine_uniform(random_bits(low, high, draw))
            draw = _U(draw + _U(1))
        next_x, next_y = x + leg * dx, y + leg * dy
        if n_points >= out.shape[0] or (next_x == x and next_y == y):
            return 0
        x, y = next_x, next_y
        out[n_points, 0], out[n_points, 1] = x, y
        n_points += 1
        driven += leg
        back_x, back_y = -dx, -dy
    return n_points


@leaf_kernel
def _draw_directions(low, high, draw, is_aligned, axis, out):
    """Unit vectors to try in turn: the lattice's axes shuffled, or any directions.  Returns the next free draw.

    Any direction is drawn in the unit disc and scaled: square roots, unlike sines, come out the same on every machine.
    """
    if is_aligned:
        c, s = axis
        out[0, 0], out[0, 1] = c, s
        out[1, 0], out[1, 1] = -s, c
        out[2, 0], out[2, 1] = -c, -s
        out[3, 0], out[3, 1] = s, -c
        for i in range(_N_DIRECTIONS - 1, 0, -1):
            k = int((i + 1) * fine_uniform(random_bits(low, high, draw)))
            draw = _U(draw + _U(1))
            for side in range(2):
                kept = out[i, side]
                out[i, side] = out[k, side]
                out[k, side] = kept
        return draw
    n = 0
    while n < _N_DIRECTIONS:
        x = 2.0 * fine_uniform(random_bits(low, high, draw)) - 1.0
        y = 2.0 * fine_uniform(random_bits(low, high, _U(draw + _U(1)))) - 1.0
        draw = _U(draw + _U(2))
        norm = math.sqrt(x * x + y * y)
        if 0.1 < norm <= 1.0:
            out[n, 0], out[n, 1] = x / norm, y / norm
            n += 1
    return draw


@leaf_kernel
def _choose_direction(edges, x, y, directions, back_x, back_y, least):
    """The first direction with enough room, else the roomiest; back along the last leg only if that beats all.

    Returns the direction and how far it can be driven.
    """
    best_x, best_y, most = back_x, back_y, 0.0
    for k in range(directions.shape[0]):
        dx, dy = directions[k, 0], directions[k, 1]
        if max(abs(dx - back_x), abs(dy - back_y)) < 1e-6:
            continue
        room = _WALL_SHARE * ray_distance(edges, x, y, dx, dy)
        if room >= least:
            return dx, dy, room
        if room > most:
            best_x, best_y, most = dx, dy, room
    if back_x != 0.0 or back_y != 0.0:
        room = _WALL_SHARE * ray_distance(edges, x, y, back_x, back_y)
        if room > most:
            return back_x, back_y, room
    return best_x, best_y, most
