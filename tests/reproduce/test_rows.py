"""Rows and claims: means with their errors, units, bounds, and numbers that JSON can hold."""

import json
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rfiddesign.reproduce.config import ClaimSection
from rfiddesign.reproduce.rows import Claim, Row, rounded, row_of, unit_of


def test_a_row_is_the_mean_over_runs_with_its_standard_error():
    row = row_of("table 2", "100 Gaussian", "x_mm", np.array([1.0, 2.0, 6.0]), 2.5)
    assert row == Row("table 2", "100 Gaussian", "x_mm", 2.5, 3.0, pytest.approx(math.sqrt(7 / 3)), "mm")
    assert row_of("t", "r", "x_mm", np.array([4.0])).stderr is None
    assert row_of("t", "r", "share_of_seeds", np.array([True, False])).measured == 0.5


def test_runs_without_a_value_do_not_count():
    row = row_of("t", "r", "x_mm", np.array([1.0, math.nan, 3.0]))
    assert (row.measured, row.stderr) == (2.0, pytest.approx(1.0))
    none = row_of("t", "r", "x_mm", np.array([math.nan, math.nan]))
    assert math.isnan(none.measured)
    assert none.stderr is None
    assert none.as_json()["measured"] is None


@pytest.mark.parametrize(
    ("metric", "unit"),
    [
        ("x_mm", "mm"), ("position_mm_max", "mm"), ("y_mm_var", "mm^2"), ("theta_rad", "rad"), ("theta_rad_max", "rad"),
        ("theta_rad_var", "rad^2"), ("theta_rmse_deg", "deg"), ("rmse_mm", "mm"), ("mm", "mm"), ("way_m", "m"),
        ("share_of_seeds", "1"), ("chance", "1"), ("rms_ln_ratio", "1"), ("x_mm_over_reinitialized", "1"),
        ("wins_from_sigma_per_radius", "1"), ("best_ratio", "1"),
        ("heading_mean_mrad", "mrad"), ("us_per_step", "us"), ("us_ratio", "1"), ("lost_share", "1"),
        ("converged_1s_share", "1"), ("position_p95_mm", "mm"),
    ],
)  # fmt: skip
def test_the_unit_is_told_by_the_name(metric, unit):
    assert unit_of(metric) == unit


@pytest.mark.parametrize(
    ("at_least", "at_most", "measured", "holds"),
    [
        (1.0, 2.0, 1.5, True), (1.0, 2.0, 1.0, True), (1.0, 2.0, 2.0, True), (1.0, 2.0, 0.999, False),
        (1.0, 2.0, 2.001, False), (None, 2.0, -5.0, True), (1.0, None, 1e9, True), (1.0, None, 0.5, False),
        (None, 2.0, None, False), (1.0, None, math.nan, False), (None, 2.0, math.nan, False), (0.0, None, 0.0, True),
    ],
)  # fmt: skip
def test_a_claim_holds_if_its_number_was_measured_and_keeps_the_bounds(at_least, at_most, measured, holds):
    claim = Claim(ClaimSection(table="t", row="r", metric="x_mm", at_least=at_least, at_most=at_most), measured)
    assert claim.holds is holds
    assert json.loads(json.dumps(claim.as_json(), allow_nan=False))["holds"] is holds


@given(st.none() | st.floats())
def test_rounding_gives_numbers_that_json_can_hold_to_six_digits(value):
    found = rounded(value)
    assert json.loads(json.dumps(found, allow_nan=False)) == found
    if found is None:
        assert value is None or not math.isfinite(value)
    else:
        assert found == pytest.approx(value, rel=5.1e-6, abs=1e-320)
        assert rounded(found) == found


@given(st.floats(), st.none() | st.floats())
def test_a_row_is_valid_json_whatever_was_measured(measured, stderr):
    row = Row("t", "r", "x_mm", None, measured, stderr, "mm").as_json()
    assert tuple(row) == ("table", "row", "metric", "published", "measured", "stderr", "unit")
    json.dumps(row, allow_nan=False)
