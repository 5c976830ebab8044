"""Margins, scores and objectives of runs."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import norm

from rfiddesign.metrics import Requirement
from rfiddesign.optimize.explore import WORST_MARGIN, Objectives, margins, score
from tests.optimize.explore.conftest import run_with

LIMITS = Requirement((("position_p95_mm", 20.0), ("heading_p95_rad", 0.1)), converged_within_s=10.0)


@given(st.floats(0.5, 100), st.floats(0, 0.5), st.one_of(st.floats(0.1, 30), st.just(math.inf)))
def test_a_run_passes_exactly_if_its_margin_is_at_most_one(error_mm, heading_rad, convergence_s):
    run = replace(run_with(error_mm, convergence_s), heading_p95_rad=heading_rad)
    assert LIMITS.is_met(run) == (margins(LIMITS, [run])[0] <= 1.0)


def test_a_margin_is_that_of_the_tightest_limit_and_ends_somewhere():
    runs = [run_with(10.0), run_with(5.0, 9.0), run_with(5.0, math.inf), run_with(1e6)]
    assert margins(LIMITS, runs).tolist() == [0.5, 0.9, WORST_MARGIN, WORST_MARGIN]


def test_the_score_of_lognormal_margins_is_their_quantile():
    drawn = np.exp(np.random.Generator(np.random.PCG64(1)).normal(-1.0, 0.3, 200_000))
    assert score(drawn, 0.95) == pytest.approx(math.exp(-1.0 + 0.3 * norm.ppf(0.95)), rel=0.01)
    assert score(np.array([0.7]), 0.95) == pytest.approx(0.7)


def test_objectives_are_minimised_and_a_run_without_end_counts_as_long_as_it_is():
    four = Objectives(("cost", "speed_mm_per_s", "position_p95_mm", "convergence_s"), 60.0)
    assert four.known(12_345, 300.0).tolist() == [123.45, -300.0]
    assert four.measured([run_with(7.0, 2.0), run_with(9.0, math.inf)]).tolist() == [[7.0, 2.0], [9.0, 60.0]]


@pytest.mark.parametrize("names", [("cost",), ("cost", "cost"), ("cost", "beauty")])
def test_faulty_objectives_are_refused(names):
    with pytest.raises(ValueError, match="objective"):
        Objectives(names, 60.0)
