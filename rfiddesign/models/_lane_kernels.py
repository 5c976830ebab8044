from rfiddesign.numerics._lane_kernels import *  # noqa: F403
