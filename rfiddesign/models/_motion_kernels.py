"""Noise of one step's odometry, compiled; the models are in motion.py."""

import math

from rfiddesign.numerics._compile_kernels import inline_kernel

# The noise of a turn must stay below half a turn at 6.4 sigma.
MAX_TURN_DEVIATION = 0.49


@inline_kernel
def step_variances(noise, dx, dy, turn):
    """Variances (x, y, heading) of a step's increment; `noise` (3, 3) as in `Motion.noise`."""
    way, turned = math.sqrt(dx * dx + dy * dy), abs(turn)
    return (
        noise[0, 0] + noise[0, 1] * way + noise[0, 2] * turned,
        noise[1, 0] + noise[1, 1] * way + noise[1, 2] * turned,
        noise[2, 0] + noise[2, 1] * way + noise[2, 2] * turned,
    )


@inline_kernel
def step_deviations(noise, dx, dy, turn):
    """Standard deviations (x, y, heading) of a step's increment, that of the heading at most 0.49 rad."""
    variance_x, variance_y, variance_heading = step_variances(noise, dx, dy, turn)
    return math.sqrt(variance_x), math.sqrt(variance_y), min(math.sqrt(variance_heading), MAX_TURN_DEVIATION)
