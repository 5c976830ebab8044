"""The Bayes estimate of a read probability is the integral that the paper writes, in closed form."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.special import comb

from rfiddesign.models.step_prior import StepPrior


def by_quadrature(prior, f, n):
    """Eqs. 2 and 3 by numerical integration of eq. 4 under the stepped prior, each side of the step on its own."""
    low, high = prior.densities

    def integral(power):
        def density(q, height):
            return height * comb(n, f) * q ** (f + power) * (1 - q) ** (n - f)

        parts = ((0.0, prior.threshold, low), (prior.threshold, 1.0, high))
        return sum(quad(density, a, b, args=(height,), epsabs=0, epsrel=1e-11)[0] for a, b, height in parts)

    return integral(1) / integral(0)


@given(
    n=st.integers(1, 8),
    threshold=st.floats(1e-3, 0.5),
    mass=st.floats(0.05, 0.95),
    share=st.floats(0, 1),
)
def test_the_closed_form_is_the_integral(n, threshold, mass, share):
    prior, f = StepPrior(threshold, mass), round(share * n)
    assert prior.estimates(n)[f] == pytest.approx(by_quadrature(prior, f, n), rel=1e-7)


def test_two_cycles_under_the_papers_prior():
    # findings, section 4: worked out by hand from the prior of section IV-A.
    prior = StepPrior()
    assert prior.estimates(2) == pytest.approx([0.0197, 0.494, 0.750], abs=6e-4)
    assert prior.mean == pytest.approx(0.1005, abs=1e-12)


@given(n=st.integers(1, 30))
def test_more_reads_mean_a_likelier_tag(n):
    estimates = StepPrior().estimates(n)
    assert (np.diff(estimates) > 0).all()
    assert 0 < estimates[0] < estimates[-1] < 1


def test_a_flat_prior_is_the_rule_of_succession():
    """With equal densities on both sides of the step the estimate is (f + 1) / (N + 2)."""
    assert StepPrior(0.25, 0.25).estimates(6) == pytest.approx((np.arange(7) + 1) / 8)


@pytest.mark.parametrize(("threshold", "mass"), [(0.0, 0.5), (1.0, 0.5), (0.1, 0.0), (0.1, 1.0), (float("nan"), 0.5)])
def test_a_prior_without_two_sides_is_refused(threshold, mass):
    with pytest.raises(ValueError, match="must be above 0 and at most"):
        StepPrior(threshold, mass)


def test_no_cycles_are_refused():
    with pytest.raises(ValueError, match="n_cycles"):
        StepPrior().estimates(0)
