"""Poses between the milestones of a drive along routes, compiled; the readable caller is in network_drive.py."""

import math

from rfiddesign.numerics._compile_kernels import kernel
from rfiddesign.numerics._math_kernels import sin_cos_64


@kernel
def poses_between(milestones, held, dt, out):
    """Write the poses at times 0, dt, 2 dt, ... to `out` (n, 3).

    Parameters
    ----------
    milestones : rows time, x, y and direction of the route, lateral deviation, deviation of the heading; all change
        evenly from row to row, times never fall, and after the last row all stays.
    held : heading held all the way [rad]; nan: the robot faces along the route.
    """
    n_milestones = milestones.shape[0]
    k = 0
    for t in range(out.shape[0]):
        time = t * dt
        while k + 1 < n_milestones and milestones[k + 1, 0] <= time:
            k += 1
        share = 0.0
        after = min(k + 1, n_milestones - 1)
        if after > k:
            share = (time - milestones[k, 0]) / (milestones[after, 0] - milestones[k, 0])
        x = milestones[k, 1] + share * (milestones[after, 1] - milestones[k, 1])
        y = milestones[k, 2] + share * (milestones[after, 2] - milestones[k, 2])
        direction = milestones[k, 3] + share * (milestones[after, 3] - milestones[k, 3])
        lateral = milestones[k, 4] + share * (milestones[after, 4] - milestones[k, 4])
        yaw = milestones[k, 5] + share * (milestones[after, 5] - milestones[k, 5])
        sine, cosine = sin_cos_64(direction)
        out[t, 0] = x - lateral * sine
        out[t, 1] = y + lateral * cosine
        out[t, 2] = (direction if math.isnan(held) else held) + yaw
