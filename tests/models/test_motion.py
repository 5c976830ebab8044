"""Noise of the odometry."""

import math

import pytest

from rfiddesign.models.motion import OmnidirectionalMotion


def test_white_velocity_noise_of_eq_1_scales_with_the_step():
    motion = OmnidirectionalMotion(20.0, 30.0, 0.1)
    assert motion.step_deviations(0.05) == pytest.approx((1.0, 1.5, 0.005))
    assert motion.step_deviations(0.1) == pytest.approx((2.0, 3.0, 0.01))


@pytest.mark.parametrize("name", ["noise_x_mm_per_s", "noise_y_mm_per_s", "noise_heading_rad_per_s"])
@pytest.mark.parametrize("value", [-1.0, math.nan, math.inf])
def test_noise_is_finite_and_not_negative(name, value):
    with pytest.raises(ValueError, match=rf"{name} is {value}, must be at least 0"):
        OmnidirectionalMotion(**{name: value})
