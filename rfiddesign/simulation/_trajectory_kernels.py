"""Poses of a robot along a polyline, compiled; the readable caller is in trajectory.py."""

import math

from rfiddesign.numerics._compile_kernels import kernel
from rfiddesign.numerics._math_kernels import atan2_64


@kernel
def drive(waypoints, speed, constant_heading, turn_rate, dt, out):
    """Write the poses at times 0, dt, 2 dt, ... to `out` (n, 3); see `trajectory.drive`.

    `constant_heading` nan: the robot faces where it drives and turns in place at corners.
    """
    n, n_waypoints = out.shape[0], waypoints.shape[0]
    is_along = math.isnan(constant_heading)
    heading = 0.0 if is_along else constant_heading
    x, y = waypoints[0, 0], waypoints[0, 1]
    back_x = back_y = 0.0
    begin, t = 0.0, 0
    for k in range(1, n_waypoints):
        dx, dy = waypoints[k, 0] - x, waypoints[k, 1] - y
        length = math.sqrt(dx * dx + dy * dy)
        if length == 0.0:
            continue
        if is_along and back_x == 0.0 and back_y == 0.0:
            heading = atan2_64(dy, dx)
        elif is_along:
            # The short way round.
            turn = atan2_64(back_x * dy - back_y * dx, back_x * dx + back_y * dy)
            end = begin + abs(turn) / turn_rate
            while t < n and t * dt < end:
                out[t, 0], out[t, 1] = x, y
                out[t, 2] = heading + turn * ((t * dt - begin) / (end - begin))
                t += 1
            heading += turn
            begin = end
        end = begin + length / speed
        while t < n and t * dt < end:
            share = (t * dt - begin) / (end - begin)
            out[t, 0], out[t, 1], out[t, 2] = x + share * dx, y + share * dy, heading
            t += 1
        begin, x, y, back_x, back_y = end, waypoints[k, 0], waypoints[k, 1], dx, dy
        if t >= n:
            return
    while t < n:
        out[t, 0], out[t, 1], out[t, 2] = x, y, heading
        t += 1
