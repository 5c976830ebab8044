"""What beliefs on square grids have in common, against numpy."""

import numpy as np
import pytest

from rfiddesign.estimators import _grid_kernels as kernels


@pytest.mark.parametrize("n", [3, 21, 40])
def test_moments_of_counted_masses_are_those_about_the_middle_cell(n):
    rng = np.random.default_rng(n)
    mass, sums, told = rng.random((n, n)), np.full((3, n + 2), np.nan), np.empty(6)
    kernels.clear_sums(sums, n)
    steps = np.arange(n) - n // 2
    for row in range(n):
        for column in range(n):
            kernels.count_mass(sums[0], sums[1], sums[2], column, mass[row, column], float(steps[row]))
    kernels.moments_of_sums(sums, n, told)
    x, y = np.meshgrid(steps, steps)
    own = mass / mass.sum()
    mean_x, mean_y = (own * x).sum(), (own * y).sum()
    spread = [
        (own * (x - mean_x) ** 2).sum(),
        (own * (x - mean_x) * (y - mean_y)).sum(),
        (own * (y - mean_y) ** 2).sum(),
    ]
    assert told == pytest.approx([mass.sum(), mean_x, mean_y, *spread])
    assert np.isnan(sums[:, n:]).all()


def test_no_mass_has_no_moments():
    sums, told = np.zeros((3, 5)), np.full(6, 7.0)
    kernels.moments_of_sums(sums, 5, told)
    assert told.tolist() == [0.0, *(7.0,) * 5]


def test_the_exponent_is_that_of_a_gaussian_with_the_precision():
    precision = np.array([[0.3, 0.1], [0.1, 0.2]])
    place = np.array([2.0, -3.0])
    told = kernels.gaussian_exponent(*place, precision[0, 0], precision[0, 1], precision[1, 1])
    assert told == pytest.approx(0.5 * place @ precision @ place)
