"""What an estimator is told of the start must be a place."""

import math

import numpy as np
import pytest

from rfiddesign.estimators.start import KnownStart, UncertainStart, UnknownStart, moments_of_start


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


@pytest.mark.parametrize(
    ("covariance", "words"),
    [
        (np.eye(2), r"shape \(2, 2\), must be \(3, 3\)"),
        (np.diag([1.0, math.nan, 1.0]), "finite"),
        (np.diag([1.0, -1e-3, 1.0]), "negative variance"),
        (np.array([[1.0, 2.0, 0.0], [2.0, 1.0, 0.0], [0.0, 0.0, 1.0]]), "negative variance"),
        (np.array([[1.0, 0.5, 0.0], [0.4, 1.0, 0.0], [0.0, 0.0, 1.0]]), "symmetric"),
    ],
)
def test_an_uncertain_start_has_a_covariance(covariance, words):
    with pytest.raises(ValueError, match=rf"start covariance.*{words}"):
        UncertainStart((0.0, 0.0, 0.0), covariance.tolist())


def test_an_uncertain_start_may_be_certain_of_an_axis():
    for variances in ([100.0, 100.0, 0.0], [0.0, 0.0, 0.0]):
        pose, covariance = moments_of_start(UncertainStart((1.0, 2.0, 3.0), np.diag(variances).tolist()))
        assert pose.tolist() == [1.0, 2.0, 3.0]
        assert np.diag(covariance).tolist() == variances


def test_an_uncertain_start_is_a_place():
    with pytest.raises(ValueError, match=r"start pose, y is inf"):
        UncertainStart((0.0, math.inf, 0.0), np.eye(3).tolist())
