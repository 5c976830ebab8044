"""The weight of a read: eq. 6 of hf_multireader_mcl for a disc, its kin for other areas."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rfiddesign.geometry import Disc, Ellipse, Rectangle, listed
from rfiddesign.models.likelihood import DistanceLikelihood


def test_a_disc_is_measured_in_sigmas_whatever_the_antennas_direction():
    likelihood = DistanceLikelihood(sigma_per_radius=1.2)
    whitening = likelihood.whitening(Disc(30.0), np.array([0.0, 0.7, -2.0]))
    z = np.array([11.0, -40.0])
    assert np.linalg.norm(whitening @ z, axis=-1) == pytest.approx(np.hypot(*z) / (1.2 * 30.0), rel=1e-12)


@settings(max_examples=100, deadline=None, derandomize=True)
@given(yaw=st.floats(-4, 4), length=st.floats(20, 700), width=st.floats(20, 700), sigma=st.floats(0.2, 5))
def test_a_rectangle_is_measured_along_its_own_sides(yaw, length, width, sigma):
    """A side's end counts as sqrt(3)/2 of a disc's rim: the distances at which a uniform tag has the same spread."""
    whitening = DistanceLikelihood(sigma_per_radius=sigma).whitening(Rectangle(length, width), np.array([yaw]))[0]
    along, across = np.array([math.cos(yaw), math.sin(yaw)]), np.array([-math.sin(yaw), math.cos(yaw)])
    rim = math.sqrt(3) / 2 / sigma
    assert np.linalg.norm(whitening @ along * length / 2) == pytest.approx(rim, rel=1e-9)
    assert np.linalg.norm(whitening @ across * width / 2) == pytest.approx(rim, rel=1e-9)


def test_the_rim_of_an_ellipse_lies_as_many_sigmas_out_as_that_of_a_disc():
    whitening = DistanceLikelihood(sigma_per_radius=1.1).whitening(Ellipse(80.0, 20.0), np.array([0.3]))[0]
    t = np.linspace(0, 2 * math.pi, 50)
    rim = np.stack([80 * np.cos(t), 20 * np.sin(t)])
    turned = np.array([[math.cos(0.3), -math.sin(0.3)], [math.sin(0.3), math.cos(0.3)]]) @ rim
    assert np.linalg.norm(whitening @ turned, axis=0) == pytest.approx(np.full(50, 1 / 1.1), rel=1e-9)


def test_there_is_one_matrix_per_antenna_of_a_layout():
    poses = listed([(0, 0, 0), (10, 20, 1)]).poses_mm
    assert DistanceLikelihood().whitening(Disc(9.0), poses[:, 2]).shape == (2, 2, 2)


def test_gaussian_has_no_flat_middle_and_no_step():
    gaussian = DistanceLikelihood(kind="gaussian", beta=0.3)
    assert (gaussian.inner_radius, gaussian.log_tail) == (0.0, 0.0)


def test_combination_steps_at_one_sigma_to_beta():
    combination = DistanceLikelihood(kind="combination", beta=0.3)
    assert (combination.inner_radius, combination.log_tail) == (1.0, math.log(0.3))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"kind": "step"}, ("likelihood", "'step'", "gaussian", "combination")),
        ({"sigma_per_radius": 0.0}, ("sigma_per_radius", "0.0", "0.01")),
        ({"sigma_per_radius": math.nan}, ("sigma_per_radius", "nan", "100")),
        ({"beta": 0.0}, ("beta", "0.0", "above 0")),
        ({"beta": 1.5}, ("beta", "1.5", "at most 1")),
    ],
)
def test_a_bad_argument_is_named_with_its_value_and_bound(arguments, words):
    with pytest.raises(ValueError, match=words[0]) as error:
        DistanceLikelihood(**arguments)
    assert all(word in str(error.value) for word in words)
    assert "\n" not in str(error.value)
