"""How kernels are compiled.

All are kept on disk, release the interpreter's lock and, like C, give infinity where they divide by zero: a kernel
raises nothing.
"""

from numba import njit

from rfiddesign.numerics.stale_code import forget_stale_code

forget_stale_code()
kernel = njit(cache=True, nogil=True, error_model="numpy")
# For kernels that allocate nothing, called in an inner loop: numba counts in and out every array that a function is
# given, about 5 ns each, unless it may not allocate.
leaf_kernel = njit(cache=True, nogil=True, error_model="numpy", _nrt=False)
# For formulas of a line or two that become part of their callers.
inline_kernel = njit(cache=True, nogil=True, error_model="numpy", inline="always")
