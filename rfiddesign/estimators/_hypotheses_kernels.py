"""Where a robot that knows nothing may be once it reads a tag: a Gaussian per heading, the antenna about the tag."""

import math

from rfiddesign.estimators._mixture_kernels import COSINE, HH, SINE, WEIGHT, XH, XX, XY, YH, YY, X, Y, face
from rfiddesign.numerics._compile_kernels import leaf_kernel

N_HYPOTHESES = 32
_SPACING = 2.0 * math.pi / N_HYPOTHESES


@leaf_kernel
def hypothesize(mix, n, weight, antenna, tag_x, tag_y, shape, field):
    """Append a component per heading, of `weight` in all; returns how many there are then.

    The tag lies anywhere in the field: variances of a disc or a rectangle with its extents.
    """
    x, y, yaw_s, yaw_c = antenna
    half_length, half_width, corner, _ = shape
    reach = field[2]
    variance = _SPACING * _SPACING / 12.0
    if reach > 0.0:
        var_u = var_v = reach * reach / 4.0
    elif half_length == 0.0 and half_width == 0.0:
        var_u = var_v = corner * corner / 4.0
    else:
        var_u, var_v = (half_length + corner) ** 2 / 3.0, (half_width + corner) ** 2 / 3.0
    for i in range(N_HYPOTHESES):
        k = n + i
        mix[k, WEIGHT] = weight / N_HYPOTHESES
        face(mix, k, (i + 0.5) * _SPACING)
        s, c = mix[k, SINE], mix[k, COSINE]
        lever_x, lever_y = c * x - s * y, s * x + c * y
        mix[k, X], mix[k, Y] = tag_x - lever_x, tag_y - lever_y
        # Along and across the antenna; a turn about the tag moves the robot by the lever.
        s, c = s * yaw_c + c * yaw_s, c * yaw_c - s * yaw_s
        mix[k, HH] = variance
        mix[k, XH], mix[k, YH] = lever_y * variance, -lever_x * variance
        mix[k, XX] = c * c * var_u + s * s * var_v + lever_y * lever_y * variance
        mix[k, XY] = s * c * (var_u - var_v) - lever_x * lever_y * variance
        mix[k, YY] = s * s * var_u + c * c * var_v + lever_x * lever_x * variance
    return n + N_HYPOTHESES
