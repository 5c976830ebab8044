from rfiddesign.numerics._noise_kernels import *  # noqa: F403
