from rfiddesign.numerics._math_kernels import *  # noqa: F403
