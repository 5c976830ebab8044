"""Several criteria at once: any refutes, all certify, and one share is the usual test."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import binom

from rfiddesign.optimize import MeanCriterion, ShareCriterion, TestPlan, battery, boundaries, judge
from rfiddesign.optimize.certify import decide

SHARE, LOOSE = ShareCriterion("pass", 0.95, 0.9), ShareCriterion("below 50 mm", 0.75, 0.5)
MEAN = MeanCriterion("mean error", 0.225, 0.25)
BOTH = TestPlan(n_designs=10, criteria=(SHARE, MEAN))


@given(st.lists(st.booleans(), max_size=200), st.integers(1, 3000))
@settings(max_examples=60)
def test_one_share_is_the_usual_test(outcomes, n_designs):
    plan = TestPlan(n_designs=n_designs, max_runs=150)
    row = np.array(outcomes, bool)
    usual = decide(boundaries(plan), row)
    assert judge(battery(plan), row) == usual
    assert judge(battery(plan), row.astype(float)[:, None]) == usual


def test_one_criterion_that_fails_refutes_whatever_the_others_say():
    scores = np.column_stack([np.ones(200), np.full(200, 0.9)])
    found = judge(battery(BOTH), scores)
    assert (found.verdict, found.refuted_by, found.n_passed) == ("refuted", 1, found.n_runs)
    scores = np.column_stack([np.zeros(200), np.zeros(200)])
    assert judge(battery(BOTH), scores).refuted_by == 0


def test_a_design_is_certified_when_its_last_criterion_is():
    n = np.arange(2000)
    scores = np.column_stack([np.ones(n.size), np.full(n.size, 0.2)])
    found = judge(battery(BOTH), scores)
    alone = [
        judge(battery(TestPlan(n_designs=10, criteria=(criterion,))), scores[:, [i]]).n_runs
        for i, criterion in enumerate((SHARE, MEAN))
    ]
    assert found.verdict == "certified"
    assert found.n_runs == max(alone)


def test_refuting_pays_for_the_number_of_criteria_and_certifying_does_not():
    one, two = TestPlan(n_designs=5, criteria=(SHARE,)), TestPlan(n_designs=5, criteria=(SHARE, LOOSE))
    assert two.refute_threshold == 2 * one.refute_threshold
    assert two.certify_threshold == one.certify_threshold


def test_a_design_that_fails_one_criterion_is_certified_at_most_at_alpha():
    """Hardest: it passes every other criterion for certain, and sits at the limit of the one it fails."""
    plan, rng, n_trials = TestPlan(n_designs=1, alpha_certify=0.05, max_runs=300, criteria=(SHARE, LOOSE)), None, 2000
    rng = np.random.default_rng(4)
    errors = 0
    for _ in range(n_trials):
        scores = np.column_stack([np.ones(300), rng.random(300) < 0.5])
        errors += judge(battery(plan), scores).verdict == "certified"
    assert errors <= binom.ppf(0.999, n_trials, 0.05)


def test_a_design_that_holds_in_all_is_refuted_at_most_at_alpha():
    plan, rng, n_trials = TestPlan(n_designs=1, alpha_refute=0.05, max_runs=300, criteria=(SHARE, LOOSE)), None, 2000
    rng = np.random.default_rng(5)
    errors = 0
    for _ in range(n_trials):
        scores = np.column_stack([rng.random(300) < 0.95, rng.random(300) < 0.75])
        errors += judge(battery(plan), scores).verdict == "refuted"
    assert errors <= binom.ppf(0.999, n_trials, 0.05)


@pytest.mark.parametrize(
    "scores", [np.ones((5, 3)), np.ones(5), np.full((5, 2), 1.5), np.full((5, 2), np.nan), np.full((5, 2), -0.1)]
)
def test_scores_that_are_none_are_refused(scores):
    with pytest.raises(ValueError, match="scores"):
        judge(battery(BOTH), scores)


def test_boundaries_are_those_of_one_share_alone():
    with pytest.raises(ValueError, match="one share"):
        boundaries(BOTH)
