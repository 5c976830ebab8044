"""Errors of a run as papers print them, against a trace made by hand."""

import math
from dataclasses import replace

import numpy as np
import pytest

from rfiddesign.evaluate import evaluate
from rfiddesign.reproduce import load_reproduction
from rfiddesign.reproduce.cases import case_of
from rfiddesign.reproduce.measure import METRICS, measure, metrics_of
from rfiddesign.simulation.run import Trace

# Truth after steps 0 to 4, and by how much the estimate is off; the last heading is once round, less 0.2 rad.
TRUE = np.array([[0, 0, 0], [10, 0, 0], [10, 0, 0], [10, 0, 0.5], [20, 0, 0.5]], float)
OFF = np.array([[9, 9, 9], [3, 4, 0.1], [-6, 8, -0.3], [0, 0, 0], [5, -12, 2 * math.pi - 0.2]], float)
TRACE = Trace(0.5, TRUE, TRUE + OFF, np.hypot(*OFF[1:, :2].T), np.abs(OFF[1:, 2]))


@pytest.fixture
def case(write):
    loaded = load_reproduction(str(write()))
    return case_of(loaded, loaded.file.rows[0])


def with_keys(case, **changes):
    return replace(case, section=case.section.model_copy(update=changes))


def test_means_maxima_variances_and_root_mean_squares_by_hand(case):
    found = metrics_of(TRACE, case)
    assert tuple(found) == METRICS
    x, y, theta = np.array([3, 6, 0, 5]), np.array([4, 8, 0, 12]), np.array([0.1, 0.3, 0, 0.2])
    for name, values in (("x_mm", x), ("y_mm", y), ("theta_rad", theta), ("position_mm", np.array([5, 10, 0, 13]))):
        assert found[name] == pytest.approx(values.sum() / 4)
        assert found[f"{name}_max"] == pytest.approx(values.max())
        assert found[f"{name}_var"] == pytest.approx((values**2).sum() / 4 - (values.sum() / 4) ** 2)
    assert found["rmse_mm"] == pytest.approx(math.sqrt((25 + 100 + 0 + 169) / 4))
    assert found["theta_rmse_deg"] == pytest.approx(math.degrees(math.sqrt((0.01 + 0.09 + 0.04) / 4)))


def test_summaries_are_those_of_a_run_and_headings_are_mrad(case):
    off = OFF.copy()
    off[4, 2] = 2 * math.pi - 0.1
    trace = replace(TRACE, poses=TRUE + off)
    found = metrics_of(trace, case)
    assert found["position_mean_mm"] == pytest.approx((5 + 10 + 0 + 13) / 4)
    assert found["position_p95_mm"] == pytest.approx(13.0)
    assert found["heading_mean_mrad"] == pytest.approx(1e3 * (0.1 + 0.3 + 0 + 0.1) / 4)
    # The second step is off by 0.3 rad.
    assert found["lost_share"] == 0.25
    settled, standing = (
        metrics_of(trace, with_keys(case, **changes)) for changes in ({"settle_s": 1.0}, {"scores_standing_only": True})
    )
    assert (settled["position_mean_mm"], settled["lost_share"]) == (pytest.approx(6.5), 0.0)
    assert (standing["position_mean_mm"], standing["lost_share"]) == (pytest.approx(10.0), 1.0)


def test_summaries_agree_with_those_of_evaluate(case):
    found = measure(case, 4, 3, 1, lambda: None)
    runs = evaluate(case.design, case.scenario, 4, seed=3).runs
    for name, field, factor in (
        ("position_mean_mm", "position_mean_mm", 1), ("position_p95_mm", "position_p95_mm", 1),
        ("heading_mean_mrad", "heading_mean_rad", 1e3), ("lost_share", "lost_share", 1),
    ):  # fmt: skip
        np.testing.assert_allclose(found[name], [factor * getattr(run, field) for run in runs], rtol=1e-9)


@pytest.mark.parametrize(
    ("n_far", "shares"),
    [(0, (1, 1)), (1, (1, 1)), (2, (0, 1)), (11, (0, 1)), (12, (0, 0)), (19, (0, 0))],
)
def test_a_run_converges_when_it_comes_near_and_stays_for_a_second(case, n_far, shares):
    """Steps of half a second: after `n_far` of them the estimate is near; the last alone is no second."""
    off = np.where(np.arange(20) < n_far, 500.0, 5.0)
    poses = np.zeros((21, 3))
    poses[1:, 0] = off
    trace = Trace(0.5, np.zeros((21, 3)), poses, off, np.zeros(20))
    # Whatever counts as an error, the clock runs from the start.
    for settle_s in (0.0, 2.0):
        found = metrics_of(trace, with_keys(case, settle_s=settle_s))
        assert (found["converged_1s_share"], found["converged_6s_share"]) == shares


def test_errors_count_from_the_time_to_settle(case):
    found = metrics_of(TRACE, with_keys(case, settle_s=1.0))
    assert found["x_mm"] == pytest.approx((0 + 5) / 2)
    assert found["y_mm_max"] == 12.0


def test_standing_only_leaves_the_steps_without_motion(case):
    """Of the four steps the second alone: the third turns in place."""
    found = metrics_of(TRACE, with_keys(case, scores_standing_only=True))
    assert (found["x_mm"], found["y_mm"], found["theta_rad"]) == (6.0, 8.0, pytest.approx(0.3))
    assert found["x_mm_var"] == 0.0


def test_a_run_in_which_no_step_counts_has_no_numbers(case):
    found = metrics_of(TRACE, with_keys(case, scores_standing_only=True, settle_s=1.0))
    assert tuple(found) == METRICS
    assert all(math.isnan(value) for value in found.values())
    # As of a filter that starts when the drive is all but over.
    assert math.isnan(metrics_of(TRACE, with_keys(case, settle_s=10.0))["x_mm"])


def test_standing_only_counts_the_stays_of_a_route(write):
    loaded = load_reproduction(str(write("shift_mm = 100.0", "shift_mm = 100.0\nstay_s = 1.0")))
    row = loaded.file.rows[0]
    both, standing = (
        case_of(loaded, row.model_copy(update={"set": {"scores_standing_only": only}})) for only in (False, True)
    )
    assert both.scenario.duration_s == pytest.approx(4.0)
    found = {name: measure(case, 2, 3, 1, lambda: None) for name, case in (("both", both), ("standing", standing))}
    assert not np.array_equal(found["both"]["x_mm"], found["standing"]["x_mm"])
    assert np.all(found["standing"]["x_mm_max"] <= found["both"]["x_mm_max"])


def test_every_run_has_its_numbers_and_is_counted(case):
    counted = []
    found = measure(case, 3, 3, 2, lambda: counted.append(1))
    assert len(counted) == 3
    assert set(found) == set(METRICS)
    assert all(values.shape == (3,) and np.isfinite(values).all() for values in found.values())
    assert len(set(found["x_mm"].tolist())) == 3
    fewer = measure(case, 2, 3, 1, lambda: None)
    np.testing.assert_array_equal(fewer["x_mm"], found["x_mm"][:2])
