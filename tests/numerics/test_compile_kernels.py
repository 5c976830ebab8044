"""Kernels are compiled once for what they are given."""

import numpy as np

from rfiddesign.numerics._compile_kernels import kernel, leaf_kernel


@leaf_kernel
def _third(values, place, is_asked):
    return values[place] / 3.0 if is_asked else 0.0


@kernel
def _thirds(values):
    total = _third(values, 0, True) + _third(values, 1, False)
    for i in range(2, values.shape[0]):
        total += _third(values, i, i > 0)
    return total


def test_numbers_written_out_in_a_call_do_not_compile_a_kernel_again():
    assert _thirds(np.array([3.0, 100.0, 6.0, 9.0])) == 6.0
    # What came from disk does not tell what it called.
    _thirds.recompile()
    assert len(_third.signatures) == 1
