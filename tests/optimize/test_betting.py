"""The test of a mean errs no more often than it says, whatever the law of the scores, and finds what is clear."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import binom

from rfiddesign.optimize.betting import STAKES, MeanTest, evidence
from rfiddesign.optimize.criteria import MeanCriterion

CRITERION = MeanCriterion("mean error", hold=0.225, fail=0.25)
N_TRIALS = 2000


def laws(mean):
    """Laws of scores in [0, 1] with that mean, from nearly constant to all or nothing."""
    return {
        "constant": lambda rng, n: np.full(n, mean),
        "all or nothing": lambda rng, n: (rng.random(n) < mean).astype(float),
        "rare and large": lambda rng, n: np.where(rng.random(n) < 0.02, 1.0, (mean - 0.02) / 0.98),
        "beta": lambda rng, n: rng.beta(4 * mean, 4 * (1 - mean), n),
    }


@pytest.mark.parametrize("law", laws(0.25))
def test_a_mean_at_the_limit_is_certified_at_most_at_alpha(law):
    alpha, test = 0.05, MeanTest(CRITERION, 1 / 0.05, 1 / 0.05, 400)
    draw, rng = laws(0.25)[law], np.random.default_rng(1)
    errors = sum(test.crossed(draw(rng, 400))[1].any() for _ in range(N_TRIALS))
    assert errors <= binom.ppf(0.999, N_TRIALS, alpha)


@pytest.mark.parametrize("law", laws(0.225))
def test_a_mean_that_holds_is_refuted_at_most_at_alpha(law):
    alpha, test = 0.05, MeanTest(CRITERION, 1 / 0.05, 1 / 0.05, 400)
    draw, rng = laws(0.225)[law], np.random.default_rng(2)
    errors = sum(test.crossed(draw(rng, 400))[0].any() for _ in range(N_TRIALS))
    assert errors <= binom.ppf(0.999, N_TRIALS, alpha)


def test_clear_cases_are_decided_soon():
    test = MeanTest(CRITERION, 1 / 0.025, 1000 / 0.025, 2000)
    rng = np.random.default_rng(3)
    half_the_limit, twice_the_limit = (np.clip(rng.normal(mean, 0.03, 2000), 0, 1) for mean in (0.125, 0.5))
    refuted, certified = test.crossed(half_the_limit)
    assert certified.argmax() < 100
    assert not refuted.any()
    refuted, certified = test.crossed(twice_the_limit)
    assert refuted.argmax() < 10
    assert not certified.any()


@given(st.lists(st.floats(-1, 1), min_size=1, max_size=60))
@settings(max_examples=50)
def test_evidence_is_the_mean_of_products_of_each_stake(gains):
    """Checked in logarithms, which the kernel avoids."""
    found = evidence(np.array(gains), 1.0)
    logs = np.array([np.cumsum(np.log1p(stake * np.array(gains))) for stake in STAKES])
    assert found == pytest.approx(np.exp(logs).mean(axis=0), rel=1e-9)
    assert (found > 0).all()


def test_the_soonest_decision_is_that_of_the_worst_scores():
    test = MeanTest(CRITERION, 1 / 0.025, 1e9, 500)
    refuted, _ = test.crossed(np.ones(500))
    assert test.soonest == refuted.argmax() + 1 < 10
    assert MeanTest(CRITERION, 1e300, 1e300, 3).soonest == 3


@pytest.mark.parametrize(("hold", "fail"), [(0.3, 0.3), (0.4, 0.3), (0.0, 0.3), (0.5, 1.0), (float("nan"), 0.5)])
def test_thresholds_that_leave_no_room_are_refused(hold, fail):
    with pytest.raises(ValueError, match=r"hold|fail"):
        MeanCriterion("mean", hold, fail)
