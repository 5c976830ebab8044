"""What an estimator is told of the start must be a place."""

import math

import pytest

from rfiddesign.estimators.start import KnownStart, UnknownStart


@pytest.mark.parametrize(
    ("pose", "words"),
    [
        ((math.nan, 0.0, 0.0), ("x", "nan")),
        ((0.0, 6e6, 0.0), ("y", "6000000", "5e+06")),
        ((0.0, 0.0, math.inf), ("heading", "inf")),
    ],
)
def test_a_known_start_is_finite_and_on_a_floor(pose, words):
    with pytest.raises(ValueError, match="start pose") as error:
        KnownStart(pose)
    assert all(word in str(error.value) for word in words)


@pytest.mark.parametrize("bounds", [(0.0, 0.0, -1.0, 5.0), (0.0, 5.0, 1.0, 4.0), (math.nan, 0.0, 1.0, 1.0)])
def test_the_box_of_an_unknown_start_is_not_inside_out(bounds):
    with pytest.raises(ValueError, match="start bounds"):
        UnknownStart(bounds)
